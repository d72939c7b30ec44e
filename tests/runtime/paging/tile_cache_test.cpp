#include "runtime/paging/tile_cache.h"

#include <gtest/gtest.h>

#include <map>
#include <set>

#include "tests/common/test_support.h"

namespace scree {
namespace {

using Claim = TileCache::Claim;
using State = TileCache::State;

// A quadtree under two roots.
Lattice small_lattice() {
    Lattice l;
    l.root_columns = 2;
    return l;
}

struct Cache : ResidentPages, TileCache {
    explicit Cache(std::int64_t slots) : TileCache(slots, small_lattice(), *this) {}
    std::int32_t load(TileId id, double need = 1) {
        const auto slot = reserve(id, need);
        EXPECT_TRUE(slot.has_value());
        complete(*slot, {}, 0);
        return *slot;
    }
    void use(TileId id) { touch(std::array{find(id)}); }
    void plan(TileId id) { touch_planned(std::array{find(id)}); }
    bool holds(TileId id) const { return find(id) >= 0; }
};

// Tiles with no tile between them and no common parent.
TileId tile(int k) { return {9, 2 * (k % 256), 2 * (k / 256)}; }

TEST(TileCache, GivesEachTileASlotOfItsOwnAndNoMoreThanThereAre) {
    Cache cache(5);
    std::set<std::int32_t> slots;
    for (int k = 0; k < 5; ++k) slots.insert(*cache.reserve(tile(k), 1));
    EXPECT_EQ(slots, (std::set<std::int32_t>{0, 1, 2, 3, 4}));
    EXPECT_EQ(cache.in_use(), 5);
    EXPECT_EQ(cache.loading(), 5);
    EXPECT_FALSE(cache.exhausted());
    EXPECT_EQ(cache.reserve(tile(5), 2), std::nullopt);  // all are loading
    EXPECT_TRUE(cache.exhausted());
    EXPECT_EQ(cache.find(tile(5)), kNotResident);
    EXPECT_EQ(cache.evictions(), 0);
}

TEST(TileCache, EvictsTheLeastRecentlyUsedFirst) {
    Cache cache(4);
    for (int k = 0; k < 4; ++k) cache.load(tile(k));
    cache.begin_frame();
    cache.use(tile(0));
    cache.use(tile(2));  // 1 and 3 are older now, 1 the oldest
    for (const int victim : {1, 3, 0}) {
        const std::int32_t slot = cache.find(tile(victim));
        ASSERT_GE(slot, 0);
        EXPECT_EQ(cache.reserve(tile(10 + victim), 1), slot);
        EXPECT_FALSE(cache.holds(tile(victim)));
    }
    EXPECT_EQ(cache.evictions(), 3);
    EXPECT_EQ(cache.in_use(), 4);
}

TEST(TileCache, OfAListTheLastIsEvictedFirst) {
    for (const bool planned : {false, true}) {
        Cache cache(3);
        std::vector<std::int32_t> slots;
        for (int k = 0; k < 3; ++k) slots.push_back(cache.load(tile(k)));
        const std::vector<std::int32_t> list{slots[1], slots[0], slots[2]};
        planned ? cache.touch_planned(list) : cache.touch(list);
        cache.begin_frame();
        for (const int victim : {2, 0, 1})
            EXPECT_EQ(cache.reserve(tile(20 + victim), 1), slots.at(std::size_t(victim)));
    }
}

TEST(TileCache, NeverEvictsWhatIsPinnedLoadingOrPlannedInThisFrame) {
    Cache cache(4);
    cache.pin(cache.load(tile(0)));
    cache.load(tile(1));
    cache.load(tile(2));
    cache.reserve(tile(3), 1);  // loading
    cache.begin_frame();
    cache.plan(tile(1));
    EXPECT_TRUE(cache.reserve(tile(4), 1).has_value());  // 2 goes
    EXPECT_FALSE(cache.holds(tile(2)));
    EXPECT_FALSE(cache.exhausted());
    EXPECT_EQ(cache.reserve(tile(5), 1), std::nullopt);
    EXPECT_TRUE(cache.exhausted());
    for (const int k : {0, 1, 3}) EXPECT_TRUE(cache.holds(tile(k)));
    cache.begin_frame();
    EXPECT_FALSE(cache.exhausted());
    EXPECT_TRUE(cache.reserve(tile(5), 1).has_value());  // no longer planned
    EXPECT_FALSE(cache.holds(tile(1)));
}

TEST(TileCache, NeverEvictsAParentBeforeItsChildrenHoweverOldItIs) {
    const TileId root{0, 0, 0}, inner{1, 1, 0}, leaf{2, 2, 1}, other{1, 0, 1};
    Cache cache(4);
    for (const TileId id : {root, inner, other, leaf}) cache.load(id);
    for (int k = 0; k < 3; ++k) cache.use(leaf);  // never its ancestors
    cache.begin_frame();
    for (const TileId victim : {other, leaf, inner, root}) {
        ASSERT_TRUE(cache.holds(victim));
        const auto slot = cache.reserve(tile(victim.level * 10 + int(victim.x)), 1);
        EXPECT_TRUE(slot.has_value());
        EXPECT_FALSE(cache.holds(victim)) << victim.level << "/" << victim.x;
    }
}

TEST(TileCache, ALoadingChildKeepsItsParent) {
    const TileId root{0, 0, 0}, child{1, 1, 1};
    Cache cache(2);
    cache.load(root);
    const auto slot = cache.reserve(child, 1);
    cache.begin_frame();
    EXPECT_EQ(cache.reserve(tile(3), 1), std::nullopt);
    cache.cancel(*slot);
    EXPECT_TRUE(cache.reserve(tile(3), 1).has_value());
    EXPECT_TRUE(cache.reserve(tile(4), 1).has_value());
    EXPECT_FALSE(cache.holds(root));
}

TEST(TileCache, ATileIsNotEvictedForItsOwnChild) {
    const TileId root{0, 0, 0}, child{1, 0, 0};
    Cache cache(1);
    cache.load(root);
    cache.begin_frame();
    EXPECT_EQ(cache.reserve(child, 1), std::nullopt);
    EXPECT_FALSE(cache.exhausted()) << "another could have had the slot";
    EXPECT_TRUE(cache.holds(root));
    EXPECT_TRUE(cache.reserve(tile(1), 1).has_value());
}

TEST(TileCache, LinksParentsAndChildrenInWhateverOrderTheyComeAndGo) {
    const TileId root{0, 1, 0}, a = child_of(root, 2), b = child_of(a, 1);
    Cache cache(4);
    HeightTileHeader header;
    header.child_mask = 9;
    header.own.min_n = -5;
    const std::int32_t slot_b = cache.load(b);
    EXPECT_EQ(cache.roots, (std::vector<std::int32_t>{kNotResident, kNotResident}));
    const std::int32_t slot_root = cache.load(root);
    EXPECT_EQ(cache.roots, (std::vector<std::int32_t>{kNotResident, slot_root}));
    const std::int32_t slot_a = *cache.reserve(a, 1);
    EXPECT_EQ(cache.children[std::size_t(slot_root)][2], kNotResident) << "not before it has arrived";
    cache.complete(slot_a, header, 7.5);
    EXPECT_EQ(cache.headers[std::size_t(slot_a)], header);
    EXPECT_EQ(cache.arrived_s[std::size_t(slot_a)], 7.5);
    EXPECT_EQ(cache.children[std::size_t(slot_root)], (std::array{-1, -1, slot_a, -1}));
    EXPECT_EQ(cache.children[std::size_t(slot_a)], (std::array{-1, slot_b, -1, -1}));
    cache.begin_frame();
    cache.load(tile(0));
    const std::int32_t instead = cache.load(tile(1));  // the only leaf goes
    EXPECT_EQ(instead, slot_b);
    EXPECT_EQ(cache.children[std::size_t(slot_a)], (std::array{-1, -1, -1, -1}));
}

TEST(TileCache, AnUnreadableTileIsKnownToItsParentAlsoWhenTheParentComesLater) {
    const TileId root{0, 0, 0}, child = child_of(root, 3);
    Cache cache(3);
    const std::int32_t parent = cache.load(root);
    cache.fail(*cache.reserve(child, 1));
    EXPECT_EQ(cache.find(child), kUnavailable);
    EXPECT_EQ(cache.children[std::size_t(parent)], (std::array{-1, -1, -1, kUnavailable}));
    EXPECT_EQ(cache.in_use(), 1);
    cache.begin_frame();
    for (int k = 0; k < 3; ++k) cache.load(tile(k));
    EXPECT_FALSE(cache.holds(root));
    cache.begin_frame();
    const std::int32_t again = cache.load(root, 5);
    EXPECT_EQ(cache.children[std::size_t(again)], (std::array{-1, -1, -1, kUnavailable}));
}

TEST(TileCache, FailureAndCancellationFreeTheSlot) {
    Cache cache(1);
    const std::int32_t slot = *cache.reserve(tile(0), 1);
    cache.cancel(slot);
    EXPECT_EQ(cache.find(tile(0)), kNotResident);
    EXPECT_EQ(cache.in_use(), 0);
    EXPECT_EQ(cache.reserve(tile(1), 1), slot);
    cache.fail(slot);
    EXPECT_EQ(cache.find(tile(1)), kUnavailable);
    EXPECT_EQ(cache.in_use(), 0);
    EXPECT_EQ(cache.reserve(tile(2), 1), slot);
    EXPECT_EQ(cache.evictions(), 0);
}

TEST(TileCache, APrefetchTakesAFreeSlotOrOneThatWasNotTouchedLately) {
    Cache cache(2);
    cache.load(tile(0));
    EXPECT_TRUE(cache.reserve(tile(1), 1, Claim::idle).has_value());
    for (std::uint64_t k = 0; k <= TileCache::kIdleFrames; ++k) {
        EXPECT_EQ(cache.reserve(tile(2), 1, Claim::idle), std::nullopt) << k;
        cache.begin_frame();
    }
    EXPECT_TRUE(cache.reserve(tile(2), 1, Claim::idle).has_value());
    EXPECT_FALSE(cache.holds(tile(0)));
}

TEST(TileCache, PrefetchedTilesThatNobodyUsedDoNotTakeTurns) {
    Cache cache(1);
    const std::int32_t slot = *cache.reserve(tile(0), 2, Claim::idle);
    cache.complete(slot, {}, 0);
    for (int k = 0; k < 100; ++k) cache.begin_frame();
    EXPECT_EQ(cache.reserve(tile(1), 2, Claim::idle), std::nullopt);
    EXPECT_TRUE(cache.reserve(tile(1), 3, Claim::idle).has_value()) << "it is needed more";
    cache.complete(slot, {}, 0);
    cache.use(tile(1));
    for (int k = 0; k < 100; ++k) cache.begin_frame();
    EXPECT_TRUE(cache.reserve(tile(2), 1, Claim::idle).has_value()) << "it had its use";
}

TEST(TileCache, WhatWasEvictedComesBackAtOnceOnlyIfItIsNeededMore) {
    for (const double need : {1.0, 10.0, 12.4, 12.6}) {
        Cache cache(1);
        cache.load(tile(0), need);
        cache.begin_frame();
        cache.load(tile(1), 10);
        cache.begin_frame();
        EXPECT_EQ(cache.reserve(tile(0), need).has_value(), need > 12.5) << need;
        EXPECT_FALSE(cache.exhausted());
        if (need > 12.5) continue;
        for (std::uint64_t k = 0; k < TileCache::kIdleFrames; ++k) cache.begin_frame();
        EXPECT_TRUE(cache.reserve(tile(0), need).has_value()) << "and later in any case";
    }
}

// Against a model that knows only the rules.
class Model {
public:
    struct Tile {
        State state = State::loading;
        std::int32_t slot = -1;
        std::uint64_t planned_in = 0, used = 0, used_in = 0;
        bool pinned = false, had_children = false;
    };
    std::map<TileId, Tile> tiles;
    std::set<TileId> unavailable;
    std::uint64_t frame = 1, clock = 0;

