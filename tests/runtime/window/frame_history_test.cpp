#include "runtime/window/frame_history.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <numeric>

#include "tests/common/test_support.h"

namespace scree {
namespace {

TEST(FrameHistory, HoldsNothingAtFirst) {
    const FrameHistory history;
    EXPECT_TRUE(history.times_ms().empty());
    EXPECT_EQ(history.mean_ms(), 0);
    EXPECT_EQ(history.max_ms(), 0);
    EXPECT_EQ(history.p99_ms(), 0);
}

TEST(FrameHistory, HoldsTheLastFramesOldestFirstAndTheirFigures) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    FrameHistory history;
    std::deque<float> expected;
    for (int k = 0; k < 1000; ++k) {
        const auto ms = static_cast<float>(test::uniform(random, 0, 40000)) / 1000;
        history.add(ms);
        expected.push_back(ms);
        if (expected.size() > kFramesKept) expected.pop_front();
        const auto times = history.times_ms();
        ASSERT_TRUE(std::equal(times.begin(), times.end(), expected.begin(), expected.end())) << k;
        std::vector<float> sorted(expected.begin(), expected.end());
        std::sort(sorted.begin(), sorted.end());
        ASSERT_EQ(history.max_ms(), sorted.back());
        // Of 240 the 238th: two are longer.
        const auto rank = static_cast<std::size_t>(std::ceil(0.99 * static_cast<double>(sorted.size()) - 1e-9));
        ASSERT_EQ(history.p99_ms(), sorted[rank - 1]);
        ASSERT_NEAR(history.mean_ms(),
                    std::accumulate(sorted.begin(), sorted.end(), 0.0) / static_cast<double>(sorted.size()), 1e-9);
    }
}

TEST(FrameHistory, KeepsNoTimeThatIsNone) {
    FrameHistory history;
    history.add(5);
    for (const double bad :
         {-1.0, 1e300, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()})
        history.add(bad);
    EXPECT_EQ(history.times_ms().size(), 1u);
}

}  // namespace
}  // namespace scree
