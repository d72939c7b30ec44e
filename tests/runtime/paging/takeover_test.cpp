// The pager while its store becomes another one: two states of it at once, never mixed, in the slots of one.
#include <gtest/gtest.h>

#include <set>
#include <thread>

#include "runtime/paging/pager.h"
#include "tests/runtime/lod/memory_store.h"
#include "tests/runtime/paging/tile_planner.h"

namespace scree {
namespace {

using test::Damage;
using test::MemoryStore;
using test::SyntheticTerrain;
using test::TilePlanner;

constexpr std::int64_t kNoLimit = std::int64_t{1} << 40;

// Whose heights lie in which slot.
class HeightSink final : public TileSink {
public:
    explicit HeightSink(const MemoryPlan& memory) : heights(static_cast<std::size_t>(memory.height_slots)) {}
    void put_height(std::int32_t slot, std::span<const SlotVertex> vertices) override {
        auto& samples = heights.at(static_cast<std::size_t>(slot));
        samples.clear();
        for (const SlotVertex& v : vertices) samples.push_back(static_cast<std::int32_t>(v.height_n));
    }
    void put_texture(std::int32_t, std::span<const std::uint8_t>) override {}
    std::vector<std::vector<std::int32_t>> heights;
};

// The same lattice, other heights.
SyntheticTerrain state(int number, std::int64_t cells_y = 64) {
    test::TerrainShape shape;
    shape.tile_cells_log2 = 2;
    shape.cells_x = 64;
    shape.cells_y = cells_y;
    shape.texture_depth = 4;
    return SyntheticTerrain(shape, test::rough_heights(static_cast<std::uint64_t>(100 + number), 800));
}

std::shared_ptr<const TileStore> borrowed(const MemoryStore& store) { return {std::shared_ptr<void>(), &store}; }

// Stands behind the stores of a test: the pager goes before them, for its threads may still be reading.
struct Closing {
    std::unique_ptr<Pager>& pager;
    ~Closing() { pager.reset(); }
};

class Takeover : public testing::Test {
protected:
    static constexpr int kThreads = 3;
    void open(const SyntheticTerrain& terrain, const MemoryStore& store, const MemoryPlan& memory) {
        memory_ = memory;
        sink_ = std::make_unique<HeightSink>(memory);
        shown_ = &terrain;
        auto created = Pager::create(store, {memory, kThreads, 0, true}, *sink_);
        ASSERT_TRUE(created.ok());
        pager_ = std::move(*created);
        pager_->on_damage = [this](const std::string& what) { damage_.push_back(what); };
    }
    void begin(const SyntheticTerrain& terrain, const MemoryStore& store) {
        StoreState next{borrowed(store), {}};
        for (int k = 0; k < kThreads; ++k) next.readers.push_back(std::move(*store.open_reader()));
        coming_ = &terrain;
        pager_->begin_takeover(std::move(next));
    }
    void switch_over() {
        pager_->switch_over();
        shown_ = coming_;
    }

