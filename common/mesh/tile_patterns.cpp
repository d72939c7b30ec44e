#include "common/mesh/tile_patterns.h"

#include <array>
#include <bit>
#include <cassert>

namespace scree {
namespace {

struct RingVertex {
    int i, j;
    unsigned removed_by;  // the edge whose thinning removes it, on blocks that touch that edge
};

// Round the centre of a block of 2 x 2 cells, counter-clockwise seen from above with j pointing south.
constexpr std::array<RingVertex, 8> kRing{{{0, 0, 0},
                                           {0, 1, kEdgeWest},
                                           {0, 2, 0},
                                           {1, 2, kEdgeSouth},
                                           {2, 2, 0},
                                           {2, 1, kEdgeEast},
                                           {2, 0, 0},
                                           {1, 0, kEdgeNorth}}};

int every_second_bit(int code) {
    int value = 0;
    for (int bit = 0; code >> (2 * bit) != 0; ++bit) value |= (code >> (2 * bit) & 1) << bit;
    return value;
}

std::size_t morton(int x, int y) {
    std::size_t code = 0;
    for (int bit = 0; (x | y) >> bit != 0; ++bit)
        code |= static_cast<std::size_t>((x >> bit & 1) | (y >> bit & 1) << 1) << (2 * bit);
    return code;
}

}  // namespace

TilePatterns::TilePatterns(int tile_cells_log2) : tile_cells_log2_(tile_cells_log2) {
    assert(tile_cells_log2 >= 1 && tile_cells_log2 <= 12);
    const int pitch = (1 << tile_cells_log2) + 1;
    for (int geomip = 0; geomip < tile_cells_log2; ++geomip) {
        const int stride = 1 << geomip;
        const int blocks = 1 << (tile_cells_log2 - geomip - 1);
        for (unsigned mask = 0; mask < kEdgeMaskCount; ++mask) {
            std::vector<std::uint32_t> starts;
            for (int block = 0; block < blocks * blocks; ++block) {
                starts.push_back(static_cast<std::uint32_t>(indices_.size()));
                const int bi = every_second_bit(block), bj = every_second_bit(block >> 1);
                unsigned thinned = 0;
                if (bj == 0) thinned |= mask & kEdgeNorth;
                if (bi == blocks - 1) thinned |= mask & kEdgeEast;
                if (bj == blocks - 1) thinned |= mask & kEdgeSouth;
                if (bi == 0) thinned |= mask & kEdgeWest;
                const auto index = [&](int i, int j) {
                    return static_cast<std::uint32_t>((2 * bj + j) * stride * pitch + (2 * bi + i) * stride);
                };
                std::array<std::uint32_t, 8> ring{};
                std::size_t count = 0;
                for (const RingVertex& v : kRing)
                    if ((v.removed_by & thinned) == 0) ring[count++] = index(v.i, v.j);
                for (std::size_t k = 0; k < count; ++k) {
                    indices_.push_back(index(1, 1));
                    indices_.push_back(ring[k]);
                    indices_.push_back(ring[(k + 1) % count]);
                }
            }
            starts.push_back(static_cast<std::uint32_t>(indices_.size()));
            block_starts_.push_back(std::move(starts));
        }
    }
}

PatternRange TilePatterns::range(int geomip, unsigned mask, TilePart part) const {
    assert(geomip >= 0 && geomip < geomip_levels() && mask < kEdgeMaskCount);
    assert(part.level >= 0 && part.level <= finest_part_level(geomip));
    const auto& starts = block_starts_[static_cast<std::size_t>(geomip) * kEdgeMaskCount + mask];
    const std::size_t blocks = (starts.size() - 1) >> (2 * part.level);
    const std::size_t first = blocks * morton(part.x, part.y);
    return {starts[first], starts[first + blocks] - starts[first]};
}

std::uint32_t pattern_triangles(int tile_cells_log2, int geomip, unsigned mask) {
    const std::uint32_t cells = 1u << (tile_cells_log2 - geomip);
    return 2 * cells * cells - static_cast<std::uint32_t>(std::popcount(mask)) * cells / 2;
}

}  // namespace scree
