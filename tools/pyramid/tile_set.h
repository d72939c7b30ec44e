// TileSet: which tiles of a pyramid exist, one bit a tile, by level.
#pragma once

#include <cstdint>
#include <vector>

#include "common/lattice.h"

namespace scree {

class TileSet {
public:
    TileSet() = default;
    /// Levels 0..deepest over the padded lattice, cut to the tiles the data's extent touches.
    TileSet(const Lattice& lattice, int deepest) {
        for (int level = 0; level <= deepest; ++level) {
            const std::int64_t extent = lattice.tile_extent(level);
            Level l;
            l.columns = (lattice.cells_x + extent - 1) / extent;
            l.rows = (lattice.cells_y + extent - 1) / extent;
            l.bits.resize(static_cast<std::size_t>(l.columns * l.rows));
            levels_.push_back(std::move(l));
        }
    }

    bool contains(TileId id) const {
        if (id.level < 0 || id.level >= static_cast<int>(levels_.size())) return false;
        const Level& l = levels_[static_cast<std::size_t>(id.level)];
        return id.x >= 0 && id.y >= 0 && id.x < l.columns && id.y < l.rows &&
               l.bits[static_cast<std::size_t>(id.y * l.columns + id.x)];
    }
    void insert(TileId id) {
        Level& l = levels_[static_cast<std::size_t>(id.level)];
        l.bits[static_cast<std::size_t>(id.y * l.columns + id.x)] = true;
    }
    std::uint8_t child_mask(TileId id) const {
        std::uint8_t mask = 0;
        for (int q = 0; q < 4; ++q)
            if (contains(child_of(id, q))) mask = static_cast<std::uint8_t>(mask | (1 << q));
        return mask;
    }

private:
    struct Level {
        std::int64_t columns = 0, rows = 0;
        std::vector<bool> bits;
    };
    std::vector<Level> levels_;
};

}  // namespace scree
