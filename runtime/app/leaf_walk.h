// The leaves of a store's height tree: the finest surface there is at each place.
#pragma once

#include "common/lattice.h"
#include "common/store/height_codec.h"
#include "common/store/tile_store.h"

namespace scree {

/// Calls visit(TileId, const HeightTile&) for the leaves at or under a tile; none where nothing is stored. Errors:
/// those of the store.
template <class Visit>
Result<void> for_each_leaf(TileReader& reader, const Lattice& lattice, TileId id, const Visit& visit) {
    TileRow row;
    auto found = reader.read(TileKind::height, id, row);
    if (!found) return found.error();
    if (!*found) return {};
    const auto tile = decode_height_tile(row.payload, lattice.tile_cells_log2, row.codec);
    if (!tile) return tile.error();
    if (tile->header.is_leaf() || id.level >= lattice.deepest_level) return visit(id, *tile), Result<void>{};
    for (int q = 0; q < 4; ++q)
        if ((tile->header.child_mask >> q & 1) != 0)
            if (auto ok = for_each_leaf(reader, lattice, child_of(id, q), visit); !ok) return ok;
    return {};
}

}  // namespace scree
