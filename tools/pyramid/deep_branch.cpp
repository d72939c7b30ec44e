#include "tools/pyramid/deep_branch.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <mutex>

#include "tools/pyramid/sample_range.h"

namespace scree {

// Where the base's cells hold a point: base sample west and north of it, and the shares on the way to the next.
struct BasePlace {
    std::int64_t i, j;
    double east, south;
};
static BasePlace base_place(std::int64_t i, std::int64_t j, int shift) {
    const std::int64_t step = std::int64_t{1} << shift;
    return {i >> shift, j >> shift, static_cast<double>(i & (step - 1)) / static_cast<double>(step),
            static_cast<double>(j & (step - 1)) / static_cast<double>(step)};
}

// Samples of the base around a rectangle of points.
class BaseWindow {
public:
    static Result<BaseWindow> read(const HeightSpool& base, std::int64_t i0, std::int64_t j0, std::int64_t i1,
                                   std::int64_t j1, int shift) {
        BaseWindow w;
        w.i0_ = std::min(i0 >> shift, base.width() - 1);
        w.j0_ = std::min(j0 >> shift, base.height() - 1);
        w.columns_ = std::min((i1 >> shift) + 1, base.width() - 1) - w.i0_ + 1;
        w.rows_ = std::min((j1 >> shift) + 1, base.height() - 1) - w.j0_ + 1;
        w.values_.resize(static_cast<std::size_t>(w.columns_ * w.rows_));
        w.valid_.resize(w.values_.size());
        if (auto ok = base.read_window(w.i0_, w.j0_, w.columns_, w.rows_, w.values_, w.valid_); !ok) return ok.error();
        return w;
    }
    // Beyond the data's extent the border is repeated.
    double value(std::int64_t i, std::int64_t j) const { return values_[index(i, j)]; }
    bool valid(std::int64_t i, std::int64_t j) const {
        return i - i0_ < columns_ && j - j0_ < rows_ && valid_[index(i, j)] != 0;
    }
    // The samples at the ends of the base edge, or at the corners of the base cell, that the point lies on.
    bool valid_around(const BasePlace& p) const {
        const std::int64_t i1 = p.i + (p.east > 0 ? 1 : 0), j1 = p.j + (p.south > 0 ? 1 : 0);
        return valid(p.i, p.j) && valid(i1, p.j) && valid(p.i, j1) && valid(i1, j1);
    }
    /// Of a base point itself, beyond the data too.
    double at(std::int64_t i, std::int64_t j) const { return value(std::max(i, i0_), std::max(j, j0_)); }
    double between(const BasePlace& p) const {
        const double north = value(p.i, p.j) * (1 - p.east) + value(p.i + 1, p.j) * p.east;
        const double south = value(p.i, p.j + 1) * (1 - p.east) + value(p.i + 1, p.j + 1) * p.east;
        return north * (1 - p.south) + south * p.south;
    }

private:
    std::size_t index(std::int64_t i, std::int64_t j) const {
        return static_cast<std::size_t>(std::min(j - j0_, rows_ - 1) * columns_ + std::min(i - i0_, columns_ - 1));
    }
    std::int64_t i0_ = 0, j0_ = 0, columns_ = 0, rows_ = 0;
    std::vector<double> values_;
    std::vector<std::uint8_t> valid_;
};

// Under points without a height: on the points of every second step, from the base down, what stands half-way between
// those of twice the step. So a surface that ends goes on from its last samples to the base's, a step at a time, and
// what a point gets depends on its place alone.
class DeepHeights::Support {
public:
    Support(const DeepHeights& heights, const BaseWindow& base) : heights_(heights), base_(base) {}

    /// Puts support where `values` (points of the rectangle) are NaN.
    Result<void> lay(std::int64_t i, std::int64_t j, std::int64_t columns, std::int64_t rows, std::int64_t stride,
                     std::span<double> values) const {
        Grid coarse;
        for (std::int64_t step = std::int64_t{1} << (heights_.shift_ - 1); step >= stride; step /= 2) {
            Grid grid{i / step * step, j / step * step, step, 0, 0, {}};
            grid.columns = (i + (columns - 1) * stride - grid.i + step - 1) / step + 1;
            grid.rows = (j + (rows - 1) * stride - grid.j + step - 1) / step + 1;
            if (auto ok = fill(grid, coarse); !ok) return ok;
            coarse = std::move(grid);
        }
        assert(coarse.columns == columns && coarse.rows == rows);
        for (std::size_t k = 0; k < values.size(); ++k)
            if (std::isnan(values[k])) values[k] = coarse.values[k];
        return {};
    }

private:
    struct Grid {
        std::int64_t i = 0, j = 0, step = 0, columns = 0, rows = 0;
        std::vector<double> values;
        double at(std::int64_t pi, std::int64_t pj) const {
            return values[static_cast<std::size_t>((pj - j) / step * columns + (pi - i) / step)];
        }
    };

