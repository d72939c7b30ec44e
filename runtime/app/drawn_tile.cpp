#include "runtime/app/drawn_tile.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>

namespace scree {
namespace {

using Corners = std::array<glm::ivec2, 3>;

// The half of a cell that lies north of its diagonal, or south. Even cells are split from north-west to south-east, odd
// ones the other way.
Corners half_of_cell(int i, int j, bool south) {
    const bool even = (i + j) % 2 == 0;
    const glm::ivec2 north_west(i, j), north_east(i + 1, j), south_west(i, j + 1), south_east(i + 1, j + 1);
    if (even) return {north_west, south_east, south ? south_west : north_east};
    return {north_east, south_west, south ? south_east : north_west};
}

bool is_south_of_diagonal(int i, int j, double s, double t) {
    return (i + j) % 2 == 0 ? t - j > s - i : (t - j) + (s - i) > 1;
}

// Twice the area of (a, b, c): positive where they run counter-clockwise seen from above, j pointing south.
template <class Point>
auto twice_area(const Point& a, const Point& b, const Point& c) {
    return (b.y - a.y) * (c.x - a.x) - (b.x - a.x) * (c.y - a.y);
}

bool contains(const Corners& triangle, const Corners& half) {
    return std::all_of(half.begin(), half.end(), [&](glm::ivec2 p) {
        const auto& [a, b, c] = triangle;
        return twice_area(a, b, p) >= 0 && twice_area(b, c, p) >= 0 && twice_area(c, a, p) >= 0;
    });
}

}  // namespace

void DrawnTile::place(const DrawItem& item, const MorphedPattern& pattern, int i, int j, const SlotVertex& vertex) {
    const auto step = static_cast<std::int32_t>(lattice_.step(item.tile.level));
    const LatticePoint corner = lattice_.corner(item.tile);
    const float side = static_cast<float>(step) * frame_.spacing_m;
    const VertexMorph morph = vertex_morph(i, j, lattice_.tile_cells_log2, pattern);
    positions_[static_cast<std::size_t>(j * (cells_ + 1) + i)] =
        frame_.position(static_cast<std::int32_t>(corner.i) + i * step, static_cast<std::int32_t>(corner.j) + j * step,
                        morphed_height(vertex, morph), morph.weight * (morph.reach_squared * (side * side)));
}

Result<void> DrawnTile::set(const DrawItem& item, std::span<const SlotVertex> vertices, const MeshPool* meshes) {
    const MorphedPattern pattern{item.geomip, item.edge_mask, item.morph, item.edge_morph};
    cells_ = lattice_.tile_cells();
    stride_ = 1 << item.geomip;
    edge_mask_ = item.edge_mask;
    samples_per_cell_ = 1.0 / static_cast<double>(lattice_.step(item.tile.level));
    positions_.resize(vertices.size());
    triangles_.clear();
    if (item.mesh.count == 0) {
        for (int j = 0; j <= cells_; j += stride_)
            for (int i = 0; i <= cells_; i += stride_)
                place(item, pattern, i, j, vertices[static_cast<std::size_t>(j * (cells_ + 1) + i)]);
        return {};
    }
    assert(meshes != nullptr);
    const auto indices = meshes->indices(item.mesh);
    if (auto ok = set_mesh(item, indices); !ok) return ok;
    for (const std::uint32_t index : indices) {
        const glm::ivec2 at = vertex(static_cast<std::int32_t>(index));
        place(item, pattern, at.x, at.y, vertices[index]);
    }
    return {};
}

Result<void> DrawnTile::set_mesh(const DrawItem& item, std::span<const std::uint32_t> indices) {
    const auto failed = [&](const std::string& what) {
        return Error{ErrorCode::check_failed,
                     fmt::format("the mesh of tile {}/{}/{} {}", item.tile.level, item.tile.x, item.tile.y, what)};
    };
    over_half_.assign(static_cast<std::size_t>(2 * cells_ * cells_), -1);
    for (std::size_t k = 0; k + 2 < indices.size(); k += 3) {
        const auto index = [&](std::size_t corner) { return static_cast<std::int32_t>(indices[k + corner]); };
        triangles_.push_back({index(0), index(1), index(2)});
        if (!lay_over_halves(static_cast<std::int32_t>(k / 3)))
            return failed(
                fmt::format("has a triangle {}, {}, {} that is no union of halves of cells, or lies over another",
                            index(0), index(1), index(2)));
    }
    const auto bare = std::find(over_half_.begin(), over_half_.end(), -1);
    if (bare == over_half_.end()) return {};
    const auto cell = static_cast<int>(bare - over_half_.begin()) / 2;
    return failed(fmt::format("covers half of cell {}, {} by no triangle", cell % cells_, cell / cells_));
}

// False: the triangle is not the union of the halves in it, or another lies over one of them.
bool DrawnTile::lay_over_halves(std::int32_t triangle) {
    const Triangle& corners = triangles_[static_cast<std::size_t>(triangle)];
    const std::int32_t end = (cells_ + 1) * (cells_ + 1);
    if (std::any_of(corners.begin(), corners.end(), [&](std::int32_t index) { return index < 0 || index >= end; }))
        return false;
    const Corners whole{vertex(corners[0]), vertex(corners[1]), vertex(corners[2])};
    const glm::ivec2 low = glm::min(glm::min(whole[0], whole[1]), whole[2]);
    const glm::ivec2 high = glm::max(glm::max(whole[0], whole[1]), whole[2]);
    int halves = 0;
    for (int j = low.y; j < high.y; ++j)
        for (int i = low.x; i < high.x; ++i)
            for (const bool south : {false, true}) {
                if (!contains(whole, half_of_cell(i, j, south))) continue;
                std::int32_t& over = over_half_[static_cast<std::size_t>(2 * (j * cells_ + i) + (south ? 1 : 0))];
                if (over >= 0) return false;
                over = triangle;
                ++halves;
            }
    return halves > 0 && halves == twice_area(whole[0], whole[1], whole[2]);
}

glm::dvec3 DrawnTile::at(double u, double v) const {
    const double s = u * samples_per_cell_, t = v * samples_per_cell_;
    return triangles_.empty() ? at_pattern(s, t) : at_mesh(s, t);
}

// In a block of 2 x 2 cells round its centre, with a = max(|dx|, |dy|) and b = min(|dx|, |dy|) in strides, a point lies
// in the triangle of centre, mid-point of the nearer side and corner; a thinned side's mid-point is the mean of its
// corners (common/mesh/drawn_surface.h).
glm::dvec3 DrawnTile::at_pattern(double s, double t) const {
    const int blocks = cells_ / (2 * stride_);
    const int bi = std::clamp(static_cast<int>(s / (2 * stride_)), 0, blocks - 1);
    const int bj = std::clamp(static_cast<int>(t / (2 * stride_)), 0, blocks - 1);
    const int ci = (2 * bi + 1) * stride_, cj = (2 * bj + 1) * stride_;
    const double dx = s - ci, dy = t - cj;
    const double ax = std::abs(dx) / stride_, ay = std::abs(dy) / stride_;
    const int si = dx > 0 ? stride_ : -stride_, sj = dy > 0 ? stride_ : -stride_;
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

// In the plane of the triangle over the half of a cell that holds the point.
glm::dvec3 DrawnTile::at_mesh(double s, double t) const {
    const int i = std::clamp(static_cast<int>(s), 0, cells_ - 1), j = std::clamp(static_cast<int>(t), 0, cells_ - 1);
    const int half = 2 * (j * cells_ + i) + (is_south_of_diagonal(i, j, s, t) ? 1 : 0);
    const Triangle& over = triangles_[static_cast<std::size_t>(over_half_[static_cast<std::size_t>(half)])];
    const glm::dvec2 point(s, t), a(vertex(over[0])), b(vertex(over[1])), c(vertex(over[2]));
    const double whole = twice_area(a, b, c);
    const double of_b = twice_area(point, c, a) / whole, of_c = twice_area(point, a, b) / whole;
    const auto place_of = [&](std::int32_t index) { return positions_[static_cast<std::size_t>(index)]; };
    return (1 - of_b - of_c) * place_of(over[0]) + of_b * place_of(over[1]) + of_c * place_of(over[2]);
}

}  // namespace scree
