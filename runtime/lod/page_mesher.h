// PageMesher: thins what selection draws by the restricted square grid: rsg and block-rsg over pages
// (docs/lod-methods.md, "Thinning what the cut draws"). Given the vertices' costs, cameras and the tiles drawn, the
// meshes depend on nothing else; with a reuse test, on the eyes that it has seen as well. Frame-loop thread only.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>

#include "common/dataset.h"
#include "runtime/lod/lod_method.h"
#include "runtime/lod/mesh_pool.h"
#include "runtime/lod/selection.h"
#include "runtime/paging/residency.h"
#include "runtime/paging/tile_measure.h"
#include "runtime/view/camera.h"

namespace scree {

/// Share of the tolerance that the cut may use up; the rest is for dropping vertices. Smaller: more pages, fewer
/// triangles (docs/lod-methods.md).
inline constexpr double kCutShare = 0.6;

struct MeshSettings {
    double tau_px = 1;
    double half_curvature = 0;  ///< 1 / (2 R), 1/m
};

struct MeshCounters {
    std::int64_t tiles = 0;      ///< drawn with a mesh
    std::int64_t chosen = 0;     ///< of these, with vertices chosen in this frame
    std::int64_t remade = 0;     ///< and with triangles made anew
    std::int64_t triangles = 0;  ///< over all views
    double reused_share() const { return tiles > 0 ? 1 - static_cast<double>(chosen) / static_cast<double>(tiles) : 1; }
};

class PageMesher {
public:
    /// `lod.method` rsg or block_rsg. Takes all its memory at once.
    PageMesher(const Dataset& dataset, const LodSettings& lod, std::int64_t height_slots);
    ~PageMesher();
    /// For another state of the store, or another number of slots: all is forgotten; pool() stays where it is.
    void renew(const Dataset& dataset, std::int64_t height_slots);

    /// A tile has come into a slot; what was known of the slot is forgotten.
    void put(std::int32_t slot, std::span<const SlotVertex> vertices, std::span<const VertexCost> costs);

    /// Chooses and makes the meshes of a selection that was made without morphing at kCutShare of the tolerance, and
    /// writes them and what is promised into it. Where they do not fit into the pool the tolerance grows by up to two
    /// octaves; where that does not help either, the selection is left to be drawn by patterns.
    void mesh(std::span<const Camera> views, const MeshSettings& settings, const Residency& residency,
              Selection& selection);

    /// What the meshes' ranges lie in.
    const MeshPool& pool() const { return pool_; }
    const MeshCounters& counters() const;  ///< of the last mesh()

    /// Bytes for each height slot, and besides them; the renderer's copy of the meshes is counted.
    static std::int64_t slot_cost(const Dataset& dataset, const LodSettings& lod);
    static std::int64_t fixed_cost(const Dataset& dataset);

private:
    struct Impl;
    MeshPool pool_;
    std::unique_ptr<Impl> impl_;
};

}  // namespace scree
