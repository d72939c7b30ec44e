// SyntheticTerrain: a whole height and texture pyramid in memory, with the certified errors of common/mesh, made from
// any function of the lattice, of one depth or of depths that vary by place. FakeResidency: the tables over any subset
// of its tiles.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <unordered_map>
#include <vector>

#include "common/dataset.h"
#include "common/height_tile.h"
#include "common/texture_tile.h"
#include "runtime/paging/residency.h"
#include "runtime/view/camera.h"
#include "runtime/view/frustum.h"
#include "tests/common/depth_map.h"
#include "tests/common/test_support.h"

namespace scree::test {

/// Height in quanta of sample (i, j), also beyond the data's extent; whether finest cell (i, j) is present.
using HeightFunction = std::function<std::int32_t(std::int64_t i, std::int64_t j)>;
using PresenceFunction = std::function<bool(std::int64_t i, std::int64_t j)>;

struct TerrainShape {
    int tile_cells_log2 = 3;
    std::int64_t cells_x = 64;
    std::int64_t cells_y = 64;
    double origin_x_m = 300000.5;
    double origin_y_m = 2700000.25;
    double spacing_m = 10;
    double quantum_m = 0.25;
    /// 0: one texture a root, so that pages are split for geometry alone. May pass the heights' depth by
    /// tile_cells_log2.
    int texture_depth = 0;
    int texture_size_log2 = 4;
    /// Certified errors grow by this factor at least from stride to stride (raising them is safe).
    float error_growth = 1;
    DepthMap depth;              ///< of the heights; leaves above the deepest level hold every 2^k-th sample
    DepthMap texture_depth_map;  ///< up to texture_depth
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
    std::uint8_t texture_children(TileId id) const;  ///< child bits
    TextureTile texture(TileId id) const;
    /// Whether finest cell (i, j) lies in a present cell of its leaf.
    bool present(std::int64_t i, std::int64_t j) const;
    /// The leaf over finest cell (i, j); nullopt where none is stored.
    std::optional<TileId> leaf_over(std::int64_t i, std::int64_t j) const;
    /// Of the finest stored surface at a place of the finest lattice.
    double height_m(std::int64_t i, std::int64_t j) const;
    Box box_of(TileId id) const;
    bool is_leaf(TileId id) const { return tile(id) != nullptr && tile(id)->header.is_leaf(); }
    /// A coarser leaf shares an edge with this tile.
    bool beside_coarser_leaf(TileId id) const;

private:
    bool source_present(std::int64_t i, std::int64_t j) const;
    bool cell_present(std::int64_t i, std::int64_t j, std::int64_t step) const;
    bool texture_ends(TileId id) const;
    template <class Visit>
    void for_each_leaf(TileId id, const Visit& visit) const;
    bool make_tile(TileId id);
    bool make_leaf(TileId id, HeightTile& tile);
    void grow_errors(HeightBounds& bounds) const;
    void map_leaves();
    void make_textures();

    Dataset dataset_;
    HeightFunction height_;
    PresenceFunction present_;
    float error_growth_;
    DepthMap depth_, texture_depth_;
    std::unordered_map<TileId, HeightTile, TileIdHash> stored_;
    std::unordered_map<TileId, std::int32_t, TileIdHash> indices_, texture_indices_;
    std::vector<TileId> ids_, texture_ids_;
    std::vector<std::int32_t> leaves_;  ///< by finest cell: index of the leaf over it, -1; where depth varies
};

/// Rough ground from integer noise of several wavelengths, -amplitude..amplitude quanta.
HeightFunction rough_heights(std::uint64_t seed, int amplitude);
/// Absent discs over a part of the extent.
PresenceFunction with_absent_discs(Random& random, const TerrainShape& shape, int discs);
/// Of all sizes, with and without absent areas, one or several roots; heights from smooth to white noise.
enum class Depth { uniform, varying };
SyntheticTerrain random_terrain(Random& random, int texture_depth = 0, float error_growth = 1,
                                Depth depth = Depth::uniform);
/// Every other world.
inline Depth depth_of_world(int world) { return world % 2 == 0 ? Depth::uniform : Depth::varying; }
inline constexpr int kDeepTextures = 99;  ///< for texture_depth: as deep as can be
/// Anywhere in, over or beside the terrain, looking at a point of it.
Camera random_camera(Random& random, const SyntheticTerrain& terrain);
inline double uniform_real(Random& random, double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
}

/// What a pager that keeps them knows of a tile's levels.
LevelCorrections corrections_of(const SyntheticTerrain& terrain, TileId id);

/// Tables over any set of the terrain's tiles, each in the slot of its index in tiles() or textures(). Made anew when
/// asked for after a change; one thread.
class FakeResidency {
public:
    explicit FakeResidency(const SyntheticTerrain& terrain);

    void add_all();
    void add_roots();
    /// Every tile with a chance of `percent`, roots always, whether its parent is there or not.
    void add_random(Random& random, int percent);
    void add(TileId id) { change(TileKind::height, id, State::resident); }
    void add_texture(TileId id) { change(TileKind::texture, id, State::resident); }
    void remove(TileId id) { change(TileKind::height, id, State::absent); }
    void remove_texture(TileId id) { change(TileKind::texture, id, State::absent); }
    void make_unavailable(TileId id) { change(TileKind::height, id, State::unavailable); }
    void make_texture_unavailable(TileId id) { change(TileKind::texture, id, State::unavailable); }
    bool holds(TileId id) const { return state(TileKind::height, id) == State::resident; }
    bool holds_texture(TileId id) const { return state(TileKind::texture, id) == State::resident; }

    /// Resident, and every tile above it too: what has no resident parent is as good as absent.
    bool reaches(TileKind kind, TileId id) const;

    /// When a tile became resident, whether it is now or not; -infinity, there from the start, unless it is set.
    void set_arrived(TileId id, double seconds) { set_arrived(TileKind::height, id, seconds); }
    void set_texture_arrived(TileId id, double seconds) { set_arrived(TileKind::texture, id, seconds); }
    void set_now(double seconds) { tables_.now_s = seconds; }
    void set_has_textures(bool has);
    /// As PagerOptions::corrections.
    void keep_corrections();

    /// Valid until the next change.
    const Residency& tables() const;
    operator const Residency&() const { return tables(); }

private:
    enum class State : std::uint8_t { absent, resident, unavailable };
    std::int32_t index(TileKind kind, TileId id) const {
        return kind == TileKind::height ? terrain_->index(id) : terrain_->texture_index(id);
    }
    const std::vector<TileId>& ids(TileKind kind) const {
        return kind == TileKind::height ? terrain_->tiles() : terrain_->textures();
    }
    State state(TileKind kind, TileId id) const;
    void change(TileKind kind, TileId id, State to);
    void set_arrived(TileKind kind, TileId id, double seconds);
    std::int32_t entry(TileKind kind, TileId id) const;
    void link(TileKind kind) const;

    const SyntheticTerrain* terrain_;
    std::array<std::vector<State>, 2> states_;  ///< by kind and slot
    mutable Residency tables_;
    mutable bool stale_ = true;
};

}  // namespace scree::test
