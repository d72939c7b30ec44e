// DrawnFrame: a draw list laid out over the finest cells, and everything that must hold of it, found without the code
// of runtime/lod or runtime/app.
#pragma once

#include <vector>

#include "runtime/app/drawn_mesh.h"
#include "runtime/lod/draw_list.h"
#include "tests/runtime/lod/synthetic_terrain.h"

namespace scree::test {

class DrawnFrame {
public:
    DrawnFrame(const SyntheticTerrain& terrain, const DrawList& draws);

    /// Exponent of the stride in which an item is drawn, in finest cells.
    int exponent(const DrawItem& item) const {
        return terrain_.lattice().deepest_level - item.tile.level + item.geomip;
    }
    /// The same, continuous: with how far it has morphed to the next.
    double level(const DrawItem& item) const { return exponent(item) + static_cast<double>(item.morph); }
    /// Finest cells (padding included) drawn more than once.
    std::int64_t cells_drawn_twice() const { return twice_; }
    std::int64_t cells_drawn() const { return drawn_; }
    /// Present cells with a corner in view of the camera that nothing is drawn over.
    std::int64_t visible_cells_missed(const Camera& camera, double half_curvature = 0) const;
    /// What is wrong with the balance, an edge mask or an edge's weight, or empty.
    std::string unbalanced() const;
    /// What is wrong with the mesh, or empty: every edge once each way, or once with nothing drawn beyond it; all
    /// triangles face up; their plan area is that of the tiles drawn.
    std::string leak(const DrawnMesh& mesh) const;

private:
    std::int32_t item_at(std::int64_t i, std::int64_t j) const;

    const SyntheticTerrain& terrain_;
    const DrawList& draws_;
    std::int64_t width_, height_;
    std::vector<std::int32_t> cells_;  ///< index of the item over each finest cell, -1
    std::int64_t drawn_ = 0, twice_ = 0;
};

/// The heights of every tile of the terrain, in the slots that FakeResidency gives them.
CpuArena arena_of(const SyntheticTerrain& terrain);

}  // namespace scree::test
