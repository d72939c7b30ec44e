#include "tools/pyramid/void_fill.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <set>

#include "tests/common/test_support.h"
#include "tools/pyramid/void_regions.h"
#include "tools/source/height_source.h"
#include "tools/source/image_source.h"

namespace scree {
namespace {

constexpr double kVoid = kVoidSample, kNone = kUncoveredSample;
constexpr std::int64_t kMemory = std::int64_t{8} << 20;

struct Raster {
    std::int64_t width = 0, height = 0;
    std::vector<double> values;

    Raster(std::int64_t w, std::int64_t h, double fill = 0)
        : width(w), height(h), values(static_cast<std::size_t>(w * h), fill) {}
    double& at(std::int64_t i, std::int64_t j) { return values[static_cast<std::size_t>(j * width + i)]; }
    double at(std::int64_t i, std::int64_t j) const { return values[static_cast<std::size_t>(j * width + i)]; }
    bool holds(std::int64_t i, std::int64_t j) const { return i >= 0 && j >= 0 && i < width && j < height; }
    template <class Height>
    void set(const Height& z) {
        for (std::int64_t j = 0; j < height; ++j)
            for (std::int64_t i = 0; i < width; ++i) at(i, j) = z(static_cast<double>(i), static_cast<double>(j));
    }
    template <class Inside>
    void cut(const Inside& inside, double with = kVoid) {
        for (std::int64_t j = 0; j < height; ++j)
            for (std::int64_t i = 0; i < width; ++i)
                if (inside(i, j)) at(i, j) = with;
    }
};

// '.' is 10, 'o' a void, '-' uncovered.
Raster drawn(const std::vector<std::string>& rows) {
    Raster r(static_cast<std::int64_t>(rows[0].size()), static_cast<std::int64_t>(rows.size()));
    r.set([&](double i, double j) {
        const char c = rows[static_cast<std::size_t>(j)][static_cast<std::size_t>(i)];
        return c == 'o' ? kVoid : c == '-' ? kNone : 10.0;
    });
    return r;
}

struct Filled {
    Raster raster;  // as read_samples gives it
    FillReport report;
};

Filled fill(const Raster& in, const FillRule& rule = {}, bool wide = true, std::int64_t memory = kMemory) {
    const test::TemporaryFolder folder;
    auto spool = HeightSpool::create(folder.file("heights"), in.width, in.height, wide);
    EXPECT_TRUE(spool);
    const auto width = static_cast<std::size_t>(in.width);
    for (std::int64_t j = 0; j < in.height; ++j)
        EXPECT_TRUE((*spool)->append(std::span(in.values).subspan(static_cast<std::size_t>(j) * width, width)));
    auto report = fill_interior_voids(**spool, rule, memory, {});
    EXPECT_TRUE(report);
    Filled out{Raster(in.width, in.height), *report};
    std::vector<std::uint8_t> valid(width);
    std::vector<double> row(width);
    for (std::int64_t j = 0; j < in.height; ++j) {
        const auto samples = std::span(out.raster.values).subspan(static_cast<std::size_t>(j) * width, width);
        EXPECT_TRUE((*spool)->read_samples(0, j, samples));
        EXPECT_TRUE((*spool)->read_row(j, row, valid));
        for (std::size_t i = 0; i < width; ++i) {
            EXPECT_EQ(valid[i] != 0, std::isfinite(samples[i]));
            if (valid[i] != 0) {
                EXPECT_EQ(row[i], samples[i]);
            }
        }
    }
    return out;
}

bool same(double a, double b) { return std::memcmp(&a, &b, 8) == 0 || (std::isnan(a) && std::isnan(b)) || a == b; }

// Everything that is not an interior void is as it was, and every filled sample is finite.
void expect_only_voids_changed(const Raster& before, const Raster& after) {
    for (std::size_t k = 0; k < before.values.size(); ++k) {
        if (std::isnan(before.values[k])) continue;
        ASSERT_TRUE(same(before.values[k], after.values[k])) << "sample " << k;
    }
}

// --- the oracle: flood fill, one sample at a time ---

struct Flood {
    std::vector<int> label;  // -1: not a void
    struct Region {
        std::int64_t voids = 0, west = 1 << 30, east = -1, north = 1 << 30, south = -1;
        bool outside = false;
        double low = INFINITY, high = -INFINITY;  // over its eight-neighbour rim
    };
    std::vector<Region> regions;
};

Flood flood(const Raster& r) {
    Flood f;
    f.label.assign(r.values.size(), -1);
    const auto index = [&](std::int64_t i, std::int64_t j) { return static_cast<std::size_t>(j * r.width + i); };
    for (std::int64_t j = 0; j < r.height; ++j)
        for (std::int64_t i = 0; i < r.width; ++i) {
            if (!std::isnan(r.at(i, j)) || f.label[index(i, j)] >= 0) continue;
            const int label = static_cast<int>(f.regions.size());
            Flood::Region region;
            std::vector<std::pair<std::int64_t, std::int64_t>> todo{{i, j}};
            f.label[index(i, j)] = label;
            while (!todo.empty()) {
                const auto [x, y] = todo.back();
                todo.pop_back();
                ++region.voids;
                region.west = std::min(region.west, x), region.east = std::max(region.east, x);
                region.north = std::min(region.north, y), region.south = std::max(region.south, y);
                for (std::int64_t dy = -1; dy <= 1; ++dy)
                    for (std::int64_t dx = -1; dx <= 1; ++dx) {
                        if (!r.holds(x + dx, y + dy)) {
                            region.outside = true;
                            continue;
                        }
                        const double v = r.at(x + dx, y + dy);
                        if (v == kNone) region.outside = true;
                        if (std::isfinite(v))
                            region.low = std::min(region.low, v), region.high = std::max(region.high, v);
                        if (!std::isnan(v) || f.label[index(x + dx, y + dy)] >= 0) continue;
                        f.label[index(x + dx, y + dy)] = label;
                        todo.emplace_back(x + dx, y + dy);
                    }
            }
            f.regions.push_back(region);
        }
    return f;
}

// Filled are exactly the interior voids, within the range of their rims; the report counts them.
void expect_filled_as_flooded(const Raster& before, const Filled& filled) {
    const Flood f = flood(before);
    std::int64_t regions = 0, samples = 0, outside = 0;
    for (const auto& region : f.regions) {
        if (region.outside) outside += region.voids;
        if (!region.outside) ++regions, samples += region.voids;
    }
    EXPECT_EQ(filled.report.filled_regions, regions);
    EXPECT_EQ(filled.report.filled_samples, samples);
    EXPECT_EQ(filled.report.outside_samples, outside);
    EXPECT_EQ(filled.report.outside_regions > 0, outside > 0);
    EXPECT_EQ(filled.report.too_large_regions, 0);
    double low = INFINITY, high = -INFINITY;
    for (std::size_t k = 0; k < before.values.size(); ++k) {
        const double v = filled.raster.values[k];
        if (f.label[k] < 0 || f.regions[static_cast<std::size_t>(f.label[k])].outside) {
            ASSERT_TRUE(same(before.values[k], v)) << "sample " << k;
            continue;
        }
        const auto& region = f.regions[static_cast<std::size_t>(f.label[k])];
        ASSERT_GE(v, region.low) << "sample " << k;
        ASSERT_LE(v, region.high) << "sample " << k;
        low = std::min(low, v), high = std::max(high, v);
    }
    if (samples > 0) {
        EXPECT_EQ(filled.report.min_raw, low);
        EXPECT_EQ(filled.report.max_raw, high);
    }
}

// --- regions ---

TEST(VoidRegions, AgreeWithAFloodFillOfRandomRasters) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int round = 0; round < 400; ++round) {
        Raster r(test::uniform(random, 1, 60), test::uniform(random, 1, 40), 1);
        const int percent = test::uniform(random, 0, 80), rows_full = test::uniform(random, 0, 3);
        for (std::int64_t j = 0; j < r.height; ++j)
            for (std::int64_t i = 0; i < r.width; ++i)
                if (j % 4 >= rows_full && test::uniform(random, 0, 99) < percent) r.at(i, j) = kVoid;
        using Box = std::tuple<std::int64_t, std::int64_t, std::int64_t, std::int64_t, std::int64_t, bool>;
        std::multiset<Box> expected, found;
        for (const auto& f : flood(r).regions) expected.insert({f.west, f.east, f.north, f.south, f.voids, f.outside});
        VoidRegions regions(r.width, r.height);
        const auto take = [&](std::span<const VoidRegion> closed) {
            for (const VoidRegion& v : closed) {
                found.insert({v.west, v.east, v.north, v.south, v.voids, v.outside});
                EXPECT_TRUE(std::isnan(r.at(v.first, v.north)));
            }
        };
        for (std::int64_t j = 0; j < r.height; ++j) {
            const auto row = std::span<const double>(r.values).subspan(static_cast<std::size_t>(j * r.width),
                                                                       static_cast<std::size_t>(r.width));
            take(regions.add_row(j, row));
        }
        take(regions.add_valid_row());
        ASSERT_EQ(found, expected) << "round " << round;
    }
}

