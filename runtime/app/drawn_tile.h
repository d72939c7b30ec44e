// DrawnTile: the surface of one drawn tile as the eye sees it: morphed, lowered by curvature, in the float positions
// that the vertex shader computes (runtime/view/relative_frame.h), and evaluated anywhere on it.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "common/lattice.h"
#include "common/mesh/morphed_vertex.h"
#include "common/result.h"
#include "runtime/lod/draw_list.h"
#include "runtime/view/relative_frame.h"

namespace scree {

class DrawnTile {
public:
    DrawnTile(const Lattice& lattice, const RelativeFrame& frame) : lattice_(lattice), frame_(frame) {}
    /// Takes up another tile, the whole of it. `meshes` holds its mesh; null where it has none. Errors
    /// (ErrorCode::check_failed): the mesh does not cover the tile once, by triangles that are unions of halves of its
    /// cells (over_half_).
    Result<void> set(const DrawItem& item, std::span<const SlotVertex> vertices, const MeshPool* meshes = nullptr);
    /// The drawn point relative to the eye over (u, v), in finest cells from the tile's north-west corner: exactly so
    /// in plan but for the rounding of float positions. 0 <= u, v <= the tile's extent. After a set() without error.
    glm::dvec3 at(double u, double v) const;

private:
    using Triangle = std::array<std::int32_t, 3>;  ///< vertices of the tile, j * (m + 1) + i

    void place(const DrawItem& item, const MorphedPattern& pattern, int i, int j, const SlotVertex& vertex);
    Result<void> set_mesh(const DrawItem& item, std::span<const std::uint32_t> indices);
    bool lay_over_halves(std::int32_t triangle);
    glm::dvec3 at_pattern(double s, double t) const;
    glm::dvec3 at_mesh(double s, double t) const;
    glm::ivec2 vertex(std::int32_t index) const { return {index % (cells_ + 1), index / (cells_ + 1)}; }
    const glm::dvec3& position(int i, int j) const {
        return positions_[static_cast<std::size_t>(j * (cells_ + 1) + i)];
    }

    const Lattice& lattice_;
    RelativeFrame frame_;
    int cells_ = 0;   ///< m of a tile
    int stride_ = 1;  ///< drawn, in the tile's own samples
    unsigned edge_mask_ = 0;
    double samples_per_cell_ = 1;
    std::vector<glm::dvec3> positions_;  ///< (m+1)^2, those of drawn vertices set
    std::vector<Triangle> triangles_;    ///< of the mesh; none: a pattern
    /// By half of a cell, 2 (j m + i) + which: the triangle over it, -1 for none. Cells are halved as the nested union
    /// jack has it, so a triangle of the restricted square grid is a union of halves.
    std::vector<std::int32_t> over_half_;
};

}  // namespace scree
