#include "tools/mosaic/stack.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "tests/programs/sample_inputs.h"
#include "tests/tools/mosaic/mosaic_support.h"

namespace scree {
namespace {

constexpr double kUncovered = -std::numeric_limits<double>::infinity();

bool same(double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); }

class Stacks : public ::testing::Test {
protected:
    std::vector<double> sample(const HeightGrid& grid, std::int64_t i, std::int64_t j, std::int64_t columns,
                               std::int64_t rows, std::int64_t stride = 1) {
        std::vector<double> out(static_cast<std::size_t>(columns * rows));
        EXPECT_TRUE(grid.sample(i, j, columns, rows, stride, out).ok());
        return out;
    }
    std::unique_ptr<HeightGrid> on(const HeightStack& stack, const TargetGrid& grid, const char* crs = "EPSG:32633") {
        auto placed = stack.on(grid, *Crs::parse(crs));
        EXPECT_TRUE(placed.ok());
        return std::move(*placed);
    }
    /// A base of 150 x 130 samples of 10 m, with voids, and a finer, turned-by-CRS one of degrees over a part of it.
    std::unique_ptr<HeightStack> two_layers(Kernel kernel) {
        test::HeightGrid base = test::hills(150, 130, 3), top = test::hills(60, 50, 4);
        for (int k = 0; k < 40; ++k) base.at(20 + k % 8, 30 + k / 8) = NAN;
        test::write_heights(folder_.file("a.tif"), base, {462000, 5233500, 100, 32633, false});
        test::write_geographic_heights(folder_.file("b.tif"), top);
        return test::stack_of({folder_.file("a.tif"), folder_.file("b.tif")}, folder_.file("t"), kernel);
    }

    test::TemporaryFolder folder_;
};

TEST_F(Stacks, FilesOfOneLayerLieOverOneAnotherWithTheirVoids) {
    test::HeightGrid a = test::hills(80, 70, 3), b = test::hills(40, 40, 4);
    b.at(3, 3) = NAN;
    a.at(60, 50) = NAN;  // under the second file's value
    a.at(0, 0) = NAN;
    a.at(53, 43) = NAN;  // under its void
    test::write_heights(folder_.file("a.tif"), a, {400000, 5300000, 10, 32633, false});
    test::write_heights(folder_.file("b.tif"), b, {400500, 5299600, 10, 32633, false});
    const auto stack = test::stack_of({folder_.file("a.tif"), folder_.file("b.tif")}, folder_.file("t"));
    ASSERT_EQ(stack->layer_count(), 1u);
    ASSERT_EQ(stack->layer(0).columns, 90);
    ASSERT_EQ(stack->layer(0).rows, 80);
    std::vector<double> all(92 * 82);
    ASSERT_TRUE(stack->samples(0, -1, -1, 92, 82, all).ok());
    for (int r = -1; r < 81; ++r)
        for (int c = -1; c < 91; ++c) {
            const bool in_a = c >= 0 && r >= 0 && c < 80 && r < 70, in_b = c >= 50 && r >= 40 && c < 90 && r < 80;
            double expected = kUncovered;
            if (in_a) expected = a.at(c, r);
            if (in_b && (!std::isnan(b.at(c - 50, r - 40)) || expected == kUncovered)) expected = b.at(c - 50, r - 40);
            ASSERT_TRUE(same(all[static_cast<std::size_t>((r + 1) * 92 + c + 1)], expected)) << c << ", " << r;
        }
    EXPECT_TRUE(std::isnan(all[44 * 92 + 54]));
    EXPECT_EQ(stack->blocks(0).size(), 4u);
}

TEST_F(Stacks, SamplesOnTheGridAreCopiedToTheLastBitByEveryKernel) {
    test::HeightGrid a = test::hills(100, 90, 3);
    for (float& z : a.z) z += 1.0F / 3;
    a.at(10, 10) = NAN;
    test::write_heights(folder_.file("a.tif"), a, {400000, 5300000, 10, 32633, false});
    for (const Kernel kernel : {Kernel::nearest, Kernel::bilinear, Kernel::cubic}) {
        const auto stack = test::stack_of({folder_.file("a.tif")}, folder_.file("t"), kernel);
        const TargetGrid target{399930, 5300050, 10};
        ASSERT_TRUE(on_grid(stack->layer(0), target, *Crs::parse("EPSG:32633")));
        const auto grid = on(*stack, target);
        const auto values = sample(*grid, 0, 0, 120, 110);
        for (int j = 0; j < 110; ++j)
            for (int i = 0; i < 120; ++i) {
                const int c = i - 7, r = j - 5;
                const bool inside = c >= 0 && r >= 0 && c < 100 && r < 90;
                const double expected = inside ? static_cast<double>(a.at(c, r)) : kUncovered;
                ASSERT_TRUE(same(values[static_cast<std::size_t>(j * 120 + i)], expected)) << i << ", " << j;
            }
        EXPECT_FALSE(on_grid(stack->layer(0), {399930, 5300050, 5}, *Crs::parse("EPSG:32633")));
        EXPECT_FALSE(on_grid(stack->layer(0), {399933, 5300050, 10}, *Crs::parse("EPSG:32633")));
        EXPECT_FALSE(on_grid(stack->layer(0), target, *Crs::parse("EPSG:32634")));
    }
}

TEST_F(Stacks, ValuesDoNotDependOnTheRectangleThatIsAskedFor) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (const Kernel kernel : {Kernel::bilinear, Kernel::cubic})
        for (const double step : {35.0, 90.0, 260.0}) {
            const auto stack = two_layers(kernel);
            ASSERT_EQ(stack->layer_count(), 2u);
            const auto grid = on(*stack, {461000.5, 5234000.25, step});
            const std::int64_t side = static_cast<std::int64_t>(17000 / step);
            const auto all = sample(*grid, -3, -5, side, side);
            for (int k = 0; k < 30; ++k) {
                const std::int64_t columns =
                                       test::uniform(random, 1, static_cast<int>(std::min<std::int64_t>(side, 90))),
                                   rows = test::uniform(random, 1, static_cast<int>(std::min<std::int64_t>(side, 90)));
                const std::int64_t i = test::uniform(random, 0, static_cast<int>(side - columns)),
                                   j = test::uniform(random, 0, static_cast<int>(side - rows));
                const auto part = sample(*grid, i - 3, j - 5, columns, rows);
                for (std::int64_t r = 0; r < rows; ++r)
                    for (std::int64_t c = 0; c < columns; ++c)
                        ASSERT_TRUE(same(part[static_cast<std::size_t>(r * columns + c)],
                                         all[static_cast<std::size_t>((j + r) * side + i + c)]))
                            << i + c << ", " << j + r << " at " << step;
            }
        }
}

