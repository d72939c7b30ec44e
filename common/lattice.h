// Lattice: the one grid of square cells that every tile, mesh and query of a dataset speaks of (docs/architecture.md,
// "One lattice"). i counts cells east, j counts cells south from the north-west sample; level l holds every 2^(L-l)-th
// sample. All values are checked by make_lattice / Lattice::check: arithmetic on a checked lattice cannot overflow.
#pragma once

#include <cstdint>
#include <optional>

#include "common/result.h"
#include "common/tile_id.h"

namespace scree {

/// Limit of the format: 2^30 finest cells a side (32-bit vertex arithmetic on the GPU).
inline constexpr std::int64_t kMaxCellsPerSide = std::int64_t{1} << 30;
/// Deepest level of either pyramid: 1 + 2*30 bits of a key.
inline constexpr int kMaxLevel = 30;
/// Roots are pinned for ever, so there may only be a few.
inline constexpr std::int64_t kMaxRoots = 64;
/// Tile sizes 5..257 samples (m = 4..256 cells). At least 4, because a split hands its stride over to children that are
/// drawn with 2 x 2 cells or more.
inline constexpr int kMinTileCellsLog2 = 2;
inline constexpr int kMaxTileCellsLog2 = 8;

struct LatticePoint {
    std::int64_t i = 0;  ///< cells east of the origin
    std::int64_t j = 0;  ///< cells south of the origin
    friend bool operator==(const LatticePoint&, const LatticePoint&) = default;
};

struct Lattice {
    double origin_x_m = 0;  ///< x of sample (0, 0), the north-west one
    double origin_y_m = 0;
    double spacing_m = 1;
    std::int64_t cells_x = 0;       ///< cells of the data's extent, east (samples - 1)
    std::int64_t cells_y = 0;       ///< cells of the data's extent, south
    int deepest_level = 0;          ///< L of the height pyramid
    int tile_cells_log2 = 5;        ///< n; a tile has (2^n + 1)^2 samples
    std::int64_t root_rows = 1;     ///< M
    std::int64_t root_columns = 1;  ///< N

    int tile_cells() const { return 1 << tile_cells_log2; }
    int tile_samples() const { return tile_cells() + 1; }
    /// Finest cells from one sample to the next at `level` (<= deepest_level).
    std::int64_t step(int level) const { return std::int64_t{1} << (deepest_level - level); }
    /// Finest cells along the side of a height tile at `level`.
    std::int64_t tile_extent(int level) const { return std::int64_t{1} << (deepest_level - level + tile_cells_log2); }
    std::int64_t tiles_x(int level) const { return root_columns << level; }
    std::int64_t tiles_y(int level) const { return root_rows << level; }
    bool contains(TileId id) const {
        return id.level >= 0 && id.level <= kMaxLevel && id.x >= 0 && id.y >= 0 && id.x < tiles_x(id.level) &&
               id.y < tiles_y(id.level);
    }
    /// North-west sample of a height tile (level <= deepest_level).
    LatticePoint corner(TileId id) const { return {id.x * tile_extent(id.level), id.y * tile_extent(id.level)}; }

    double x_m(double i) const { return origin_x_m + i * spacing_m; }
    double y_m(double j) const { return origin_y_m - j * spacing_m; }
    double i_of(double x) const { return (x - origin_x_m) / spacing_m; }
    double j_of(double y) const { return (origin_y_m - y) / spacing_m; }

    /// Every field in range and the padded extent within the format's limits; the message names field and value.
    Result<void> check() const;

    friend bool operator==(const Lattice&, const Lattice&) = default;
};

/// The lattice over cells_x x cells_y cells: as few roots as the shape allows, min(M, N) = 1 unless that would take
/// more than kMaxRoots. Errors: ErrorCode::input for extents beyond the format.
Result<Lattice> make_lattice(double origin_x_m, double origin_y_m, double spacing_m, std::int64_t cells_x,
                             std::int64_t cells_y, int tile_cells_log2);

/// Prefix code of a tile: a leading 1, two bits a level (Morton), then the root: ((1 << 2l | morton) * roots + root).
/// Sorted keys put coarse levels first. Nullopt where the id is outside the lattice or the key would pass 63 bits.
std::optional<std::int64_t> tile_key(const Lattice& lattice, TileId id);
/// Inverse of tile_key; nullopt for an integer that is no key of this lattice.
std::optional<TileId> tile_from_key(const Lattice& lattice, std::int64_t key);

}  // namespace scree