// --- which voids ---

TEST(VoidFill, FillsWhatAFloodFillCallsInteriorInRandomRasters) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    std::int64_t filled_in_all = 0;
    for (int round = 0; round < 400; ++round) {
        Raster r(test::uniform(random, 1, 70), test::uniform(random, 1, 50));
        for (double& v : r.values) v = test::uniform(random, -100000, 100000) / 16.0;
        const int percent = test::uniform(random, 0, 45), none_percent = test::uniform(random, 0, 3),
                  patch = test::uniform(random, 1, 6);
        for (std::int64_t j = 0; j < r.height; j += patch)
            for (std::int64_t i = 0; i < r.width; i += patch) {
                const int dice = test::uniform(random, 0, 99);
                for (std::int64_t y = j; y < std::min(j + patch, r.height); ++y)
                    for (std::int64_t x = i; x < std::min(i + patch, r.width); ++x)
                        if (dice < percent) r.at(x, y) = dice < none_percent ? kNone : kVoid;
            }
        const std::int64_t memory = round % 3 == 0 ? 0 : kMemory;
        const Filled filled = fill(r, {}, round % 2 == 0, memory);
        expect_filled_as_flooded(r, filled);
        filled_in_all += filled.report.filled_samples;
    }
    EXPECT_GT(filled_in_all, 5000);
}

