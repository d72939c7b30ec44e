#include "tests/runtime/lod/probed_surface.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_map>

#include "common/mesh/morphed_vertex.h"

namespace scree::test {

std::vector<double> ProbedSurface::heights_m(const DrawList& draws, const std::vector<glm::dvec2>& places,
                                             glm::dvec3 eye, double half_curvature) const {
    const Lattice& l = terrain_.lattice();
    std::unordered_map<TileId, const DrawItem*, TileIdHash> drawn;
    for (const DrawItem& item : draws) drawn[item.tile] = &item;
    std::vector<double> heights;
    for (const glm::dvec2 place : places) {
        heights.push_back(std::numeric_limits<double>::quiet_NaN());
        for (int level = 0; level <= l.deepest_level; ++level) {
            const auto extent = static_cast<double>(l.tile_extent(level));
            const auto found = drawn.find(
                {level, static_cast<std::int64_t>(place.x / extent), static_cast<std::int64_t>(place.y / extent)});
            if (found != drawn.end()) heights.back() = height_m(*found->second, place, eye, half_curvature);
        }
    }
    return heights;
}

// Each block of 2 x 2 cells is a fan round its centre; see common/mesh/tile_patterns.h.
double ProbedSurface::height_m(const DrawItem& item, glm::dvec2 place, glm::dvec3 eye, double half_curvature) const {
    const Lattice& l = terrain_.lattice();
    const int m = l.tile_cells(), stride = 1 << item.geomip;
    const LatticePoint corner = l.corner(item.tile);
    const auto step = static_cast<double>(l.step(item.tile.level));
    const auto vertices = arena_.vertices(item.height_slot);
    const MorphedPattern pattern{item.geomip, item.edge_mask, item.morph, item.edge_morph};
    const auto vertex_m = [&](int i, int j) {
        const SlotVertex& v = vertices[static_cast<std::size_t>(j * (m + 1) + i)];
        const VertexMorph morph = vertex_morph(i, j, l.tile_cells_log2, pattern);
        const double x = l.x_m(static_cast<double>(corner.i) + i * step) - eye.x;
        const double y = l.y_m(static_cast<double>(corner.j) + j * step) - eye.y;
        const double side = step * l.spacing_m;
        const double height_n = static_cast<double>(morphed_height(v, morph));
        return terrain_.dataset().height_m(height_n) -
               (x * x + y * y + static_cast<double>(morph.weight) * morph.reach_squared * side * side) * half_curvature;
    };
    const double s = (place.x - static_cast<double>(corner.i)) / step,
                 t = (place.y - static_cast<double>(corner.j)) / step;
    const auto middle = [&](double along) {
        return (2 * std::clamp(static_cast<int>(along / (2 * stride)), 0, m / (2 * stride) - 1) + 1) * stride;
    };
    const int ci = middle(s), cj = middle(t);
    const int di = s < ci ? -stride : stride, dj = t < cj ? -stride : stride;
    const double ax = std::abs(s - ci) / stride, ay = std::abs(t - cj) / stride;
    const double corner_m = vertex_m(ci + di, cj + dj);
    const bool along_x = ax >= ay;
    const unsigned side = along_x ? (di > 0 ? kEdgeEast : kEdgeWest) : (dj > 0 ? kEdgeSouth : kEdgeNorth);
    const int rim = along_x ? ci + di : cj + dj;
    double mid_m = 0;
    if ((item.edge_mask & side) != 0 && (rim == 0 || rim == m))
        mid_m = 0.5 * (corner_m + (along_x ? vertex_m(ci + di, cj - dj) : vertex_m(ci - di, cj + dj)));
    else
        mid_m = along_x ? vertex_m(ci + di, cj) : vertex_m(ci, cj + dj);
    const double a = std::max(ax, ay), b = std::min(ax, ay);
    return (1 - a) * vertex_m(ci, cj) + (a - b) * mid_m + b * corner_m;
}

}  // namespace scree::test
