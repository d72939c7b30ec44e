// Certified geometric error: the exact maximum vertical distance between a surface that a tile can draw and the finest
// surface, over present cells. Because every coarse edge is a union of finest edges (nested union jack; Scree lod,
// C11), the maximum lies at finest vertices. All arithmetic is exact: integers in doubles below 2^53.
//
// A tile's surface at any stride is a set of blocks of 2 x 2 cells. A parent's surface at a stride its children can
// draw is theirs, so only each tile's coarsest surface, one block, is ever compared with the finest data.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "common/height_tile.h"

namespace scree {

/// Finest vertices of one deepest-level tile, (m+1)^2, and which of them belong to a present cell (nullptr: all).
struct FinestVertices {
    const std::int32_t* samples = nullptr;
    const std::uint8_t* present = nullptr;
    int tile_cells_log2 = 0;
};

/// One byte a vertex from one byte a cell (HeightTile::presence). Empty in, empty out.
std::vector<std::uint8_t> present_vertices(std::span<const std::uint8_t> cell_presence, int tile_cells_log2);

/// The 3 x 3 vertices of a block of 2 x 2 cells, row-major from the north-west.
using BlockVertices = std::array<std::int32_t, 9>;

/// Error, in quanta, of a block of stride `stride` finest cells over a deepest-level tile that lies inside it with its
/// corner (offset_i, offset_j) finest cells from the block's. Includes every variant in which sides of the block are
/// thinned. stride * 2^23 must stay below 2^52.
double coarse_block_error(const BlockVertices& block, std::int64_t stride, std::int64_t offset_i, std::int64_t offset_j,
                          const FinestVertices& finest);

/// Errors of a deepest-level tile against itself at geomip levels 0..n-1 with all thinned variants, in quanta,
/// saturated (never falling with the level).
using LeafErrors = std::array<double, kMaxTileCellsLog2>;
LeafErrors leaf_errors(const FinestVertices& finest);
/// The same of several tiles of one size, `errors` an entry each: sixteen at a time in the lanes of a vector.
void leaf_errors(std::span<const FinestVertices> tiles, std::span<LeafErrors> errors);

/// max(known, coarse_block_error(block, ...)), given the tile's own errors: what a few of its vertices miss the block
/// by, and how far the others can be from a surface through those, mostly shows that no vertex passes `known`. The
/// tile's corner lies at multiples of its cells from the block's centre.
double greatest_block_error(const BlockVertices& block, std::int64_t stride, std::int64_t offset_i,
                            std::int64_t offset_j, const FinestVertices& finest, const LeafErrors& own, double known);

/// The smallest float not below `value` >= 0.
float round_up_to_float(double value);

}  // namespace scree
