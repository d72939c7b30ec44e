#include "runtime/view/ground.h"

#include <algorithm>
#include <cmath>

#include "common/mesh/drawn_surface.h"

namespace scree {
namespace {
constexpr std::size_t kRecentTiles = 32;
}

Ground::Ground(const TileStore& store, std::unique_ptr<TileReader> reader)
    : store_(store), reader_(std::move(reader)) {}

Result<std::unique_ptr<Ground>> Ground::open(const TileStore& store) {
    auto reader = store.open_reader();
    if (!reader) return reader.error();
    return std::unique_ptr<Ground>(new Ground(store, std::move(*reader)));
}

Result<const HeightTile*> Ground::tile(TileId id) {
    const auto hit = std::find_if(recent_.begin(), recent_.end(), [&](const Cached& c) { return c.id == id; });
    if (hit != recent_.end()) {
        recent_.splice(recent_.begin(), recent_, hit);
        return static_cast<const HeightTile*>(hit->exists ? &hit->tile : nullptr);
    }
    Cached cached{id, false, {}};
    TileRow row;
    auto found = reader_->read(TileKind::height, id, row);
    if (!found) return found.error();
    if (*found) {
        auto tile = read_height_tile(*reader_, store_.dataset(), id);
        if (!tile) return tile.error();
        cached.exists = true;
        cached.tile = std::move(*tile);
    }
    recent_.push_front(std::move(cached));
    if (recent_.size() > kRecentTiles) recent_.pop_back();
    return static_cast<const HeightTile*>(recent_.front().exists ? &recent_.front().tile : nullptr);
}

Result<std::optional<double>> Ground::height(double x_m, double y_m) {
    const Dataset& d = store_.dataset();
    const Lattice& l = d.lattice;
    const double i = l.i_of(x_m), j = l.j_of(y_m);
    if (!(i >= 0 && j >= 0 && i <= static_cast<double>(l.cells_x) && j <= static_cast<double>(l.cells_y)))
        return std::optional<double>{};
    const std::int64_t m = l.tile_cells();
    const auto ci = std::min(static_cast<std::int64_t>(i), l.cells_x - 1),
               cj = std::min(static_cast<std::int64_t>(j), l.cells_y - 1);
    auto found = tile({l.deepest_level, ci / m, cj / m});
    if (!found) return found.error();
    if (*found == nullptr) return std::optional<double>{};
    const HeightTile& t = **found;
    if (!t.presence.empty() && t.presence[static_cast<std::size_t>((cj % m) * m + ci % m)] == 0)
        return std::optional<double>{};
    const double n = drawn_height_at(t.samples, l.tile_cells_log2, {0, 0}, i - static_cast<double>(ci / m * m),
                                     j - static_cast<double>(cj / m * m));
    return std::optional<double>{d.height_m(n)};
}

}  // namespace scree
