// TileSink: where arriving tiles go: a renderer's arenas, or arrays of the CPU.
#pragma once

#include <cstdint>
#include <span>

#include "common/dataset.h"
#include "common/mesh/vertex_slot.h"
#include "runtime/paging/memory_plan.h"
#include "runtime/paging/tile_measure.h"

namespace scree {

class TileSink {
public:
    virtual ~TileSink() = default;
    /// Before the first tile of another state of the store is drawn. Where the plan is another one than before, no slot
    /// holds anything afterwards.
    virtual Result<void> renew(const Dataset& /*dataset*/, const MemoryPlan& /*plan*/) { return {}; }
    virtual void put_height(std::int32_t slot, std::span<const SlotVertex> vertices) = 0;
    /// After put_height, where the pager has a measure.
    virtual void put_costs(std::int32_t /*slot*/, std::span<const SlotVertex> /*vertices*/,
                           std::span<const VertexCost> /*costs*/) {}
    virtual void put_texture(std::int32_t slot, std::span<const std::uint8_t> chain) = 0;
};

}  // namespace scree