TEST(VoidFill, VoidsAtTheBorderStay) {
    const Raster r = drawn({"..o....",  //
                            "..oo...",  //
                            "....o..",  //
                            "o......",  //
                            "......o",  //
                            ".o.....",  //
                            "o...o.."});
    const Filled filled = fill(r);
    EXPECT_EQ(filled.report.filled_samples, 0);
    EXPECT_EQ(filled.report.outside_regions, 5);
    EXPECT_EQ(filled.report.outside_samples, 9);
    for (std::size_t k = 0; k < r.values.size(); ++k) EXPECT_TRUE(same(r.values[k], filled.raster.values[k]));
}

TEST(VoidFill, VoidsBesideUncoveredSamplesStayAndTheirNeighboursAreFilled) {
    const Raster r = drawn({".........",  //
                            ".oo...o..",  //
                            "...-.....",  //
                            "......o..",  //
                            "........."});
    const Filled filled = fill(r);
    EXPECT_EQ(filled.report.filled_regions, 2);
    EXPECT_EQ(filled.report.outside_regions, 1);
    EXPECT_EQ(filled.report.outside_samples, 2);
    EXPECT_TRUE(std::isnan(filled.raster.at(1, 1)));
    EXPECT_EQ(filled.raster.at(3, 2), kNone);
    EXPECT_EQ(filled.raster.at(6, 1), 10);
    EXPECT_EQ(filled.raster.at(6, 3), 10);
}

TEST(VoidFill, DiagonalNeighboursAreOneVoid) {
    const Raster r = drawn({".......",  //
                            ".o...o.",  //
                            "..o.o..",  //
                            "...o...",  //
                            ".......",  //
                            "......."});
    EXPECT_EQ(fill(r).report.filled_regions, 1);
    const Raster to_border = drawn({".......",  //
                                    ".o...o.",  //
                                    "..o.o.o",  //
                                    "...o...",  //
                                    ".......",  //
                                    "......."});
    EXPECT_EQ(fill(to_border).report.filled_regions, 0);
    EXPECT_EQ(fill(to_border).report.outside_regions, 1);
}

TEST(VoidFill, ARasterWithoutVoidsIsNotRead) {
    const Raster r(40, 30, 5);
    const Filled filled = fill(r);
    EXPECT_EQ(filled.report.filled_regions, 0);
    EXPECT_EQ(filled.report.min_raw, 0);
    EXPECT_EQ(filled.raster.values, r.values);
}

// --- what with ---

double plane(double i, double j) { return 1000 + 0.75 * i - 0.31 * j; }