    // `coarse`: of twice the step around it; empty: the base.
    Result<void> fill(Grid& grid, const Grid& coarse) const {
        grid.values.resize(static_cast<std::size_t>(grid.columns * grid.rows));
        if (auto ok = heights_.grid_.sample(grid.i, grid.j, grid.columns, grid.rows, grid.step, grid.values); !ok)
            return ok;
        const auto above = [&](std::int64_t pi, std::int64_t pj) {
            return coarse.values.empty() ? base_.at(pi >> heights_.shift_, pj >> heights_.shift_) : coarse.at(pi, pj);
        };
        const std::int64_t twice = 2 * grid.step;
        for (std::int64_t r = 0; r < grid.rows; ++r)
            for (std::int64_t c = 0; c < grid.columns; ++c) {
                double& value = grid.values[static_cast<std::size_t>(r * grid.columns + c)];
                const std::int64_t pi = grid.i + c * grid.step, pj = grid.j + r * grid.step;
                const BasePlace p = base_place(pi, pj, heights_.shift_);
                value = heights_.height(value, p, base_);
                if (!std::isnan(value)) continue;
                const std::int64_t west = pi / twice * twice, north = pj / twice * twice;
                const std::int64_t east = west + (pi == west ? 0 : twice), south = north + (pj == north ? 0 : twice);
                value = (above(west, north) + above(east, north) + above(west, south) + above(east, south)) / 4;
            }
        return {};
    }

