// TileSink: where arriving tiles go: a renderer's arenas, or arrays of the CPU.
#pragma once

#include <cstdint>
#include <span>

#include "common/mesh/vertex_slot.h"

namespace scree {

class TileSink {
public:
    virtual ~TileSink() = default;
    virtual void put_height(std::int32_t slot, std::span<const SlotVertex> vertices) = 0;
    virtual void put_texture(std::int32_t slot, std::span<const std::uint8_t> chain) = 0;
};

}  // namespace scree