    // All that is reached holds what the state has, and no slot has two owners.
    void check() {
        std::array<std::set<std::int32_t>, 2> slots;
        walk(pager_->residency(), *shown_, slots);
        if (pager_->taking_over()) walk(pager_->coming(), *coming_, slots);
        ASSERT_LE(static_cast<std::int64_t>(slots[0].size()), memory_.height_slots);
        for (const std::int32_t root : pager_->residency().heights.roots) ASSERT_GE(root, 0) << "a hole";
        for (const std::int32_t root : pager_->residency().textures.roots) ASSERT_GE(root, 0);
    }
    // A frame as the scene makes it. True: nothing is missing of what is loaded.
    bool frame(double detail, double i, double j, std::int64_t upload, bool wait) {
        pager_->take_arrivals(upload, wait);
        check();
        const bool both = pager_->taking_over();
        MemoryPlan share = memory_;
        if (both) share.height_slots /= 2, share.texture_slots /= 2;
        TilePlanner of_shown(shown_->dataset(), share, detail);
        const test::TilePlan& shown = of_shown.plan(pager_->residency(), i, j);
        bool complete = shown.complete;
        std::set<std::int32_t> drawn;
        for (const auto& [kind, id, slot] : shown.resident)
            if (kind == TileKind::height) drawn.insert(slot);
        if (!both) {
            pager_->request(shown.wishes());
        } else {
            Pager::Wishes of_old = shown.wishes();
            of_old.requests = {};
            complete = false;
            if (pager_->roots_ready()) {
                TilePlanner of_coming(coming_->dataset(), share, detail);
                const test::TilePlan& coming = of_coming.plan(pager_->coming(), i, j);
                complete = coming.complete;
                pager_->request(of_old, coming.wishes());
                std::array<std::set<std::int32_t>, 2> kept;
                walk(pager_->coming(), *coming_, kept);
                for (const auto& [kind, id, slot] : coming.resident)
                    EXPECT_TRUE(kept[static_cast<std::size_t>(kind)].contains(slot)) << "a planned tile went";
            } else {
                pager_->request(of_old, {});
            }
        }
        // What is drawn after this is still where it was.
        std::array<std::set<std::int32_t>, 2> slots;
        walk(pager_->residency(), *shown_, slots);
        for (const std::int32_t slot : drawn) EXPECT_TRUE(slots[0].contains(slot)) << "a drawn tile went";
        check();
        return complete;
    }
    void settle(double detail, double i, double j) {
        int frames = 0;
        while (!frame(detail, i, j, kNoLimit, true) && !HasFatalFailure()) ASSERT_LT(++frames, 1000);
    }

    void walk(const Residency& residency, const SyntheticTerrain& terrain,
              std::array<std::set<std::int32_t>, 2>& slots) {
        const Lattice& l = terrain.lattice();
        for (const TileKind kind : {TileKind::height, TileKind::texture})
            for (std::int64_t k = 0; k < l.root_rows * l.root_columns; ++k)
                if (const std::int32_t root = residency.of(kind).roots.at(static_cast<std::size_t>(k)); root >= 0)
                    reach(residency, terrain, kind, {0, k % l.root_columns, k / l.root_columns}, root, slots);
    }
    void reach(const Residency& residency, const SyntheticTerrain& terrain, TileKind kind, TileId id, std::int32_t slot,
               std::array<std::set<std::int32_t>, 2>& slots) {
        const auto at = static_cast<std::size_t>(slot);
        ASSERT_TRUE(slots[static_cast<std::size_t>(kind)].insert(slot).second) << "two tiles in one slot";
        if (kind == TileKind::height) {
            ASSERT_EQ(sink_->heights.at(at), terrain.tile(id)->samples) << "heights of another state, or tile";
            ASSERT_EQ(residency.heights.headers.at(at), terrain.tile(id)->header);
        }
        for (int q = 0; q < 4; ++q)
            if (const auto child = residency.of(kind).children.at(at)[static_cast<std::size_t>(q)]; child >= 0)
                reach(residency, terrain, kind, child_of(id, q), child, slots);
    }
    std::size_t resident(const Residency& residency, const SyntheticTerrain& terrain) {
        std::array<std::set<std::int32_t>, 2> slots;
        walk(residency, terrain, slots);
        return slots[0].size();
    }

