#include "runtime/paging/memory_plan.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/mesh/vertex_slot.h"
#include "common/texture_tile.h"
#include "tests/common/test_support.h"

namespace scree {
namespace {

// Only what the plan reads.
Dataset random_dataset(test::Random& random) {
    Dataset d;
    d.lattice.tile_cells_log2 = test::uniform(random, kMinTileCellsLog2, kMaxTileCellsLog2);
    d.texture_size_log2 = test::uniform(random, kMinTextureSizeLog2, kMaxTextureSizeLog2);
    d.lattice.root_rows = test::uniform(random, 1, 8);
    d.lattice.root_columns = test::uniform(random, 1, 8);
    const std::int64_t roots = d.lattice.root_rows * d.lattice.root_columns;
    d.height_tiles = roots + (std::int64_t{1} << test::uniform(random, 0, 24));
    d.texture_tiles = roots + (std::int64_t{1} << test::uniform(random, 0, 24));
    return d;
}

// What the slots would take if every one were full, without the bookkeeping.
std::int64_t payload_bytes(const Dataset& d, std::int64_t heights, std::int64_t textures) {
    return heights * static_cast<std::int64_t>(slot_bytes(d.lattice.tile_cells_log2)) +
           textures * static_cast<std::int64_t>(bc1_chain_bytes(d.texture_size_log2));
}

TEST(MemoryPlan, NeverPassesTheBudgetAndKeepsRootsToAnEighth) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    int planned = 0, refused = 0;
    for (int k = 0; k < 20000; ++k) {
        const Dataset d = random_dataset(random);
        const auto budget = static_cast<std::int64_t>(std::exp(std::uniform_real_distribution<double>(12, 26)(random)));
        const auto plan = plan_memory(d, budget);
        if (!plan) {
            EXPECT_EQ(plan.error().code, ErrorCode::usage);
            ++refused;
            continue;
        }
        ++planned;
        const std::int64_t roots = d.lattice.root_rows * d.lattice.root_columns;
        ASSERT_LE(plan->resident_bytes, budget);
        const std::int64_t staged = plan->staging_slots;
        ASSERT_LE(payload_bytes(d, plan->height_slots + staged, plan->texture_slots + staged) + fixed_cost(d, 2),
                  plan->resident_bytes);
        ASSERT_LE(8 * payload_bytes(d, roots, roots), budget);
        ASSERT_GE(plan->staging_slots, 1);
        // The roots fit, and so does a split of one of them.
        ASSERT_GE(plan->height_slots, std::min(roots + 4, d.height_tiles));
        ASSERT_GE(plan->texture_slots, std::min(roots, d.texture_tiles));
        // Two states of the store at once, at most; and of each the roots.
        ASSERT_LE(plan->height_slots, 2 * d.height_tiles + roots);
        ASSERT_LE(plan->texture_slots, 2 * d.texture_tiles + roots);
        ASSERT_GE(plan->height_slots, 2 * roots);
        ASSERT_GE(plan->texture_slots, 2 * roots);
    }
    EXPECT_GT(planned, 2000);
    EXPECT_GT(refused, 2000);
}

TEST(MemoryPlan, LeavesTexturesRoomToSplitARootAtTheSmallestBudgetOfAnyShape) {
    for (int n = kMinTileCellsLog2; n <= kMaxTileCellsLog2; ++n)
        for (int texture = kMinTextureSizeLog2; texture <= kMaxTextureSizeLog2; ++texture)
            for (const int roots : {1, 2, 5, 64}) {
                Dataset d;
                d.lattice.tile_cells_log2 = n;
                d.texture_size_log2 = texture;
                d.lattice.root_columns = roots;
                d.height_tiles = d.texture_tiles = std::int64_t{1} << 40;
                std::int64_t low = 0, high = std::int64_t{1} << 40;  // refused, accepted
                while (high - low > 1) {
                    const std::int64_t middle = (low + high) / 2;
                    (plan_memory(d, middle).ok() ? high : low) = middle;
                }
                for (const std::int64_t budget : {high, high + high / 10, 2 * high}) {
                    const auto plan = plan_memory(d, budget);
                    ASSERT_TRUE(plan.ok());
                    EXPECT_GE(plan->height_slots, roots + 4);
                    EXPECT_GE(plan->texture_slots, roots + 4) << "tile cells 2^" << n << ", texture 2^" << texture
                                                              << ", " << roots << " roots, " << budget << " bytes";
                }
            }
}

TEST(MemoryPlan, RefusesWhatIsTooSmallAndNamesWhatSuffices) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int k = 0; k < 300; ++k) {
        const Dataset d = random_dataset(random);
        std::int64_t low = 0, high = std::int64_t{1} << 40;  // refused, accepted
        ASSERT_FALSE(plan_memory(d, low).ok());
        ASSERT_TRUE(plan_memory(d, high).ok());
        while (high - low > 1) {
            const std::int64_t middle = (low + high) / 2;
            (plan_memory(d, middle).ok() ? high : low) = middle;
        }
        const auto refused = plan_memory(d, low);
        ASSERT_FALSE(refused.ok());
        // The figure it names, typed after --budget, is enough, and no more than rounding asks for.
        const std::string message = refused.error().message;
        const std::size_t colon = message.find(": ");
        ASSERT_NE(colon, std::string::npos) << message;
        const auto named = static_cast<std::int64_t>(std::stod(message.substr(colon + 2)) * 1024 * 1024 + 0.5);
        EXPECT_TRUE(plan_memory(d, named).ok()) << message << "; suffices: " << high;
        EXPECT_LE(named, high + 110000) << message << "; suffices: " << high;
        // And nothing in between is refused again.
        for (int more = 0; more < 20; ++more)
            EXPECT_TRUE(plan_memory(d, high + test::uniform(random, 0, 1 << 30)).ok());
    }
    EXPECT_FALSE(plan_memory(random_dataset(random), -5).ok());
}

TEST(MemoryPlan, SpendsWhatItIsGiven) {
    // At least nine tenths of the budget, when the store has that many tiles.
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int k = 0; k < 2000; ++k) {
        Dataset d = random_dataset(random);
        d.height_tiles = d.texture_tiles = std::int64_t{1} << 40;
        const std::int64_t budget = 10 * fixed_cost(d, 2) + 100 * (height_slot_cost(d) + texture_slot_cost(d)) *
                                                                d.lattice.root_rows * d.lattice.root_columns;
        const auto plan = plan_memory(d, budget);
        ASSERT_TRUE(plan.ok());
        EXPECT_GE(plan->resident_bytes, budget / 10 * 9);
    }
}

}  // namespace
}  // namespace scree
