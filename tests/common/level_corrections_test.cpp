#include "common/mesh/level_corrections.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "common/mesh/drawn_surface.h"
#include "tests/common/test_support.h"

namespace scree {
namespace {

TEST(LevelCorrections, AreTheGreatestDistanceOfTheNextFinerLevelsVertices) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int n = 2; n <= 7; ++n) {
        const auto samples = test::random_samples(random, n, 1000);
        std::vector<SlotVertex> slot(slot_vertex_count(n));
        fill_vertex_slot(samples, n, slot);
        const LevelCorrections corrections = level_corrections(slot, n);
        const int m = 1 << n;
        for (int g = 0; g < kMaxTileCellsLog2; ++g) {
            double expected = 0;
            const int stride = g > 0 ? 1 << (g - 1) : 1;
            for (int j = 0; g > 0 && g < n && j <= m; j += stride)
                for (int i = 0; i <= m; i += stride)
                    expected = std::max(expected, std::abs(samples[static_cast<std::size_t>(j * (m + 1) + i)] -
                                                           drawn_height(samples, n, {g, 0}, i, j, 1).quanta()));
            ASSERT_EQ(static_cast<double>(corrections[static_cast<std::size_t>(g)]), expected)
                << "n " << n << " g " << g;
        }
    }
}

// What makes them no bound: the same sign at every level adds up.
TEST(LevelCorrections, OfARidgeStayBehindItsError) {
    constexpr int n = 5, m = 1 << n;
    std::vector<std::int32_t> samples;
    for (int j = 0; j <= m; ++j)
        for (int i = 0; i <= m; ++i) samples.push_back(i * (m - i));
    std::vector<SlotVertex> slot(slot_vertex_count(n));
    fill_vertex_slot(samples, n, slot);
    const LevelCorrections corrections = level_corrections(slot, n);
    for (int g = 1; g < n; ++g) {
        const double stride = 1 << g;
        EXPECT_EQ(static_cast<double>(corrections[static_cast<std::size_t>(g)]), stride * stride / 4);
    }
}

}  // namespace
}  // namespace scree
