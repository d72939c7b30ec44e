#include "runtime/app/coverage.h"

#include <algorithm>
#include <unordered_set>

#include "runtime/lod/cut.h"
#include "runtime/view/frustum.h"

namespace scree {
namespace {

struct Walk {
    const Dataset& dataset;
    const Residency& residency;
    Frustum frustum;
    glm::dvec3 eye;
    double half_curvature;
    std::unordered_set<TileId, TileIdHash> drawn;
    std::int64_t reached = 0;
    std::int64_t holes = 0;

    std::int64_t cells(TileId id) const {
        const Lattice& l = dataset.lattice;
        const LatticePoint c = l.corner(id);
        const std::int64_t extent = l.tile_extent(id.level);
        return std::max<std::int64_t>(0, std::min(extent, l.cells_x - c.i)) *
               std::max<std::int64_t>(0, std::min(extent, l.cells_y - c.j));
    }

    void visit(TileId id, const HeightBounds& bounds, std::int32_t slot) {
        if (drawn.contains(id)) {
            ++reached;
            return;
        }
        const Lattice& l = dataset.lattice;
        const LatticePoint c = l.corner(id);
        const std::int64_t extent = l.tile_extent(id.level);
        const Box box{{l.x_m(static_cast<double>(c.i)), l.y_m(static_cast<double>(std::min(c.j + extent, l.cells_y))),
                       dataset.height_m(bounds.min_n)},
                      {l.x_m(static_cast<double>(std::min(c.i + extent, l.cells_x))), l.y_m(static_cast<double>(c.j)),
                       dataset.height_m(bounds.max_n)}};
        if (!frustum.may_see(lowered_by_curvature(box, eye, half_curvature))) return;
        if (slot < 0 || residency.heights.headers[static_cast<std::size_t>(slot)].child_mask == 0) {
            holes += cells(id);
            return;
        }
        const auto k = static_cast<std::size_t>(slot);
        const HeightTileHeader& header = residency.heights.headers[k];
        for (std::size_t q = 0; q < 4; ++q)
            if ((header.child_mask >> q & 1) != 0)
                visit(child_of(id, static_cast<int>(q)), header.children[q], residency.heights.children[k][q]);
    }
};

}  // namespace

std::int64_t count_holes(const Dataset& dataset, const Residency& residency, const Camera& camera,
                         const DrawList& draws, double half_curvature) {
    Walk walk{dataset, residency, Frustum(camera), camera.eye, half_curvature, {}, 0, 0};
    for (const DrawItem& item : draws)
        if (!walk.drawn.insert(item.tile).second) walk.holes += walk.cells(item.tile);
    const Lattice& l = dataset.lattice;
    for (std::int64_t y = 0; y < l.root_rows; ++y)
        for (std::int64_t x = 0; x < l.root_columns; ++x)
            if (const std::int32_t root = residency.heights.roots[static_cast<std::size_t>(y * l.root_columns + x)];
                root >= 0)
                walk.visit({0, x, y}, residency.heights.headers[static_cast<std::size_t>(root)].own, root);
    // What the walk did not meet lies under another drawn node: covered twice.
    if (walk.reached < static_cast<std::int64_t>(walk.drawn.size()))
        for (const TileId id : walk.drawn)
            for (int level = 0; level < id.level; ++level)
                if (walk.drawn.contains(ancestor_at(id, level))) {
                    walk.holes += walk.cells(id);
                    break;
                }
    return walk.holes;
}

}  // namespace scree
