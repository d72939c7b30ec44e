// A height tile: (m+1)^2 samples as integers of the dataset's height quantum, what a renderer must know to draw or
// refine it without reading its children, and (of a leaf) which of its cells were valid in the source.
//
// A leaf is a tile without children, at any level: the tree is as deep as the data under it. Over a leaf's extent its
// own samples, triangulated at its own stride, are the finest stored surface. docs/store-format.md, "Depth".
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/lattice.h"
#include "common/result.h"

namespace scree {

/// |n| < 2^23: n, n/2 and differences of two n are exact in float32.
inline constexpr std::int32_t kMaxHeightUnits = (1 << 23) - 1;

/// Errors of successive levels differ by this factor at least: a level whose error is that of the next would be left as
/// soon as it is reached, and its morph would be a jump (Scree lod, C15).
inline constexpr float kErrorGrowth = 1.25f;
/// No surface errs by more: an error of this size grows no further.
inline constexpr float kMaxErrorUnits = 4.0f * static_cast<float>(kMaxHeightUnits);

/// Height range and certified errors of the terrain under one tile's extent, in quanta.
struct HeightBounds {
    std::int32_t min_n = 0;  ///< over every sample that can be drawn in the extent
    std::int32_t max_n = 0;
    /// error_n[g]: maximum vertical distance between the finest stored surface over present cells and the tile's
    /// surface drawn at geomip level g (stride 2^g samples of the tile), with any of its border vertices of ratio 2
    /// removed. At least kErrorGrowth times that of g - 1; never below a child's value at the same absolute stride. g =
    /// 0 .. tile_cells_log2 - 1: a tile is drawn with at least 2 x 2 cells. Rounded up. Of a leaf error_n[0]
    /// counts removed border vertices only: drawn whole, the finest surface has error 0.
    std::array<float, kMaxTileCellsLog2> error_n{};

    friend bool operator==(const HeightBounds&, const HeightBounds&) = default;
};

struct HeightTileHeader {
    std::uint8_t child_mask = 0;  ///< bit q: child quadrant q is stored (has a present cell); 0: a leaf
    std::uint8_t leaf_mask = 0;   ///< bit q: child q is a leaf above the deepest level
    bool texture_ends = false;    ///< above the deepest texture level: the texture here is not refined, or ends above
    std::uint8_t texture_end_mask = 0;  ///< bit q: the same of child q
    HeightBounds own;
    std::array<HeightBounds, 4> children;  ///< those of existing children, zero elsewhere

    bool is_leaf() const { return child_mask == 0; }

    friend bool operator==(const HeightTileHeader&, const HeightTileHeader&) = default;
};

struct HeightTile {
    HeightTileHeader header;
    std::vector<std::int32_t> samples;  ///< (m+1)^2, row-major, north-west first
    /// Leaves only: one byte a cell (m*m, row-major), 1 = present. Empty means every cell is present.
    std::vector<std::uint8_t> presence;

    friend bool operator==(const HeightTile&, const HeightTile&) = default;
};

/// How many geomip levels a tile can be drawn at (strides 1, 2, .. m/2 of its samples).
inline int geomip_level_count(int tile_cells_log2) { return tile_cells_log2; }

}  // namespace scree
