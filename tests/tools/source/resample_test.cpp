#include "tools/source/resample.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "tests/common/test_support.h"

namespace scree {
namespace {

using test::Random;

constexpr double kVoid = std::numeric_limits<double>::quiet_NaN();

/// A whole raster as one window.
template <class T>
struct Raster {
    std::int64_t columns, rows;
    std::vector<T> values;

    Raster(std::int64_t wide, std::int64_t high, const std::function<T(double, double)>& value)
        : columns(wide), rows(high) {
        for (std::int64_t r = 0; r < rows; ++r) {
            for (std::int64_t c = 0; c < columns; ++c) {
                values.push_back(value(static_cast<double>(c), static_cast<double>(r)));
            }
        }
    }
    T& at(std::int64_t c, std::int64_t r) { return values[static_cast<std::size_t>(r * columns + c)]; }
    SampleWindow<T> window() const { return {0, 0, columns, rows, values}; }
    ResampleRule rule(Kernel kernel, double shrink_columns = 1, double shrink_rows = 1, bool rim = false) const {
        return {kernel, {shrink_columns, shrink_rows}, rim, columns, rows};
    }
};
using Heights = Raster<double>;
using Colours = Raster<std::uint32_t>;

double sample(const SampleWindow<double>& window, const ResampleRule& rule, double u, double v) {
    double out = -12345;
    resample_heights(window, {{&u, 1}, {&v, 1}}, rule, {&out, 1});
    return out;
}
std::uint32_t sample(const SampleWindow<std::uint32_t>& window, const ResampleRule& rule, double u, double v) {
    std::uint32_t out = 12345;
    resample_colours(window, {{&u, 1}, {&v, 1}}, rule, {&out, 1});
    return out;
}
template <class T>
T sample(const Raster<T>& raster, const ResampleRule& rule, double u, double v) {
    return sample(raster.window(), rule, u, v);
}

std::uint32_t rgba(std::uint32_t r, std::uint32_t g, std::uint32_t b, std::uint32_t a = 255) {
    return r | g << 8 | b << 16 | a << 24;
}
int channel(std::uint32_t pixel, int index) { return static_cast<int>(pixel >> (8 * index) & 255); }

double real(Random& random, double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
}

constexpr std::array<Kernel, 2> kSmooth = {Kernel::bilinear, Kernel::cubic};
constexpr std::array<double, 6> kShrinks = {0.3, 1, 1.2, 1.9, 2.5, 7.3};

TEST(Resample, PlanesStayPlanesWithEveryKernelAndShrinkUpToTheOutermostSample) {
    SCREE_TRACE_SEED();
    Random random(test::seed());
    const auto plane = [](double x, double y) { return 1000 + 3.25 * x - 1.75 * y; };
    const Heights raster(23, 17, plane);
    for (const Kernel kernel : kSmooth) {
        for (const double across : kShrinks) {
            for (const double down : kShrinks) {
                for (int n = 0; n < 50; ++n) {
                    const double u = n < 4 ? 22 * (n & 1) : real(random, 0, 22);
                    const double v = n < 4 ? 16 * (n >> 1) : real(random, 0, 16);
                    ASSERT_NEAR(sample(raster, raster.rule(kernel, across, down), u, v), plane(u, v), 1e-10)
                        << u << " " << v << " shrink " << across << " " << down;
                }
            }
        }
    }
}

TEST(Resample, CubicReproducesQuadraticsAwayFromTheEdge) {
    SCREE_TRACE_SEED();
    Random random(test::seed());
    const auto surface = [](double x, double y) { return 5 + x * x - 0.5 * x * y + 2 * y * y; };
    const Heights raster(12, 12, surface);
    for (int n = 0; n < 200; ++n) {
        const double u = real(random, 1, 10), v = real(random, 1, 10);
        ASSERT_NEAR(sample(raster, raster.rule(Kernel::cubic), u, v), surface(u, v), 1e-10);
        EXPECT_GE(std::abs(sample(raster, raster.rule(Kernel::bilinear), std::floor(u) + .5, v) -
                           surface(std::floor(u) + .5, v)),
                  0.2);
    }
}

TEST(Resample, SamplesAreReturnedAsTheyAre) {
    SCREE_TRACE_SEED();
    Random random(test::seed());
    Heights raster(9, 7, [&](double, double) { return real(random, -1e4, 1e4); });
    raster.at(4, 3) = kVoid;
    for (const Kernel kernel : {Kernel::nearest, Kernel::bilinear, Kernel::cubic}) {
        for (std::int64_t r = 0; r < 7; ++r) {
            for (std::int64_t c = 0; c < 9; ++c) {
                const double z = sample(raster, raster.rule(kernel), static_cast<double>(c), static_cast<double>(r));
                if (c == 4 && r == 3) {
                    EXPECT_TRUE(std::isnan(z));
                } else {
                    EXPECT_EQ(z, raster.at(c, r));
                }
            }
        }
    }
}

TEST(Resample, NearestTakesTheNearest) {
    const Heights raster(5, 5, [](double x, double y) { return 10 * y + x; });
    EXPECT_EQ(sample(raster, raster.rule(Kernel::nearest, 9, 9), 1.49, 2.51), 31);
    EXPECT_EQ(sample(raster, raster.rule(Kernel::nearest), 3.5, 0.2), 4);
}

TEST(Resample, AMeanOfColoursIsOverAreasAndCountsEverySampleAlike) {
    const Colours raster(8, 8, [](double x, double) { return rgba(static_cast<std::uint32_t>(x) * 20, 0, 0); });
    EXPECT_EQ(sample(raster, raster.rule(Kernel::bilinear, 2, 2), 2.5, 2.5), rgba(50, 0, 0));
    // From 0.5 to 3.5: three whole samples. From 0.5 to 3: two and a half.
    EXPECT_EQ(sample(raster, raster.rule(Kernel::cubic, 3, 1), 2, 2), rgba(40, 0, 0));
    EXPECT_EQ(sample(raster, raster.rule(Kernel::bilinear, 2.5, 1), 1.75, 2), rgba(36, 0, 0));
    // Partly outside: what lies inside counts.
    EXPECT_EQ(sample(raster, raster.rule(Kernel::bilinear, 4, 1), 0.5, 2), rgba(20, 0, 0));
}

TEST(Resample, NothingBetweenPointsIsLostWhereHeightsShrink) {
    // Boxes of 4 that tile the axis weigh a lone peak to a quarter altogether, wherever it stands.
    for (std::int64_t peak = 8; peak < 24; ++peak) {
        Heights raster(33, 1, [](double, double) { return 0.0; });
        raster.at(peak, 0) = 100;
        double sum = 0;
        for (double u = 4; u <= 28; u += 4) sum += sample(raster, raster.rule(Kernel::bilinear, 4, 1), u, 0);
        EXPECT_NEAR(sum, 25, 1e-9) << peak;
    }
}

TEST(Resample, ThereIsNoStepWhereShrinkingBegins) {
    SCREE_TRACE_SEED();
    Random random(test::seed());
    const Heights heights(16, 16, [&](double, double) { return real(random, 0, 1); });
    for (int n = 0; n < 100; ++n) {
        const double u = real(random, 2, 13), v = real(random, 2, 13);
        EXPECT_NEAR(sample(heights, heights.rule(Kernel::bilinear, 1 + 2e-3, 1 + 2e-3), u, v),
                    sample(heights, heights.rule(Kernel::bilinear), u, v), 0.01);
        EXPECT_NEAR(sample(heights, heights.rule(Kernel::bilinear, 2 - 1e-6, 1), u, v),
                    sample(heights, heights.rule(Kernel::bilinear, 2 + 1e-6, 1), u, v), 1e-4);
    }
}

TEST(Resample, APointIsVoidExactlyWhereItsNearestSampleIs) {
    SCREE_TRACE_SEED();
    Random random(test::seed());
    Heights raster(20, 20, [&](double, double) { return random() % 3 == 0 ? kVoid : real(random, 50, 60); });
    for (const Kernel kernel : {Kernel::nearest, Kernel::bilinear, Kernel::cubic}) {
        for (const double shrink : kShrinks) {
            for (int n = 0; n < 200; ++n) {
                const double u = real(random, 0, 19), v = real(random, 0, 19);
                const double z = sample(raster, raster.rule(kernel, shrink, shrink), u, v);
                const bool is_void = std::isnan(raster.at(std::lround(u), std::lround(v)));
                ASSERT_EQ(std::isnan(z), is_void);
                // Voids have no weight, and nothing overshoots for want of samples.
                if (!is_void) {
                    ASSERT_GE(z, kernel == Kernel::cubic ? 45 : 50);
                    ASSERT_LE(z, kernel == Kernel::cubic ? 65 : 60);
                }
            }
        }
    }
}

TEST(Resample, CubicIsBilinearWhereOneOfItsSamplesIsVoid) {
    SCREE_TRACE_SEED();
    Random random(test::seed());
    Heights heights(12, 12, [&](double, double) { return real(random, 0, 100); });
    Colours colours(12, 12, [&](double, double) { return static_cast<std::uint32_t>(random()) | 0xff000000U; });
    heights.at(5, 5) = kVoid;
    colours.at(5, 5) = 0;
    for (const auto& [at, differs] : {std::pair{6.3, false}, std::pair{7.3, true}}) {
        const double apart = sample(heights, heights.rule(Kernel::cubic), at, at) -
                             sample(heights, heights.rule(Kernel::bilinear), at, at);
        EXPECT_EQ(std::abs(apart) > 1e-9, differs);
        EXPECT_EQ(sample(colours, colours.rule(Kernel::cubic), at, at) !=
                      sample(colours, colours.rule(Kernel::bilinear), at, at),
                  differs);
    }
}

TEST(Resample, PointRastersEndAtTheirOutermostSamplesAndAreaRastersHalfASampleBeyond) {
    const Heights raster(6, 4, [](double x, double y) { return 1 + x + 10 * y; });
    const Colours colours(
        6, 4, [](double x, double y) { return rgba(static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y), 0); });
    for (const Kernel kernel : {Kernel::nearest, Kernel::bilinear, Kernel::cubic}) {
        for (const double shrink : {1.0, 3.0}) {
            const ResampleRule points = raster.rule(kernel, shrink, shrink, false);
            const ResampleRule areas = raster.rule(kernel, shrink, shrink, true);
            EXPECT_EQ(sample(raster, points, 5 + 1e-7, 3), 36);
            EXPECT_EQ(sample(raster, points, -1e-7, -1e-7), 1);
            EXPECT_TRUE(std::isnan(sample(raster, points, 5 + 1e-5, 3)));
            EXPECT_TRUE(std::isnan(sample(raster, points, 5, -1e-5)));
            EXPECT_EQ(sample(raster, areas, 5.5, 3.5), 36);
            EXPECT_EQ(sample(raster, areas, -0.5 - 1e-7, 0), 1);
            EXPECT_TRUE(std::isnan(sample(raster, areas, 2, 3.5 + 1e-5)));
            EXPECT_TRUE(std::isnan(sample(raster, areas, -0.5 - 1e-5, 2)));
            EXPECT_EQ(sample(colours, points, 5 + 1e-5, 3), 0U);
            EXPECT_NE(sample(colours, areas, 5.5, 3), 0U);
            EXPECT_EQ(sample(colours, areas, 5.6, 3), 0U);
        }
    }
}

TEST(Resample, NowhereIsVoid) {
    const Heights raster(4, 4, [](double, double) { return 1.0; });
    const Colours colours(4, 4, [](double, double) { return rgba(1, 2, 3); });
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    for (const double bad : {kVoid, kInfinity, -kInfinity, 1e300, -1e300}) {
        EXPECT_TRUE(std::isnan(sample(raster, raster.rule(Kernel::cubic), bad, 1)));
        EXPECT_TRUE(std::isnan(sample(raster, raster.rule(Kernel::bilinear), 1, bad)));
        EXPECT_EQ(sample(colours, colours.rule(Kernel::bilinear), bad, 1), 0U);
    }
    EXPECT_TRUE(std::isnan(sample(raster, {Kernel::bilinear, {}, true, 0, 0}, 0, 0)));
}

TEST(Resample, RastersOfOneSampleHaveOneValue) {
    const Heights raster(1, 1, [](double, double) { return 7.0; });
    for (const double shrink : kShrinks) {
        EXPECT_EQ(sample(raster, raster.rule(Kernel::bilinear, shrink, shrink, true), 0.25, -0.5), 7);
        EXPECT_EQ(sample(raster, raster.rule(Kernel::cubic, shrink, shrink, true), 0, 0), 7);
    }
}

TEST(Resample, AWindowWithTheReachOfTheKernelSaysWhatTheRasterSays) {
    SCREE_TRACE_SEED();
    Random random(test::seed());
    const Heights raster(40, 40, [&](double, double) { return random() % 9 == 0 ? kVoid : real(random, 0, 1); });
    const Colours colours(40, 40, [&](double, double) {
        return static_cast<std::uint32_t>(random()) | (random() % 4 == 0 ? 0 : 0xff000000U);
    });
    for (const Kernel kernel : {Kernel::nearest, Kernel::bilinear, Kernel::cubic}) {
        for (const double shrink : kShrinks) {
            const std::int64_t reach = kernel_reach(kernel, shrink);
            for (int n = 0; n < 100; ++n) {
                const double u = real(random, 0, 39), v = real(random, 0, 39);
                const auto left = static_cast<std::int64_t>(std::floor(u)) - reach + (u == std::floor(u) ? 0 : 1);
                const auto top = static_cast<std::int64_t>(std::floor(v)) - reach + (v == std::floor(v) ? 0 : 1);
                const std::int64_t size = 2 * reach;
                std::vector<double> heights;
                std::vector<std::uint32_t> pixels;
                for (std::int64_t r = top; r < top + size; ++r) {
                    for (std::int64_t c = left; c < left + size; ++c) {
                        const bool inside = c >= 0 && r >= 0 && c < 40 && r < 40;
                        const auto index = static_cast<std::size_t>(r * 40 + c);
                        heights.push_back(inside ? raster.values[index] : kVoid);
                        pixels.push_back(inside ? colours.values[index] : 0);
                    }
                }
                const ResampleRule rule = raster.rule(kernel, shrink, shrink);
                const double whole = sample(raster, rule, u, v);
                const double part = sample({left, top, size, size, heights}, rule, u, v);
                ASSERT_TRUE(whole == part || (std::isnan(whole) && std::isnan(part))) << u << " " << v << " " << shrink;
                ASSERT_EQ(sample(colours, rule, u, v), sample({left, top, size, size, pixels}, rule, u, v));
            }
        }
    }
}

TEST(Resample, UniformColourStaysWhatItIs) {
    SCREE_TRACE_SEED();
    Random random(test::seed());
    for (const Kernel kernel : {Kernel::nearest, Kernel::bilinear, Kernel::cubic}) {
        for (const double shrink : kShrinks) {
            const std::uint32_t colour = static_cast<std::uint32_t>(random()) | 0xff000000U;
            const Colours raster(9, 9, [&](double, double) { return colour; });
            for (int n = 0; n < 50; ++n) {
                ASSERT_EQ(sample(raster, raster.rule(kernel, shrink, shrink), real(random, 0, 8), real(random, 0, 8)),
                          colour);
            }
        }
    }
}

TEST(Resample, OpaqueColoursAreTheBilinearMeanToWithinRounding) {
    SCREE_TRACE_SEED();
    Random random(test::seed());
    const Colours raster(9, 9, [&](double, double) { return static_cast<std::uint32_t>(random()) | 0xff000000U; });
    for (int n = 0; n < 500; ++n) {
        const double u = real(random, 0, 8), v = real(random, 0, 8);
        const std::uint32_t got = sample(raster, raster.rule(Kernel::bilinear), u, v);
        for (int k = 0; k < 3; ++k) {
            const Heights one(9, 9, [&](double x, double y) {
                return channel(raster.values[static_cast<std::size_t>(y * 9 + x)], k);
            });
            ASSERT_NEAR(channel(got, k), sample(one, one.rule(Kernel::bilinear), u, v), 0.57);
        }
        ASSERT_EQ(channel(got, 3), 255);
    }
}

TEST(Resample, OpaqueColoursAreTheCubicMeanToWithinRounding) {
    SCREE_TRACE_SEED();
    Random random(test::seed());
    const Colours raster(12, 12, [&](double, double) { return static_cast<std::uint32_t>(random()) | 0xff000000U; });
    for (int n = 0; n < 500; ++n) {
        const double u = real(random, 0, 11), v = real(random, 0, 11);
        const std::uint32_t got = sample(raster, raster.rule(Kernel::cubic), u, v);
        for (int k = 0; k < 3; ++k) {
            const Heights one(12, 12, [&](double x, double y) {
                return channel(raster.values[static_cast<std::size_t>(y * 12 + x)], k);
            });
            const double expected = std::clamp(sample(one, one.rule(Kernel::cubic), u, v), 0.0, 255.0);
            ASSERT_NEAR(channel(got, k), expected, 0.57);
        }
        ASSERT_EQ(channel(got, 3), 255);
    }
}

TEST(Resample, OpaqueColoursThatShrinkAreTheMeanOfTheirAreaToWithinRounding) {
    SCREE_TRACE_SEED();
    Random random(test::seed());
    const Colours raster(90, 90, [&](double, double) { return static_cast<std::uint32_t>(random()) | 0xff000000U; });
    for (const double across : {1.2, 3.0, 17.5, 31.9, 40.0}) {
        for (const double down : {1.0, 2.7, 31.9}) {
            for (int n = 0; n < 20; ++n) {
                const double u = real(random, 20, 69), v = std::floor(real(random, 20, 69));
                std::array<double, 3> sum{};
                const double high = down > 1 ? down : 1;  // on a row, where nothing is between rows
                for (std::int64_t r = 0; r < 90; ++r) {
                    for (std::int64_t c = 0; c < 90; ++c) {
                        const auto x = static_cast<double>(c), y = static_cast<double>(r);
                        const double wide = std::min(x + 0.5, u + across / 2) - std::max(x - 0.5, u - across / 2);
                        const double tall = std::min(y + 0.5, v + high / 2) - std::max(y - 0.5, v - high / 2);
                        if (wide <= 0 || tall <= 0) continue;
                        for (int k = 0; k < 3; ++k)
                            sum[static_cast<std::size_t>(k)] +=
                                wide * tall * channel(raster.values[static_cast<std::size_t>(r * 90 + c)], k);
                    }
                }
                const std::uint32_t got = sample(raster, raster.rule(Kernel::bilinear, across, down), u, v);
                for (int k = 0; k < 3; ++k)
                    ASSERT_NEAR(channel(got, k), sum[static_cast<std::size_t>(k)] / (across * high), 0.6)
                        << across << " x " << down;
            }
        }
    }
}

// One by one, many at a time, and as lines that cross: on windows of a raster, around its rims and beyond them.
TEST(Resample, PointsGetTheSameColourAloneTogetherAndInLines) {
    SCREE_TRACE_SEED();
    Random random(test::seed());
    for (int round = 0; round < 600; ++round) {
        const int wide = test::uniform(random, 1, 40), high = test::uniform(random, 1, 40);
        const int holes = test::uniform(random, 0, 2) == 0 ? test::uniform(random, 1, 20) : 0;
        const Colours raster(wide, high, [&](double, double) {
            const auto colour = static_cast<std::uint32_t>(random());
            if (test::uniform(random, 1, 100) > holes) return colour | 0xff000000U;
            return test::uniform(random, 0, 1) == 0 ? colour & 0x00ffffffU : colour;
        });
        const std::array<Kernel, 3> kernels{Kernel::nearest, Kernel::bilinear, Kernel::cubic};
        const auto shrink = [&] { return test::uniform(random, 0, 1) == 0 ? 1.0 : real(random, 0.5, 40); };
        const ResampleRule rule = raster.rule(kernels[static_cast<std::size_t>(test::uniform(random, 0, 2))], shrink(),
                                              shrink(), test::uniform(random, 0, 1) == 0);
        // From anywhere to anywhere, on samples now and then, in no order.
        std::vector<double> columns(static_cast<std::size_t>(test::uniform(random, 1, 19))),
            rows(static_cast<std::size_t>(test::uniform(random, 1, 9)));
        const double beyond = test::uniform(random, 0, 1) == 0 ? 0 : 1.5;
        const auto place = [&](std::vector<double>& line, int size) {
            for (double& at : line) {
                at = real(random, -beyond, size - 1 + beyond);
                const int kind = test::uniform(random, 0, 9);
                if (kind == 0) at = std::nearbyint(at);
                if (kind == 1) at = std::nearbyint(at * 4096) / 4096;
                if (kind == 2 && beyond > 0) at = kVoid;
            }
        };
        place(columns, wide);
        place(rows, high);
        std::vector<double> u, v;
        for (const double row : rows) {
            for (const double column : columns) {
                u.push_back(column);
                v.push_back(row);
            }
        }
        std::vector<std::uint32_t> alone, together(u.size()), lines(u.size());
        for (std::size_t k = 0; k < u.size(); ++k) alone.push_back(sample(raster, rule, u[k], v[k]));
        resample_colours(raster.window(), {u, v}, rule, together);
        resample_colour_lines(raster.window(), {columns, rows}, rule, lines);
        ASSERT_EQ(together, alone);
        ASSERT_EQ(lines, alone);
        for (const double at : columns) {
            const std::int64_t nearest = nearest_sample(at, wide, rule.half_sample_rim);
            const double rim = (rule.half_sample_rim ? 0.5 : 0) + 1e-6;
            if (at >= -rim && at <= wide - 1 + rim)
                ASSERT_LE(std::abs(static_cast<double>(nearest) - std::clamp(at, 0.0, wide - 1.0)), 0.5);
            else
                ASSERT_EQ(nearest, -1);
        }
    }
}

TEST(Resample, TransparentPixelsGiveNoColour) {
    Colours raster(2, 2, [](double, double) { return rgba(200, 100, 50); });
    raster.at(1, 0) = raster.at(1, 1) = rgba(0, 255, 0, 0);
    const std::uint32_t near = sample(raster, raster.rule(Kernel::bilinear), 0.25, 0);
    EXPECT_EQ(near, rgba(200, 100, 50, 191));
    EXPECT_EQ(sample(raster, raster.rule(Kernel::bilinear), 0.75, 0), 0U);
    EXPECT_EQ(sample(raster, raster.rule(Kernel::cubic), 0.25, 0), near);
    // Half as opaque, half the weight: (200 + 0.5 * 50) / 1.5.
    raster.at(1, 0) = raster.at(1, 1) = rgba(50, 100, 50, 128);
    EXPECT_NEAR(channel(sample(raster, raster.rule(Kernel::bilinear), 0.5, 0), 0), 150, 1);
}

}  // namespace
}  // namespace scree