    MemoryPlan memory_;
    const SyntheticTerrain *shown_ = nullptr, *coming_ = nullptr;
    std::unique_ptr<HeightSink> sink_;
    std::unique_ptr<Pager> pager_;
    std::vector<std::string> damage_;
};

TEST_F(Takeover, RandomFlightsOverManyStatesNeverMixThemAndNeverLeaveAHole) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    std::vector<SyntheticTerrain> states;
    for (int k = 0; k < 6; ++k) states.push_back(state(k, 16));  // four roots in a row
    int switched = 0, cut_short = 0;
    for (int round = 0; round < 30 && !HasFailure(); ++round) {
        SCOPED_TRACE("round " + std::to_string(round));
        std::vector<std::unique_ptr<MemoryStore>> stores;
        for (const SyntheticTerrain& s : states) stores.push_back(std::make_unique<MemoryStore>(s, round % 2 * 200));
        const Closing closing{pager_};
        const std::int64_t roots = 4;
        open(states[0], *stores[0],
             {2 * roots + test::uniform(random, 0, 40), 2 * roots + test::uniform(random, 0, 40),
              test::uniform(random, 1, 6), 0});
        const double detail = std::exp(test::uniform_real(random, -2, 1));
        double i = 30, j = 8;
        const auto fly = [&](int frames) {
            bool complete = false;
            for (int k = 0; k < frames && !HasFatalFailure(); ++k) {
                i += test::uniform_real(random, -3, 3);
                j += test::uniform_real(random, -1, 1);
                complete = frame(detail, i, j, test::uniform(random, 0, 20000), test::uniform(random, 0, 9) == 0);
            }
            return complete;
        };
        for (std::size_t next = 1; next < states.size() && !HasFatalFailure(); ++next) {
            fly(test::uniform(random, 0, 60));
            begin(states[next], *stores[next]);
            fly(test::uniform(random, 0, 30));
            // Another update comes before this one is shown.
            if (next + 1 < states.size() && test::uniform(random, 0, 2) == 0) {
                ++cut_short;
                continue;
            }
            settle(detail, i, j);
            if (HasFatalFailure()) return;
            ASSERT_TRUE(pager_->roots_ready());
            switch_over();
            ++switched;
            check();
        }
        settle(detail, i, j);
        ASSERT_EQ(pager_->counters().damaged_tiles, 0);
        const std::size_t flown = resident(pager_->residency(), *shown_);
        const PagerCounters& c = pager_->counters();
        EXPECT_GT(c.tiles_paged_in, c.tiles_paged_out - 1);
        EXPECT_GE(flown, 4u);
    }
    EXPECT_GT(switched, 50);
    EXPECT_GT(cut_short, 10);
}

TEST_F(Takeover, WhatWasBeingReadOfTheOldStateIsThrownAway) {
    const SyntheticTerrain old = state(1), now = state(2);
    const MemoryStore old_store(old), now_store(now);
    const Closing closing{pager_};
    open(old, old_store, {20, 20, 2, 0});
    const std::int64_t before = old_store.reads_begun();
    old_store.hold();
    const std::vector<TileRequest> requests{{TileKind::height, {1, 0, 0}, 9}, {TileKind::height, {1, 1, 0}, 8}};
    pager_->request({.requests = requests});
    old_store.wait_for_reads(before + 2);
    begin(now, now_store);
    // Both places among the staged heights are taken by what nobody wants any more.
    pager_->request({}, {});
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    EXPECT_EQ(now_store.reads_begun(), 0);
    old_store.release();
    while (!pager_->roots_ready()) {
        pager_->take_arrivals(kNoLimit, true);
        pager_->request({}, {});
    }
    check();
    EXPECT_EQ(pager_->counters().bytes_read, 0);
    switch_over();
    EXPECT_EQ(pager_->residency().heights.children[static_cast<std::size_t>(pager_->residency().heights.roots[0])][0],
              kNotResident);
    settle(0.5, 20, 20);
    EXPECT_GT(resident(pager_->residency(), now), 4u);
    EXPECT_EQ(pager_->counters().damaged_tiles, 0);
}

TEST_F(Takeover, WhatIsReadAfterAnUpdateIsNeitherShownNorCalledDamaged) {
    const SyntheticTerrain old = state(1), now = state(2);
    MemoryStore old_store(old);
    const MemoryStore now_store(now);
    const Closing closing{pager_};
    const TileId good{1, 0, 0}, gone{1, 1, 0};
    old_store.damage(TileKind::height, gone, Damage::missing);
    open(old, old_store, {20, 20, 4, 0});
    const std::int64_t before = old_store.reads_begun();
    old_store.hold();
    const std::vector<TileRequest> requests{{TileKind::height, good, 9}, {TileKind::height, gone, 8}};
    pager_->request({.requests = requests});
    old_store.wait_for_reads(before + 2);
    EXPECT_FALSE(pager_->stale());
    old_store.rewrite();
    old_store.release();
    while (!pager_->idle()) pager_->take_arrivals(kNoLimit, true);
    EXPECT_TRUE(pager_->stale());
    EXPECT_EQ(resident(pager_->residency(), old), 1u) << "the root, and nothing else";
    EXPECT_EQ(pager_->counters().damaged_tiles, 0);
    EXPECT_TRUE(damage_.empty());
    // Nothing more is asked of it: it would all come to nothing.
    pager_->request({.requests = requests});
    EXPECT_TRUE(pager_->idle());
    EXPECT_EQ(old_store.reads_begun(), before + 2);
    begin(now, now_store);
    EXPECT_FALSE(pager_->stale());
    settle(0.5, 20, 20);
    switch_over();
    settle(0.5, 20, 20);
    const auto& root_children =
        pager_->residency().heights.children[static_cast<std::size_t>(pager_->residency().heights.roots[0])];
    EXPECT_GE(root_children[1], 0) << "what could not be read of the old state can be of the new one";
}

TEST_F(Takeover, DamagedTilesOfTheOldStateAreAskedForAnew) {
    const SyntheticTerrain old = state(1), bad = state(2), now = state(3);
    const MemoryStore old_store(old), now_store(now);
    MemoryStore bad_store(bad);
    const Closing closing{pager_};
    bad_store.damage(TileKind::height, {1, 0, 0}, Damage::checksum);
    open(old, old_store, {20, 20, 4, 0});
    const auto take_over = [&](const SyntheticTerrain& terrain, const MemoryStore& store) {
        begin(terrain, store);
        settle(0.5, 2, 2);
        switch_over();
        settle(0.5, 2, 2);
    };
    // Often enough that every table serves twice.
    take_over(bad, bad_store);
    EXPECT_EQ(damage_.size(), 1u);
    take_over(now, now_store);
    take_over(old, old_store);
    EXPECT_GE(pager_->residency().heights.children[static_cast<std::size_t>(pager_->residency().heights.roots[0])][0],
              0);
    EXPECT_EQ(damage_.size(), 1u);
}

TEST_F(Takeover, ADamagedRootLeavesWhatIsShown) {
    const SyntheticTerrain old = state(1), bad = state(2), now = state(3);
    const MemoryStore old_store(old), now_store(now);
    for (const TileKind kind : {TileKind::height, TileKind::texture}) {
        MemoryStore bad_store(bad);
        const Closing closing{pager_};
        bad_store.damage(kind, {0, 0, 0}, Damage::checksum);
        damage_.clear();
        open(old, old_store, {20, 20, 4, 0});
        settle(0.5, 20, 20);
        const std::size_t before = resident(pager_->residency(), old);
        begin(bad, bad_store);
        while (pager_->taking_over()) {
            pager_->request({}, {});
            pager_->take_arrivals(kNoLimit, true);
            check();
        }
        EXPECT_TRUE(pager_->gave_up());
        ASSERT_EQ(damage_.size(), 1u);
        EXPECT_NE(damage_[0].find("0/0/0"), std::string::npos) << damage_[0];
        EXPECT_GE(resident(pager_->residency(), old) + 1, before) << "but for the slot that a root may have taken";
        frame(0.5, 20, 20, kNoLimit, false);
        begin(now, now_store);
        settle(0.5, 20, 20);
        switch_over();
        settle(0.5, 20, 20);
        EXPECT_FALSE(pager_->gave_up());
    }
}

TEST_F(Takeover, NoCallOfTheFrameLoopWaitsForAHeldUpStore) {
    const SyntheticTerrain old = state(1), now = state(2);
    const MemoryStore old_store(old), now_store(now);
    const Closing closing{pager_};
    open(old, old_store, {20, 20, 4, 0});
    settle(0.5, 20, 20);
    now_store.hold();
    begin(now, now_store);
    // Would hang here for ever if it did.
    for (int k = 0; k < 100; ++k) frame(0.5, 20, 20, kNoLimit, false);
    EXPECT_FALSE(pager_->roots_ready());
    now_store.release();
    settle(0.5, 20, 20);
    EXPECT_TRUE(pager_->roots_ready());
}

}  // namespace
}  // namespace scree
