#include "common/store/tile_store.h"

#include <fmt/format.h>

#include "common/store/height_codec.h"
#include "common/store/texture_codec.h"

namespace scree {
namespace {

Error with_tile(const Error& error, const char* kind, TileId id) {
    return {error.code, fmt::format("{} tile {}/{}/{}: {}", kind, id.level, id.x, id.y, error.message)};
}

Result<void> read_row(TileReader& reader, TileKind kind, const char* name, TileId id, TileRow& row) {
    auto found = reader.read(kind, id, row);
    if (!found) return with_tile(found.error(), name, id);
    if (!*found) return with_tile({ErrorCode::store, "is missing from the store"}, name, id);
    return {};
}

}  // namespace

Result<HeightTile> read_height_tile(TileReader& reader, const Dataset& dataset, TileId id) {
    thread_local TileRow row;
    if (auto ok = read_row(reader, TileKind::height, "height", id, row); !ok) return ok.error();
    auto tile = decode_height_tile(row.payload, dataset.lattice.tile_cells_log2, row.codec);
    if (!tile) return with_tile(tile.error(), "height", id);
    return tile;
}

Result<TextureTile> read_texture_tile(TileReader& reader, const Dataset& dataset, TileId id) {
    thread_local TileRow row;
    if (auto ok = read_row(reader, TileKind::texture, "texture", id, row); !ok) return ok.error();
    auto tile = decode_texture_tile(row.payload, dataset.texture_size_log2, row.codec);
    if (!tile) return with_tile(tile.error(), "texture", id);
    return tile;
}

}  // namespace scree
