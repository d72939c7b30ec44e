#include "tools/pyramid/height_index.h"

#include "common/store/height_codec.h"

namespace scree {

HeightIndex::HeightIndex(const Lattice& base, int deepest_noted_level)
    : base_level_(base.deepest_level),
      deepest_noted_level_(deepest_noted_level),
      stored_(base, base.deepest_level),
      some_(base, base.deepest_level),
      refined_(base, base.deepest_level) {}

void HeightIndex::note(TileId id, std::span<const std::uint8_t> payload) {
    const std::lock_guard lock(mutex_);
    if (id.level > base_level_) {
        if (id.level <= deepest_noted_level_) deep_.insert(id);
        return;
    }
    stored_.insert(id);
    const auto marks = height_marks(payload);
    if (id.level < base_level_ || !marks) return;
    if (marks->child_mask != 0) refined_.insert(id);
    if (marks->some_absent) some_.insert(id);
}

Result<void> HeightIndex::note_all(const SqliteStoreWriter& store, const Lattice& lattice) {
    std::vector<std::int64_t> keys;
    if (auto ok = store.for_each_key(TileKind::height, [&](std::int64_t key) { keys.push_back(key); }); !ok) return ok;
    TileRow row;
    for (const std::int64_t key : keys) {
        const auto id = tile_from_key(lattice, key);
        if (!id) return Error{ErrorCode::store, "a height tile lies outside the lattice"};
        row.payload.clear();
        if (id->level == base_level_)
            if (auto found = store.read(TileKind::height, key, row); !found) return found.error();
        note(*id, row.payload);
    }
    return {};
}

Result<void> HeightIndex::note_all(const SqliteStore& store) {
    bool sound = true;
    auto ok = store.for_each(TileKind::height, [&](const SqliteStore::RowView& row) {
        const auto id = tile_from_key(store.dataset().lattice, row.key);
        sound = row.checksum_ok && id.has_value();
        if (sound) note(*id, row.payload);
        return sound;
    });
    if (ok && !sound) return Error{ErrorCode::store, store.path() + ": a height row is damaged; run scree verify"};
    return ok;
}

bool HeightIndex::stored(TileId id) const {
    return id.level > base_level_ ? deep_.count(id) != 0 : stored_.contains(id);
}

HeightIndex::Cells HeightIndex::cells(TileId base_tile) const {
    if (!stored_.contains(base_tile)) return Cells::none;
    return some_.contains(base_tile) ? Cells::some : Cells::all;
}

}  // namespace scree
