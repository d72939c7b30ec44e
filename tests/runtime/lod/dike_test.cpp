// The dike: Scree lod, section 2 and items 10 to 12 of section 7.
#include "runtime/lod/dike.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>

#include "tests/common/test_support.h"

namespace scree {
namespace {

using test::Random;
using test::uniform;
using Side = std::vector<std::int32_t>;

struct Corner {
    int x = 0, y = 0;  ///< east, north
    friend auto operator<=>(const Corner&, const Corner&) = default;
};

// Twice the area, positive where counter-clockwise.
std::int64_t doubled_area(const std::array<Corner, 3>& t) {
    return std::int64_t{t[1].x - t[0].x} * (t[2].y - t[0].y) - std::int64_t{t[2].x - t[0].x} * (t[1].y - t[0].y);
}

Corner place(DikeLie lie, bool on_b, std::int32_t y) {
    if (lie == DikeLie::between_west_and_east) return {on_b ? 1 : 0, -y};
    return {y, on_b ? -1 : 0};
}

std::vector<std::array<Corner, 3>> triangles_of(DikeLie lie, const Side& a, const Side& b) {
    std::vector<std::array<Corner, 3>> triangles;
    walk_zipper(a, b, [&](bool on_b, std::int32_t base, std::int32_t apex) {
        const Side &own = on_b ? b : a, &other = on_b ? a : b;
        const auto at = [](const Side& side, std::int32_t k) { return side[static_cast<std::size_t>(k)]; };
        triangles.push_back(counter_clockwise(lie, on_b, place(lie, on_b, at(own, base)),
                                              place(lie, on_b, at(own, base + 1)), place(lie, !on_b, at(other, apex))));
    });
    return triangles;
}

Side every(std::int32_t n, std::int32_t step) {
    Side side;
    for (std::int32_t y = 0; y <= n; y += step) side.push_back(y);
    return side;
}

Side random_side(Random& random, std::int32_t n) {
    Side side{0};
    for (std::int32_t y = 1; y < n; ++y)
        if (uniform(random, 0, 2) == 0) side.push_back(y);
    side.push_back(n);
    return side;
}

void split_at_random(Random& random, std::int32_t from, std::int32_t to, int percent, Side& side) {
    if (to - from > 1 && uniform(random, 0, 99) < percent) {
        split_at_random(random, from, (from + to) / 2, percent, side);
        split_at_random(random, (from + to) / 2, to, percent, side);
    } else {
        side.push_back(to);
    }
}

// Any partition that a block's edge may have.
Side random_dyadic_side(Random& random, std::int32_t n) {
    Side side{0};
    split_at_random(random, 0, n, uniform(random, 0, 100), side);
    return side;
}

// What is wrong with a strip, or nothing.
std::string flaw(DikeLie lie, const Side& a, const Side& b) {
    const auto triangles = triangles_of(lie, a, b);
    if (triangles.size() != a.size() + b.size() - 2) return "count";
    std::int64_t area = 0;
    std::map<std::pair<Corner, Corner>, int> uses;  // of directed edges
    for (const auto& t : triangles) {
        const std::int64_t twice = doubled_area(t);
        if (twice <= 0) return "orientation";
        area += twice;
        for (std::size_t k = 0; k < 3; ++k) ++uses[{t[k], t[(k + 1) % 3]}];
    }
    if (area != 2 * std::int64_t{a.back()}) return "area";
    int on_sides = 0, ends = 0;
    for (const auto& [edge, count] : uses) {
        if (count != 1) return "an edge is used twice in one direction";
        const bool shared = uses.count({edge.second, edge.first}) != 0;
        const bool along =
            lie == DikeLie::between_west_and_east ? edge.first.x == edge.second.x : edge.first.y == edge.second.y;
        if (along && shared) return "an edge of a side is inside";
        on_sides += along ? 1 : 0;
        ends += !along && !shared ? 1 : 0;
    }
    if (on_sides != static_cast<int>(a.size() + b.size()) - 2) return "side edges";
    return ends == 2 ? "" : "rungs";
}

TEST(Zipper, CoversTheStripOnceCounterClockwiseWhateverTheSides) {
    SCREE_TRACE_SEED();
    Random random(test::seed());
    for (int round = 0; round < 400'000; ++round) {
        const std::int32_t n = round % 4 == 0 ? uniform(random, 1, 40) : 1 << uniform(random, 0, 5);
        const bool dyadic = round % 4 != 0;
        const Side a = dyadic ? random_dyadic_side(random, n) : random_side(random, n);
        const Side b = dyadic ? random_dyadic_side(random, n) : random_side(random, n);
        const DikeLie lie = round % 2 == 0 ? DikeLie::between_west_and_east : DikeLie::between_north_and_south;
        ASSERT_EQ(flaw(lie, a, b), "") << "round " << round << ", n " << n;
    }
}

TEST(Zipper, CommonParametersOfDyadicSidesGetARungAndOneSideIsASingleEdgeBetween) {
    SCREE_TRACE_SEED();
    Random random(test::seed() + 1);
    for (int round = 0; round < 100'000; ++round) {
        const std::int32_t n = 1 << uniform(random, 0, 5);
        const Side a = random_dyadic_side(random, n), b = random_dyadic_side(random, n);
        std::set<std::pair<std::int32_t, std::int32_t>> rungs{{0, 0}};
        std::size_t i = 0, j = 0;
        walk_zipper(a, b, [&](bool on_b, std::int32_t, std::int32_t) {
            ++(on_b ? j : i);
            rungs.emplace(a[i], b[j]);
        });
        Side common;
        std::set_intersection(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(common));
        for (const std::int32_t y : common) ASSERT_TRUE(rungs.count({y, y}) != 0) << "round " << round << " at " << y;
        for (std::size_t k = 1; k < common.size(); ++k) {
            const auto edges = [&](const Side& side) {
                return std::count_if(side.begin(), side.end(),
                                     [&](std::int32_t y) { return y > common[k - 1] && y <= common[k]; });
            };
            ASSERT_EQ(std::min(edges(a), edges(b)), 1) << "round " << round;
        }
    }
}

TEST(Zipper, CountsOfThePapersLayout) {
    EXPECT_EQ(zip(Side{0, 32}, every(32, 1))->size(), 33u);
    EXPECT_EQ(zip(Side{0, 32}, Side{0, 32})->size(), 2u);
    const std::size_t strip = zip(every(32, 1), every(32, 1))->size();
    EXPECT_EQ(strip, 64u);
    const auto quad = corner_quad(Corner{0, 1}, Corner{1, 1}, Corner{0, 0}, Corner{1, 0});
    for (const auto& t : quad) EXPECT_EQ(doubled_area(t), 1);
    // 20 x 20 blocks of 32 x 32 cells, 659 x 659 cells in all: the paper's 868,488 lacks 74 corner triangles.
    EXPECT_EQ(400 * 2048 + 2 * 20 * 19 * strip + 19 * 19 * quad.size(), 868'562u);
    EXPECT_EQ(2 * 659 * 659, 868'562);
}

TEST(Zipper, AFullStripIsTheFullMesh) {
    const auto strip = zip(every(32, 1), every(32, 1));
    ASSERT_TRUE(strip.ok());
    for (const ZipTriangle& t : *strip) {
        if (t.on_b) continue;
        // Its slanted side goes from A[j + 1] to B[j].
        EXPECT_EQ(t.apex, t.base);
    }
}

TEST(Zipper, RefusesWhatIsNoSide) {
    const Side good{0, 16, 32};
    for (const Side& bad :
         {Side{}, Side{0}, Side{32, 16, 0}, Side{0, 16, 16, 32}, Side{0, 40, 32}, Side{1, 32}, Side{0, 31}}) {
        const auto first = zip(bad, good), second = zip(good, bad);
        ASSERT_FALSE(first.ok()) << bad.size();
        ASSERT_FALSE(second.ok()) << bad.size();
        EXPECT_EQ(first.error().code, ErrorCode::input);
    }
    EXPECT_TRUE(zip(good, good).ok());
}

std::vector<double> heights(std::int32_t n, double at_0, double per_sample) {
    std::vector<double> z;
    for (std::int32_t y = 0; y <= n; ++y) z.push_back(at_0 + y * per_sample);
    return z;
}

TEST(DikeErrors, TheTwistedStripErrsBy160MetresThoughBothSidesAreExact) {
    // A level, B rising 0.5 m a metre, 32 cells of 40 m (C10).
    std::vector<float> error(33);
    dike_errors(heights(32, 0, 0), heights(32, 0, 20), error);
    EXPECT_EQ(error[16], 160.0f);
    EXPECT_EQ(error[8], 80.0f);
    EXPECT_EQ(error[1], 10.0f);
    EXPECT_EQ(error[0], 0.0f);
    EXPECT_EQ(error[32], 0.0f);
    // f K 160 m at 800 px and 40 degrees: nearer than this it is more than a pixel.
    const double f = 400 / std::tan(20 * std::acos(-1.0) / 180), k = 1 + 2 * std::pow(400 / f, 2);
    EXPECT_NEAR(f * k * static_cast<double>(error[16]) / 1000, 222, 1);
}

TEST(DikeErrors, APlaneHasNone) {
    std::vector<float> error(17);
    dike_errors(heights(16, 3, 2), heights(16, 8, 2), error);
    for (const float e : error) EXPECT_NEAR(e, 0, 1e-5);
}

// Height of a triangulated strip at (t, y), from its triangles: nothing shared with the formulas under test.
double height_at(const Side& a, const Side& b, const std::vector<double>& za, const std::vector<double>& zb, double t,
                 double y) {
    double found = std::nan("");
    walk_zipper(a, b, [&](bool on_b, std::int32_t base, std::int32_t apex) {
        const Side &own = on_b ? b : a, &other = on_b ? a : b;
        const std::vector<double>&z = on_b ? zb : za, &zo = on_b ? za : zb;
        const double y0 = own[static_cast<std::size_t>(base)], y1 = own[static_cast<std::size_t>(base) + 1],
                     y2 = other[static_cast<std::size_t>(apex)];
        const double w2 = on_b ? 1 - t : t;  // the apex's weight
        const double w1 = (y - w2 * y2 - (1 - w2) * y0) / (y1 - y0), w0 = 1 - w2 - w1;
        if (std::min({w0, w1, w2}) < -1e-9) return;
        found = w0 * z[static_cast<std::size_t>(y0)] + w1 * z[static_cast<std::size_t>(y1)] +
                w2 * zo[static_cast<std::size_t>(y2)];
    });
    return found;
}

TEST(DikeErrors, BoundTheInsideOfEveryDyadicStrip) {
    SCREE_TRACE_SEED();
    Random random(test::seed() + 2);
    const auto real = [&](double low, double high) {
        return std::uniform_real_distribution<double>(low, high)(random);
    };
    double nearest = 0;
    for (int round = 0; round < 3000; ++round) {
        const std::int32_t n = 1 << uniform(random, 1, 5);
        std::vector<double> za, zb;
        for (std::int32_t y = 0; y <= n; ++y) {
            za.push_back(round % 2 == 0 ? real(-50, 50) : 5 * std::sin(y * 0.3) + real(-1, 1));
            zb.push_back(round % 2 == 0 ? real(-50, 50) : y * 3 + real(-1, 1));
        }
        const Side a = random_dyadic_side(random, n), b = random_dyadic_side(random, n), full = every(n, 1);
        std::vector<float> between(za.size());
        dike_errors(za, zb, between);
        const auto has = [](const Side& side, std::int32_t y) {
            return std::binary_search(side.begin(), side.end(), y);
        };
        // What the sides' own tests know: the dropped middles of the edges, and the samples along them.
        double bound = 0, along = 0;
        for (std::int32_t mid = 1; mid < n; ++mid) {
            const std::int32_t w = dyadic_half(mid);
            for (const auto& [side, z] : {std::pair{&a, &za}, std::pair{&b, &zb}}) {
                if (has(*side, mid)) continue;
                const auto next = std::upper_bound(side->begin(), side->end(), mid);
                const double y0 = *(next - 1), y1 = *next, u = (mid - y0) / (y1 - y0);
                along = std::max(
                    along, std::abs((*z)[static_cast<std::size_t>(mid)] - (1 - u) * (*z)[static_cast<std::size_t>(y0)] -
                                    u * (*z)[static_cast<std::size_t>(y1)]));
                if (has(*side, mid - w) && has(*side, mid + w))
                    bound = std::max(bound, static_cast<double>(between[static_cast<std::size_t>(mid)]));
            }
        }
        for (int sample = 0; sample < 60; ++sample) {
            const double t = real(0, 1), y = real(0, n);
            const double error = std::abs(height_at(a, b, za, zb, t, y) - height_at(full, full, za, zb, t, y));
            ASSERT_LE(error, std::max(bound, along) + 1e-6) << "round " << round << " at " << t << ", " << y;
            if (bound > along) nearest = std::max(nearest, error / bound);
        }
    }
    EXPECT_GT(nearest, 0.9);  // and it is no larger than need be
}

}  // namespace
}  // namespace scree
