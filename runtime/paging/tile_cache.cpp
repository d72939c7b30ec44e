#include "runtime/paging/tile_cache.h"

#include <cassert>

namespace scree {

TileCache::TileCache(std::int64_t capacity) : capacity_(capacity) {
    free_.reserve(static_cast<std::size_t>(capacity));
    for (std::int64_t slot = capacity - 1; slot >= 0; --slot) free_.push_back(static_cast<std::int32_t>(slot));
    entries_.reserve(static_cast<std::size_t>(capacity));
}

const TileCache::Entry* TileCache::find(TileId id) const {
    const auto it = entries_.find(id);
    return it == entries_.end() ? nullptr : &it->second;
}

void TileCache::touch_planned(std::span<const TileId> ids, std::uint64_t frame) {
    for (auto id = ids.rbegin(); id != ids.rend(); ++id) {
        const auto it = entries_.find(*id);
        if (it == entries_.end()) continue;
        it->second.planned_in = frame;
        if (it->second.state == State::resident) recency_.splice(recency_.begin(), recency_, it->second.position);
    }
}

void TileCache::touch(std::span<const TileId> ids) {
    for (auto id = ids.rbegin(); id != ids.rend(); ++id) {
        const auto it = entries_.find(*id);
        if (it != entries_.end() && it->second.state == State::resident)
            recency_.splice(recency_.begin(), recency_, it->second.position);
    }
}

std::optional<std::int32_t> TileCache::reserve(TileId id, std::uint64_t frame) {
    assert(!entries_.contains(id));
    std::int32_t slot = -1;
    if (!free_.empty()) {
        slot = free_.back();
        free_.pop_back();
        ++in_use_;
    } else {
        for (auto it = recency_.rbegin(); it != recency_.rend(); ++it) {
            const auto found = entries_.find(*it);
            if (found->second.pinned || found->second.planned_in >= frame) continue;
            slot = found->second.slot;
            recency_.erase(found->second.position);
            entries_.erase(found);
            ++evictions_;
            break;
        }
    }
    if (slot < 0) return std::nullopt;
    Entry entry;
    entry.slot = slot;
    entry.planned_in = frame;
    entries_.emplace(id, entry);
    return slot;
}

void TileCache::complete(TileId id, const HeightTileHeader* header) {
    Entry& entry = entries_.at(id);
    assert(entry.state == State::loading);
    entry.state = State::resident;
    if (header != nullptr) entry.header = *header;
    recency_.push_front(id);
    entry.position = recency_.begin();
}

void TileCache::fail(TileId id) {
    Entry& entry = entries_.at(id);
    assert(entry.state == State::loading);
    free_.push_back(entry.slot);
    --in_use_;
    entry.slot = -1;
    entry.state = State::unavailable;
}

void TileCache::cancel(TileId id) {
    const auto it = entries_.find(id);
    assert(it != entries_.end() && it->second.state == State::loading);
    free_.push_back(it->second.slot);
    --in_use_;
    entries_.erase(it);
}

void TileCache::pin(TileId id) { entries_.at(id).pinned = true; }

}  // namespace scree
