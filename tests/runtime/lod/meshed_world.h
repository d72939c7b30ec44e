// MeshedWorld: a synthetic terrain drawn by any method of level of detail, as the frame loop does it, and how far the
// surface drawn is from the finest data on the screen.
#pragma once

#include <memory>
#include <span>

#include "runtime/app/cpu_arena.h"
#include "runtime/app/drawn_mesh.h"
#include "runtime/lod/lod_method.h"
#include "runtime/lod/page_mesher.h"
#include "runtime/lod/selection.h"
#include "tests/runtime/lod/synthetic_terrain.h"

namespace scree::test {

class MeshedWorld {
public:
    /// All tiles are resident. `pool_tiles`: so many whole tiles' triangles have room; 0: all of them.
    MeshedWorld(const TerrainShape& shape, HeightFunction height, const LodSettings& lod, PresenceFunction present = {},
                std::int64_t pool_tiles = 0);
    MeshedWorld(const MeshedWorld&) = delete;  // its parts point to one another
    MeshedWorld& operator=(const MeshedWorld&) = delete;

    const SyntheticTerrain& terrain() const { return terrain_; }
    const MeshCounters& counters() const { return mesher_->counters(); }
    bool has_mesher() const { return mesher_ != nullptr; }
    /// A place of the finest lattice at a height.
    glm::dvec3 at(double i, double j, double z) const {
        return {terrain_.lattice().x_m(i), terrain_.lattice().y_m(j), z};
    }
    /// Hands every tile to the mesher again, as if it had been read anew.
    void reload();

    const Selection& draw(std::span<const Camera> views, double tau_px, double half_curvature = 0);
    const Selection& draw(const Camera& view, double tau_px, double half_curvature = 0) {
        return draw({&view, 1}, tau_px, half_curvature);
    }
    /// Of the last draw().
    DrawnMesh mesh(std::size_t view = 0) const;

    /// What is wrong with the last draw() of a view, or empty: numbers that are none, holes, cracks, what is seen but
    /// not drawn, a surface further off than promised. Where the pool is short, than is stated.
    std::string fault(const Camera& camera, std::size_t view, double tau_px, double half_curvature = 0) const;
    /// Greatest distance on the screen between what was drawn and the finest data, at places of the finest lattice, by
    /// C1 of Scree lod: f K delta h / (r_P r_Q). Places nearer than the near plane do not count.
    double greatest_error_px(const Camera& camera, const DrawnMesh& mesh, double half_curvature) const;
    /// Places that were not where the data has them: a test that sees none proves nothing.
    std::int64_t places_off() const { return places_off_; }

private:
    bool is_data(std::int64_t i, std::int64_t j) const;

    bool pool_is_short_;
    SyntheticTerrain terrain_;
    LodSettings lod_;
    FakeResidency residency_;
    Selector selector_;
    CpuArena arena_;
    TilePatterns patterns_;
    std::unique_ptr<PageMesher> mesher_;
    Selection* drawn_ = nullptr;
    mutable std::int64_t places_off_ = 0;
};

}  // namespace scree::test
