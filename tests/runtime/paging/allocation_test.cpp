// Memory that the frame loop asks for, counted.
#include <gtest/gtest.h>

#include "tests/common/counted_new.h"
#include "tests/runtime/lod/memory_store.h"
#include "tests/runtime/paging/tile_planner.h"

namespace scree {
namespace {

class NoSink final : public TileSink {
public:
    void put_height(std::int32_t, std::span<const SlotVertex>) override {}
    void put_texture(std::int32_t, std::span<const std::uint8_t>) override {}
};

class PagerMemory : public testing::Test {
protected:
    static test::SyntheticTerrain terrain() {
        test::TerrainShape shape;
        shape.tile_cells_log2 = 2;
        shape.cells_x = shape.cells_y = 128;
        shape.texture_depth = 5;
        return test::SyntheticTerrain(shape, test::rough_heights(3, 500));
    }
    PagerMemory() : terrain_(terrain()), store_(terrain_), planner_(terrain_.dataset(), kMemory, 0.2, true) {
        auto created = Pager::create(store_, {kMemory, 2, 0, true}, sink_);
        EXPECT_TRUE(created.ok());
        pager_ = std::move(*created);
    }

    // Allocations of the pager's part of a frame.
    std::int64_t frame(double i, double j, bool finish) {
        std::int64_t before = test::allocations();
        do pager_->take_arrivals(std::int64_t{1} << 40, false);
        while (finish && !pager_->idle());
        std::int64_t counted = test::allocations() - before;
        const test::TilePlan& plan = planner_.plan(pager_->residency(), i, j);
        complete_ = plan.complete;
        const Pager::Wishes wishes = plan.wishes();
        before = test::allocations();
        pager_->request(wishes);
        return counted + test::allocations() - before;
    }

    static constexpr MemoryPlan kMemory{120, 100, 32, 0};
    test::SyntheticTerrain terrain_;
    test::MemoryStore store_;
    NoSink sink_;
    test::TilePlanner planner_;
    std::unique_ptr<Pager> pager_;
    bool complete_ = false;
};

TEST_F(PagerMemory, ASteadyFrameAllocatesNothing) {
    for (int k = 0; k < 200; ++k) frame(60, 60, true);
    ASSERT_TRUE(complete_);
    const std::int64_t reads = store_.reads_begun();
    std::int64_t counted = 0;
    for (int k = 0; k < 1000; ++k) counted += frame(60, 60, true);
    EXPECT_EQ(counted, 0);
    EXPECT_EQ(store_.reads_begun(), reads);
}

TEST_F(PagerMemory, AFlightThatLoadsAndEvictsComesToAllocateNothing) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    const auto fly = [&](int frames) {
        std::int64_t counted = 0;
        for (int k = 0; k < frames; ++k)
            counted += frame(test::uniform_real(random, 0, 128), test::uniform_real(random, 0, 128), k % 2 == 0);
        return counted;
    };
    fly(2000);
    const PagerCounters before = pager_->counters();
    EXPECT_EQ(fly(1000), 0);
    EXPECT_GT(pager_->counters().tiles_paged_in, before.tiles_paged_in + 1000);
    EXPECT_GT(pager_->counters().tiles_paged_out, before.tiles_paged_out + 1000);
}

TEST_F(PagerMemory, TheCountCounts) {
    const std::int64_t before = test::allocations();
    ::operator delete(::operator new(4));
    EXPECT_EQ(test::allocations(), before + 1);
}

}  // namespace
}  // namespace scree