    bool has_children(TileId id) const {
        for (int q = 0; q < 4; ++q)
            if (tiles.contains(child_of(id, q))) return true;
        return false;
    }
    // `asked` is about to be loaded: its parent stays.
    bool evictable(TileId id, TileId asked) const {
        const Tile& t = tiles.at(id);
        return t.state == State::resident && !t.pinned && t.planned_in != frame && !has_children(id) &&
               !(asked.level > 0 && parent_of(asked) == id);
    }
    void note_parents() {
        for (auto& [id, t] : tiles) t.had_children = t.had_children || has_children(id);
    }
};

void expect_tables(const Cache& cache, const Model& model) {
    std::set<std::int32_t> slots;
    const auto entry = [&](TileId id) {
        const auto t = model.tiles.find(id);
        if (t != model.tiles.end() && t->second.state == State::resident) return t->second.slot;
        return model.unavailable.contains(id) ? kUnavailable : kNotResident;
    };
    for (const auto& [id, t] : model.tiles) {
        ASSERT_EQ(cache.find(id), t.slot);
        ASSERT_EQ(cache.state(t.slot), t.state);
        ASSERT_TRUE(slots.insert(t.slot).second);
        for (int q = 0; t.state == State::resident && q < 4; ++q)
            ASSERT_EQ(cache.children[std::size_t(t.slot)][std::size_t(q)], entry(child_of(id, q)));
    }
    for (const TileId id : model.unavailable) ASSERT_EQ(cache.find(id), kUnavailable);
    ASSERT_EQ(cache.in_use(), static_cast<std::int64_t>(slots.size()));
    for (int x = 0; x < 2; ++x) ASSERT_EQ(cache.roots[std::size_t(x)], entry({0, x, 0}));
}

TEST(TileCache, BehavesLikeItsRulesUnderRandomUse) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    std::int64_t evictions = 0, refusals = 0;
    for (int round = 0; round < 60; ++round) {
        const int capacity = test::uniform(random, 1, 24);
        Cache cache(capacity);
        Model model;
        const auto any_tile = [&] {
            const int level = test::uniform(random, 0, 3);
            return TileId{level, test::uniform(random, 0, (2 << level) - 1),
                          test::uniform(random, 0, (1 << level) - 1)};
        };
        for (int step = 0; step < 1500; ++step) {
            const TileId id = any_tile();
            const auto known = model.tiles.find(id);
            const bool resident = known != model.tiles.end() && known->second.state == State::resident;
            const bool loading = known != model.tiles.end() && !resident;
            switch (test::uniform(random, 0, 8)) {
                case 0:
                    cache.begin_frame();
                    ++model.frame;
                    break;
                case 1:
                case 2:
                    if (!resident) break;
                    if (test::uniform(random, 0, 1) == 0) {
                        cache.plan(id);
                        known->second.planned_in = model.frame;
                    } else {
                        cache.use(id);
                    }
                    known->second.used = ++model.clock;
                    break;
                case 3:
                    if (!loading) break;
                    cache.cancel(known->second.slot);
                    model.tiles.erase(known);
                    break;
                case 4:
                    if (!loading || test::uniform(random, 0, 99) != 0) break;
                    cache.fail(known->second.slot);
                    model.tiles.erase(known);
                    model.unavailable.insert(id);
                    break;
                case 5:
                case 6:
                    if (!loading) break;
                    cache.complete(known->second.slot, {}, 0);
                    known->second.state = State::resident;
                    known->second.used = ++model.clock;
                    if (test::uniform(random, 0, 400) != 0) break;
                    cache.pin(known->second.slot);
                    known->second.pinned = true;
                    break;
                default: {
                    if (known != model.tiles.end() || model.unavailable.contains(id)) break;
                    // Need grows for ever: nothing is kept out for having been evicted.
                    const auto slot = cache.reserve(id, std::exp2(step / 3.0));
                    if (static_cast<int>(model.tiles.size()) == capacity) {
                        TileId victim{-1, 0, 0};
                        bool any = false;
                        std::uint64_t oldest_leaf = ~std::uint64_t{0};
                        for (const auto& [other, t] : model.tiles) {
                            any = any || model.evictable(other, id);
                            if (model.evictable(other, id) && !t.had_children)
                                oldest_leaf = std::min(oldest_leaf, t.used);
                            if (slot && t.slot == *slot) victim = other;
                        }
                        ASSERT_EQ(slot.has_value(), any);
                        refusals += any ? 0 : 1;
                        if (!slot) break;
                        ASSERT_GE(victim.level, 0);
                        ASSERT_TRUE(model.evictable(victim, id));
                        // No evictable tile that never was a parent is older; a parent may pass for as young as its
                        // children were.
                        ASSERT_LE(model.tiles.at(victim).used, oldest_leaf);
                        model.tiles.erase(victim);
                        ++evictions;
                    }
                    ASSERT_TRUE(slot.has_value());
                    model.tiles[id] = {.slot = *slot, .used = ++model.clock};
                }
            }
            model.note_parents();
            expect_tables(cache, model);
            if (HasFatalFailure()) return;
        }
        ASSERT_EQ(cache.resident() + cache.loading(), cache.in_use());
    }
    EXPECT_GT(evictions, 1000);
    EXPECT_GT(refusals, 100);
}

}  // namespace
}  // namespace scree
