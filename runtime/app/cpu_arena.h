// CpuArena: a sink that keeps the heights of every slot in ordinary memory, as they were handed over for drawing, for
// what must look at the drawn surface (audit, --mesh). May pass tiles on to another sink.
#pragma once

#include <span>
#include <vector>

#include "common/dataset.h"
#include "runtime/paging/tile_sink.h"

namespace scree {

class CpuArena final : public TileSink {
public:
    CpuArena(const Dataset& dataset, std::int64_t height_slots, TileSink* next = nullptr);
    void put_height(std::int32_t slot, std::span<const SlotVertex> vertices) override;
    void put_texture(std::int32_t slot, std::span<const std::uint8_t> chain) override;
    /// The (m+1)^2 vertices of a slot.
    std::span<const SlotVertex> vertices(std::int32_t slot) const;

private:
    std::size_t slot_vertices_;
    std::vector<SlotVertex> vertices_;
    TileSink* next_;
};

}  // namespace scree
