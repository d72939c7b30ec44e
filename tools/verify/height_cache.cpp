#include "tools/verify/height_cache.h"

#include "common/store/height_codec.h"

namespace scree {

Result<std::shared_ptr<const HeightTile>> HeightCache::get(TileId id) {
    Slot& slot = slots_[static_cast<std::size_t>((id.level & 1) << 6 | (id.y & 7) << 3 | (id.x & 7))];
    if (slot.tile && slot.id == id) return slot.tile;
    auto found = reader_.read(TileKind::height, id, row_);
    if (!found) return found.error();
    if (!*found) return std::shared_ptr<const HeightTile>{};
    auto tile = decode_height_tile(row_.payload, dataset_.lattice.tile_cells_log2, row_.codec);
    if (!tile) return tile.error();
    slot = {id, std::make_shared<const HeightTile>(std::move(*tile))};
    return slot.tile;
}

}  // namespace scree
