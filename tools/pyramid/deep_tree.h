// DeepTree: which tiles of the finest lattice are refined where depth varies by place: a fine layer deepens its own
// branches of a coarser base, and what grading asks beside them (docs/store-format.md, "Depth").
#pragma once

#include <cstdint>
#include <unordered_set>
#include <vector>

#include "common/lattice.h"
#include "common/tile_id.h"

namespace scree {

class DeepTree {
public:
    /// Every tile above `base_level` is refined, none at it or below until mark() says so.
    DeepTree(const Lattice& lattice, int base_level);

    /// Data of level `level` lies over the cells [west, east) x [north, south) (finest cells, fractions allowed): tiles
    /// over it from the base level to the one above `level` are refined.
    void mark(double west, double north, double east, double south, int level);
    /// After all marks: leaves that share an edge differ by one level at most.
    void grade();

    bool refined(TileId id) const;
    int base_level() const { return base_level_; }
    /// Of the base level, by rows.
    std::vector<TileId> refined_base_tiles() const;
    /// Tiles that are refined at and below the base level.
    std::int64_t count() const;

private:
    static std::uint64_t pack(std::int64_t x, std::int64_t y) {
        return static_cast<std::uint64_t>(y) << 32 | static_cast<std::uint64_t>(x);
    }
    void insert(TileId id);

    Lattice lattice_;
    int base_level_;
    std::vector<std::unordered_set<std::uint64_t>> refined_;  // by level - base level
};

}  // namespace scree