void expect_plane_restored(Raster r, const char* what) {
    const Filled filled = fill(r);
    expect_filled_as_flooded(r, filled);
    EXPECT_GT(filled.report.filled_samples, 0);
    double worst = 0;
    for (std::int64_t j = 0; j < r.height; ++j)
        for (std::int64_t i = 0; i < r.width; ++i)
            worst = std::max(worst,
                             std::abs(filled.raster.at(i, j) - plane(static_cast<double>(i), static_cast<double>(j))));
    EXPECT_LT(worst, 1e-4) << what;  // of heights that differ by some 300
}

TEST(VoidFill, PlanesAreRestoredThroughHolesOfEveryShape) {
    Raster r(331, 301);
    r.set(plane);
    Raster square = r, disc = r, ring = r, spiral = r, comb = r, sieve = r;
    square.cut([](auto i, auto j) { return i > 20 && i < 310 && j > 10 && j < 280; });
    expect_plane_restored(square, "square");
    disc.cut([](auto i, auto j) { return (i - 160) * (i - 160) + (j - 150) * (j - 150) < 140 * 140; });
    expect_plane_restored(disc, "disc");
    ring.cut([](auto i, auto j) {
        const auto d = (i - 160) * (i - 160) + (j - 150) * (j - 150);
        return d < 140 * 140 && d > 0;
    });
    expect_plane_restored(ring, "ring around an island of one sample");
    spiral.cut([](auto i, auto j) {
        const double x = static_cast<double>(i) - 165, y = static_cast<double>(j) - 150, d = std::hypot(x, y);
        return d < 140 && std::fmod(d + 9 * std::atan2(y, x) / std::acos(-1.0) + 36, 18) < 13;
    });
    expect_plane_restored(spiral, "spiral");
    comb.cut([](auto i, auto j) { return i > 5 && i < 320 && j > 5 && j < 290 && (j < 12 || i % 3 != 0); });
    expect_plane_restored(comb, "comb");
    sieve.cut([](auto i, auto j) { return i > 5 && i < 320 && j > 5 && j < 290 && (i % 5 != 0 || j % 7 != 0); });
    expect_plane_restored(sieve, "sieve");
}

// x^2 - y^2 solves the five-point equation exactly; x^2 + y^2 does not, and the membrane lies above it by less than the
// hole's depth.
TEST(VoidFill, HarmonicQuadricsAreRestoredAndOthersStayWithinTheRim) {
    Raster saddle(160, 150);
    saddle.set([](double i, double j) { return (i - 70) * (i - 70) - (j - 80) * (j - 80); });
    const Raster truth = saddle;
    saddle.cut([](auto i, auto j) { return i > 4 && i < 150 && j > 9 && j < 140 && !(i == 77 && j == 33); });
    const Filled filled = fill(saddle);
    for (std::size_t k = 0; k < truth.values.size(); ++k)
        ASSERT_NEAR(filled.raster.values[k], truth.values[k], 2e-3) << k;  // of 12000

    Raster bowl(90, 80);
    bowl.set([](double i, double j) { return (i - 40) * (i - 40) + (j - 35) * (j - 35); });
    const Raster deep = bowl;
    bowl.cut([](auto i, auto j) { return (i - 40) * (i - 40) + (j - 35) * (j - 35) < 900; });
    const Filled flat = fill(bowl);
    expect_filled_as_flooded(bowl, flat);
    EXPECT_GT(flat.raster.at(40, 35), 890);
    EXPECT_GT(flat.raster.at(40, 35), deep.at(40, 35));
}

TEST(VoidFill, EverySampleOfASmoothFillIsTheMeanOfItsFourNeighbours) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int round = 0; round < 12; ++round) {
        Raster r(test::uniform(random, 60, 260), test::uniform(random, 60, 260));
        for (double& v : r.values) v = test::uniform(random, 0, 1000);
        for (int blob = 0; blob < 12; ++blob) {
            const int x = test::uniform(random, 20, 200), y = test::uniform(random, 20, 200),
                      size = test::uniform(random, 1, 50);
            r.cut([&](auto i, auto j) {
                return i > 0 && j > 0 && i < r.width - 1 && j < r.height - 1 &&
                       std::abs(i - x) + 2 * std::abs(j - y) < size && (i * 7 + j * 3) % 31 != 0;
            });
        }
        const Filled filled = fill(r);
        expect_filled_as_flooded(r, filled);
        const Raster& f = filled.raster;
        for (std::int64_t j = 1; j + 1 < r.height; ++j)
            for (std::int64_t i = 1; i + 1 < r.width; ++i)
                if (std::isnan(r.at(i, j))) {
                    ASSERT_NEAR(f.at(i, j), (f.at(i - 1, j) + f.at(i + 1, j) + f.at(i, j - 1) + f.at(i, j + 1)) / 4,
                                3e-4)
                        << i << ", " << j;
                }
    }
}

