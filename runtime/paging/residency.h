// Residency: what selection may know of the tiles in memory. Implemented by paging; read-only, no thread of its own.
#pragma once

#include <cstdint>

#include "common/height_tile.h"
#include "common/tile_id.h"

namespace scree {

struct ResidentHeight {
    const HeightTileHeader* header = nullptr;  ///< null: not resident
    std::int32_t slot = -1;
};

class Residency {
public:
    virtual ~Residency() = default;
    virtual ResidentHeight height(TileId id) const = 0;
    /// Slot of a resident texture tile, or -1.
    virtual std::int32_t texture(TileId id) const = 0;
    /// Child-exists bits of a resident texture tile; 0 when it is not resident.
    virtual std::uint8_t texture_children(TileId id) const = 0;
    /// A tile that turned out to be unreadable: it will never be resident, and is not asked for again.
    virtual bool unavailable_height(TileId id) const = 0;
    virtual bool unavailable_texture(TileId id) const = 0;
};

}  // namespace scree
