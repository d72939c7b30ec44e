// BlockScene: a store in the layout of Ueng & Chuang (runtime/lod/block_world.h), whole in memory: what Scene is where
// tiles are paged. The world is flat, and a store that is updated meanwhile is shown as it was. No OpenGL. One thread.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "common/dataset.h"
#include "common/store/tile_store.h"
#include "runtime/app/drawn_mesh.h"
#include "runtime/lod/block_world.h"
#include "runtime/scene/scene.h"

namespace scree {

class BlockScene {
public:
    /// With what OpenGL holds: a vertex, and two triangles of three indices where everything is drawn.
    static constexpr std::int64_t kBytesPerSample = BlockWorld::kBytesPerSample + 16 + 24;

    /// Of the options: budget, tau, lod; the curvature, which may not be on. Errors: ErrorCode::usage for that; those
    /// of read_height_raster() and BlockWorld::make().
    static Result<std::unique_ptr<BlockScene>> open(const TileStore& store, const SceneOptions& options);

    const Dataset& dataset() const { return dataset_; }
    const BlockWorld& world() const { return world_; }
    std::int64_t resident_bytes() const;

    double tau_px() const { return rules_.tau_px; }
    void set_tau_px(double tau_px) { rules_.tau_px = tau_px; }
    /// How far off the finest data what is drawn may be, pixels; none where nothing is promised.
    std::optional<double> promise_px() const;

    /// The frame, and all below that speaks of what is drawn, is valid until the next call.
    const BlockFrame& select(const Camera& camera);
    /// Triangles drawn, three of the world's vertices each.
    std::span<const std::span<const std::uint32_t>> pieces() const { return pieces_; }
    LatticePoint lattice_point(std::uint32_t vertex) const;
    float height_n(std::uint32_t vertex) const;
    DrawnMesh drawn_mesh() const;
    /// Between the blocks drawn, and in them, no edge may be open.
    CrackReport count_cracks() const;
    /// Finest cells in view that are not drawn.
    std::int64_t count_holes(const Camera& camera) const;

private:
    BlockScene(const Dataset& dataset, const LodSettings& lod, double tau_px, BlockWorld world);
    bool is_drawn(std::int64_t x, std::int64_t y) const;
    bool covers(std::int64_t i, std::int64_t j) const;
    std::int64_t count_holes(const Camera& camera, int block) const;

    Dataset dataset_;
    LodSettings lod_;
    BlockRules rules_;
    BlockWorld world_;
    std::vector<std::uint8_t> drawn_;  ///< blocks
    std::vector<std::span<const std::uint32_t>> pieces_;
};

}  // namespace scree