TEST(VoidFill, ASingleSampleIsTheMeanOfItsNeighbours) {
    Raster r(3, 3, 100);
    r.at(1, 1) = kVoid;
    r.at(0, 1) = 1;
    r.at(2, 1) = 2;
    r.at(1, 0) = 3;
    r.at(1, 2) = 6;
    EXPECT_EQ(fill(r).raster.at(1, 1), 3);
}

TEST(VoidFill, IntegerHeightsStayIntegers) {
    Raster r(50, 50);
    r.set([](double i, double j) { return std::floor(13 * std::sin(i / 5) + j * j / 40); });
    r.cut([](auto i, auto j) { return i > 5 && i < 40 && j > 8 && j < 45; });
    FillRule rule;
    rule.integer = true;
    const Filled filled = fill(r, rule, false);
    expect_filled_as_flooded(r, filled);
    const Filled exact = fill(r);
    for (std::size_t k = 0; k < r.values.size(); ++k) {
        ASSERT_EQ(filled.raster.values[k], std::round(filled.raster.values[k]));
        ASSERT_LE(std::abs(filled.raster.values[k] - exact.raster.values[k]), 0.5);
    }
}

TEST(VoidFill, AValueFillsInteriorVoidsAlone) {
    const Raster r = drawn({"o......",  //
                            "..o.oo.",  //
                            ".oo....",  //
                            "......."});
    FillRule rule{FillRule::Kind::value, -3.25, false};
    const Filled filled = fill(r, rule);
    expect_only_voids_changed(r, filled.raster);
    EXPECT_TRUE(std::isnan(filled.raster.at(0, 0)));
    EXPECT_EQ(filled.raster.at(2, 1), -3.25);
    EXPECT_EQ(filled.raster.at(5, 1), -3.25);
    EXPECT_EQ(filled.report.filled_samples, 5);
    EXPECT_EQ(filled.report.min_raw, -3.25);
    EXPECT_EQ(filled.report.max_raw, -3.25);
    rule.integer = true;
    EXPECT_EQ(fill(r, rule).raster.at(2, 1), -3);
}

TEST(VoidFill, NoneLeavesEveryVoid) {
    const Raster r = drawn({".....", "..o..", "....."});
    EXPECT_TRUE(std::isnan(fill(r, {FillRule::Kind::none}).raster.at(2, 1)));
}

TEST(VoidFill, HeightsWhoseDifferencesOverflowStayFinite) {
    Raster r(5, 5, 1.7e308);
    r.at(1, 2) = r.at(2, 1) = -1.7e308;
    r.at(2, 2) = r.at(3, 2) = kVoid;
    const Filled filled = fill(r);
    expect_filled_as_flooded(r, filled);
}

// --- limits, memory, rows ---

TEST(VoidFill, WindowsAboveTheLimitStayAndAreReported) {
    Raster r(2051, 2060);
    r.set(plane);
    // Two lines that cross the raster: a window of exactly the limit, and one a row more.
    Raster fits = r;
    fits.cut([](auto i, auto j) { return i == j && i >= 1 && i <= 2046; });
    EXPECT_EQ(fill(fits).report.filled_samples, 2046);
    Raster exceeds = r;
    exceeds.cut([](auto i, auto j) { return i == std::min<std::int64_t>(j, 2046) && j >= 1 && j <= 2047; });
    exceeds.at(2000, 5) = kVoid;
    const Filled filled = fill(exceeds);
    EXPECT_EQ(filled.report.filled_samples, 1) << "a void in its box that is not of it";
    EXPECT_EQ(filled.report.too_large_regions, 1);
    EXPECT_EQ(filled.report.too_large_samples, 2047);
    EXPECT_EQ(filled.report.largest_left.west, 1);
    EXPECT_EQ(filled.report.largest_left.north, 1);
    EXPECT_EQ(filled.report.largest_left.width, 2046);
    EXPECT_EQ(filled.report.largest_left.height, 2047);
    EXPECT_TRUE(std::isnan(filled.raster.at(700, 700)));
}

