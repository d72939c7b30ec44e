#include "runtime/app/drawn_mesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <cstring>
#include <span>
#include <unordered_set>

#include "common/mesh/morphed_vertex.h"
#include "common/report.h"

namespace scree {
namespace {

struct Edge {
    LatticeVertex low, high;
    bool forward = true;  // runs from low to high in its triangle
};

// Is any drawn tile over the lattice point (i, j), given in half cells and off every tile border?
class Coverage {
public:
    Coverage(const Dataset& d, const DrawList& draws) : lattice_(d.lattice) {
        for (const DrawItem& item : draws) tiles_.insert(item.tile);
    }
    bool at(double i, double j) const {
        if (i < 0 || j < 0) return false;
        for (int level = 0; level <= lattice_.deepest_level; ++level) {
            const auto extent = static_cast<double>(lattice_.tile_extent(level));
            if (tiles_.contains({level, static_cast<std::int64_t>(i / extent), static_cast<std::int64_t>(j / extent)}))
                return true;
        }
        return false;
    }

private:
    const Lattice lattice_;
    std::unordered_set<TileId, TileIdHash> tiles_;
};

// Strictly between the ends of an axis-parallel or diagonal edge, in plan.
bool inside(const Edge& e, const LatticeVertex& v) {
    const std::int64_t dx = std::int64_t{e.high.i} - e.low.i, dy = std::int64_t{e.high.j} - e.low.j;
    const std::int64_t px = std::int64_t{v.i} - e.low.i, py = std::int64_t{v.j} - e.low.j;
    if (dx * py != dy * px) return false;
    const std::int64_t along = dx * px + dy * py, length = dx * dx + dy * dy;
    return along > 0 && along < length;
}

// Of the whole tile, or of the mesh that it is drawn by.
std::span<const std::uint32_t> drawn_indices(const DrawItem& item, const TilePatterns& patterns,
                                             const MeshPool* meshes) {
    if (item.mesh.count > 0) {
        assert(meshes != nullptr);
        return meshes->indices(item.mesh);
    }
    const PatternRange range = patterns.range(item.geomip, item.edge_mask);
    return std::span(patterns.indices()).subspan(range.first, range.count);
}

}  // namespace

DrawnMesh drawn_mesh(const Dataset& d, const TilePatterns& patterns, const DrawList& draws, const CpuArena& arena,
                     const MeshPool* meshes) {
    DrawnMesh mesh;
    const auto pitch = static_cast<std::uint32_t>(d.lattice.tile_samples());
    for (const DrawItem& item : draws) {
        const auto vertices = arena.vertices(item.height_slot);
        const MorphedPattern pattern{item.geomip, item.edge_mask, item.morph, item.edge_morph};
        const LatticePoint corner = d.lattice.corner(item.tile);
        const std::int64_t step = d.lattice.step(item.tile.level);
        const float side_m = static_cast<float>(step) * static_cast<float>(d.lattice.spacing_m);
        for (const std::uint32_t index : drawn_indices(item, patterns, meshes)) {
            const VertexMorph morph = vertex_morph(static_cast<int>(index % pitch), static_cast<int>(index / pitch),
                                                   d.lattice.tile_cells_log2, pattern);
            mesh.corners.push_back({static_cast<std::int32_t>(corner.i + index % pitch * step),
                                    static_cast<std::int32_t>(corner.j + index / pitch * step),
                                    morphed_height(vertices[index], morph),
                                    morph.weight * (morph.reach_squared * (side_m * side_m))});
        }
    }
    return mesh;
}

CrackReport count_cracks(const Dataset& d, const DrawList& draws, const DrawnMesh& mesh) {
    const Coverage covered(d, draws);
    return count_cracks(mesh, [&](double i, double j) { return covered.at(i, j); });
}

CrackReport count_cracks(const DrawnMesh& mesh, const CoveredAt& covered) {
    CrackReport report;
    std::vector<Edge> edges;
    edges.reserve(mesh.corners.size());
    for (std::size_t t = 0; t < mesh.corners.size(); t += 3)
        for (std::size_t k = 0; k < 3; ++k) {
            const LatticeVertex a = mesh.corners[t + k], b = mesh.corners[t + (k + 1) % 3];
            edges.push_back(a < b ? Edge{a, b, true} : Edge{b, a, false});
        }
    report.edges = static_cast<std::int64_t>(edges.size());
    std::sort(edges.begin(), edges.end(), [](const Edge& a, const Edge& b) {
        if (a.low != b.low) return a.low < b.low;
        return a.high < b.high;
    });
    std::vector<Edge> open;
    for (std::size_t first = 0, last = 0; first < edges.size(); first = last) {
        while (last < edges.size() && edges[last].low == edges[first].low && edges[last].high == edges[first].high)
            ++last;
        if (last - first == 2 && edges[first].forward != edges[first + 1].forward) continue;
        for (std::size_t k = first; k < last; ++k) {
            // Half a cell to the right of the edge, as its triangle runs, lies what should have shared it.
            const Edge& e = edges[k];
            const double sign = e.forward ? 1 : -1;
            const double dx = sign * (e.high.i - e.low.i), dy = sign * (e.high.j - e.low.j);
            const double length = std::hypot(dx, dy);
            const double i = 0.5 * (double{1} * e.low.i + e.high.i) - 0.25 * dy / length;
            const double j = 0.5 * (double{1} * e.low.j + e.high.j) + 0.25 * dx / length;
            if (last - first == 1 && !covered(i, j)) continue;
            open.push_back(e);
        }
    }
    report.open_edges = static_cast<std::int64_t>(open.size());
    for (const Edge& e : open)
        if (std::any_of(open.begin(), open.end(), [&](const Edge& o) { return inside(e, o.low) || inside(e, o.high); }))
            ++report.t_junctions;
    return report;
}

Result<void> write_ply(const std::string& file, const Dataset& d, const DrawnMesh& mesh, glm::dvec3 eye,
                       double half_curvature) {
    static_assert(std::endian::native == std::endian::little);
    std::vector<LatticeVertex> vertices = mesh.corners;
    std::sort(vertices.begin(), vertices.end());
    vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
    std::string text = fmt::format(
        "ply\nformat binary_little_endian 1.0\ncomment drawn by scree-view; metres of the dataset's CRS\nelement "
        "vertex {}\n"
        "property double x\nproperty double y\nproperty double z\nelement face {}\nproperty list uchar int "
        "vertex_indices\n"
        "end_header\n",
        vertices.size(), mesh.corners.size() / 3);
    const auto append = [&](const auto& value) {
        char bytes[sizeof value];
        std::memcpy(bytes, &value, sizeof value);
        text.append(bytes, sizeof value);
    };
    for (const LatticeVertex& v : vertices) {
        const double x = d.lattice.x_m(v.i), y = d.lattice.y_m(v.j);
        append(x);
        append(y);
        const double across =
            (x - eye.x) * (x - eye.x) + (y - eye.y) * (y - eye.y) + static_cast<double>(v.morph_reach_m2);
        append(d.height_m(v.n) - across * half_curvature);
    }
    for (std::size_t t = 0; t < mesh.corners.size(); t += 3) {
        text.push_back(3);
        for (std::size_t k = 0; k < 3; ++k)
            append(static_cast<std::int32_t>(std::lower_bound(vertices.begin(), vertices.end(), mesh.corners[t + k]) -
                                             vertices.begin()));
    }
    return write_text(file, text);
}

}  // namespace scree
