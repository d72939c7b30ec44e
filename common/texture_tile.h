// A texture tile: a square BC1 image of `texture_size` texels with its mip chain, covering the extent of the height
// tile of the same address. Alpha 0 means "no heights here"; transparent texels decode to black, so a filtered colour
// is divided by its filtered alpha.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace scree {

inline constexpr int kMinTextureSizeLog2 = 4;   // 16
inline constexpr int kMaxTextureSizeLog2 = 11;  // 2048

struct TextureTile {
    std::uint8_t child_mask = 0;       ///< bit q: texture child quadrant q is stored
    std::vector<std::uint8_t> blocks;  ///< BC1 mip chain, coarsest (1x1) first

    friend bool operator==(const TextureTile&, const TextureTile&) = default;
};

/// Mip levels of a 2^size_log2 texture down to 1x1.
inline int mip_count(int size_log2) { return size_log2 + 1; }

/// Bytes of mip `mip` (0 = full size) of a BC1 texture of 2^size_log2 texels.
inline std::size_t bc1_mip_bytes(int size_log2, int mip) {
    const int log2 = size_log2 - mip;
    const std::size_t blocks = log2 <= 2 ? 1 : std::size_t{1} << (log2 - 2);
    return 8 * blocks * blocks;
}

/// Bytes of the whole chain.
inline std::size_t bc1_chain_bytes(int size_log2) {
    std::size_t total = 0;
    for (int mip = 0; mip <= size_log2; ++mip) total += bc1_mip_bytes(size_log2, mip);
    return total;
}

/// Byte offset of mip `mip` in a chain stored coarsest first.
inline std::size_t bc1_mip_offset(int size_log2, int mip) {
    std::size_t offset = 0;
    for (int coarser = size_log2; coarser > mip; --coarser) offset += bc1_mip_bytes(size_log2, coarser);
    return offset;
}

}  // namespace scree
