#include "tests/runtime/lod/drawn_frame.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <utility>

#include "common/mesh/vertex_slot.h"

namespace scree::test {

DrawnFrame::DrawnFrame(const SyntheticTerrain& terrain, const DrawList& draws) : terrain_(terrain), draws_(draws) {
    const Lattice& l = terrain.lattice();
    width_ = l.root_columns * l.tile_extent(0);
    height_ = l.root_rows * l.tile_extent(0);
    cells_.assign(static_cast<std::size_t>(width_ * height_), -1);
    for (std::size_t k = 0; k < draws.size(); ++k) {
        const LatticePoint corner = l.corner(draws[k].tile);
        const std::int64_t extent = l.tile_extent(draws[k].tile.level);
        for (std::int64_t j = corner.j; j < corner.j + extent; ++j)
            for (std::int64_t i = corner.i; i < corner.i + extent; ++i) {
                std::int32_t& cell = cells_[static_cast<std::size_t>(j * width_ + i)];
                ++(cell < 0 ? drawn_ : twice_);
                cell = static_cast<std::int32_t>(k);
            }
    }
}

std::int32_t DrawnFrame::item_at(std::int64_t i, std::int64_t j) const {
    if (i < 0 || j < 0 || i >= width_ || j >= height_) return -1;
    return cells_[static_cast<std::size_t>(j * width_ + i)];
}

std::int64_t DrawnFrame::visible_cells_missed(const Camera& camera, double half_curvature) const {
    const Lattice& l = terrain_.lattice();
    const Frustum frustum(camera);
    std::int64_t missed = 0;
    for (std::int64_t j = 0; j < l.cells_y; ++j)
        for (std::int64_t i = 0; i < l.cells_x; ++i) {
            if (item_at(i, j) >= 0 || !terrain_.present(i, j)) continue;
            bool seen = false;
            for (int k = 0; k < 4; ++k) {
                const std::int64_t u = i + k % 2, v = j + k / 2;
                glm::dvec3 p{l.x_m(static_cast<double>(u)), l.y_m(static_cast<double>(v)), terrain_.height_m(u, v)};
                const double x = p.x - camera.eye.x, y = p.y - camera.eye.y;
                p.z -= (x * x + y * y) * half_curvature;
                seen |= frustum.contains(p);
            }
            missed += seen ? 1 : 0;
        }
    return missed;
}

std::string DrawnFrame::unbalanced() const {
    constexpr std::size_t kNorth = 0, kEast = 1, kSouth = 2, kWest = 3;
    std::vector<std::array<double, 4>> edges(draws_.size());  // greatest level that meets at each side
    std::vector<std::array<bool, 4>> met(draws_.size());      // by anything at all
    for (std::size_t k = 0; k < draws_.size(); ++k) edges[k].fill(level(draws_[k]));
    const auto look_across = [&](std::int32_t a, std::int32_t b, std::size_t side) -> std::string {
        if (a == b || a < 0 || b < 0) return {};
        const DrawItem &own = draws_[static_cast<std::size_t>(a)], &other = draws_[static_cast<std::size_t>(b)];
        double& edge = edges[static_cast<std::size_t>(a)][side];
        edge = std::max(edge, level(other));
        met[static_cast<std::size_t>(a)][side] = true;
        if (std::abs(level(own) - level(other)) > 1 || (own.tile.level > other.tile.level && level(own) > level(other)))
            return fmt::format("level {} at stride 2^{} beside level {} at stride 2^{}", own.tile.level, level(own),
                               other.tile.level, level(other));
        return {};
    };
    for (std::int64_t j = 0; j < height_; ++j)
        for (std::int64_t i = 0; i < width_; ++i) {
            const std::int32_t here = item_at(i, j), east = item_at(i + 1, j), south = item_at(i, j + 1);
            for (const std::string& problem : {look_across(here, east, kEast), look_across(east, here, kWest),
                                               look_across(here, south, kSouth), look_across(south, here, kNorth)})
                if (!problem.empty()) return problem;
        }
    for (std::size_t k = 0; k < draws_.size(); ++k)
        for (std::size_t side = 0; side < 4; ++side) {
            const DrawItem& item = draws_[k];
            const bool thinned = (item.edge_mask >> side & 1) != 0;
            // Towards nothing an edge may be as coarse as any neighbour might make it.
            const double drawn = exponent(item) + (thinned ? 1 : 0) + static_cast<double>(item.edge_morph[side]);
            if (!met[k][side] && drawn >= level(item) && drawn <= level(item) + 1) continue;
            const double exponent_there = std::floor(edges[k][side]);
            if (exponent_there + item.edge_morph[side] != edges[k][side] ||
                thinned != (exponent_there > exponent(item)))
                return fmt::format("side {} of level 2^{} thinned {} and moved by {} where 2^{} meets it", side,
                                   level(item), thinned, item.edge_morph[side], edges[k][side]);
        }
    return {};
}

std::string DrawnFrame::leak(const DrawnMesh& mesh) const {
    using Directed = std::pair<LatticeVertex, LatticeVertex>;
    std::vector<Directed> uses;
    uses.reserve(mesh.corners.size());
    std::int64_t twice_area = 0;
    for (std::size_t t = 0; t < mesh.corners.size(); t += 3) {
        const LatticeVertex &a = mesh.corners[t], &b = mesh.corners[t + 1], &c = mesh.corners[t + 2];
        const std::int64_t area = std::int64_t{b.j - a.j} * (c.i - a.i) - std::int64_t{b.i - a.i} * (c.j - a.j);
        if (area <= 0) return fmt::format("a triangle at {}, {} faces down", a.i, a.j);
        twice_area += area;
        for (std::size_t k = 0; k < 3; ++k) uses.emplace_back(mesh.corners[t + k], mesh.corners[t + (k + 1) % 3]);
    }
    if (twice_area != 2 * drawn_)
        return fmt::format("triangles of twice the area {} over {} cells", twice_area, drawn_);
    std::sort(uses.begin(), uses.end());
    for (std::size_t k = 0; k < uses.size(); ++k) {
        const auto& [a, b] = uses[k];
        if (k > 0 && uses[k] == uses[k - 1])
            return fmt::format("the edge {}, {} - {}, {} is used twice one way", a.i, a.j, b.i, b.j);
        if (std::binary_search(uses.begin(), uses.end(), Directed{b, a})) continue;
        if (a.i != b.i && a.j != b.j) return fmt::format("a single diagonal edge at {}, {}", a.i, a.j);
        // The triangle lies to the left; nothing may be drawn to the right of any part of the edge.
        for (std::int64_t i = std::min(a.i, b.i); i < std::max(a.i, b.i); ++i)
            if (item_at(i, b.i > a.i ? a.j : a.j - 1) >= 0) return fmt::format("an open edge at {}, {}", i, a.j);
        for (std::int64_t j = std::min(a.j, b.j); j < std::max(a.j, b.j); ++j)
            if (item_at(b.j < a.j ? a.i : a.i - 1, j) >= 0) return fmt::format("an open edge at {}, {}", a.i, j);
    }
    return {};
}

CpuArena arena_of(const SyntheticTerrain& terrain) {
    const int n = terrain.lattice().tile_cells_log2;
    CpuArena arena(terrain.dataset(), static_cast<std::int64_t>(terrain.tiles().size()));
    std::vector<SlotVertex> vertices(slot_vertex_count(n));
    for (const TileId id : terrain.tiles()) {
        fill_vertex_slot(terrain.tile(id)->samples, n, vertices);
        arena.put_height(terrain.index(id), vertices);
    }
    return arena;
}

}  // namespace scree::test
