#include "tools/source/warp_map.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <proj.h>

#include "tests/common/test_support.h"
#include "tools/source/resample.h"

namespace scree {
namespace {

using test::Random;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

double real(Random& random, double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
}

Crs crs(const std::string& text) {
    Result<Crs> parsed = Crs::parse(text);
    EXPECT_TRUE(parsed.ok()) << parsed.error().message;
    return *parsed;
}

struct Point {
    double x, y;
};

/// PROJ itself, by its own choice of operation: the CRS of these tests have but one between them.
class DirectTransform {
public:
    DirectTransform(const std::string& from, const std::string& to) : context_(proj_context_create()) {
        proj_context_set_enable_network(context_, 0);
        PJ* const plain = proj_create_crs_to_crs(context_, from.c_str(), to.c_str(), nullptr);
        operation_ = proj_normalize_for_visualization(context_, plain);
        proj_destroy(plain);
    }
    ~DirectTransform() {
        proj_destroy(operation_);
        proj_context_destroy(context_);
    }
    DirectTransform(const DirectTransform&) = delete;
    DirectTransform& operator=(const DirectTransform&) = delete;

    Point operator()(Point p) const {
        const PJ_COORD out = proj_trans(operation_, PJ_FWD, proj_coord(p.x, p.y, 0, 0));
        return {out.xy.x, out.xy.y};
    }

private:
    PJ_CONTEXT* context_;
    PJ* operation_ = nullptr;
};

struct Mapped {
    std::int64_t columns;
    std::vector<double> column, row;

