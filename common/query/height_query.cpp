#include "common/query/height_query.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "common/mesh/drawn_surface.h"

namespace scree {
namespace {

// The finest cells that a coordinate touches.
struct TouchedCells {
    std::int64_t first = 0;
    std::int64_t last = -1;
};

TouchedCells touched_cells(double coordinate, std::int64_t cells) {
    if (!(coordinate >= 0 && coordinate <= static_cast<double>(cells))) return {};
    const auto whole = static_cast<std::int64_t>(coordinate);
    const bool on_line = static_cast<double>(whole) == coordinate;
    return {on_line ? std::max<std::int64_t>(whole - 1, 0) : whole, std::min(whole, cells - 1)};
}

}  // namespace

double on_lattice(double coordinate, double metres, double origin_m, double spacing_m) {
    // Twice what x_m and i_of round, half a unit in the last place an operation.
    const double slack =
        std::numeric_limits<double>::epsilon() * (std::abs(metres) + 2 * std::abs(metres - origin_m)) / spacing_m;
    const double whole = std::round(coordinate);
    return std::abs(coordinate - whole) <= slack ? whole : coordinate;
}

std::optional<HeightAt> height_in_cell(const Dataset& d, TileId id, const HeightTileView& tile, std::int64_t ci,
                                       std::int64_t cj, double i, double j) {
    const Lattice& l = d.lattice;
    const LatticePoint corner = l.corner(id);
    const std::int64_t cell = l.step(id.level);
    if (!tile.presence.empty() &&
        tile.presence[static_cast<std::size_t>((cj - corner.j) / cell * l.tile_cells() + (ci - corner.i) / cell)] == 0)
        return std::nullopt;
    const auto step = static_cast<double>(cell);
    const double n =
        drawn_height_at(tile.samples, l.tile_cells_log2, {0, 0}, (i - static_cast<double>(corner.i)) / step,
                        (j - static_cast<double>(corner.j)) / step);
    return HeightAt{d.height_m(n), surface_error_m(d, *tile.header), id.level, tile.header->is_leaf()};
}

Result<std::optional<HeightAt>> height_over_cell(HeightSource& source, std::int64_t ci, std::int64_t cj, double i,
                                                 double j) {
    const Dataset& d = source.dataset();
    const Lattice& l = d.lattice;
    const TileId leaf{l.deepest_level, ci >> l.tile_cells_log2, cj >> l.tile_cells_log2};
    TileId id = ancestor_at(leaf, 0);
    auto tile = source.view(id);
    if (!tile) return tile.error();
    while (*tile && !(*tile)->header->is_leaf() && id.level < l.deepest_level) {
        const TileId next = ancestor_at(leaf, id.level + 1);
        if (((*tile)->header->child_mask >> quadrant_of(next) & 1) == 0) return std::optional<HeightAt>{};
        auto child = source.view(next);
        if (!child) return child.error();
        if (!*child) {
            tile = source.view(id);  // the view of the parent ended when the child was asked for
            if (!tile) return tile.error();
            break;
        }
        tile = std::move(child);
        id = next;
    }
    if (!*tile) return std::optional<HeightAt>{};
    return height_in_cell(d, id, **tile, ci, cj, i, j);
}

Result<std::optional<HeightAt>> best_height(const Lattice& l, double x_m, double y_m, const HeightOverCell& ask) {
    const double i = on_lattice(l.i_of(x_m), x_m, l.origin_x_m, l.spacing_m);
    const double j = on_lattice(l.j_of(y_m), y_m, l.origin_y_m, l.spacing_m);
    const TouchedCells columns = touched_cells(i, l.cells_x), rows = touched_cells(j, l.cells_y);
    std::optional<HeightAt> best, leaf;
    std::vector<HeightAt> all;
    for (std::int64_t cj = rows.first; cj <= rows.last; ++cj)
        for (std::int64_t ci = columns.first; ci <= columns.last; ++ci) {
            auto height = ask(ci, cj, i, j);
            if (!height) return height;
            if (!*height) continue;
            if ((*height)->finest) {
                if ((*height)->level == l.deepest_level) return height;
                if (!leaf || (*height)->level > leaf->level) leaf = *height;
                continue;
            }
            if (!best || (*height)->error_bound_m < best->error_bound_m) best = *height;
            all.push_back(**height);
        }
    if (leaf) return leaf;
    // Which of the cells are present nobody knows here, and an error holds for its own present cells only.
    for (const HeightAt& h : all)
        best->error_bound_m = std::max(best->error_bound_m, h.error_bound_m + std::abs(h.height_m - best->height_m));
    return best;
}

Result<std::optional<HeightAt>> height_at(HeightSource& source, double x_m, double y_m) {
    return best_height(source.dataset().lattice, x_m, y_m,
                       [&source](std::int64_t ci, std::int64_t cj, double i, double j) {
                           return height_over_cell(source, ci, cj, i, j);
                       });
}

}  // namespace scree
