#include "runtime/app/drawn_tile.h"

#include <algorithm>
#include <cmath>

#include "common/mesh/morphed_vertex.h"

namespace scree {

void DrawnTile::set(const DrawItem& item, std::span<const SlotVertex> vertices) {
    const int n = lattice_.tile_cells_log2;
    const auto step = static_cast<std::int32_t>(lattice_.step(item.tile.level));
    const LatticePoint corner = lattice_.corner(item.tile);
    const MorphedPattern pattern{item.geomip, item.edge_mask, item.morph, item.edge_morph};
    cells_ = 1 << n;
    stride_ = 1 << item.geomip;
    edge_mask_ = item.edge_mask;
    samples_per_cell_ = 1.0 / static_cast<double>(step);
    positions_.resize(vertices.size());
    const float side = static_cast<float>(step) * frame_.spacing_m;
    for (int j = 0; j <= cells_; j += stride_)
        for (int i = 0; i <= cells_; i += stride_) {
            const auto k = static_cast<std::size_t>(j * (cells_ + 1) + i);
            const VertexMorph morph = vertex_morph(i, j, n, pattern);
            positions_[k] = frame_.position(
                static_cast<std::int32_t>(corner.i) + i * step, static_cast<std::int32_t>(corner.j) + j * step,
                morphed_height(vertices[k], morph), morph.weight * (morph.reach_squared * (side * side)));
        }
}

// In a block of 2 x 2 cells round its centre, with a = max(|dx|, |dy|) and b = min(|dx|, |dy|) in strides, a point lies
// in the triangle of centre, mid-point of the nearer side and corner; a thinned side's mid-point is the mean of its
// corners (common/mesh/drawn_surface.h).
glm::dvec3 DrawnTile::at(double u, double v) const {
    const double s = u * samples_per_cell_, t = v * samples_per_cell_;
    const int blocks = cells_ / (2 * stride_);
    const int bi = std::clamp(static_cast<int>(s / (2 * stride_)), 0, blocks - 1);
    const int bj = std::clamp(static_cast<int>(t / (2 * stride_)), 0, blocks - 1);
    const int ci = (2 * bi + 1) * stride_, cj = (2 * bj + 1) * stride_;
    const double dx = s - ci, dy = t - cj;
    const double ax = std::abs(dx) / stride_, ay = std::abs(dy) / stride_;
    const int si = dx > 0 ? stride_ : -stride_, sj = dy > 0 ? stride_ : -stride_;
    const auto position = [&](int i, int j) { return positions_[static_cast<std::size_t>(j * (cells_ + 1) + i)]; };
    const glm::dvec3 corner = position(ci + si, cj + sj);
    const bool along_x = ax >= ay;
    const unsigned side = along_x ? (si > 0 ? kEdgeEast : kEdgeWest) : (sj > 0 ? kEdgeSouth : kEdgeNorth);
    const int rim = along_x ? ci + si : cj + sj;
    const bool thinned = (edge_mask_ & side) != 0 && (rim == 0 || rim == cells_);
    glm::dvec3 mid;
    if (thinned)
        mid = 0.5 * (corner + (along_x ? position(ci + si, cj - sj) : position(ci - si, cj + sj)));
    else
        mid = along_x ? position(ci + si, cj) : position(ci, cj + sj);
    const double a = std::max(ax, ay), b = std::min(ax, ay);
    return (1 - a) * position(ci, cj) + (a - b) * mid + b * corner;
}

}  // namespace scree
