#include "tools/verify/alpha_pyramid.h"

#include <algorithm>
#include <bit>
#include <cstring>

#include "common/texture_tile.h"

namespace scree {
namespace {

bool is_uniform(std::span<const std::uint8_t> v) { return std::memcmp(v.data(), v.data() + 1, v.size() - 1) == 0; }

// Halves a square of `size` into rows of `pitch`.
void halve(const std::uint8_t* fine, int size, std::uint8_t* coarse, std::size_t pitch) {
    const auto half = static_cast<std::size_t>(size / 2), wide = static_cast<std::size_t>(size);
    for (std::size_t r = 0; r < half; ++r) {
        const std::uint8_t* north = fine + 2 * r * wide;
        const std::uint8_t* south = north + wide;
        for (std::size_t c = 0; c < half; ++c) {
            const unsigned sum = 2u + north[2 * c] + north[2 * c + 1] + south[2 * c] + south[2 * c + 1];
            coarse[r * pitch + c] = static_cast<std::uint8_t>(sum >> 2);
        }
    }
}

// Transparent texels of a BC1 block, in the even bits of the selectors' order.
std::uint32_t transparent_texels(const std::uint8_t* block) {
    const unsigned c0 = block[0] | static_cast<unsigned>(block[1]) << 8, c1 = block[2] | static_cast<unsigned>(block[3])
                                                                                             << 8;
    if (c0 > c1) return 0;
    const std::uint32_t selectors = std::uint32_t{block[4]} | std::uint32_t{block[5]} << 8 |
                                    std::uint32_t{block[6]} << 16 | std::uint32_t{block[7]} << 24;
    return selectors & (selectors >> 1) & 0x55555555u;
}

std::uint32_t expected_transparent(const std::uint8_t* alpha, int size, int block_c, int block_r) {
    std::uint32_t bits = 0;
    for (int k = 0; k < 16; ++k) {
        const int c = (4 * block_c + k % 4) & (size - 1), r = (4 * block_r + k / 4) & (size - 1);  // small mips repeat
        if (alpha[r * size + c] < 128) bits |= 1u << (2 * k);
    }
    return bits;
}

}  // namespace

void halve_into_quadrant(const AlphaRaster& fine, int quadrant, AlphaRaster& coarse) {
    const auto half = static_cast<std::size_t>(coarse.size / 2), pitch = static_cast<std::size_t>(coarse.size);
    std::uint8_t* out =
        coarse.texels.data() + ((quadrant & 2) != 0 ? half * pitch : 0) + ((quadrant & 1) != 0 ? half : 0);
    if (is_uniform(fine.texels)) {
        for (std::size_t r = 0; r < half; ++r) std::memset(out + r * pitch, fine.texels[0], half);
        return;
    }
    halve(fine.texels.data(), fine.size, out, pitch);
}

TexelGrid::TexelGrid(const Dataset& d, int texture_level, int step_log2)
    : log2_cells_(d.lattice.tile_cells_log2 + d.lattice.deepest_level - texture_level - d.texture_size_log2 -
                  step_log2) {}

void mark_present(const TexelGrid& grid, std::int64_t x, std::int64_t y, const CellPresence& presence,
                  AlphaRaster& alpha) {
    // Texels of this tile whose centre lies in the presence's columns; rows alike.
    const auto range = [&](std::int64_t tile, std::int64_t first_cell) {
        const std::int64_t first_texel = tile * alpha.size;
        std::int64_t from = 0, to = alpha.size;
        while (from < to && grid.cell_of_texel(first_texel + from) < first_cell) {
            const std::int64_t jump = std::max<std::int64_t>(from + 1, grid.texel_at_cell(first_cell) - first_texel);
            from = std::min(jump, to);
        }
        std::vector<std::int64_t> cells;
        for (std::int64_t k = from; k < to; ++k) {
            const std::int64_t cell = grid.cell_of_texel(first_texel + k);
            if (cell >= first_cell + presence.extent()) break;
            cells.push_back(cell);
        }
        return std::pair(from, cells);
    };
    const auto [first_c, columns] = range(x, presence.first_i);
    const auto [first_r, rows] = range(y, presence.first_j);
    for (std::size_t r = 0; r < rows.size(); ++r) {
        std::uint8_t* out = alpha.texels.data() + (first_r + static_cast<std::int64_t>(r)) * alpha.size + first_c;
        if (presence.bits.empty()) {
            std::memset(out, 255, columns.size());
            continue;
        }
        for (std::size_t c = 0; c < columns.size(); ++c)
            if (presence.at(columns[c], rows[r])) out[c] = 255;
    }
}

std::optional<AlphaDifference> compare_alpha(std::span<const std::uint8_t> chain, int size_log2,
                                             const AlphaRaster& alpha) {
    AlphaDifference difference;
    std::vector<std::uint8_t> mip(alpha.texels), coarser;
    bool uniform = is_uniform(mip);
    for (int k = 0; k <= size_log2; ++k) {
        const int size = 1 << (size_log2 - k);
        const int blocks = std::max(1, size / 4);
        const std::uint8_t* block = chain.data() + bc1_mip_offset(size_log2, k);
        for (int r = 0; r < blocks; ++r) {
            for (int c = 0; c < blocks; ++c, block += 8) {
                const std::uint32_t expected =
                    uniform ? (mip[0] < 128 ? 0x55555555u : 0u) : expected_transparent(mip.data(), size, c, r);
                const std::uint32_t wrong = expected ^ transparent_texels(block);
                if (wrong == 0) continue;
                const int first = std::countr_zero(wrong) / 2;
                if (difference.texels == 0) difference = {0, k, 4 * c + first % 4, 4 * r + first / 4};
                difference.texels += std::popcount(wrong);
            }
        }
        if (uniform || size == 1) continue;
        coarser.resize(mip.size() / 4);
        halve(mip.data(), size, coarser.data(), static_cast<std::size_t>(size / 2));
        mip.swap(coarser);
        uniform = mip.size() < 2 || is_uniform(mip);
    }
    if (difference.texels == 0) return std::nullopt;
    return difference;
}

}  // namespace scree
