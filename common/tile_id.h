// TileId: the address of a tile in a pyramid. Level 0 is the coarsest (the roots). x counts tiles from the west, y from
// the north, over all roots of the level: the root of a tile is (x >> level, y >> level).
#pragma once

#include <compare>
#include <cstdint>

namespace scree {

struct TileId {
    int level = 0;
    std::int64_t x = 0;
    std::int64_t y = 0;

    friend bool operator==(const TileId&, const TileId&) = default;
    friend auto operator<=>(const TileId&, const TileId&) = default;
};

inline TileId parent_of(TileId id) { return {id.level - 1, id.x >> 1, id.y >> 1}; }

/// Child `quadrant` = (row << 1) | column: 0 north-west, 1 north-east, 2 south-west, 3 south-east.
inline TileId child_of(TileId id, int quadrant) {
    return {id.level + 1, 2 * id.x + (quadrant & 1), 2 * id.y + (quadrant >> 1)};
}

inline int quadrant_of(TileId id) { return static_cast<int>(((id.y & 1) << 1) | (id.x & 1)); }

/// The ancestor of `id` at `level` (<= id.level).
inline TileId ancestor_at(TileId id, int level) {
    const int up = id.level - level;
    return {level, id.x >> up, id.y >> up};
}

struct TileIdHash {
    std::size_t operator()(const TileId& id) const {
        std::uint64_t h = static_cast<std::uint64_t>(id.x) * 0x9E3779B97F4A7C15u;
        h ^= (static_cast<std::uint64_t>(id.y) + 0x7F4A7C15u) * 0xC2B2AE3D27D4EB4Fu;
        h ^= static_cast<std::uint64_t>(id.level) << 57;
        return static_cast<std::size_t>(h ^ (h >> 29));
    }
};

}  // namespace scree
