#include "tools/verify/surface_error.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/mesh/drawn_surface.h"
#include "tests/common/test_support.h"

namespace scree {
namespace {

// Greatest |z - drawn| over all masks, as a numerator over 2 * stride, stride in finest cells.
std::int64_t brute(std::span<const std::int32_t> drawn, int geomip, std::int64_t origin_i, std::int64_t origin_j,
                   std::int64_t unit, const FinestTile& finest) {
    const int n = finest.tile_cells_log2, pitch = (1 << n) + 1;
    std::int64_t worst = 0;
    for (unsigned mask = 0; mask < kEdgeMaskCount; ++mask)
        for (int k = 0; k < pitch * pitch; ++k) {
            const auto at = static_cast<std::size_t>(k);
            if (!finest.present.empty() && finest.present[at] == 0) continue;
            const ExactHeight h =
                drawn_height(drawn, n, {geomip, mask}, origin_i + k % pitch, origin_j + k / pitch, unit);
            EXPECT_EQ(h.denominator, 2 * unit << geomip);
            worst = std::max(worst, std::abs(finest.samples[at] * h.denominator - h.numerator));
        }
    return worst;
}

TEST(OwnErrors, EqualTheBruteForce) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int n = 2; n <= 5; ++n)
        for (int k = 0; k < 8; ++k) {
            const auto samples = test::random_samples(random, n, k % 2 == 0 ? 100 : kMaxHeightUnits);
            const auto cells =
                k % 3 == 0 ? std::vector<std::uint8_t>{} : test::random_presence(random, n, k % 3 == 1 ? 50 : 5);
            const FinestTile finest = make_finest_tile(samples, cells, n);
            const auto errors = own_errors(finest);
            ASSERT_EQ(errors.size(), static_cast<std::size_t>(n));
            for (int g = 0; g < n; ++g) {
                EXPECT_EQ(errors[static_cast<std::size_t>(g)].stride, 1 << g);
                EXPECT_EQ(errors[static_cast<std::size_t>(g)].numerator, brute(samples, g, 0, 0, 1, finest))
                    << n << " " << g;
            }
        }
}

TEST(AncestorError, EqualsTheBruteForceEverywhereInTheAncestor) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int n = 2; n <= 4; ++n)
        for (int up = 1; up <= 3; ++up) {
            const auto ancestor = test::random_samples(random, n, kMaxHeightUnits);
            for (int place = 0; place < 1 << (2 * up); ++place) {
                const auto samples = test::random_samples(random, n, kMaxHeightUnits);
                const auto cells = place % 2 == 0 ? std::vector<std::uint8_t>{} : test::random_presence(random, n, 20);
                const FinestTile finest = make_finest_tile(samples, cells, n);
                const std::int64_t i = (place & ((1 << up) - 1)) << n, j = (place >> up) << n;
                ASSERT_EQ(ancestor_error(coarsest_block(ancestor, n), std::int64_t{1} << (up + n - 1), i, j, finest),
                          brute(ancestor, n - 1, i, j, std::int64_t{1} << up, finest));
            }
        }
}

TEST(ExactError, IsComparedWithABoundWithoutRounding) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int k = 0; k < 20000; ++k) {
        const std::int64_t stride = std::int64_t{1} << test::uniform(random, 0, 29);
        const auto numerator =
            static_cast<std::int64_t>(random() % static_cast<std::uint64_t>(2 * stride * kMaxHeightUnits));
        const ExactError error{numerator, stride};
        auto smallest = static_cast<float>(error.quanta());  // quanta() may be rounded too: look one float around
        while (smallest > 0 && error.within(std::nextafter(smallest, -1.0f)))
            smallest = std::nextafter(smallest, -1.0f);
        while (!error.within(smallest)) smallest = std::nextafter(smallest, std::numeric_limits<float>::max());
        const long double exact = static_cast<long double>(numerator) / (2.0L * static_cast<long double>(stride));
        ASSERT_GE(static_cast<long double>(smallest), exact);
        if (smallest > 0) {
            ASSERT_LT(static_cast<long double>(std::nextafter(smallest, -1.0f)), exact);
        }
    }
    EXPECT_TRUE((ExactError{0, 1}).within(0));
    EXPECT_FALSE((ExactError{1, std::int64_t{1} << 29}).within(0));
}

}  // namespace
}  // namespace scree
