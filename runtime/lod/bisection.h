// Bisection: the restricted square grid of one block, as tables. A block of m x m cells, m = 2^n, has (m+1)^2 vertices,
// index j * (m+1) + i (i east, j south). Its two root triangles are split at the middles of their hypotenuses, again
// and again: at odd levels the centre of a square, at even levels the middle of its sides; 2n levels. Source: Lindstrom
// et al. 1996; Ueng & Chuang; Scree lod, section 1.3.
//
// It is the nested union jack of docs/architecture.md: a tile at (x, y) of its level is `odd` iff x + y is.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace scree {

/// Right-angled at `apex`; counter-clockwise seen from above (x east, y north).
struct BisectionTriangle {
    std::int32_t apex = 0, left = 0, right = 0;
    std::int32_t middle() const { return (left + right) / 2; }  ///< where it is split; exact until level 2n
    BisectionTriangle left_half() const { return {middle(), apex, left}; }
    BisectionTriangle right_half() const { return {middle(), right, apex}; }
};

struct BisectionVertex {
    std::array<std::int32_t, 2> ends{-1, -1};  ///< of the hypotenuse whose middle it is
    /// Apexes of the one or two triangles that it splits: it can be active only where these are. [1] is -1 on the
    /// block's border.
    std::array<std::int32_t, 2> parents{-1, -1};
    /// Vertices one level finer whose parent it is, -1 behind the last.
    std::array<std::int32_t, 4> children{-1, -1, -1, -1};
    std::int32_t level = 0;  ///< 1 .. 2n; 0: a corner of the block, always active
};

class Bisection {
public:
    /// n = 1 .. kMaxTileCellsLog2. `odd`: the root square is split from north-east to south-west.
    Bisection(int cells_log2, bool odd);

    int cells_log2() const { return cells_log2_; }
    int cells() const { return 1 << cells_log2_; }
    int row() const { return cells() + 1; }
    int levels() const { return 2 * cells_log2_; }
    std::size_t vertex_count() const { return vertices_.size(); }
    std::int32_t index(int i, int j) const { return j * row() + i; }

    const BisectionVertex& vertex(std::int32_t index) const { return vertices_[static_cast<std::size_t>(index)]; }
    /// 1 <= level <= levels().
    std::span<const std::int32_t> of_level(int level) const {
        return std::span(order_).subspan(
            first_[static_cast<std::size_t>(level)],
            first_[static_cast<std::size_t>(level) + 1] - first_[static_cast<std::size_t>(level)]);
    }
    /// All vertices but the corners, coarsest first.
    std::span<const std::int32_t> coarse_to_fine() const { return order_; }
    /// The two triangles that the whole block is.
    std::array<BisectionTriangle, 2> roots() const { return roots_; }
    /// The two that a cell of stride 2^log2, (x, y) of that grid, is.
    std::array<BisectionTriangle, 2> roots(int stride_log2, int x, int y) const;

private:
    int cells_log2_;
    bool odd_;
    std::array<BisectionTriangle, 2> roots_;
    std::vector<BisectionVertex> vertices_;
    std::vector<std::int32_t> order_;
    std::vector<std::size_t> first_;  ///< in order_, by level, and the end
};

}  // namespace scree
