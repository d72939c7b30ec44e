// Height tiles as the walk needs them: a tile is asked for once as itself and twice as a neighbour, close together in
// time.
#pragma once

#include <array>
#include <memory>

#include "common/store/tile_store.h"

namespace scree {

/// One thread. Holds at most kSlots decoded tiles (33^2 samples: 128 * 4.4 KB = 0.6 MB; 257^2: 34 MB).
class HeightCache {
public:
    HeightCache(TileReader& reader, const Dataset& dataset) : reader_(reader), dataset_(dataset) {}

    /// nullptr: no such row. Errors: ErrorCode::store damaged, ErrorCode::io.
    Result<std::shared_ptr<const HeightTile>> get(TileId id);

private:
    static constexpr std::size_t kSlots = 128;  // a window of 8 x 8 tiles at two levels
    struct Slot {
        TileId id;
        std::shared_ptr<const HeightTile> tile;
    };
    TileReader& reader_;
    const Dataset& dataset_;
    TileRow row_;
    std::array<Slot, kSlots> slots_;
};

}  // namespace scree
