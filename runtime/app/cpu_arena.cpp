#include "runtime/app/cpu_arena.h"

#include <algorithm>

namespace scree {

CpuArena::CpuArena(const Dataset& dataset, std::int64_t height_slots, TileSink* next)
    : slot_vertices_(slot_vertex_count(dataset.lattice.tile_cells_log2)),
      vertices_(slot_vertices_ * static_cast<std::size_t>(height_slots)),
      next_(next) {}

void CpuArena::put_height(std::int32_t slot, std::span<const SlotVertex> vertices) {
    std::copy(vertices.begin(), vertices.end(),
              vertices_.begin() + static_cast<std::ptrdiff_t>(slot_vertices_ * static_cast<std::size_t>(slot)));
    if (next_ != nullptr) next_->put_height(slot, vertices);
}

void CpuArena::put_texture(std::int32_t slot, std::span<const std::uint8_t> chain) {
    if (next_ != nullptr) next_->put_texture(slot, chain);
}

std::span<const SlotVertex> CpuArena::vertices(std::int32_t slot) const {
    return {vertices_.data() + slot_vertices_ * static_cast<std::size_t>(slot), slot_vertices_};
}

}  // namespace scree