    Mapped(const WarpMap& map, std::int64_t i0, std::int64_t j0, std::int64_t wide, std::int64_t high)
        : columns(wide), column(static_cast<std::size_t>(wide * high), -1e99), row(column) {
        map.map(i0, j0, wide, high, {column, row});
    }
    std::size_t index(std::int64_t i, std::int64_t j) const { return static_cast<std::size_t>(j * columns + i); }
};

/// What is mapped lies within the bounds, and the bounds within what is mapped around it: up to the chunks' far
/// corners.
void check_bounds(const WarpMap& map, std::int64_t i0, std::int64_t j0, std::int64_t wide, std::int64_t high) {
    const auto least = [](const std::vector<double>& values) {
        double found = std::numeric_limits<double>::infinity();
        for (const double v : values) found = v < found ? v : found;
        return found;
    };
    const auto greatest = [&](std::vector<double> values) {
        for (double& v : values) v = -v;
        return -least(values);
    };
    const auto bounds = map.bounds(i0, j0, wide, high);
    const Mapped inner(map, i0, j0, wide, high);
    if (!bounds) {
        ASSERT_TRUE(std::isinf(least(inner.column)));
        return;
    }
    const auto close = [](double at) { return 1e-9 * std::max(1.0, std::abs(at)); };
    ASSERT_LE(bounds->west, least(inner.column) + close(bounds->west));
    ASSERT_GE(bounds->east, greatest(inner.column) - close(bounds->east));
    ASSERT_LE(bounds->north, least(inner.row) + close(bounds->north));
    ASSERT_GE(bounds->south, greatest(inner.row) - close(bounds->south));
    const Mapped outer(map, i0 - 64, j0 - 64, wide + 129, high + 129);
    ASSERT_GE(bounds->west, least(outer.column) - kWarpBoundSamples);
    ASSERT_LE(bounds->east, greatest(outer.column) + kWarpBoundSamples);
    ASSERT_GE(bounds->north, least(outer.row) - kWarpBoundSamples);
    ASSERT_LE(bounds->south, greatest(outer.row) + kWarpBoundSamples);
}

bool same(double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); }

WarpMap make(const TargetGrid& grid, const std::string& grid_crs, const Georeference& source,
             const std::string& source_crs, const WarpOptions& options = {}) {
    Result<WarpMap> map = WarpMap::make(grid, crs(grid_crs), source, crs(source_crs), options);
    EXPECT_TRUE(map.ok()) << map.error().message;
    return std::move(*map);
}

/// An affine placement with its middle sample at `middle`, of any direction; `step` units a sample.
Georeference random_place(Random& random, Point middle, double step, std::int64_t columns, std::int64_t rows) {
    Georeference out;
    if (test::uniform(random, 0, 1) == 0) {
        out.column_x = step * (test::uniform(random, 0, 3) == 0 ? -1 : 1);
        out.row_y = step * real(random, 0.5, 2) * (test::uniform(random, 0, 3) == 0 ? 1 : -1);
    } else {
        const double angle = real(random, 0, 6.28);
        out.column_x = step * std::cos(angle);
        out.column_y = step * std::sin(angle);
        out.row_x = step * (1.3 * std::sin(angle) + 0.1);
        out.row_y = -1.3 * step * std::cos(angle);
    }
    out.first_x = out.first_y = 0;
    const double c = static_cast<double>(columns - 1) / 2, r = static_cast<double>(rows - 1) / 2;
    const double x = out.x(c, r), y = out.y(c, r);
    out.first_x = middle.x - x;
    out.first_y = middle.y - y;
    return out;
}

/// A CRS and where it is used.
struct Region {
    const char* crs;
    double unit_m;  ///< metres a unit, about
};
struct Setting {
    double west, south, east, north;
    std::vector<Region> crs;
};

const std::vector<Setting>& settings() {
    static const std::vector<Setting> kAll = {
        {120.2, 22, 121.8, 25, {{"EPSG:32651", 1}, {"EPSG:4326", 1e5}, {"EPSG:3826", 1}, {"EPSG:3857", 1}}},
        {-1, 43, 6, 49, {{"EPSG:32631", 1}, {"EPSG:4326", 1e5}, {"EPSG:2154", 1}, {"EPSG:3857", 1}}},
        {-179.9, 70, 179.9, 89.99, {{"EPSG:3413", 1}, {"EPSG:4326", 1e5}, {"EPSG:3995", 1}}},
        {-179.9, -89.99, 179.9, -70, {{"EPSG:3031", 1}, {"EPSG:4326", 1e5}, {"EPSG:32761", 1}}},
        {179.9, -20, 180.1, -15, {{"EPSG:32601", 1}, {"EPSG:4326", 1e5}, {"EPSG:32660", 1}}},
    };
    return kAll;
}

/// Where grid point (i, j) lies in the source by PROJ, on whichever turn is nearest to `guess`.
Point exact_place(const DirectTransform& direct, const TargetGrid& grid, const Georeference& source, bool degrees,
                  std::int64_t i, std::int64_t j, Point guess) {
    Point p =
        direct({grid.x_m + static_cast<double>(i) * grid.step_m, grid.y_m - static_cast<double>(j) * grid.step_m});
    if (degrees) p.x += 360 * std::round((source.x(guess.x, guess.y) - p.x) / 360);
    const double dx = p.x - source.first_x, dy = p.y - source.first_y;
    const double det = source.column_x * source.row_y - source.row_x * source.column_y;
    return {(dx * source.row_y - dy * source.row_x) / det, (source.column_x * dy - source.column_y * dx) / det};
}

TEST(WarpMap, PointsAreWithinTheBoundOfProjsOwn) {
    SCREE_TRACE_SEED();
    Random random(test::seed());
    double worst = 0;
    for (int n = 0; n < 120; ++n) {
        const Setting& setting = settings()[static_cast<std::size_t>(n) % settings().size()];
        const auto pick = [&] {
            return setting
                .crs[static_cast<std::size_t>(test::uniform(random, 0, static_cast<int>(setting.crs.size()) - 1))];
        };
        const Region target = pick(), source = pick();
        if (target.unit_m > 1 || std::string(target.crs) == source.crs) continue;  // grids are metric
        const double lon = real(random, setting.west, setting.east), lat = real(random, setting.south, setting.north);
        const Point at = DirectTransform("EPSG:4326", target.crs)({lon, lat});
        const DirectTransform direct(target.crs, source.crs);
        const double step = std::pow(10, real(random, -1, 4.3));
        const TargetGrid grid{at.x, at.y, step};
        const Point middle = direct(at);
        if (!std::isfinite(middle.x)) continue;
        const Georeference place =
            random_place(random, middle, step * std::pow(2, real(random, -3, 3)) / source.unit_m, 1001, 901);
        const WarpMap map = make(grid, target.crs, place, source.crs, {1001, 901, nullptr});
        EXPECT_FALSE(map.exact());

        // The place itself lies in the middle of the raster; the turn is the right one.
        const Mapped centre(map, 0, 0, 1, 1);
        ASSERT_NEAR(centre.column[0], 500, 0.02) << target.crs << " " << source.crs;
        ASSERT_NEAR(centre.row[0], 450, 0.02);

        const std::int64_t i0 = test::uniform(random, -200, 100), j0 = test::uniform(random, -200, 100);
        const Mapped got(map, i0, j0, 100, 90);
        ASSERT_NO_FATAL_FAILURE(check_bounds(map, i0, j0, 100, 90));
        for (std::int64_t j = 0; j < 90; ++j) {
            for (std::int64_t i = 0; i < 100; ++i) {
                const std::size_t k = got.index(i, j);
                const Point want =
                    exact_place(direct, grid, place, source.unit_m > 1, i0 + i, j0 + j, {got.column[k], got.row[k]});
                if (!std::isfinite(want.x)) {
                    ASSERT_TRUE(std::isnan(got.column[k]) && std::isnan(got.row[k]));
                    continue;
                }
                const double apart = std::hypot(got.column[k] - want.x, got.row[k] - want.y);
                worst = std::max(worst, apart);
                ASSERT_LE(apart, kWarpBoundSamples)
                    << target.crs << " <- " << source.crs << " at " << lon << " " << lat << " step " << step;
            }
        }
    }
    EXPECT_GT(worst, kWarpBoundSamples / 100);  // something was interpolated
}

// Interpolation that is good everywhere would not notice a map of the wrong turn: the pole itself, and grids so coarse
// that the map is bent within a chunk.
TEST(WarpMap, CoarseGridsAroundPolesAndAcrossTheAntimeridianKeepTheBound) {
    for (const double step : {0.5, 50.0, 1000.0, 20000.0, 60000.0}) {
        for (const auto& [grid_crs, x, y] : {std::tuple{"EPSG:3413", 0.0, 0.0}, std::tuple{"EPSG:3031", 1.7, -0.3},
                                             std::tuple{"EPSG:3413", 40 * step, 40 * step}}) {
            const TargetGrid grid{x - 40 * step, y + 40 * step, step};
            Georeference world;
            world.first_x = -179.75;
            world.first_y = 89.75;
            world.column_x = 0.5;
            world.row_y = -0.5;
            const WarpMap map = make(grid, grid_crs, world, "EPSG:4326", {720, 360, nullptr});
            const DirectTransform direct(grid_crs, "EPSG:4326");
            const Mapped got(map, 0, 0, 81, 81);
            for (std::int64_t j = 0; j < 81; ++j) {
                for (std::int64_t i = 0; i < 81; ++i) {
                    const std::size_t k = got.index(i, j);
                    const Point want = exact_place(direct, grid, world, true, i, j, {got.column[k], got.row[k]});
                    if (!std::isfinite(want.x)) {
                        ASSERT_TRUE(std::isnan(got.column[k]));
                        continue;
                    }
                    ASSERT_GE(got.column[k], -0.5 - 1e-6);
                    ASSERT_LE(got.column[k], 719.5 + 1e-6);
                    // At the pole itself any longitude is right.
                    const double column = want.y < -0.4999999 || want.y > 359.4999999 ? got.column[k] : want.x;
                    ASSERT_LE(std::hypot(got.column[k] - column, got.row[k] - want.y), kWarpBoundSamples)
                        << grid_crs << " step " << step << " point " << i << " " << j;
                }
            }
        }
    }
}

// About the equator latitude is an odd function of Mercator's northing: right at the ends and in the middle of a chunk.
TEST(WarpMap, ErrorsThatVanishInTheMiddleOfAChunkAreSeen) {
    Georeference place;
    place.first_x = -10;
    place.first_y = 20;
    place.column_x = 0.1;
    place.row_y = -0.1;
    const TargetGrid grid{0, 32 * 5e4, 5e4};
    const WarpMap map = make(grid, "EPSG:3857", place, "EPSG:4326", {1000, 400, nullptr});
    const DirectTransform direct("EPSG:3857", "EPSG:4326");
    const Mapped got(map, 0, 0, 64, 64);
    for (std::int64_t j = 0; j < 64; ++j) {
        for (std::int64_t i = 0; i < 64; ++i) {
            const std::size_t k = got.index(i, j);
            const Point want = exact_place(direct, grid, place, true, i, j, {got.column[k], got.row[k]});
            ASSERT_LE(std::hypot(got.column[k] - want.x, got.row[k] - want.y), kWarpBoundSamples) << i << " " << j;
        }
    }
}

TEST(WarpMap, WhatIsAskedForTogetherDoesNotMatter) {
    SCREE_TRACE_SEED();
    Random random(test::seed());
    for (const auto& [grid_crs, x, y, step, source_crs, unit] :
         {std::tuple{"EPSG:32651", 3e5, 2.7e6, 30.0, "EPSG:3826", 1.0},
          std::tuple{"EPSG:3413", -3000.0, 2000.0, 90.0, "EPSG:4326", 1e5},
          std::tuple{"EPSG:3413", -3e5, 2e5, 9000.0, "EPSG:4326", 1e5},
          std::tuple{"EPSG:3857", -2.1e7, 2e6, 2e4, "EPSG:32601", 1.0}}) {
        const DirectTransform direct(grid_crs, source_crs);
        Point middle = direct({x + 50 * step, y - 50 * step});
        if (!std::isfinite(middle.x)) middle = {0, 0};
        const Georeference place = random_place(random, middle, step / unit, 400, 400);
        const WarpMap map = make({x, y, step}, grid_crs, place, source_crs, {400, 400, nullptr});
        const Mapped whole(map, -70, -10, 200, 150);
        for (int n = 0; n < 40; ++n) {
            const std::int64_t i = test::uniform(random, 0, 190), j = test::uniform(random, 0, 140);
            const std::int64_t columns = test::uniform(random, 1, 200 - static_cast<int>(i));
            const std::int64_t rows = test::uniform(random, 1, 150 - static_cast<int>(j));
            const Mapped part(map, i - 70, j - 10, columns, rows);
            for (std::int64_t q = 0; q < rows; ++q) {
                for (std::int64_t p = 0; p < columns; ++p) {
                    ASSERT_TRUE(same(part.column[part.index(p, q)], whole.column[whole.index(i + p, j + q)]));
                    ASSERT_TRUE(same(part.row[part.index(p, q)], whole.row[whole.index(i + p, j + q)]));
                }
            }
        }
    }
}

TEST(WarpMap, ThreadsGetWhatOneGets) {
    Georeference place;
    place.first_x = 120;
    place.first_y = 26;
    place.column_x = 1e-3;
    place.row_y = -1e-3;
    const WarpMap map = make({2e5, 2.8e6, 100}, "EPSG:32651", place, "EPSG:4326", {3000, 3000, nullptr});
    const Mapped alone(map, 0, 0, 640, 640);
    std::vector<std::thread> threads;
    std::array<bool, 4> good{};
    for (std::size_t t = 0; t < good.size(); ++t) {
        threads.emplace_back([&, t] {
            good[t] = true;
            for (std::int64_t n = 0; n < 40; ++n) {
                const std::int64_t chunk = (n * 7 + static_cast<std::int64_t>(t) * 13) % 100;
                const std::int64_t i = chunk % 10 * 64, j = chunk / 10 * 64;
                const Mapped part(map, i, j, 64, 64);
                for (std::int64_t q = 0; q < 64; ++q) {
                    for (std::int64_t p = 0; p < 64; ++p) {
                        good[t] = good[t] && part.column[part.index(p, q)] == alone.column[alone.index(i + p, j + q)] &&
                                  part.row[part.index(p, q)] == alone.row[alone.index(i + p, j + q)];
                    }
                }
                good[t] = good[t] && map.shrink_at(i, j).columns > 0;
            }
        });
    }
    for (std::thread& thread : threads) thread.join();
    for (const bool one : good) EXPECT_TRUE(one);
}

TEST(WarpMap, RastersLieWhereTheyLieOnWhicheverTurnTheirLongitudesAre) {
    const DirectTransform to_grid("EPSG:4326", "EPSG:32601");
    const Point corner = to_grid({179.8, -16});
    const TargetGrid grid{corner.x, corner.y, 100};
    for (const double first : {179.5, -180.5, 539.5}) {
        Georeference place;
        place.first_x = first;
        place.first_y = -15.5;
        place.column_x = 1.0 / 512;
        place.row_y = -1.0 / 512;
        for (const bool sized : {true, false}) {
            const WarpMap map =
                make(grid, "EPSG:32601", place, "EPSG:4326", sized ? WarpOptions{1024, 1024, nullptr} : WarpOptions{});
            const Mapped got(map, 0, 0, 400, 2);
            EXPECT_NEAR(got.column[0], 0.3 * 512, 0.02);
            EXPECT_NEAR(got.row[0], 0.5 * 512, 0.02);
            for (std::size_t i = 1; i < 400; ++i) ASSERT_NEAR(got.column[i] - got.column[i - 1], 0.48, 0.02);
            for (std::int64_t i = 0; i < 400; ++i) ASSERT_NEAR(map.shrink_at(i, 0).columns, 0.48, 0.02);
        }
    }
}

TEST(WarpMap, PointsJustWestOfARasterOfKnownSizeAreJustWestOfIt) {
    const Point corner = DirectTransform("EPSG:4326", "EPSG:32632")({8.9, 47});
    Georeference place;
    place.first_x = 9;
    place.first_y = 48;
    place.column_x = 0.01;
    place.row_y = -0.01;
    const WarpMap map = make({corner.x, corner.y, 100}, "EPSG:32632", place, "EPSG:4326", {100, 100, nullptr});
    EXPECT_NEAR(Mapped(map, 0, 0, 1, 1).column[0], -10, 0.02);
}

TEST(WarpMap, WithoutATransformPlacesAreExact) {
    SCREE_TRACE_SEED();
    Random random(test::seed());
    for (int n = 0; n < 200; ++n) {
        const Georeference place =
            random_place(random, {real(random, -1e7, 1e7), real(random, -1e7, 1e7)}, 10, 101, 101);
        const TargetGrid grid{real(random, -1e7, 1e7), real(random, -1e7, 1e7), real(random, 1, 30)};
        const WarpMap map = make(grid, "EPSG:32633", place, "EPSG:32633");
        ASSERT_TRUE(map.exact());
        const Mapped got(map, -3, 1000000, 5, 3);
        ASSERT_NO_FATAL_FAILURE(check_bounds(map, -3, 1000000, 5, 3));
        for (std::int64_t j = 0; j < 3; ++j) {
            for (std::int64_t i = 0; i < 5; ++i) {
                const std::size_t k = got.index(i, j);
                ASSERT_NEAR(place.x(got.column[k], got.row[k]), grid.x_m + static_cast<double>(i - 3) * grid.step_m,
                            1e-6);
                ASSERT_NEAR(place.y(got.column[k], got.row[k]),
                            grid.y_m - static_cast<double>(j + 1000000) * grid.step_m, 1e-6);
                if (!place.axis_aligned()) continue;
                ASSERT_EQ(got.column[k], got.column[got.index(i, 0)]);
                ASSERT_EQ(got.row[k], got.row[got.index(0, j)]);
            }
        }
    }
}

TEST(WarpMap, AGridOnTheSamplesMeetsThemToTheLastBitFarFromTheOrigin) {
    Georeference place;
    place.first_x = 1e7 + 0.0005;
    place.first_y = 9e6 - 0.25;
    place.column_x = 1e-3;
    place.row_y = -1e-3;
    const WarpMap map = make({place.first_x, place.first_y, 1e-3}, "EPSG:32633", place, "EPSG:32633");
    const Mapped got(map, 123456, 777777, 64, 64);
    for (std::int64_t j = 0; j < 64; ++j) {
        for (std::int64_t i = 0; i < 64; ++i) {
            ASSERT_EQ(got.column[got.index(i, j)], static_cast<double>(123456 + i));
            ASSERT_EQ(got.row[got.index(i, j)], static_cast<double>(777777 + j));
        }
    }
}

TEST(WarpMap, ShrinkIsSamplesAPoint) {
    Georeference place;
    place.column_x = 2;
    place.row_y = 0.5;  // south-up
    const WarpMap plain = make({0, 0, 10}, "EPSG:32633", place, "EPSG:32633");
    EXPECT_DOUBLE_EQ(plain.shrink_at(5, 5).columns, 5);
    EXPECT_DOUBLE_EQ(plain.shrink_at(5, 5).rows, 20);
    place = {};
    place.column_x = place.column_y = place.row_x = std::sqrt(0.5);
    place.row_y = -std::sqrt(0.5);
    EXPECT_NEAR(make({0, 0, 3}, "EPSG:32633", place, "EPSG:32633").shrink_at(0, 0).columns, 3, 1e-12);

    // A second of arc at 60 degrees: 30.9 m along the meridian, half of it across.
    const Point at = DirectTransform("EPSG:4326", "EPSG:32633")({15, 60});
    place = {};
    place.first_x = 14;
    place.first_y = 61;
    place.column_x = 1.0 / 3600;
    place.row_y = -1.0 / 3600;
    const WarpMap map = make({at.x, at.y, 30.9}, "EPSG:32633", place, "EPSG:4326", {7200, 7200, nullptr});
    EXPECT_NEAR(map.shrink_at(0, 0).columns, 2, 0.02);
    EXPECT_NEAR(map.shrink_at(0, 0).rows, 1, 0.02);
}

TEST(WarpMap, BeyondTheDomainIsNowhere) {
    // A transverse Mercator has nothing a quarter of a turn from its meridian on the equator.
    const DirectTransform direct("EPSG:3857", "EPSG:32633");
    const TargetGrid grid{8e6, 32e5, 1e5};
    Georeference place;
    place.column_x = 1e5;
    place.row_y = -1e5;
    const WarpMap map = make(grid, "EPSG:3857", place, "EPSG:32633", {400, 400, nullptr});
    const Mapped got(map, 0, 0, 64, 64);
    for (const std::int64_t i : {0, 20, 40, 64, 128}) ASSERT_NO_FATAL_FAILURE(check_bounds(map, i, 3, 20, 30));
    std::size_t nowhere = 0;
    for (std::int64_t j = 0; j < 64; ++j) {
        for (std::int64_t i = 0; i < 64; ++i) {
            const Point want =
                direct({grid.x_m + static_cast<double>(i) * 1e5, grid.y_m - static_cast<double>(j) * 1e5});
            const std::size_t k = got.index(i, j);
            ASSERT_EQ(std::isnan(got.column[k]), !std::isfinite(want.x));
            ASSERT_EQ(std::isnan(got.row[k]), !std::isfinite(want.x));
            if (!std::isfinite(want.x)) {
                ++nowhere;
                EXPECT_EQ(map.shrink_at(i, j).columns, 1);
            } else {
                ASSERT_NEAR(got.column[k], want.x / 1e5, kWarpBoundSamples);
            }
        }
    }
    EXPECT_GT(nowhere, 100U);
    EXPECT_LT(nowhere, 4000U);
}

TEST(WarpMap, PlacesAndGridsWithoutExtentAreRefused) {
    const Crs utm = crs("EPSG:32633");
    const auto refused = [&](const TargetGrid& grid, const Georeference& place) {
        const Result<WarpMap> map = WarpMap::make(grid, utm, place, utm);
        return !map.ok() && map.error().code == ErrorCode::input;
    };
    Georeference flat;
    flat.column_x = flat.row_x = 1;
    flat.column_y = flat.row_y = 2;
    Georeference lost;
    lost.first_x = kNaN;
    Georeference vast;
    vast.column_x = vast.row_y = 1e200;
    EXPECT_TRUE(refused({}, flat));
    EXPECT_TRUE(refused({}, lost));
    EXPECT_TRUE(refused({}, vast));
    EXPECT_TRUE(refused({0, 0, 0}, {}));
    EXPECT_TRUE(refused({0, 0, kNaN}, {}));
    EXPECT_TRUE(refused({std::numeric_limits<double>::infinity(), 0, 1}, {}));
    EXPECT_FALSE(refused({}, {}));
}

// Through the whole of it: an analytic surface in one CRS, sampled by a raster in another, read on a grid.
TEST(WarpMap, SurfacesComeThroughMapAndResampling) {
    SCREE_TRACE_SEED();
    Random random(test::seed());
    const double x0 = 3e5, y0 = 2.7e6;
    const auto surface = [&](double x, double y) {
        const double a = (x - x0) / 1e3, b = (y - y0) / 1e3;
        return 1000 + 120 * a - 70 * b + 3 * a * a - 2 * a * b;
    };
    for (const auto& [source_crs, unit] :
         {std::pair{"EPSG:3826", 1.0}, std::pair{"EPSG:4326", 1.1e5}, std::pair{"EPSG:3857", 1.0}}) {
        const DirectTransform to_source("EPSG:32651", source_crs), to_grid(source_crs, "EPSG:32651");
        const std::int64_t size = 300;
        const Georeference place = random_place(random, to_source({x0 + 700, y0 - 700}), 10 / unit, size, size);
        std::vector<double> values;
        for (std::int64_t r = 0; r < size; ++r) {
            for (std::int64_t c = 0; c < size; ++c) {
                const Point p = to_grid({place.x(static_cast<double>(c), static_cast<double>(r)),
                                         place.y(static_cast<double>(c), static_cast<double>(r))});
                values.push_back(surface(p.x, p.y));
            }
        }
        const WarpMap map = make({x0, y0, 10}, "EPSG:32651", place, source_crs, {size, size, nullptr});
        const Mapped got(map, 0, 0, 128, 128);
        std::vector<double> heights(std::size_t{128} * 128);
        resample_heights({0, 0, size, size, values}, {const_cast<Mapped&>(got).column, const_cast<Mapped&>(got).row},
                         {Kernel::bilinear, map.shrink_at(64, 64), false, size, size}, heights);
        std::size_t present = 0;
        for (std::int64_t j = 0; j < 128; ++j) {
            for (std::int64_t i = 0; i < 128; ++i) {
                const double z = heights[got.index(i, j)];
                if (std::isnan(z)) continue;
                ++present;
                // Slopes below 0.3: 1/64 of a sample of up to 20 m is worth 0.1 m.
                ASSERT_NEAR(z, surface(x0 + 10.0 * static_cast<double>(i), y0 - 10.0 * static_cast<double>(j)), 0.1);
            }
        }
        EXPECT_GT(present, heights.size() / 2);
    }
}

}  // namespace
}  // namespace scree