TEST(VoidFill, MemoryChangesNoValue) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    Raster r(300, 400);
    for (double& v : r.values) v = test::uniform(random, 0, 1000);
    for (int blob = 0; blob < 300; ++blob) {
        const int x = test::uniform(random, 0, 300), y = test::uniform(random, 0, 400),
                  size = test::uniform(random, 1, 25);
        const bool tall = test::uniform(random, 0, 4) == 0;
        r.cut([&](auto i, auto j) { return (tall ? 12 : 1) * std::abs(i - x) + std::abs(j - y) < size; },
              blob % 20 == 0 ? kNone : kVoid);
    }
    const Filled least = fill(r, {}, false, 0);
    expect_filled_as_flooded(r, least);
    EXPECT_GT(least.report.filled_regions, 20);
    for (const std::int64_t memory : {std::int64_t{1} << 14, std::int64_t{1} << 17, std::int64_t{1} << 30}) {
        const Filled more = fill(r, {}, false, memory);
        for (std::size_t k = 0; k < r.values.size(); ++k)
            ASSERT_TRUE(same(least.raster.values[k], more.raster.values[k])) << "sample " << k << ", memory " << memory;
        EXPECT_EQ(least.report.filled_regions, more.report.filled_regions);
    }
}

TEST(VoidFill, SupportUnderRemainingVoidsUsesFilledSamples) {
    const test::TemporaryFolder folder;
    auto spool = HeightSpool::create(folder.file("heights"), 6, 4, false);
    ASSERT_TRUE(spool);
    const double v = kVoid;
    for (const auto& row : std::vector<std::vector<double>>{
             {v, v, v, v, v, v}, {8, 8, 8, 8, 8, 8}, {8, 8, v, 8, v, kNone}, {8, 8, 8, 8, 8, v}})
        ASSERT_TRUE((*spool)->append(row));
    std::vector<double> values(6);
    std::vector<std::uint8_t> valid(6);
    ASSERT_TRUE((*spool)->read_row(2, values, valid));
    ASSERT_TRUE(fill_interior_voids(**spool, {FillRule::Kind::value, 2}, kMemory, {}));
    ASSERT_TRUE((*spool)->read_row(2, values, valid));
    EXPECT_EQ(values, (std::vector<double>{8, 8, 2, 8, 8, 8}));
    EXPECT_EQ(valid, (std::vector<std::uint8_t>{1, 1, 1, 1, 0, 0}));
    ASSERT_TRUE((*spool)->read_row(0, values, valid));
    EXPECT_EQ(values, std::vector<double>(6, 8));
}

TEST(VoidFill, StopsWheneverToldTo) {
    const test::TemporaryFolder folder;
    int asked = 0, stop_at = 0;
    bool stopped = true;
    for (; stopped; ++stop_at) {
        auto spool = HeightSpool::create(folder.file("heights"), 200, 200, false);
        ASSERT_TRUE(spool);
        for (int j = 0; j < 200; ++j) {
            std::vector<double> row(200, 3 * j);
            if (j > 0 && j < 199) std::fill(row.begin() + 1, row.end() - 1, kVoid);
            ASSERT_TRUE((*spool)->append(row));
        }
        asked = 0;
        auto filled = fill_interior_voids(**spool, {}, kMemory, [&] { return asked++ < stop_at; });
        stopped = !filled;
        if (stopped) {
            EXPECT_EQ(filled.error().code, ErrorCode::interrupted);
        }
    }
    EXPECT_GT(stop_at, 5) << "a large void is not one step";
}

// --- real voids ---

TEST(VoidFill, RadarShadowsOfRainierAndFujiAreFilledWithinTheirRims) {
    const char* root = std::getenv("SCREE_DATA");
    if (root == nullptr) GTEST_SKIP() << "needs the folder that $SCREE_DATA names";
    for (const char* name : {"mt_rainier_90m.tif", "mt_fuji_90m.tif"}) {
        auto dem = open_heights(std::string(root) + "/srtm_void/" + name, {});
        ASSERT_TRUE(dem) << dem.error().message;
        const ImageInfo& info = (*dem)->info();
        Raster r(info.width, info.height);
        ASSERT_TRUE((*dem)->read_channel(0, info.height, std::span<double>(r.values)));
        VoidRule(info, {}).apply(r.values);
        FillRule rule;
        rule.integer = true;
        const Filled filled = fill(r, rule, false);
        expect_filled_as_flooded(r, filled);
        EXPECT_GT(filled.report.filled_samples, 0) << name;
        RecordProperty(name, std::to_string(filled.report.filled_samples));
    }
}

}  // namespace
}  // namespace scree
