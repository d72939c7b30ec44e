#include "experiments/claims/strip.h"

#include <gtest/gtest.h>

#include "tests/common/test_support.h"

namespace scree {
namespace {

std::vector<std::int32_t> random_side(test::Random& random, int cells) {
    std::vector<std::int32_t> side{0};
    for (int k = 1; k < cells; ++k)
        if (test::uniform(random, 0, 2) == 0) side.push_back(k);
    side.push_back(cells);
    return side;
}

TEST(Strip, IsCoveredOnceWhateverIsSelectedOnItsSides) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int round = 0; round < 500; ++round) {
        const auto a = random_side(random, 32), b = random_side(random, 32);
        const auto triangles = zip_strip(a, b);
        EXPECT_EQ(triangles.size(), a.size() + b.size() - 2);
        int bases = 0;
        for (const StripTriangle& t : triangles) {
            EXPECT_LT(t.low, t.high);
            bases += t.high - t.low;
        }
        EXPECT_EQ(bases, 64);
    }
}

TEST(Strip, WithAllItsVerticesIsTheWholeOne) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    std::vector<double> a, b;
    std::vector<std::int32_t> all;
    for (int k = 0; k <= 32; ++k) {
        a.push_back(test::uniform(random, 0, 1000));
        b.push_back(test::uniform(random, 0, 1000));
        all.push_back(k);
    }
    int places = 0;
    sample_strip(a, b, zip_strip(all, all), [&](double, double, double drawn, double whole) {
        EXPECT_NEAR(drawn, whole, 1e-9);
        ++places;
    });
    EXPECT_GT(places, 32 * 7);
    EXPECT_EQ(zip_strip(all, all).size(), 64u);
}

}  // namespace
}  // namespace scree
