// SyntheticTerrain: a whole height and texture pyramid in memory, with the certified errors of common/mesh, made from
// any function of the lattice. FakeResidency: any subset of its tiles, each in a slot of its own.
#pragma once

#include <functional>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "common/dataset.h"
#include "common/height_tile.h"
#include "common/texture_tile.h"
#include "runtime/paging/residency.h"
#include "runtime/view/camera.h"
#include "runtime/view/frustum.h"
#include "tests/common/test_support.h"

namespace scree::test {

/// Height in quanta of sample (i, j), also beyond the data's extent; whether finest cell (i, j) is present.
using HeightFunction = std::function<std::int32_t(std::int64_t i, std::int64_t j)>;
using PresenceFunction = std::function<bool(std::int64_t i, std::int64_t j)>;

struct TerrainShape {
    int tile_cells_log2 = 3;
    std::int64_t cells_x = 64;
    std::int64_t cells_y = 64;
    double spacing_m = 10;
    double quantum_m = 0.25;
    /// 0: one texture a root, so that pages are split for geometry alone. May pass the heights' depth by
    /// tile_cells_log2.
    int texture_depth = 0;
    int texture_size_log2 = 4;
};

class SyntheticTerrain {
public:
    SyntheticTerrain(const TerrainShape& shape, HeightFunction height, PresenceFunction present = {});

    const Dataset& dataset() const { return dataset_; }
    const Lattice& lattice() const { return dataset_.lattice; }
    /// Null where none is stored.
    const HeightTile* tile(TileId id) const;
    /// Stored height tiles, coarse before fine; a tile's index serves as its slot.
    const std::vector<TileId>& tiles() const { return ids_; }
    std::int32_t index(TileId id) const;
    /// Stored texture tiles and their indices, likewise.
    const std::vector<TileId>& textures() const { return texture_ids_; }
    std::int32_t texture_index(TileId id) const;
    bool has_texture(TileId id) const { return texture_index(id) >= 0; }
    TextureTile texture(TileId id) const;
    bool present(std::int64_t i, std::int64_t j) const;
    double height_m(std::int64_t i, std::int64_t j) const { return dataset_.height_m(height_(i, j)); }
    Box box_of(TileId id) const;

private:
    bool make_tile(TileId id);
    void make_textures();

    Dataset dataset_;
    HeightFunction height_;
    PresenceFunction present_;
    std::unordered_map<TileId, HeightTile, TileIdHash> stored_;
    std::unordered_map<TileId, std::int32_t, TileIdHash> indices_, texture_indices_;
    std::vector<TileId> ids_, texture_ids_;
};

/// Rough ground from integer noise of several wavelengths, -amplitude..amplitude quanta.
HeightFunction rough_heights(std::uint64_t seed, int amplitude);
/// Absent discs over a part of the extent.
PresenceFunction with_absent_discs(Random& random, const TerrainShape& shape, int discs);
/// Of all sizes, with and without absent areas, one or several roots; heights from smooth to white noise.
SyntheticTerrain random_terrain(Random& random, int texture_depth = 0);
inline constexpr int kDeepTextures = 99;  ///< for texture_depth: as deep as can be
/// Anywhere in, over or beside the terrain, looking at a point of it.
Camera random_camera(Random& random, const SyntheticTerrain& terrain);
inline double uniform_real(Random& random, double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
}

class FakeResidency final : public Residency {
public:
    explicit FakeResidency(const SyntheticTerrain& terrain) : terrain_(&terrain) {}
    void add_all();
    void add_roots();
    /// Every tile with a chance of `percent`, roots always, whether its parent is there or not.
    void add_random(Random& random, int percent);
    void add(TileId id) { heights_.insert(id); }
    void add_texture(TileId id) { textures_.insert(id); }
    void remove(TileId id) { heights_.erase(id); }
    void make_unavailable(TileId id) {
        heights_.erase(id);
        unavailable_.insert(id);
    }
    bool holds(TileId id) const { return heights_.contains(id); }
    bool holds_texture(TileId id) const { return textures_.contains(id); }

    ResidentHeight height(TileId id) const override;
    std::int32_t texture(TileId id) const override;
    std::uint8_t texture_children(TileId id) const override;
    bool unavailable_height(TileId id) const override { return unavailable_.contains(id); }
    bool unavailable_texture(TileId) const override { return false; }

private:
    const SyntheticTerrain* terrain_;
    std::unordered_set<TileId, TileIdHash> heights_, textures_, unavailable_;
};

}  // namespace scree::test
