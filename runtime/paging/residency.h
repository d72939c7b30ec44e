// Residency: what selection may know of the tiles in memory, as plain tables by slot, so that a walk from the roots
// never looks anything up by name. Kept up to date by the pager (frame-loop thread only); tests make their own.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/height_tile.h"
#include "common/mesh/level_corrections.h"
#include "common/store/tile_store.h"

namespace scree {

inline constexpr std::int32_t kNotResident = -1;
/// A tile that turned out to be unreadable: it will never be resident, and is not asked for again.
inline constexpr std::int32_t kUnavailable = -2;

/// The resident tiles of one kind, by slot. A resident tile is reached through its parent: what has no resident parent
/// is as good as absent. Entries of free slots mean nothing.
struct ResidentPages {
    std::vector<HeightTileHeader> headers;              ///< of a texture tile only child_mask
    std::vector<std::array<std::int32_t, 4>> children;  ///< slot of each child quadrant, kNotResident or kUnavailable
    std::vector<double> arrived_s;                      ///< Residency::now_s when the tile became resident
    /// Of height tiles, in quanta, where the owner was asked to keep them (ErrorMetric::deboer); else empty.
    std::vector<LevelCorrections> corrections;
    std::vector<std::int32_t> roots;  ///< row-major over the roots; kNotResident: not stored
};

struct Residency {
    ResidentPages heights;
    ResidentPages textures;
    /// False: nothing asks for textures, and every texture slot is kNotResident (audits).
    bool has_textures = true;
    /// A clock that the owner advances, in seconds: a tile younger than the growth time is still growing out of its
    /// parent's shape. Tiles that were there from the start are older than any.
    double now_s = 0;

    const ResidentPages& of(TileKind kind) const { return kind == TileKind::height ? heights : textures; }
    ResidentPages& of(TileKind kind) { return kind == TileKind::height ? heights : textures; }
};

}  // namespace scree
