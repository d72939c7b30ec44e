// TextureArena: the imagery of all resident tiles in compressed 2D arrays of equal layers, taken once. Slot s is layer
// s % layers_per_array() of array s / layers_per_array(). OpenGL thread only.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/result.h"
#include "common/texture_tile.h"
#include "runtime/render/gl_handle.h"

namespace scree {

/// Layers of one array at most. 2048 layers of 256^2 texels are 90 MB: large budgets need a handful of arrays, and each
/// array is one multi-draw. Below this the smaller of the driver's limit and this holds. A TextureCode has 11 bits for
/// a layer.
inline constexpr int kMaxArrayLayers = 2048;

/// What an arena of `slots` slots takes of a memory budget.
inline std::size_t texture_arena_bytes(int texture_size_log2, int slots) {
    return bc1_chain_bytes(texture_size_log2) * static_cast<std::size_t>(slots);
}

struct TextureArenaOptions {
    int texture_size_log2 = 8;
    int slots = 1;
    /// 1: off. Up to 16: sharper imagery at grazing angles, bounded by the driver. Free on a GPU; any degree costs 5 to
    /// 6 ms a full screen of 800x800 on software OpenGL.
    double anisotropy = 1;
    int max_array_layers = kMaxArrayLayers;  ///< tests take fewer to have several arrays
};

class TextureArena {
public:
    TextureArena() = default;
    /// Errors (ErrorCode::display): the driver has no memory for it.
    static Result<TextureArena> create(const TextureArenaOptions& options);

    /// `chain`: BC1 blocks of every mip, coarsest first, as in TextureTile::blocks; its size is bc1_chain_bytes(). 0 <=
    /// slot < slots(). What was drawn before keeps the old imagery.
    void upload(int slot, std::span<const std::uint8_t> chain);

    int slots() const { return slots_; }
    int layers_per_array() const { return layers_per_array_; }
    int array_of(int slot) const { return slot / layers_per_array_; }
    int layer_of(int slot) const { return slot % layers_per_array_; }
    const std::vector<TextureHandle>& arrays() const { return arrays_; }

private:
    std::vector<TextureHandle> arrays_;
    int texture_size_log2_ = 0;
    int slots_ = 0;
    int layers_per_array_ = 1;
};

}  // namespace scree
