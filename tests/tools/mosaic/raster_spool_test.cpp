#include "tools/mosaic/raster_spool.h"

#include <gtest/gtest.h>

#include <algorithm>

#include <cmath>
#include <limits>

#include "tests/common/test_support.h"

namespace scree {
namespace {

constexpr double kNothing = -std::numeric_limits<double>::infinity();
constexpr double kVoid = std::numeric_limits<double>::quiet_NaN();

bool same(double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); }

// The rule by its words: a value lies over anything, a void over what no file reaches.
double laid(double fresh, double held) {
    if (std::isfinite(fresh)) return fresh;
    return std::isnan(fresh) && held == kNothing ? fresh : held;
}
double random_value(test::Random& random, double) {
    const int kind = test::uniform(random, 0, 9);
    return kind == 0 ? kVoid : kind == 1 ? kNothing : static_cast<double>(test::uniform(random, -100, 100));
}
float random_value(test::Random& random, float) { return static_cast<float>(random_value(random, 0.0)); }

template <class T>
class Spooled : public ::testing::Test {};
using Kinds = ::testing::Types<float, double>;
TYPED_TEST_SUITE(Spooled, Kinds);

TYPED_TEST(Spooled, HoldsWhatRectanglesLaidOverOneAnotherHold) {
    using T = TypeParam;
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    const T nothing = static_cast<T>(kNothing);
    const test::TemporaryFolder folder;
    for (int round = 0; round < 20; ++round) {
        const std::int64_t width = test::uniform(random, 1, 200), height = test::uniform(random, 1, 200);
        auto spool = RasterSpool<T>::create(folder.file("r"), width, height, nothing);
        ASSERT_TRUE(spool.ok());
        EXPECT_TRUE(std::filesystem::is_empty(folder.file(""))) << "the file must vanish with the process";
        std::vector<T> raster(static_cast<std::size_t>(width * height), nothing);
        for (int k = test::uniform(random, 0, 8); k > 0; --k) {
            const std::int64_t c0 = test::uniform(random, 0, static_cast<int>(width) - 1),
                               r0 = test::uniform(random, 0, static_cast<int>(height) - 1);
            const std::int64_t columns = test::uniform(random, 1, static_cast<int>(width - c0)),
                               rows = test::uniform(random, 1, static_cast<int>(height - r0));
            std::vector<T> values(static_cast<std::size_t>(columns * rows));
            for (T& v : values) v = random_value(random, T{});
            ASSERT_TRUE((*spool)->lay(c0, r0, columns, rows, values).ok());
            for (std::int64_t r = 0; r < rows; ++r)
                for (std::int64_t c = 0; c < columns; ++c) {
                    T& held = raster[static_cast<std::size_t>((r0 + r) * width + c0 + c)];
                    const T fresh = values[static_cast<std::size_t>(r * columns + c)];
                    held = static_cast<T>(laid(fresh, held));
                }
        }
        // Windows of any place, beyond the raster too.
        for (int k = 0; k < 8; ++k) {
            const std::int64_t c0 = test::uniform(random, -70, 220), r0 = test::uniform(random, -70, 220);
            const std::int64_t columns = test::uniform(random, 1, 150), rows = test::uniform(random, 1, 150);
            std::vector<T> window(static_cast<std::size_t>(columns * rows));
            ASSERT_TRUE((*spool)->read(c0, r0, columns, rows, window).ok());
            const bool empty = std::all_of(window.begin(), window.end(), [&](T v) { return same(v, nothing); });
            ASSERT_TRUE(empty || (*spool)->holds_any(c0, r0, columns, rows));
            for (std::int64_t r = 0; r < rows; ++r)
                for (std::int64_t c = 0; c < columns; ++c) {
                    const std::int64_t x = c0 + c, y = r0 + r;
                    const bool inside = x >= 0 && y >= 0 && x < width && y < height;
                    const T expected = inside ? raster[static_cast<std::size_t>(y * width + x)] : nothing;
                    ASSERT_TRUE(same(window[static_cast<std::size_t>(r * columns + c)], expected)) << x << ", " << y;
                }
        }
        // Its corners are those of the blocks that hold anything.
        std::vector<bool> holds(static_cast<std::size_t>(((width + 63) / 64) * ((height + 63) / 64)));
        for (std::int64_t r = 0; r < height; ++r)
            for (std::int64_t c = 0; c < width; ++c)
                if (!same(raster[static_cast<std::size_t>(r * width + c)], nothing))
                    holds[static_cast<std::size_t>(r / 64 * ((width + 63) / 64) + c / 64)] = true;
        std::size_t corners = 0;
        for (std::size_t b = 0; b < holds.size(); ++b) corners += holds[b] ? 1 : 0;
        const auto found = (*spool)->corners();
        EXPECT_GE(found.size(), corners);
        for (std::size_t k = 1; k < found.size(); ++k)
            EXPECT_TRUE(found[k - 1].row < found[k].row ||
                        (found[k - 1].row == found[k].row && found[k - 1].column < found[k].column));
        EXPECT_EQ((*spool)->file_bytes(), static_cast<std::int64_t>(found.size() * 64 * 64 * sizeof(T)));
    }
}

TEST(RasterSpool, WhatIsNotWrittenTakesNoRoom) {
    const test::TemporaryFolder folder;
    auto spool = RasterSpool<double>::create(folder.file("r"), std::int64_t{1} << 30, std::int64_t{1} << 30, kNothing);
    ASSERT_TRUE(spool.ok());
    const std::vector<double> values{1, 2, 3, 4};
    ASSERT_TRUE((*spool)->lay((std::int64_t{1} << 30) - 2, (std::int64_t{1} << 30) - 2, 2, 2, values).ok());
    EXPECT_EQ((*spool)->file_bytes(), 64 * 64 * 8);
    EXPECT_FALSE((*spool)->holds_any((std::int64_t{1} << 30) - 200, (std::int64_t{1} << 30) - 64, 136, 300));
    EXPECT_TRUE((*spool)->holds_any((std::int64_t{1} << 30) - 200, (std::int64_t{1} << 30) - 64, 137, 300));
    std::vector<double> read(4);
    ASSERT_TRUE((*spool)->read((std::int64_t{1} << 30) - 2, (std::int64_t{1} << 30) - 2, 2, 2, read).ok());
    EXPECT_EQ(read, values);
}

}  // namespace
}  // namespace scree
