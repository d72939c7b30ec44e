// Index lists of a tile's mesh for every geomip level and edge mask. Source: the nested union jack
// (docs/architecture.md, "One triangulation"): cell (i, j) of a stride is split by the diagonal (i,j)-(i+1,j+1) iff i +
// j is even. With at least 2 x 2 cells a tile is a set of blocks of 2 x 2 cells, each a fan of 8 triangles round its
// centre. Thinning an edge by 2 removes the mid-vertex of each block's side on that edge and merges its two triangles:
// the bisection hierarchy of Ueng & Chuang and the omitted vertices of de Boer (section 2.4) at once.
#pragma once

#include <cstdint>
#include <vector>

namespace scree {

enum EdgeMask : unsigned { kEdgeNorth = 1, kEdgeEast = 2, kEdgeSouth = 4, kEdgeWest = 8 };
inline constexpr unsigned kEdgeMaskCount = 16;

/// Where one pattern's indices lie in TilePatterns::indices.
struct PatternRange {
    std::uint32_t first = 0;
    std::uint32_t count = 0;
};

/// A square part of a tile: (x, y) of 2^level x 2^level. Level 0 is the whole tile.
struct TilePart {
    int level = 0;
    int x = 0;
    int y = 0;
};

/// All patterns of tiles of 2^n cells a side. Vertex (i, j) of a tile has index j * (2^n + 1) + i. Triangles are
/// counter-clockwise seen from above (x east, y north).
class TilePatterns {
public:
    explicit TilePatterns(int tile_cells_log2);

    int tile_cells_log2() const { return tile_cells_log2_; }
    int geomip_levels() const { return tile_cells_log2_; }
    /// Pattern of geomip level g (stride 2^g), 0 <= g < geomip_levels(), with the edges in `mask` thinned by 2.
    PatternRange range(int geomip, unsigned mask) const { return range(geomip, mask, TilePart{}); }
    /// The indices of a part only: blocks stand in Morton order, so a part is one range. A part holds at least one
    /// block: part.level <= finest_part_level(geomip).
    PatternRange range(int geomip, unsigned mask, TilePart part) const;
    int finest_part_level(int geomip) const { return tile_cells_log2_ - 1 - geomip; }
    const std::vector<std::uint32_t>& indices() const { return indices_; }

private:
    int tile_cells_log2_;
    std::vector<std::vector<std::uint32_t>> block_starts_;  ///< by pattern: first index of each block, and the end
    std::vector<std::uint32_t> indices_;
};

/// Triangles of a pattern: 2 (m/s)^2 less one for each removed border vertex.
std::uint32_t pattern_triangles(int tile_cells_log2, int geomip, unsigned mask);

}  // namespace scree
