// BlockScene: a store in the layout of Ueng & Chuang (runtime/lod/block_world.h), whole in memory: what Scene is where
// tiles are paged. A store that is updated meanwhile is shown as it was. No OpenGL. One thread.
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
#include "runtime/lod/surface_piece.h"
#include "runtime/scene/scene.h"

namespace scree {

class BlockScene {
public:
    /// With what OpenGL holds: a vertex, and two triangles of three indices where everything is drawn. An EdgeField has
    /// no more cells than there are samples.
    static constexpr std::int64_t kBytesPerSample = BlockWorld::kBytesPerSample + 16 + 24 + 3;

    /// Of the options: budget, tau, lod, curvature. Errors: those of read_height_raster() and BlockWorld::make().
    static Result<std::unique_ptr<BlockScene>> open(const TileStore& store, const SceneOptions& options,
                                                    const LoadProgress& progress = {});

    const Dataset& dataset() const { return dataset_; }
    const BlockWorld& world() const { return world_; }
    std::int64_t resident_bytes() const;

    double tau_px() const { return rules_.tau_px; }
    /// What is no length stands for 0.
    void set_tau_px(double tau_px) { rules_.tau_px = tau_px > 0 ? tau_px : 0; }
    /// How far off the finest data what is drawn may be, pixels; none where nothing is promised.
    std::optional<double> promise_px() const;

    /// 1 / (2 R) of the last frame, 1/m; 0: flat.
    double half_curvature() const { return rules_.half_curvature; }
    /// Every block is chosen anew in the next frame.
    void forget() { world_.forget(); }

    /// The frame, and all below that speaks of what is drawn, is valid until the next call.
    const BlockFrame& select(const Camera& camera);
    /// Triangles drawn, of the world's vertices: blocks, strips and quads, each in a place of its own.
    std::span<const SurfacePiece> pieces() const { return pieces_; }
    /// By place: the most indices that its piece can have.
    std::vector<std::uint32_t> rooms() const;
    /// Where the blocks end. Null without SceneOptions::soft_edge.
    const std::shared_ptr<const EdgeField>& edge_field() const { return edge_field_; }
    LatticePoint lattice_point(std::uint32_t vertex) const;
    float height_n(std::uint32_t vertex) const;
    DrawnMesh drawn_mesh() const;
    /// Between the blocks drawn, and in them, no edge may be open.
    CrackReport count_cracks() const;
    /// Finest cells in view that are not drawn.
    std::int64_t count_holes(const Camera& camera) const;

private:
    BlockScene(const Dataset& dataset, const SceneOptions& options, BlockWorld world);
    void make_edge_field();
    bool is_at_end(int block) const;
    bool is_drawn(std::int64_t x, std::int64_t y) const;
    bool covers(std::int64_t i, std::int64_t j) const;
    std::int64_t count_holes(const Camera& camera, int block) const;

    Dataset dataset_;
    LodSettings lod_;
    Curvature curvature_;
    BlockRules rules_;
    BlockWorld world_;
    std::vector<std::uint8_t> drawn_;   ///< blocks
    std::vector<std::uint8_t> at_end_;  ///< blocks near the end
    std::vector<SurfacePiece> pieces_;
    std::shared_ptr<const EdgeField> edge_field_;
};

}  // namespace scree
