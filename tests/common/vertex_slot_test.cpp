#include "common/mesh/vertex_slot.h"

#include <gtest/gtest.h>

#include "common/mesh/drawn_surface.h"
#include "tests/common/test_support.h"

namespace scree {
namespace {

int birth(int i, int j, int n) {
    int level = 0;
    while (level < n - 1 && i % (2 << level) == 0 && j % (2 << level) == 0) ++level;
    return level;
}

TEST(VertexSlot, HoldsTheGridAndItsBorderMidPoints) {
    EXPECT_EQ(slot_vertex_count(5), 1217u);
    EXPECT_EQ(slot_bytes(5), 14604u);
}

TEST(VertexSlot, HeightsAreTheSamplesAndTheNextLevelsSurfaces) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int n = 2; n <= 5; ++n) {
        // Half a million: a quarter of a sum of such heights still fits a float exactly.
        const auto samples = test::random_samples(random, n, 500000);
        std::vector<SlotVertex> slot(slot_vertex_count(n));
        fill_vertex_slot(samples, n, slot);
        const int m = 1 << n;
        for (int j = 0; j <= m; ++j)
            for (int i = 0; i <= m; ++i) {
                const SlotVertex& v = slot[static_cast<std::size_t>(j * (m + 1) + i)];
                const int k = birth(i, j, n);
                ASSERT_EQ(v.height_n, static_cast<float>(samples[static_cast<std::size_t>(j * (m + 1) + i)]));
                ASSERT_EQ(v.next_n, drawn_height(samples, n, {std::min(k + 1, n - 1), 0}, i, j, 1).quanta())
                    << i << ", " << j;
                ASSERT_EQ(v.second_next_n, drawn_height(samples, n, {std::min(k + 2, n - 1), 0}, i, j, 1).quanta());
            }
    }
}

TEST(VertexSlot, NextHeightsAreExactAtTheExtremes) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    const int n = 4, m = 16;
    const auto samples = test::random_samples(random, n, kMaxHeightUnits);
    std::vector<SlotVertex> slot(slot_vertex_count(n));
    fill_vertex_slot(samples, n, slot);
    for (int j = 0; j <= m; ++j)
        for (int i = 0; i <= m; ++i) {
            const int k = birth(i, j, n);
            ASSERT_EQ(slot[static_cast<std::size_t>(j * (m + 1) + i)].next_n,
                      drawn_height(samples, n, {std::min(k + 1, n - 1), 0}, i, j, 1).quanta());
        }
}

TEST(VertexSlot, BorderMidPointsLieOnTheBorder) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    const int n = 3, m = 8;
    const auto samples = test::random_samples(random, n, 500000);
    std::vector<SlotVertex> slot(slot_vertex_count(n));
    fill_vertex_slot(samples, n, slot);
    std::size_t next = static_cast<std::size_t>((m + 1) * (m + 1));
    const auto expect_mid = [&](std::int64_t u, std::int64_t v) {  // in half samples
        const SlotVertex& mid = slot[next++];
        EXPECT_EQ(mid.height_n, drawn_height(samples, n, {0, 0}, u, v, 2).quanta());
        EXPECT_EQ(mid.next_n, drawn_height(samples, n, {1, 0}, u, v, 2).quanta());
        EXPECT_EQ(mid.second_next_n, drawn_height(samples, n, {2, 0}, u, v, 2).quanta());
    };
    for (int k = 0; k < m; ++k) expect_mid(2 * k + 1, 0);
    for (int k = 0; k < m; ++k) expect_mid(2 * m, 2 * k + 1);
    for (int k = 0; k < m; ++k) expect_mid(2 * k + 1, 2 * m);
    for (int k = 0; k < m; ++k) expect_mid(0, 2 * k + 1);
    EXPECT_EQ(next, slot.size());
}

}  // namespace
}  // namespace scree
