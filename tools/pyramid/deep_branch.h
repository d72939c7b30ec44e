// The tiles under one tile of the base level where finer data deepens the pyramid: depth first, from the finest leaves
// up, in memory that does not grow with the depth.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "common/dataset.h"
#include "common/height_tile.h"
#include "common/mesh/geometric_error.h"
#include "tools/mosaic/stack.h"
#include "tools/pyramid/deep_tree.h"
#include "tools/pyramid/height_quantizer.h"
#include "tools/pyramid/height_spool.h"

namespace scree {

struct BasePlace;
class BaseWindow;

/// Heights on the points of the finest lattice: base samples where there are some, else the layers' values, else (over
/// voids) the base's filled samples between, else support: what stands half-way between points of twice the step.
/// Every value is finite. Any thread.
class DeepHeights {
public:
    /// Base sample (i, j) is point (i << shift, j << shift) of `grid`.
    DeepHeights(const HeightGrid& grid, const HeightSpool& base, const HeightQuantizer& quantizer, int shift)
        : grid_(grid), base_(base), quantizer_(quantizer), shift_(shift) {}

    /// Points (i + c * stride, j + r * stride), row-major, in quanta, and one byte a point, 1 = valid: a layer has a
    /// value there, or the base's samples around it are valid (a void that was filled). `worst_error_m` grows to the
    /// greatest rounding of a valid value.
    Result<void> sample(std::int64_t i, std::int64_t j, std::int64_t columns, std::int64_t rows, std::int64_t stride,
                        std::span<std::int32_t> out, std::span<std::uint8_t> valid, double& worst_error_m) const;

private:
    class Support;
    double height(double layers, const BasePlace& place, const BaseWindow& base) const;

    const HeightGrid& grid_;
    const HeightSpool& base_;
    HeightQuantizer quantizer_;
    int shift_;
};

/// What an ancestor of the base tile can draw over it at its coarsest: the block's vertices, its stride and the base
/// tile's corner in it, in base cells.
struct AncestorBlock {
    BlockVertices vertices{};
    std::int64_t stride = 0;
    std::int64_t offset_i = 0, offset_j = 0;
};

/// What the tiles above need to know of a built branch.
struct BranchSummary {
    bool exists = false;  ///< false: no present cell
    bool leaf = false;
    int coarsest_leaf = kMaxLevel;  ///< level
    HeightBounds bounds;
    std::array<double, kMaxLevel + 1> ancestor_error{};  ///< by level, of the ancestor's coarsest block over the branch
    std::int64_t present_cells = 0;                      ///< of leaves
    std::int32_t min_n = 0, max_n = 0;                   ///< over vertices of present cells
    double worst_quantum_error_m = 0;
};

/// Takes finished tiles; called from several threads.
using TileSink = std::function<Result<void>(TileId id, const HeightTile& tile)>;

class DeepBranches {
public:
    /// `lattice`: the finest one. The referenced objects must outlive it.
    DeepBranches(const Lattice& lattice, const DeepTree& tree, const DeepHeights& heights, TileSink sink)
        : lattice_(lattice), tree_(tree), heights_(heights), sink_(std::move(sink)) {}

    /// Builds and stores the children of a refined base tile and all below. `blocks`: of the base tile's ancestors and
    /// (last) its own. Any thread.
    struct Children {
        std::array<BranchSummary, 4> quadrant;
    };
    Result<Children> build(TileId base_tile, const std::vector<AncestorBlock>& blocks) const;

private:
    struct Place;  // of a tile on the way down
    Result<BranchSummary> tile(TileId id, const Place& place) const;
    Result<BranchSummary> leaf(TileId id, const Place& place) const;
    Result<BranchSummary> refined(TileId id, const Place& place) const;
    Result<Children> children(TileId id, const Place& place) const;

    Lattice lattice_;
    const DeepTree& tree_;
    const DeepHeights& heights_;
    TileSink sink_;
};

/// Enters a stored child into its parent's header.
void set_child(HeightTileHeader& header, int quadrant, const HeightBounds& bounds, bool leaf_above_deepest);
/// A parent's finest level has the error of its children's second: the growth goes on from level to level.
void let_errors_grow(HeightBounds& bounds, int tile_cells_log2);
/// Bounds of a tile from its children's, its own samples' range and its coarsest block's error.
HeightBounds bounds_over(std::span<const HeightBounds> children, std::span<const std::int32_t> samples,
                         double coarsest_error, int tile_cells_log2);

}  // namespace scree
