#include "common/query/ground.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/store/height_codec.h"

namespace scree {
namespace {

constexpr std::size_t kRecentTiles = 32;  // a path from the root and the tiles round a point

Error named(TileId id, const Error& error) {
    return {error.code, fmt::format("height tile {}/{}/{}: {}", id.level, id.x, id.y, error.message)};
}

HeightTileView view_of(const HeightTile& tile) { return {&tile.header, tile.samples, tile.presence}; }

}  // namespace

Ground::Ground(const TileStore& store, std::unique_ptr<TileReader> reader)
    : store_(store), reader_(std::move(reader)), leaf_level_(store.dataset().lattice.deepest_level) {}

Result<std::unique_ptr<Ground>> Ground::open(const TileStore& store) {
    auto reader = store.open_reader();
    if (!reader) return reader.error();
    return std::unique_ptr<Ground>(new Ground(store, std::move(*reader)));
}

Result<const HeightTile*> Ground::tile(TileId id) {
    const auto hit = std::find_if(recent_.begin(), recent_.end(), [&](const Cached& c) { return c.id == id; });
    if (hit != recent_.end()) {
        recent_.splice(recent_.begin(), recent_, hit);
    } else {
        Cached cached{id, std::nullopt};
        TileRow row;
        auto found = reader_->read(TileKind::height, id, row);
        if (!found) return named(id, found.error());
        if (*found) {
            auto tile = decode_height_tile(row.payload, dataset().lattice.tile_cells_log2, row.codec);
            if (!tile) return named(id, tile.error());
            cached.tile = std::move(*tile);
        }
        recent_.push_front(std::move(cached));
        if (recent_.size() > kRecentTiles) recent_.pop_back();
    }
    const Cached& first = recent_.front();
    return static_cast<const HeightTile*>(first.tile ? &*first.tile : nullptr);
}

Result<std::optional<HeightTileView>> Ground::view(TileId id) {
    auto found = tile(id);
    if (!found) return found.error();
    if (*found != nullptr) return std::optional<HeightTileView>{view_of(**found)};
    if (id.level > 0) return named(id, {ErrorCode::store, "is missing from the store"});
    return std::optional<HeightTileView>{};
}

Result<std::optional<HeightAt>> Ground::height(double x_m, double y_m) {
    return best_height(dataset().lattice, x_m, y_m, [this](std::int64_t ci, std::int64_t cj, double i, double j) {
        return leaf_height(ci, cj, i, j);
    });
}

Result<std::optional<HeightAt>> Ground::leaf_height(std::int64_t ci, std::int64_t cj, double i, double j) {
    const Lattice& l = dataset().lattice;
    const TileId deepest{l.deepest_level, ci >> l.tile_cells_log2, cj >> l.tile_cells_log2};
    const TileId id = ancestor_at(deepest, leaf_level_);
    auto found = tile(id);
    if (!found) return found.error();
    if (*found != nullptr && (*found)->header.is_leaf())
        return height_in_cell(dataset(), id, view_of(**found), ci, cj, i, j);
    // From the root it shows how deep the leaf lies, and whether a tile is absent or lost.
    auto height = height_over_cell(*this, ci, cj, i, j);
    if (height && *height) leaf_level_ = (*height)->level;
    return height;
}

}  // namespace scree
