// The true error of a drawn surface, recomputed in whole numbers. Deliberately apart from common/mesh/geometric_error:
// what certifies a bound must not be what checks it. Definition of the surface: common/mesh/drawn_surface.h.
//
// Both tools here look at one quadrant of a block of 2 x 2 cells of stride S: centre (p, q) = (0, 0), outer corner (S,
// S), p and q counted in finest cells away from the centre. Two triangles meet on p = q:
//   p >= q:  2S z = 2(S - p) centre + (p - q) 2 mid_p + 2q corner      q >= p: the same with p and q exchanged
// and a thinned side puts (corner + mirrored corner) in the place of 2 mid.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "common/height_tile.h"

namespace scree {

/// An error of numerator / (2 * stride) quanta, without rounding.
struct ExactError {
    std::int64_t numerator = 0;
    std::int64_t stride = 1;

    /// numerator / (2 stride) <= bound, decided exactly. bound is finite, 0 <= bound <= 2^26.
    bool within(float bound) const;
    double quanta() const { return static_cast<double>(numerator) / (2.0 * static_cast<double>(stride)); }
};

/// A deepest-level tile: its samples and which of its vertices belong to a present cell.
struct FinestTile {
    std::span<const std::int32_t> samples;  ///< (m+1)^2
    std::vector<std::uint8_t> present;      ///< (m+1)^2, or empty: all
    int tile_cells_log2 = 0;
};

/// Vertices touched by a present cell. `cell_presence` empty: all.
FinestTile make_finest_tile(std::span<const std::int32_t> samples, std::span<const std::uint8_t> cell_presence,
                            int tile_cells_log2);

/// The 3 x 3 samples that a tile draws at its coarsest geomip level, row-major.
std::array<std::int32_t, 9> coarsest_block(std::span<const std::int32_t> samples, int tile_cells_log2);

/// Numerator of the error, over 2 * stride, of a block over a deepest-level tile whose north-west corner lies
/// (offset_i, offset_j) finest cells from the block's; stride >= the tile's cells. Worst over all 16 edge masks.
std::int64_t ancestor_error(const std::array<std::int32_t, 9>& block, std::int64_t stride, std::int64_t offset_i,
                            std::int64_t offset_j, const FinestTile& finest);

/// Errors of a deepest-level tile at its own geomip levels, each worst over all 16 edge masks.
std::vector<ExactError> own_errors(const FinestTile& finest);

}  // namespace scree
