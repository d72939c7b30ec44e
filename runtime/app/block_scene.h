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
    /// With what OpenGL holds: a vertex, and two triangles of three indices where everything is drawn. An EdgeField has
    /// no more cells than there are samples.
    static constexpr std::int64_t kBytesPerSample = BlockWorld::kBytesPerSample + 16 + 24 + 3;

    /// Of the options: budget, tau, lod; the curvature, which may not be on. Errors: ErrorCode::usage for that; those
    /// of read_height_raster() and BlockWorld::make().
    static Result<std::unique_ptr<BlockScene>> open(const TileStore& store, const SceneOptions& options,
                                                    const LoadProgress& progress = {});

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
    /// The last so many of them reach into the band of edge_field().
    std::size_t pieces_at_end() const { return pieces_at_end_; }
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
    template <class Take>
    void for_each_piece(const BlockFrame& frame, const Take& take) const;
    bool is_drawn(std::int64_t x, std::int64_t y) const;
    bool covers(std::int64_t i, std::int64_t j) const;
    std::int64_t count_holes(const Camera& camera, int block) const;

    Dataset dataset_;
    LodSettings lod_;
    BlockRules rules_;
    BlockWorld world_;
    std::vector<std::uint8_t> drawn_;   ///< blocks
    std::vector<std::uint8_t> at_end_;  ///< blocks near the end
    std::vector<std::span<const std::uint32_t>> pieces_;
    std::size_t pieces_at_end_ = 0;
    std::shared_ptr<const EdgeField> edge_field_;
};

}  // namespace scree