    const DeepHeights& heights_;
    const BaseWindow& base_;
};

// NaN: there is none.
double DeepHeights::height(double layers, const BasePlace& p, const BaseWindow& base) const {
    if (p.east == 0 && p.south == 0) return base.at(p.i, p.j);  // what the tiles above have, filled voids too
    if (std::isfinite(layers)) return layers;
    return base.valid_around(p) ? base.between(p) : std::numeric_limits<double>::quiet_NaN();
}

Result<void> DeepHeights::sample(std::int64_t i, std::int64_t j, std::int64_t columns, std::int64_t rows,
                                 std::int64_t stride, std::span<std::int32_t> out, std::span<std::uint8_t> valid,
                                 double& worst_error_m) const {
    std::vector<double> values(out.size());
    if (auto ok = grid_.sample(i, j, columns, rows, stride, values); !ok) return ok;
    auto window = BaseWindow::read(base_, i, j, i + (columns - 1) * stride, j + (rows - 1) * stride, shift_);
    if (!window) return window.error();
    bool lacking = false;
    for (std::int64_t r = 0; r < rows; ++r)
        for (std::int64_t c = 0; c < columns; ++c) {
            const auto k = static_cast<std::size_t>(r * columns + c);
            const BasePlace p = base_place(i + c * stride, j + r * stride, shift_);
            valid[k] = std::isfinite(values[k]) || window->valid_around(p) ? 1 : 0;
            values[k] = height(values[k], p, *window);
            lacking = lacking || std::isnan(values[k]);
        }
    if (lacking)
        if (auto ok = Support(*this, *window).lay(i, j, columns, rows, stride, values); !ok) return ok;
    for (std::size_t k = 0; k < values.size(); ++k) {
        out[k] = quantizer_.quantize(values[k]);
        if (valid[k] != 0) worst_error_m = std::max(worst_error_m, quantizer_.error_m(values[k]));
    }
    return {};
}

void set_child(HeightTileHeader& header, int quadrant, const HeightBounds& bounds, bool leaf_above_deepest) {
    header.child_mask = static_cast<std::uint8_t>(header.child_mask | 1 << quadrant);
    if (leaf_above_deepest) header.leaf_mask = static_cast<std::uint8_t>(header.leaf_mask | 1 << quadrant);
    header.children[static_cast<std::size_t>(quadrant)] = bounds;
}

void let_errors_grow(HeightBounds& bounds, int tile_cells_log2) {
    for (int g = 1; g < tile_cells_log2; ++g) {
        float& error = bounds.error_n[static_cast<std::size_t>(g)];
        const float grown = kErrorGrowth * bounds.error_n[static_cast<std::size_t>(g - 1)];
        error = std::max(error, std::min(grown, kMaxErrorUnits));
    }
}

HeightBounds bounds_over(std::span<const HeightBounds> children, std::span<const std::int32_t> samples,
                         double coarsest_error, int tile_cells_log2) {
    HeightBounds bounds;
    const SampleRange range = range_of(samples);
    bounds.min_n = range.low;
    bounds.max_n = range.high;
    for (const HeightBounds& child : children) {
        bounds.min_n = std::min(bounds.min_n, child.min_n);
        bounds.max_n = std::max(bounds.max_n, child.max_n);
        for (int g = 0; g + 1 < tile_cells_log2; ++g) {
            float& error = bounds.error_n[static_cast<std::size_t>(g)];
            error = std::max(error, child.error_n[static_cast<std::size_t>(g + 1)]);
        }
    }
    bounds.error_n[static_cast<std::size_t>(tile_cells_log2 - 1)] = round_up_to_float(coarsest_error);
    let_errors_grow(bounds, tile_cells_log2);
    return bounds;
}

// On the way down: what the tiles above can draw over this one.
struct DeepBranches::Place {
    TileId base;
    const std::vector<AncestorBlock>* base_blocks;  // levels 0 .. base level
    std::vector<BlockVertices> deep_blocks;         // levels base + 1 .. this tile's parent
};

Result<DeepBranches::Children> DeepBranches::build(TileId base_tile, const std::vector<AncestorBlock>& blocks) const {
    return children(base_tile, Place{base_tile, &blocks, {}});
}

Result<DeepBranches::Children> DeepBranches::children(TileId id, const Place& place) const {
    Children built;
    std::array<Result<void>, 4> outcome;
    tbb::parallel_for(0, 4, [&](int q) {
        const auto k = static_cast<std::size_t>(q);
        auto branch = tile(child_of(id, q), place);
        if (branch)
            built.quadrant[k] = std::move(*branch);
        else
            outcome[k] = branch.error();
    });
    for (const auto& ok : outcome)
        if (!ok) return ok.error();
    return built;
}

Result<BranchSummary> DeepBranches::tile(TileId id, const Place& place) const {
    return tree_.refined(id) ? refined(id, place) : leaf(id, place);
}

Result<BranchSummary> DeepBranches::leaf(TileId id, const Place& place) const {
    const int n = lattice_.tile_cells_log2, up = id.level - place.base.level;
    const std::int64_t m = lattice_.tile_cells(), side = m + 1;
    // The tile's corner in the base tile, in its own cells.
    const std::int64_t in_base_i = (id.x - (place.base.x << up)) * m, in_base_j = (id.y - (place.base.y << up)) * m;
    BranchSummary summary;
    summary.leaf = true;
    summary.coarsest_leaf = id.level;
    HeightTile tile;
    tile.samples.resize(static_cast<std::size_t>(side * side));
    std::vector<std::uint8_t> valid(tile.samples.size());
    const LatticePoint corner = lattice_.corner(id);
    const std::int64_t step = lattice_.step(id.level);
    if (auto ok =
            heights_.sample(corner.i, corner.j, side, side, step, tile.samples, valid, summary.worst_quantum_error_m);
        !ok)
        return ok.error();
    tile.presence.resize(static_cast<std::size_t>(m * m));
    for (std::int64_t r = 0; r < m; ++r)
        for (std::int64_t c = 0; c < m; ++c) {
            const std::uint8_t* v = valid.data() + r * side + c;
            const bool inside =
                corner.i + (c + 1) * step <= lattice_.cells_x && corner.j + (r + 1) * step <= lattice_.cells_y;
            const auto present = static_cast<std::uint8_t>(inside ? v[0] & v[1] & v[side] & v[side + 1] : 0);
            tile.presence[static_cast<std::size_t>(r * m + c)] = present;
            summary.present_cells += present;
        }
    if (summary.present_cells == m * m) tile.presence.clear();
    if (summary.present_cells == 0) return summary;
    summary.exists = true;
    const auto vertices = present_vertices(tile.presence, n);
    const FinestVertices finest{tile.samples.data(), vertices.empty() ? nullptr : vertices.data(), n};
    const SampleRange range = range_of(tile.samples);
    summary.bounds.min_n = range.low;
    summary.bounds.max_n = range.high;
    const auto errors = leaf_errors(finest);
    for (std::size_t g = 0; g < static_cast<std::size_t>(n); ++g)
        summary.bounds.error_n[g] = round_up_to_float(errors[g]);
    let_errors_grow(summary.bounds, n);
    summary.min_n = std::numeric_limits<std::int32_t>::max();
    summary.max_n = std::numeric_limits<std::int32_t>::min();
    for (std::size_t k = 0; k < tile.samples.size(); ++k)
        if (vertices.empty() || vertices[k] != 0) {
            summary.min_n = std::min(summary.min_n, tile.samples[k]);
            summary.max_n = std::max(summary.max_n, tile.samples[k]);
        }
    for (std::size_t level = 0; level < place.base_blocks->size(); ++level) {
        const AncestorBlock& b = (*place.base_blocks)[level];
        summary.ancestor_error[level] = greatest_block_error(b.vertices, b.stride << up, (b.offset_i << up) + in_base_i,
                                                             (b.offset_j << up) + in_base_j, finest, errors, 0);
    }
    for (std::size_t k = 0; k < place.deep_blocks.size(); ++k) {
        const int level = place.base.level + 1 + static_cast<int>(k), down = id.level - level;
        const TileId above = ancestor_at(id, level);
        summary.ancestor_error[static_cast<std::size_t>(level)] =
            greatest_block_error(place.deep_blocks[k], (m / 2) << down, (id.x - (above.x << down)) * m,
                                 (id.y - (above.y << down)) * m, finest, errors, 0);
    }
    tile.header.own = summary.bounds;
    if (auto ok = sink_(id, tile); !ok) return ok.error();
    return summary;
}

Result<BranchSummary> DeepBranches::refined(TileId id, const Place& place) const {
    const int n = lattice_.tile_cells_log2;
    const std::int64_t m = lattice_.tile_cells(), side = m + 1;
    HeightTile tile;
    tile.samples.resize(static_cast<std::size_t>(side * side));
    const LatticePoint corner = lattice_.corner(id);
    std::vector<std::uint8_t> valid(tile.samples.size());
    double unused = 0;
    if (auto ok = heights_.sample(corner.i, corner.j, side, side, lattice_.step(id.level), tile.samples, valid, unused);
        !ok)
        return ok.error();
    Place below = place;
    BlockVertices block{};
    for (std::int64_t k = 0; k < 9; ++k)
        block[static_cast<std::size_t>(k)] =
            tile.samples[static_cast<std::size_t>(k / 3 * (m / 2) * side + k % 3 * (m / 2))];
    below.deep_blocks.push_back(block);
    auto built = children(id, below);
    if (!built) return built.error();

    BranchSummary summary;
    summary.min_n = std::numeric_limits<std::int32_t>::max();
    summary.max_n = std::numeric_limits<std::int32_t>::min();
    std::vector<HeightBounds> existing;
    for (std::size_t q = 0; q < 4; ++q) {
        const BranchSummary& child = built->quadrant[q];
        if (!child.exists) continue;
        summary.exists = true;
        existing.push_back(child.bounds);
        set_child(tile.header, static_cast<int>(q), child.bounds, child.leaf && id.level + 1 < lattice_.deepest_level);
        summary.coarsest_leaf = std::min(summary.coarsest_leaf, child.coarsest_leaf);
        summary.present_cells += child.present_cells;
        summary.min_n = std::min(summary.min_n, child.min_n);
        summary.max_n = std::max(summary.max_n, child.max_n);
        summary.worst_quantum_error_m = std::max(summary.worst_quantum_error_m, child.worst_quantum_error_m);
        for (std::size_t level = 0; level < summary.ancestor_error.size(); ++level)
            summary.ancestor_error[level] = std::max(summary.ancestor_error[level], child.ancestor_error[level]);
    }
    if (!summary.exists) return summary;
    summary.bounds = bounds_over(existing, tile.samples, summary.ancestor_error[static_cast<std::size_t>(id.level)], n);
    tile.header.own = summary.bounds;
    if (auto ok = sink_(id, tile); !ok) return ok.error();
    return summary;
}

}  // namespace scree
