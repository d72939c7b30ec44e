// What the textures must know of the stored height tiles: which there are, and which leaves lack cells. Noted as tiles
// are made, or read back from a store that was cut off.
#pragma once

#include <cstdint>
#include <mutex>
#include <span>
#include <unordered_set>

#include "common/lattice.h"
#include "common/result.h"
#include "common/store/sqlite_store.h"
#include "tools/pyramid/tile_set.h"

namespace scree {

class HeightIndex {
public:
    /// `base`: the dense part. Deeper tiles are noted down to `deepest_noted_level`.
    HeightIndex(const Lattice& base, int deepest_noted_level);

    /// Any thread.
    void note(TileId id, std::span<const std::uint8_t> payload);
    /// Every height tile of a store, growing or finished. `lattice`: the keys'.
    Result<void> note_all(const SqliteStoreWriter& store, const Lattice& lattice);
    Result<void> note_all(const SqliteStore& store);

    // After the last note, from any thread:
    bool stored(TileId id) const;
    enum class Cells { none, all, some };
    /// Of a tile of the base's deepest level that is not refined.
    Cells cells(TileId base_tile) const;
    /// Finer tiles stand under this tile of the base's deepest level.
    bool refined(TileId base_tile) const { return refined_.contains(base_tile); }

private:
    int base_level_, deepest_noted_level_;
    std::mutex mutex_;
    TileSet stored_, some_, refined_;
    std::unordered_set<TileId, TileIdHash> deep_;
};

}  // namespace scree