TEST_F(Stacks, AStrideGivesThePointsOfTheDenseGrid) {
    const auto stack = two_layers(Kernel::bilinear);
    const auto grid = on(*stack, {461000.5, 5234000.25, 45});
    const auto dense = sample(*grid, 0, 0, 380, 300);
    for (const std::int64_t stride : {2, 3, 8, 64, 100}) {
        const std::int64_t i0 = 5, j0 = 2, columns = (379 - i0) / stride + 1, rows = (299 - j0) / stride + 1;
        const auto sparse = sample(*grid, i0, j0, columns, rows, stride);
        for (std::int64_t r = 0; r < rows; ++r)
            for (std::int64_t c = 0; c < columns; ++c)
                ASSERT_TRUE(same(sparse[static_cast<std::size_t>(r * columns + c)],
                                 dense[static_cast<std::size_t>((j0 + r * stride) * 380 + i0 + c * stride)]))
                    << c << ", " << r << " by " << stride;
    }
}

TEST_F(Stacks, AVoidIsToldFromWhatNoFileReaches) {
    test::HeightGrid a = test::hills(64, 64, 3);
    for (int r = 20; r < 40; ++r)
        for (int c = 20; c < 40; ++c) a.at(c, r) = NAN;
    test::write_heights(folder_.file("a.tif"), a, {400000, 5300000, 10, 32633, false});
    const auto stack = test::stack_of({folder_.file("a.tif")}, folder_.file("t"));
    const auto grid = on(*stack, {400003, 5299996, 10});
    const auto values = sample(*grid, -10, -10, 90, 90);
    for (int j = -10; j < 80; ++j)
        for (int i = -10; i < 80; ++i) {
            const double v = values[static_cast<std::size_t>((j + 10) * 90 + i + 10)];
            // Point (i, j) is at column i + 0.3, row j + 0.4.
            const bool inside = i >= 0 && j >= 0 && i + 0.3 <= 63 && j + 0.4 <= 63;
            const bool in_void = i >= 20 && i < 40 && j >= 20 && j < 40;
            // Half a sample beyond the last one a point is void: a seam that narrow may be filled.
            const bool beside = !inside && i >= 0 && j >= 0 && i <= 63 && j <= 63;
            if (beside)
                ASSERT_TRUE(std::isnan(v)) << i << ", " << j;
            else if (!inside)
                ASSERT_EQ(v, kUncovered) << i << ", " << j;
            else if (in_void)
                ASSERT_TRUE(std::isnan(v)) << i << ", " << j;
            else
                ASSERT_TRUE(std::isfinite(v)) << i << ", " << j;
        }
}

TEST_F(Stacks, TheTopmostLayerWithAValueCounts) {
    test::HeightGrid a = test::hills(64, 64, 3), b = test::hills(64, 64, 4);
    for (float& z : a.z) z = 100;
    for (float& z : b.z) z = 200;
    b.at(30, 30) = NAN;
    test::write_heights(folder_.file("a.tif"), a, {400000, 5300000, 10, 32633, false});
    test::write_heights(folder_.file("b.tif"), b, {400203, 5299797, 10, 32633, false});
    for (const bool swapped : {false, true}) {
        std::vector<std::string> paths{folder_.file("a.tif"), folder_.file("b.tif")};
        if (swapped) std::swap(paths[0], paths[1]);
        const auto stack = test::stack_of(paths, folder_.file("t"));
        ASSERT_EQ(stack->layer_count(), 2u);
        const auto grid = on(*stack, {400000, 5300000, 10});
        const auto values = sample(*grid, 0, 0, 90, 90);
        for (int j = 0; j < 90; ++j)
            for (int i = 0; i < 90; ++i) {
                const double c = i - 20.3, r = j - 20.3;
                const bool in_a = i < 64 && j < 64;
                const bool in_b =
                    c >= 0 && r >= 0 && c <= 63 && r <= 63 && !(std::nearbyint(c) == 30 && std::nearbyint(r) == 30);
                const double expected = in_a && in_b ? (swapped ? 100 : 200) : in_a ? 100 : in_b ? 200 : kUncovered;
                const double v = values[static_cast<std::size_t>(j * 90 + i)];
                if (expected == kUncovered)
                    ASSERT_FALSE(std::isfinite(v)) << i << ", " << j;
                else
                    ASSERT_NEAR(v, expected, 1e-9) << i << ", " << j;
            }
    }
}

}  // namespace
}  // namespace scree
