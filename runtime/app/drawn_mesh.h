// The drawn triangles on the lattice, with morphed heights: what audits check for cracks and `shot --mesh` writes for
// others to check. Heights are the floats that the vertex shader computes, so shared vertices compare bit for bit.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include <glm/glm.hpp>

#include "common/dataset.h"
#include "common/mesh/tile_patterns.h"
#include "runtime/app/cpu_arena.h"
#include "runtime/lod/draw_list.h"

namespace scree {

struct LatticeVertex {
    std::int32_t i = 0, j = 0;
    float n = 0;               ///< height in quanta
    float morph_reach_m2 = 0;  ///< what curvature adds to the squared distance (RelativeFrame::position)
    friend auto operator<=>(const LatticeVertex&, const LatticeVertex&) = default;
};

struct DrawnMesh {
    std::vector<LatticeVertex> corners;  ///< three a triangle, counter-clockwise from above
};

/// `meshes`: the pool that the items' meshes are held in; null where no item has one.
DrawnMesh drawn_mesh(const Dataset& dataset, const TilePatterns& patterns, const DrawList& draws, const CpuArena& arena,
                     const MeshPool* meshes = nullptr);

struct CrackReport {
    std::int64_t edges = 0;        ///< sides of triangles, each triangle's three
    std::int64_t open_edges = 0;   ///< not shared by exactly two triangles although terrain is drawn on both sides
    std::int64_t t_junctions = 0;  ///< open edges with a vertex of another triangle inside them
};

/// Is terrain drawn at the lattice point (i, j), which lies in a cell and not on its border?
using CoveredAt = std::function<bool(double i, double j)>;

/// Counts cracks. Edges on the border of what is drawn (culled, absent, end of the data) are no cracks.
CrackReport count_cracks(const DrawnMesh& mesh, const CoveredAt& covered);
CrackReport count_cracks(const Dataset& dataset, const DrawList& draws, const DrawnMesh& mesh);

/// Binary PLY, vertices as doubles in the dataset's coordinates, shared between triangles; z is lowered by curvature as
/// seen from `eye` where `half_curvature` is not 0. Whole or absent.
Result<void> write_ply(const std::string& file, const Dataset& dataset, const DrawnMesh& mesh, glm::dvec3 eye,
                       double half_curvature);

}  // namespace scree
