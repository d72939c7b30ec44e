#include "runtime/app/cpu_arena.h"

namespace scree {

CpuArena::CpuArena(const Dataset& dataset, std::int64_t height_slots, TileSink* next)
    : samples_(static_cast<std::size_t>(dataset.lattice.tile_samples() * dataset.lattice.tile_samples())),
      heights_(samples_ * static_cast<std::size_t>(height_slots)),
      next_(next) {}

void CpuArena::put_height(std::int32_t slot, std::span<const SlotVertex> vertices) {
    std::int32_t* out = heights_.data() + samples_ * static_cast<std::size_t>(slot);
    for (std::size_t k = 0; k < samples_; ++k) out[k] = static_cast<std::int32_t>(vertices[k].height_n);
    if (next_ != nullptr) next_->put_height(slot, vertices);
}

void CpuArena::put_texture(std::int32_t slot, std::span<const std::uint8_t> chain) {
    if (next_ != nullptr) next_->put_texture(slot, chain);
}

std::span<const std::int32_t> CpuArena::heights(std::int32_t slot) const {
    return {heights_.data() + samples_ * static_cast<std::size_t>(slot), samples_};
}

}  // namespace scree
