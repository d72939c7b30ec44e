// DepthMap: which addresses of a lattice have something finer under them, for test worlds whose depth varies by place.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <unordered_set>

#include "common/lattice.h"
#include "tests/common/test_support.h"

namespace scree::test {

/// Told apart from what is stored: an address may be refined and hold no present cell.
class DepthMap {
public:
    /// The same depth everywhere.
    DepthMap() = default;

    /// Depths at random, of four levels at most; somewhere the deepest, and somewhere not unless there is no other
    /// level. Graded: where an address is refined, those that share an edge with it exist (docs/store-format.md,
    /// "Depth").
    static DepthMap random(Random& random, const Lattice& lattice, int deepest, bool graded) {
        DepthMap map;
        map.varies_ = true;
        const int base = uniform(random, std::max(0, deepest - 3), std::max(0, deepest - 1));
        for (int spot = uniform(random, 1, 3); spot >= 0; --spot) {
            const int level = spot == 0 ? deepest : uniform(random, base, deepest);
            const TileId corner{level, pick(random, lattice.tiles_x(level)), pick(random, lattice.tiles_y(level))};
            const int side = uniform(random, 1, 4);
            for (int k = 0; k < side * side; ++k) map.reach(lattice, {level, corner.x + k % side, corner.y + k / side});
        }
        for (int level = 0; level < base; ++level)
            for (std::int64_t y = 0; y < lattice.tiles_y(level); ++y)
                for (std::int64_t x = 0; x < lattice.tiles_x(level); ++x) map.refined_.insert({level, x, y});
        if (graded) map.grade(lattice, deepest);
        return map;
    }

    /// Refined from the root to the parent of `id`, and nowhere else.
    static DepthMap path_to(TileId id) {
        DepthMap map;
        map.varies_ = true;
        for (int level = 0; level < id.level; ++level) map.refined_.insert(ancestor_at(id, level));
        return map;
    }

    bool varies() const { return varies_; }
    /// Meant for addresses above the deepest level.
    bool refined(TileId id) const { return !varies_ || refined_.contains(id); }
    /// Every address above it is refined.
    bool exists(TileId id) const {
        for (int level = 0; level < id.level; ++level)
            if (!refined(ancestor_at(id, level))) return false;
        return true;
    }

private:
    static std::int64_t pick(Random& random, std::int64_t count) {
        return uniform(random, 0, static_cast<int>(count) - 1);
    }
    void reach(const Lattice& lattice, TileId id) {
        if (!lattice.contains(id)) return;
        for (int level = 0; level < id.level; ++level) refined_.insert(ancestor_at(id, level));
    }
    void grade(const Lattice& lattice, int deepest) {
        for (int level = deepest - 1; level > 0; --level) {
            const std::unordered_set<TileId, TileIdHash> all = refined_;
            for (const TileId id : all) {
                if (id.level != level) continue;
                for (const TileId beside : std::array<TileId, 4>{{{level, id.x, id.y - 1},
                                                                  {level, id.x + 1, id.y},
                                                                  {level, id.x, id.y + 1},
                                                                  {level, id.x - 1, id.y}}})
                    reach(lattice, beside);
            }
        }
    }

    bool varies_ = false;
    std::unordered_set<TileId, TileIdHash> refined_;
};

}  // namespace scree::test
