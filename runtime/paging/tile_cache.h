// TileCache: which tiles of one kind hold which slots, and the tables that selection reads of them. Fixed capacity; a
// slot is reserved when its tile is requested, so nothing is loaded that could not be kept. Least recently used goes
// first; pinned, planned and loading tiles and those with resident or loading children never go, so that what is
// resident is reached from the roots. Everything is by slot and O(1); a tile is looked up by its name only when it is
// asked for, arrives or goes. Nothing is allocated after construction but the names of unreadable tiles. Frame-loop
// thread only.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <unordered_set>
#include <vector>

#include "common/lattice.h"
#include "runtime/paging/residency.h"

namespace scree {

class TileCache {
public:
    enum class State : std::uint8_t { free, loading, resident };
    /// What a reservation may take besides a free slot.
    enum class Claim {
        any,  ///< the least recently used tile's slot
        idle  ///< the same, if it was not touched for kIdleFrames: a prefetch
    };
    static constexpr std::uint64_t kIdleFrames = 30;  // half a second at 60 Hz
    /// A tile that was evicted for another and is wanted back within kIdleFrames takes only an idle slot, unless it is
    /// needed this many times as much as that other was: two tiles of like need would evict each other for ever.
    static constexpr double kWantedBack = 1.25;

    /// Two caches may share slots: each slot belongs to one of them at any time.
    enum class Slots { all, none };
    /// `pages` is kept up to date and outlives the cache; `lattice` says where the roots are.
    TileCache(std::int64_t capacity, const Lattice& lattice, ResidentPages& pages, Slots slots = Slots::all);
    TileCache(const TileCache&) = delete;
    TileCache& operator=(const TileCache&) = delete;

    /// Slot of a tile that is resident or loading; kNotResident or kUnavailable.
    std::int32_t find(TileId id) const;
    State state(std::int32_t slot) const { return entry(slot).state; }
    TileId id(std::int32_t slot) const { return entry(slot).id; }

    void begin_frame() { ++frame_; }
    /// Slots of resident tiles that are not to be evicted in this frame, and are most recently used. The first of the
    /// list becomes the most recent: give parents before children, and children go first.
    void touch_planned(std::span<const std::int32_t> slots);
    /// Marks tiles as used, evictable; order as above.
    void touch(std::span<const std::int32_t> slots);

    /// Reserves a slot for a tile that is neither resident, loading nor unavailable. `need`: how much it is wanted.
    std::optional<std::int32_t> reserve(TileId id, double need, Claim claim = Claim::any);
    /// The last reservation failed because nothing may be evicted in this frame: so would any other.
    bool exhausted() const { return exhausted_in_ == frame_ && free_.empty(); }
    void complete(std::int32_t slot, const HeightTileHeader& header, double arrived_s);
    void fail(std::int32_t slot);    ///< unreadable: the slot is freed, the tile stays known as unavailable
    void cancel(std::int32_t slot);  ///< a request not begun: forgotten, the slot is freed
    void cancel_all();               ///< everything that is loading
    void pin(std::int32_t slot);     ///< resident for ever

    /// Of a loading tile: wanted in this frame, and how much.
    void wish(std::int32_t slot, double need);
    bool wished(std::int32_t slot) const { return entry(slot).wished_in == frame_; }
    double need(std::int32_t slot) const { return entry(slot).need; }
    bool prefetch(std::int32_t slot) const { return entry(slot).prefetch; }
    void promote(std::int32_t slot) { entry(slot).prefetch = false; }

    bool has_free_slot() const { return !free_.empty(); }
    /// Lets go of a slot: a free one, or the least recently used tile's. None: nothing may be evicted in this frame.
    std::optional<std::int32_t> give_away();
    void receive(std::int32_t slot);
    /// Forgets every tile, unavailable ones too; all slots go to `heir`.
    void hand_over(TileCache& heir);

    std::int64_t capacity() const { return static_cast<std::int64_t>(entries_.size()); }
    std::int64_t in_use() const { return owned_ - static_cast<std::int64_t>(free_.size()); }
    std::int64_t resident() const { return resident_; }
    std::int64_t loading() const { return loading_; }
    std::int64_t evictions() const { return evictions_; }
    /// Bytes that a slot takes here and in its tables.
    static std::int64_t bookkeeping_bytes();

private:
    struct Entry {
        TileId id;
        std::uint64_t used_at = 0;  ///< the list runs by it; never falls from older to newer
        std::uint64_t used_in = 0, planned_in = 0, wished_in = 0;  ///< frames
        double need = 0;
        std::int32_t older = -1, newer = -1;
        std::int32_t parent = -1;  ///< slot of the parent, resident or loading
        State state = State::free;
        std::uint8_t live_children = 0;  ///< resident or loading
        bool pinned = false;
        bool prefetch = false;  ///< asked for ahead of need, and not used yet
    };
    /// What went lately, and for what need; a later one may lie in an earlier one's place.
    struct Evicted {
        TileId id;
        std::uint64_t frame = 0;
        double for_need = 0;
    };

    Entry& entry(std::int32_t slot) { return entries_[static_cast<std::size_t>(slot)]; }
    const Entry& entry(std::int32_t slot) const { return entries_[static_cast<std::size_t>(slot)]; }
    bool valid_resident(std::int32_t slot) const {
        return slot >= 0 && slot < capacity() && entry(slot).state == State::resident;
    }
    void mark_used(std::int32_t slot);
    void link_newest(std::int32_t slot);
    void link_in_front_of(std::int32_t slot, std::int32_t other);
    void unlink(std::int32_t slot);
    /// Of those in the list.
    std::int32_t newest_child(std::int32_t slot) const;
    bool evictable(const Entry& e) const {
        return e.state == State::resident && e.live_children == 0 && !e.pinned && e.planned_in != frame_;
    }
    std::int32_t oldest_evictable();
    bool may_take(std::int32_t victim, TileId id, double need, Claim claim) const;
    void evict(std::int32_t slot, double for_need);
    void leave_parent(std::int32_t slot, std::int32_t link);
    void forget(std::int32_t slot);
    void forget_all();
    std::int32_t& link_to(const Entry& e);

    std::size_t home(TileId id) const;
    std::int32_t find_known(TileId id) const;
    void insert_known(std::int32_t slot);
    void erase_known(std::int32_t slot);
    Evicted& evicted(TileId id) { return evicted_[home(id) % evicted_.size()]; }
    const Evicted& evicted(TileId id) const { return evicted_[home(id) % evicted_.size()]; }
    bool adds_up() const { return in_use() == resident_ + loading_; }

    ResidentPages& pages_;
    std::int64_t root_columns_;
    std::vector<Entry> entries_;  ///< by slot
    std::vector<std::int32_t> free_;
    std::vector<std::int32_t> known_;  ///< open addressing: slots of resident and loading tiles by name, -1
    int known_log2_ = 0;
    std::unordered_set<TileId, TileIdHash> unavailable_;
    std::vector<Evicted> evicted_;
    std::int32_t oldest_ = -1, newest_ = -1;  ///< resident tiles that are not pinned
    std::uint64_t frame_ = 1, clock_ = 0, exhausted_in_ = 0;
    std::int64_t owned_ = 0;  ///< slots, of all
    std::int64_t resident_ = 0, loading_ = 0, evictions_ = 0;
};

}  // namespace scree
