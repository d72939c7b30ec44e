#include "runtime/paging/tile_cache.h"

#include <gtest/gtest.h>

#include <map>
#include <set>

#include "tests/common/test_support.h"

namespace scree {
namespace {

using State = TileCache::State;

TileId tile(int k) { return {9, k % 512, k / 512}; }

void load(TileCache& cache, int k, std::uint64_t frame) {
    ASSERT_TRUE(cache.reserve(tile(k), frame).has_value());
    cache.complete(tile(k), nullptr);
}

TEST(TileCache, GivesEachTileASlotOfItsOwnAndNoMoreThanThereAre) {
    TileCache cache(5);
    std::set<std::int32_t> slots;
    for (int k = 0; k < 5; ++k) slots.insert(*cache.reserve(tile(k), 1));
    EXPECT_EQ(slots, (std::set<std::int32_t>{0, 1, 2, 3, 4}));
    EXPECT_EQ(cache.in_use(), 5);
    EXPECT_EQ(cache.reserve(tile(5), 2), std::nullopt);  // all are loading
    EXPECT_EQ(cache.find(tile(5)), nullptr);
    EXPECT_EQ(cache.evictions(), 0);
}

TEST(TileCache, EvictsTheLeastRecentlyUsedFirst) {
    TileCache cache(4);
    for (int k = 0; k < 4; ++k) load(cache, k, 1);
    const TileId used[] = {tile(0), tile(2)};
    cache.touch({used, 1});
    cache.touch({used + 1, 1});  // 1 and 3 are older now, 1 the oldest
    const std::int32_t slot_of_1 = cache.find(tile(1))->slot;
    EXPECT_EQ(cache.reserve(tile(10), 2), slot_of_1);
    EXPECT_EQ(cache.find(tile(1)), nullptr);
    const std::int32_t slot_of_3 = cache.find(tile(3))->slot;
    EXPECT_EQ(cache.reserve(tile(11), 2), slot_of_3);
    const std::int32_t slot_of_0 = cache.find(tile(0))->slot;
    EXPECT_EQ(cache.reserve(tile(12), 2), slot_of_0);
    EXPECT_EQ(cache.evictions(), 3);
    EXPECT_EQ(cache.in_use(), 4);
}

TEST(TileCache, NeverEvictsWhatIsPinnedLoadingOrPlannedInThisFrame) {
    TileCache cache(4);
    load(cache, 0, 1);
    cache.pin(tile(0));
    load(cache, 1, 1);
    load(cache, 2, 1);
    cache.reserve(tile(3), 1);  // loading
    const TileId planned[] = {tile(1)};
    cache.touch_planned(planned, 7);
    EXPECT_TRUE(cache.reserve(tile(4), 7).has_value());  // 2 goes
    EXPECT_EQ(cache.find(tile(2)), nullptr);
    EXPECT_EQ(cache.reserve(tile(5), 7), std::nullopt);
    EXPECT_NE(cache.find(tile(0)), nullptr);
    EXPECT_NE(cache.find(tile(1)), nullptr);
    EXPECT_NE(cache.find(tile(3)), nullptr);
    EXPECT_TRUE(cache.reserve(tile(5), 8).has_value());  // no longer planned in frame 8
    EXPECT_EQ(cache.find(tile(1)), nullptr);
}

TEST(TileCache, FailureAndCancellationFreeTheSlot) {
    TileCache cache(1);
    const std::int32_t slot = *cache.reserve(tile(0), 1);
    cache.cancel(tile(0));
    EXPECT_EQ(cache.find(tile(0)), nullptr);
    EXPECT_EQ(cache.in_use(), 0);
    EXPECT_EQ(cache.reserve(tile(1), 1), slot);
    cache.fail(tile(1));
    ASSERT_NE(cache.find(tile(1)), nullptr);
    EXPECT_EQ(cache.find(tile(1))->state, State::unavailable);
    EXPECT_EQ(cache.find(tile(1))->slot, -1);
    EXPECT_EQ(cache.in_use(), 0);
    EXPECT_EQ(cache.reserve(tile(2), 1), slot);
    EXPECT_EQ(cache.evictions(), 0);
}

TEST(TileCache, KeepsTheHeaderOfWhatArrived) {
    TileCache cache(1);
    HeightTileHeader header;
    header.child_mask = 9;
    header.own.min_n = -5;
    cache.reserve(tile(0), 1);
    cache.complete(tile(0), &header);
    EXPECT_EQ(cache.find(tile(0))->header, header);
    EXPECT_EQ(cache.find(tile(0))->state, State::resident);
}

// Against a model that knows only the rules.
TEST(TileCache, BehavesLikeItsRulesUnderRandomUse) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int round = 0; round < 40; ++round) {
        const int capacity = test::uniform(random, 1, 12);
        TileCache cache(capacity);
        struct Model {
            State state;
            std::int32_t slot;
            std::uint64_t planned_in, used;
            bool pinned;
        };
        std::map<TileId, Model> model;
        std::uint64_t frame = 1, clock = 0;
        for (int step = 0; step < 1500; ++step) {
            const TileId id = tile(test::uniform(random, 0, 30));
            const auto known = model.find(id);
            switch (test::uniform(random, 0, 7)) {
                case 0:
                    ++frame;
                    break;
                case 1:
                    cache.touch_planned({&id, 1}, frame);
                    if (known != model.end()) {
                        known->second.planned_in = frame;
                        known->second.used = ++clock;
                    }
                    break;
                case 2:
                    cache.touch({&id, 1});
                    if (known != model.end()) known->second.used = ++clock;
                    break;
                case 3:
                    if (known != model.end() && known->second.state == State::loading) {
                        cache.cancel(id);
                        model.erase(known);
                    }
                    break;
                case 4:
                    if (known != model.end() && known->second.state == State::loading &&
                        test::uniform(random, 0, 9) == 0) {
                        cache.fail(id);
                        known->second.state = State::unavailable;
                        known->second.slot = -1;
                    }
                    break;
                case 5:
                    if (known != model.end() && known->second.state == State::loading) {
                        cache.complete(id, nullptr);
                        known->second.state = State::resident;
                        known->second.used = ++clock;
                        if (test::uniform(random, 0, 60) == 0) {
                            cache.pin(id);
                            known->second.pinned = true;
                        }
                    }
                    break;
                default: {
                    if (known != model.end()) break;
                    std::int64_t held = 0;
                    auto victim = model.end();
                    for (auto it = model.begin(); it != model.end(); ++it) {
                        held += it->second.slot >= 0 ? 1 : 0;
                        if (it->second.state != State::resident || it->second.pinned || it->second.planned_in >= frame)
                            continue;
                        if (victim == model.end() || it->second.used < victim->second.used) victim = it;
                    }
                    const auto slot = cache.reserve(id, frame);
                    if (held < capacity) {
                        ASSERT_TRUE(slot.has_value());
                    } else if (victim == model.end()) {
                        ASSERT_FALSE(slot.has_value());
                        break;
                    } else {
                        ASSERT_EQ(slot, victim->second.slot);
                        model.erase(victim);
                    }
                    model[id] = {State::loading, *slot, frame, ++clock, false};
                }
            }
            std::set<std::int32_t> slots;
            for (int k = 0; k <= 30; ++k) {
                const auto* entry = cache.find(tile(k));
                const auto expected = model.find(tile(k));
                ASSERT_EQ(entry != nullptr, expected != model.end());
                if (entry == nullptr) continue;
                ASSERT_EQ(entry->state, expected->second.state);
                ASSERT_EQ(entry->slot, expected->second.slot);
                if (entry->slot < 0) continue;
                ASSERT_LT(entry->slot, capacity);
                ASSERT_TRUE(slots.insert(entry->slot).second);
            }
            ASSERT_EQ(cache.in_use(), static_cast<std::int64_t>(slots.size()));
        }
    }
}

}  // namespace
}  // namespace scree
