#include "runtime/paging/tile_cache.h"

#include <algorithm>
#include <bit>
#include <cassert>

namespace scree {
namespace {

constexpr std::array<std::int32_t, 4> kNoChildren{kNotResident, kNotResident, kNotResident, kNotResident};
// What 30 frames evict in a fast flight, about.
constexpr std::size_t kEvictedRemembered = 1024;
// Entries fetched before they are touched: one after the other they lie anywhere.
constexpr std::ptrdiff_t kAhead = 8;

std::size_t quadrant(TileId id) { return static_cast<std::size_t>(quadrant_of(id)); }

}  // namespace

TileCache::TileCache(std::int64_t capacity, const Lattice& lattice, ResidentPages& pages, Slots slots_owned)
    : pages_(pages), root_columns_(lattice.root_columns) {
    const auto slots = static_cast<std::size_t>(capacity);
    entries_.resize(slots);
    free_.reserve(slots);
    if (slots_owned == Slots::all)
        for (std::int64_t slot = capacity - 1; slot >= 0; --slot) receive(static_cast<std::int32_t>(slot));
    // Never more than half full, so that runs of the open addressing stay short.
    known_log2_ = static_cast<int>(std::bit_width(2 * slots + 1));
    known_.assign(std::size_t{1} << known_log2_, -1);
    evicted_.resize(std::min(std::bit_ceil(slots + 1), kEvictedRemembered));
    pages_.headers.resize(slots);
    pages_.children.assign(slots, kNoChildren);
    pages_.arrived_s.resize(slots);
    pages_.roots.assign(static_cast<std::size_t>(lattice.root_rows * lattice.root_columns), kNotResident);
}

std::int64_t TileCache::bookkeeping_bytes() {
    // `known_` has 2 to 4 places a slot: 4 are counted.
    return static_cast<std::int64_t>(sizeof(Entry) + 5 * sizeof(std::int32_t) + sizeof(HeightTileHeader) +
                                     sizeof kNoChildren + sizeof(double));
}

std::size_t TileCache::home(TileId id) const { return (TileIdHash{}(id)*0x9E3779B97F4A7C15u) >> (64 - known_log2_); }

std::int32_t TileCache::find_known(TileId id) const {
    const std::size_t mask = known_.size() - 1;
    for (std::size_t k = home(id); known_[k] >= 0; k = (k + 1) & mask)
        if (entry(known_[k]).id == id) return known_[k];
    return kNotResident;
}

void TileCache::insert_known(std::int32_t slot) {
    const std::size_t mask = known_.size() - 1;
    std::size_t k = home(entry(slot).id);
    while (known_[k] >= 0) k = (k + 1) & mask;
    known_[k] = slot;
}

// What follows in the run moves up, so that no mark of the erased place is needed (Knuth, 6.4, algorithm R).
void TileCache::erase_known(std::int32_t slot) {
    const std::size_t mask = known_.size() - 1;
    std::size_t hole = home(entry(slot).id);
    while (known_[hole] != slot) hole = (hole + 1) & mask;
    for (std::size_t k = (hole + 1) & mask; known_[k] >= 0; k = (k + 1) & mask) {
        const std::size_t from_home = (k - home(entry(known_[k]).id)) & mask;
        if (from_home < ((k - hole) & mask)) continue;
        known_[hole] = known_[k];
        hole = k;
    }
    known_[hole] = -1;
}

std::int32_t TileCache::find(TileId id) const {
    const std::int32_t slot = find_known(id);
    if (slot < 0 && !unavailable_.empty() && unavailable_.contains(id)) return kUnavailable;
    return slot;
}

void TileCache::unlink(std::int32_t slot) {
    Entry& e = entry(slot);
    (e.older >= 0 ? entry(e.older).newer : oldest_) = e.newer;
    (e.newer >= 0 ? entry(e.newer).older : newest_) = e.older;
    e.older = e.newer = -1;
}

void TileCache::link_newest(std::int32_t slot) {
    Entry& e = entry(slot);
    e.used_at = ++clock_;
    e.older = newest_;
    e.newer = -1;
    (newest_ >= 0 ? entry(newest_).newer : oldest_) = slot;
    newest_ = slot;
}

void TileCache::link_in_front_of(std::int32_t slot, std::int32_t other) {
    Entry &e = entry(slot), &behind = entry(other);
    e.used_at = behind.used_at;
    e.older = other;
    e.newer = behind.newer;
    (behind.newer >= 0 ? entry(behind.newer).older : newest_) = slot;
    behind.newer = slot;
}

void TileCache::mark_used(std::int32_t slot) {
    Entry& e = entry(slot);
    e.used_in = frame_;
    e.prefetch = false;
    if (e.pinned) return;
    unlink(slot);
    link_newest(slot);
}

void TileCache::touch_planned(std::span<const std::int32_t> slots) {
    for (auto slot = slots.rbegin(); slot != slots.rend(); ++slot) {
        if (slots.rend() - slot > kAhead) __builtin_prefetch(entries_.data() + slot[kAhead]);
        assert(valid_resident(*slot));
        if (!valid_resident(*slot)) continue;
        entry(*slot).planned_in = frame_;
        mark_used(*slot);
    }
}

void TileCache::touch(std::span<const std::int32_t> slots) {
    for (auto slot = slots.rbegin(); slot != slots.rend(); ++slot) {
        if (slots.rend() - slot > kAhead) __builtin_prefetch(entries_.data() + slot[kAhead]);
        assert(valid_resident(*slot));
        if (valid_resident(*slot)) mark_used(*slot);
    }
}

std::int32_t TileCache::newest_child(std::int32_t slot) const {
    std::int32_t newest = -1;
    for (const std::int32_t child : pages_.children[static_cast<std::size_t>(slot)])
        if (child >= 0 && !entry(child).pinned && (newest < 0 || entry(child).used_at > entry(newest).used_at))
            newest = child;
    return newest;
}

// From the oldest on. A parent older than its children was overlooked when they were used: it takes its place in front
// of them, once, and is not met again before they are. So what is passed over is what waits for a load, its ancestors,
// and (only when there is nothing to be had) what is planned.
std::int32_t TileCache::oldest_evictable() {
    for (std::int32_t slot = oldest_; slot >= 0;) {
        const Entry& e = entry(slot);
        if (evictable(e)) return slot;
        const std::int32_t next = e.newer;
        if (const std::int32_t child = e.live_children == 0 ? -1 : newest_child(slot);
            child >= 0 && entry(child).used_at > e.used_at) {
            unlink(slot);
            link_in_front_of(slot, child);
        }
        slot = next;
    }
    return -1;
}

bool TileCache::may_take(std::int32_t victim, TileId id, double need, Claim claim) const {
    const Entry& v = entry(victim);
    const bool idle = v.used_in + kIdleFrames < frame_;
    // Of two prefetched tiles that nobody has used, the more needed stays: else they would take turns for ever.
    if (claim == Claim::idle) return idle && !(v.prefetch && v.need >= need);
    const Evicted& before = evicted(id);
    const bool wanted_back = before.frame != 0 && before.id == id && before.frame + kIdleFrames >= frame_;
    return idle || !wanted_back || need > kWantedBack * before.for_need;
}

std::int32_t& TileCache::link_to(const Entry& e) {
    if (e.id.level == 0) return pages_.roots[static_cast<std::size_t>(e.id.y * root_columns_ + e.id.x)];
    return pages_.children[static_cast<std::size_t>(e.parent)][quadrant(e.id)];
}

void TileCache::leave_parent(std::int32_t slot, std::int32_t link) {
    Entry& e = entry(slot);
    if (e.id.level == 0 || (e.parent >= 0 && entry(e.parent).state == State::resident)) link_to(e) = link;
    if (e.parent >= 0) --entry(e.parent).live_children;
    e.parent = -1;
}

// Takes a tile's name and slot away; its children, if any came before it, are on their own again.
void TileCache::forget(std::int32_t slot) {
    Entry& e = entry(slot);
    for (int q = 0; e.live_children > 0 && q < 4; ++q)
        if (const std::int32_t child = find_known(child_of(e.id, q)); child >= 0 && entry(child).parent == slot) {
            entry(child).parent = -1;
            --e.live_children;
        }
    erase_known(slot);
    --(e.state == State::resident ? resident_ : loading_);
    e = Entry{};
    free_.push_back(slot);
    assert(adds_up());
}

void TileCache::evict(std::int32_t slot, double for_need) {
    const Entry& e = entry(slot);
    assert(evictable(e));
    evicted(e.id) = {e.id, frame_, for_need};
    unlink(slot);
    leave_parent(slot, kNotResident);
    forget(slot);
    ++evictions_;
}

std::optional<std::int32_t> TileCache::give_away() {
    if (free_.empty()) {
        const std::int32_t victim = oldest_evictable();
        if (victim < 0) return std::nullopt;
        evict(victim, 0);
    }
    const std::int32_t slot = free_.back();
    free_.pop_back();
    --owned_;
    return slot;
}

void TileCache::receive(std::int32_t slot) {
    assert(state(slot) == State::free);
    free_.push_back(slot);
    ++owned_;
}

void TileCache::hand_over(TileCache& heir) {
    for (std::int32_t slot = 0; slot < capacity(); ++slot)
        if (entry(slot).state != State::free) heir.receive(slot);
    for (const std::int32_t slot : free_) heir.receive(slot);
    forget_all();
}

void TileCache::forget_all() {
    // Roots were never paged in.
    evictions_ += resident_ - std::count_if(entries_.begin(), entries_.end(), [](const Entry& e) { return e.pinned; });
    owned_ = resident_ = loading_ = 0;
    oldest_ = newest_ = -1;
    exhausted_in_ = 0;
    free_.clear();
    unavailable_.clear();
    std::fill(entries_.begin(), entries_.end(), Entry{});
    std::fill(known_.begin(), known_.end(), -1);
    std::fill(evicted_.begin(), evicted_.end(), Evicted{});
    std::fill(pages_.children.begin(), pages_.children.end(), kNoChildren);
    std::fill(pages_.roots.begin(), pages_.roots.end(), kNotResident);
}

std::optional<std::int32_t> TileCache::reserve(TileId id, double need, Claim claim) {
    assert(find(id) == kNotResident);
    const std::int32_t parent = id.level > 0 ? find_known(parent_of(id)) : kNotResident;
    if (parent >= 0) ++entry(parent).live_children;  // from here on it cannot be evicted for its own child
    if (free_.empty()) {
        const std::int32_t victim = oldest_evictable();
        if (victim < 0 || !may_take(victim, id, need, claim)) {
            if (parent >= 0) --entry(parent).live_children;
            if (victim < 0 && (parent < 0 || !evictable(entry(parent)))) exhausted_in_ = frame_;
            return std::nullopt;
        }
        evict(victim, need);
    }
    const std::int32_t slot = free_.back();
    free_.pop_back();
    ++loading_;
    Entry& e = entry(slot);
    e.id = id;
    e.parent = parent;
    e.state = State::loading;
    e.need = need;
    e.wished_in = frame_;
    e.prefetch = claim == Claim::idle;
    insert_known(slot);
    for (int q = 0; q < 4; ++q)
        if (const std::int32_t child = find_known(child_of(id, q)); child >= 0) {
            entry(child).parent = slot;
            ++e.live_children;
        }
    assert(adds_up());
    return slot;
}

void TileCache::wish(std::int32_t slot, double need) {
    assert(state(slot) == State::loading);
    entry(slot).wished_in = frame_;
    entry(slot).need = need;
}

void TileCache::complete(std::int32_t slot, const HeightTileHeader& header, double arrived_s) {
    Entry& e = entry(slot);
    assert(e.state == State::loading);
    e.state = State::resident;
    e.used_in = frame_;
    --loading_;
    ++resident_;
    link_newest(slot);
    const auto at = static_cast<std::size_t>(slot);
    pages_.headers[at] = header;
    pages_.arrived_s[at] = arrived_s;
    for (int q = 0; q < 4; ++q) {
        const std::int32_t child = find(child_of(e.id, q));
        const bool there = child == kUnavailable || (child >= 0 && entry(child).state == State::resident);
        pages_.children[at][static_cast<std::size_t>(q)] = there ? child : kNotResident;
    }
    if (e.id.level == 0 || (e.parent >= 0 && entry(e.parent).state == State::resident)) link_to(e) = slot;
    assert(adds_up());
}

void TileCache::fail(std::int32_t slot) {
    assert(state(slot) == State::loading);
    unavailable_.insert(id(slot));
    leave_parent(slot, kUnavailable);
    forget(slot);
}

void TileCache::cancel(std::int32_t slot) {
    assert(state(slot) == State::loading);
    leave_parent(slot, kNotResident);
    forget(slot);
}

void TileCache::cancel_all() {
    for (std::int32_t slot = 0; loading_ > 0 && slot < capacity(); ++slot)
        if (state(slot) == State::loading) cancel(slot);
}

void TileCache::pin(std::int32_t slot) {
    Entry& e = entry(slot);
    assert(e.state == State::resident);
    if (!e.pinned) unlink(slot);
    e.pinned = true;
}

}  // namespace scree
