// SmallWorld: a height pyramid in memory, behind TileStore, with exact errors by brute force; and an independent
// reading of its finest surface, triangle by triangle, each cell as large as its leaf has it. PartialSource: any subset
// of its tiles.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <set>

#include "common/query/height_source.h"
#include "common/query/ray_cast.h"
#include "common/store/tile_store.h"
#include "tests/common/depth_map.h"
#include "tests/common/test_support.h"

namespace scree::test {

struct WorldShape {
    int tile_cells_log2 = 2;
    std::int64_t cells_x = 16, cells_y = 16;
    double origin_x_m = 0, origin_y_m = 0, spacing_m = 1, height_offset_m = 0, quantum_m = 1;
    double quantum_error_m = 0, warp_error_m = 0;
    DepthMap depth;
};

class SmallWorld final : public TileStore {
public:
    using Heights = std::function<std::int32_t(std::int64_t i, std::int64_t j)>;
    using Presence = std::function<bool(std::int64_t i, std::int64_t j)>;
    SmallWorld(const WorldShape& shape, Heights heights, Presence presence = {});

    const Dataset& dataset() const override { return dataset_; }
    const Lattice& lattice() const { return dataset_.lattice; }
    Result<std::unique_ptr<TileReader>> open_reader() const override;

    const std::map<TileId, HeightTile>& tiles() const { return tiles_; }
    /// Rows that read as if they were not there, or cut in half.
    std::set<TileId> lost, cut;
    mutable std::int64_t reads = 0;

    /// Of finest cell (i, j): whether it lies in a present cell of its leaf.
    bool present(std::int64_t i, std::int64_t j) const;
    bool depth_varies() const { return depth_.varies(); }
    /// Of the leaf over a finest cell, stored or not: its level, and the north-west corner and side of its cell there.
    struct LeafCell {
        int level = 0;
        std::int64_t i = 0, j = 0, side = 1;
    };
    LeafCell leaf_cell(std::int64_t ci, std::int64_t cj) const;
    double x_m(double i) const { return lattice().x_m(i); }
    double y_m(double j) const { return lattice().y_m(j); }
    double height_m(std::int64_t i, std::int64_t j) const { return dataset_.height_m(heights_(i, j)); }
    /// A corner of the lattice as a point.
    Vector3 vertex(std::int64_t i, std::int64_t j) const;
    /// The two triangles of the leaf's cell over a finest cell, by the rule: split from (i, j) to (i+1, j+1) iff i + j
    /// is even, in the leaf's units.
    std::array<std::array<Vector3, 3>, 2> triangles(std::int64_t i, std::int64_t j) const;
    /// Height of the finest surface at lattice position (i, j) inside cell (ci, cj).
    double surface_m(std::int64_t ci, std::int64_t cj, double i, double j) const;

private:
    bool source_present(std::int64_t i, std::int64_t j) const;
    double surface_n(std::int64_t ci, std::int64_t cj, double i, double j) const;
    bool make_tile(TileId id);
    float own_error(TileId id, const HeightTile& tile) const;

    Dataset dataset_;
    Heights heights_;
    Presence presence_;
    DepthMap depth_;
    std::map<TileId, HeightTile> tiles_;
};

/// Sizes, places, heights and holes at random; some with several roots. `varying`: depths too.
SmallWorld random_world(Random& random, bool varying = false);

class PartialSource final : public HeightSource {
public:
    explicit PartialSource(const SmallWorld& world) : world_(world) {}
    /// Each tile but the roots goes with this chance, and all below it with it.
    void drop(Random& random, int percent);

    const Dataset& dataset() const override { return world_.dataset(); }
    Result<std::optional<HeightTileView>> view(TileId id) override;
    std::int64_t views = 0;

private:
    const SmallWorld& world_;
    std::set<TileId> dropped_;
    HeightTile shown_;  // overwritten by each call, as the contract allows
};

inline double uniform_real(Random& random, double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
}

}  // namespace scree::test
