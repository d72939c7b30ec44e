// DrawnTile: the surface of one drawn tile as the eye sees it: morphed, lowered by curvature, in the float positions
// that the vertex shader computes (runtime/view/relative_frame.h), and evaluated anywhere on it.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "common/lattice.h"
#include "common/mesh/vertex_slot.h"
#include "runtime/lod/draw_list.h"
#include "runtime/view/relative_frame.h"

namespace scree {

class DrawnTile {
public:
    DrawnTile(const Lattice& lattice, const RelativeFrame& frame) : lattice_(lattice), frame_(frame) {}
    /// Takes up another tile.
    void set(const DrawItem& item, std::span<const SlotVertex> vertices);
    /// The drawn point relative to the eye over (u, v), in finest cells from the tile's north-west corner: exactly so
    /// in plan but for the rounding of float positions. 0 <= u, v <= the tile's extent.
    glm::dvec3 at(double u, double v) const;

private:
    const Lattice& lattice_;
    RelativeFrame frame_;
    int cells_ = 0;   ///< m of a tile
    int stride_ = 1;  ///< drawn, in the tile's own samples
    unsigned edge_mask_ = 0;
    double samples_per_cell_ = 1;
    std::vector<glm::dvec3> positions_;  ///< (m+1)^2, those of drawn vertices set
};

}  // namespace scree
