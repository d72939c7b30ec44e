// TileCache: which tiles of one kind hold which slots. Fixed capacity; a slot is reserved when its tile is requested,
// so nothing is loaded that could not be kept. Least recently used goes first; pinned, planned and loading tiles never
// go. Frame-loop thread only.
#pragma once

#include <cstdint>
#include <list>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

#include "common/height_tile.h"
#include "common/tile_id.h"

namespace scree {

class TileCache {
public:
    enum class State { loading, resident, unavailable };
    struct Entry {
        State state = State::loading;
        std::int32_t slot = -1;        ///< -1 when unavailable
        std::uint64_t planned_in = 0;  ///< frame in which it was last planned
        bool pinned = false;
        HeightTileHeader header;  ///< of a texture tile only the child bits
        std::list<TileId>::iterator position;
    };

    explicit TileCache(std::int64_t capacity);

    const Entry* find(TileId id) const;
    /// Marks tiles as planned in this frame (most recently used, not to be evicted in it). The first of the list
    /// becomes the most recent: give parents before children, and children go first.
    void touch_planned(std::span<const TileId> ids, std::uint64_t frame);
    /// Marks tiles as used, evictable; order as above.
    void touch(std::span<const TileId> ids);
    /// Reserves a slot for a tile that is not known yet: a free one, else the least recently used tile's whose
    /// planned_in is before `frame`. Nullopt when there is none.
    std::optional<std::int32_t> reserve(TileId id, std::uint64_t frame);
    void complete(TileId id, const HeightTileHeader* header);  ///< null: nothing is known of children
    void fail(TileId id);    ///< unreadable: the slot is freed, the tile stays known as unavailable
    void cancel(TileId id);  ///< a request not begun: forgotten, the slot is freed
    void pin(TileId id);

    std::int64_t capacity() const { return capacity_; }
    std::int64_t in_use() const { return in_use_; }
    std::int64_t evictions() const { return evictions_; }

private:
    std::int64_t capacity_;
    std::int64_t in_use_ = 0;
    std::int64_t evictions_ = 0;
    std::vector<std::int32_t> free_;
    std::unordered_map<TileId, Entry, TileIdHash> entries_;
    std::list<TileId> recency_;  ///< most recent first; resident tiles only
};

}  // namespace scree
