#include "common/query/ray_cast.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "common/query/ground.h"
#include "tests/common/query/small_world.h"

namespace scree {
namespace {

using test::SmallWorld;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct Ray {
    Vector3 origin, direction;  // of any length
    double length() const { return std::hypot(direction.x, direction.y, direction.z); }
    Vector3 at(double metres) const {
        const double t = metres / length();
        return {origin.x + t * direction.x, origin.y + t * direction.y, origin.z + t * direction.z};
    }
};

Ray from_to(const Vector3& a, const Vector3& b) { return {a, {b.x - a.x, b.y - a.y, b.z - a.z}}; }

std::optional<RayHit> cast(HeightSource& source, const Ray& ray, double max_m = kInfinity) {
    auto hit = cast_ray(source, ray.origin, ray.direction, max_m);
    EXPECT_TRUE(hit.ok()) << (hit.ok() ? "" : hit.error().message);
    return hit.ok() ? *hit : std::nullopt;
}

// Distance to a triangle, by Cramer's rule; nullopt unless met by more than `margin` inside its edges.
std::optional<double> meets(const Ray& ray, const std::array<Vector3, 3>& t, long double margin) {
    using Column = std::array<long double, 3>;
    const auto minus = [](const Vector3& a, const Vector3& b) {
        return Column{static_cast<long double>(a.x) - b.x, static_cast<long double>(a.y) - b.y,
                      static_cast<long double>(a.z) - b.z};
    };
    const auto det = [](const Column& a, const Column& b, const Column& c) {
        return a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) +
               a[2] * (b[0] * c[1] - b[1] * c[0]);
    };
    const Column d{-static_cast<long double>(ray.direction.x), -static_cast<long double>(ray.direction.y),
                   -static_cast<long double>(ray.direction.z)};
    const Column p = minus(t[1], t[0]), q = minus(t[2], t[0]), o = minus(ray.origin, t[0]);
    const long double whole = det(d, p, q);
    if (std::abs(whole) < 1e-12L * ray.length()) return std::nullopt;
    const long double distance = det(o, p, q) / whole, a = det(d, o, q) / whole, b = det(d, p, o) / whole;
    if (a < margin || b < margin || a + b > 1 - margin || distance < 0) return std::nullopt;
    return static_cast<double>(distance) * ray.length();
}

std::optional<double> nearest_triangle(const SmallWorld& world, const Ray& ray, long double margin) {
    std::optional<double> nearest;
    for (std::int64_t j = 0; j < world.lattice().cells_y; ++j)
        for (std::int64_t i = 0; i < world.lattice().cells_x; ++i) {
            if (!world.present(i, j)) continue;
            for (const auto& triangle : world.triangles(i, j)) {
                const auto distance = meets(ray, triangle, margin);
                if (distance && (!nearest || *distance < *nearest)) nearest = distance;
            }
        }
    return nearest;
}

// The ray's height above a present cell at that distance, read independently; nullopt where there is none, or where
// rounding decides which cell it is.
std::optional<double> above(const SmallWorld& world, const Ray& ray, double distance_m) {
    const Vector3 p = ray.at(distance_m);
    const double i = world.lattice().i_of(p.x), j = world.lattice().j_of(p.y);
    const auto ci = static_cast<std::int64_t>(std::floor(i)), cj = static_cast<std::int64_t>(std::floor(j));
    if (!world.present(ci, cj)) return std::nullopt;
    return p.z - world.surface_m(ci, cj, i, j);
}

// Is every cell present that the ray passes from one distance to the other, and any beside it?
bool over_ground(const SmallWorld& world, const Ray& ray, double from, double to) {
    const Vector3 a = ray.at(from), b = ray.at(to);
    const Lattice& l = world.lattice();
    const auto low = [](double x, double y) { return static_cast<std::int64_t>(std::floor(std::min(x, y) - 1e-6)); };
    const auto high = [](double x, double y) { return static_cast<std::int64_t>(std::floor(std::max(x, y) + 1e-6)); };
    const double ia = l.i_of(a.x), ib = l.i_of(b.x), ja = l.j_of(a.y), jb = l.j_of(b.y);
    for (std::int64_t j = low(ja, jb); j <= high(ja, jb); ++j)
        for (std::int64_t i = low(ia, ib); i <= high(ia, ib); ++i)
            if (!world.present(i, j)) return false;
    return true;
}

double extent_m(const SmallWorld& world) {
    const Lattice& l = world.lattice();
    return l.spacing_m * static_cast<double>(l.cells_x + l.cells_y) + 400 * world.dataset().height_quantum_m;
}

// Somewhere in, above, below or beside the world.
Vector3 random_point(test::Random& random, const SmallWorld& world, double beside) {
    const Lattice& l = world.lattice();
    const Dataset& d = world.dataset();
    return {world.x_m(test::uniform_real(random, -beside, 1 + beside) * static_cast<double>(l.cells_x)),
            world.y_m(test::uniform_real(random, -beside, 1 + beside) * static_cast<double>(l.cells_y)),
            d.height_m(test::uniform_real(random, -80, 80) * (1 + 3 * beside))};
}

// A hit lies on the surface of a present cell, and no triangle well inside which the ray passes is met before.
void expect_agrees_with_triangles(const SmallWorld& world, const Ray& ray, std::int64_t& hits, std::int64_t& misses) {
    auto ground = Ground::open(world);
    ASSERT_TRUE(ground.ok());
    const auto hit = cast(**ground, ray);
    const auto certain = nearest_triangle(world, ray, 1e-7L);
    const double tolerance = 1e-7 * extent_m(world);
    ++(hit ? hits : misses);
    if (!hit) {
        ASSERT_FALSE(certain) << "missed a triangle at " << *certain;
        return;
    }
    if (certain) {
        ASSERT_LE(hit->distance_m, *certain + tolerance) << "passed through a triangle";
    }
    const Vector3 p = ray.at(hit->distance_m);
    ASSERT_NEAR(p.x, hit->position.x, 1e-9 * (1 + std::abs(p.x) + hit->distance_m));
    ASSERT_NEAR(p.y, hit->position.y, 1e-9 * (1 + std::abs(p.y) + hit->distance_m));
    ASSERT_NEAR(p.z, hit->position.z, 1e-9 * (1 + std::abs(p.z) + hit->distance_m));
    const auto height = (*ground)->height(hit->position.x, hit->position.y);
    ASSERT_TRUE(height.ok());
    const double stated_m = world.dataset().height_quantum_error_m + world.dataset().warp_error_m;
    if (world.depth_varies() && hit->error_bound_m > stated_m + tolerance) {  // a step between leaves of two depths
        if (*height) {
            ASSERT_LE(std::abs((*height)->height_m - hit->position.z), hit->error_bound_m - stated_m + tolerance);
        }
        return;
    }
    if (const auto possible = nearest_triangle(world, ray, -1e-6L); possible) {
        ASSERT_GE(hit->distance_m, *possible - 1e-4 * extent_m(world)) << "a hit before any triangle";
    }
    if (!*height) return;  // on the edge of a hole rounding may put it inside
    ASSERT_NEAR((*height)->height_m, hit->position.z, tolerance);
    ASSERT_NEAR(hit->error_bound_m, (*height)->error_bound_m, tolerance);
}

TEST(RayCast, FindsTheFirstTriangleThatBruteForceFinds) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    std::int64_t hits = 0, misses = 0;
    for (int w = 0; w < 60; ++w) {
        const SmallWorld world = test::random_world(random, w % 2 == 1);
        for (int k = 0; k < 60; ++k) {
            Ray ray = from_to(random_point(random, world, k % 2), random_point(random, world, 0));
            if (k % 7 == 0) ray.direction.z = 0;
            if (k % 7 == 1) ray.direction.x = 0;
            if (k % 7 == 2) ray.direction.y = 0;
            if (k % 7 == 3) ray.direction = {0, 0, k % 2 == 0 ? -1.0 : 1.0};
            const double scale = std::exp(test::uniform_real(random, -300, 300));
            if (k % 5 == 0) ray.direction = {ray.direction.x * scale, ray.direction.y * scale, ray.direction.z * scale};
            SCOPED_TRACE("world " + std::to_string(w) + " ray " + std::to_string(k));
            if (k % 5 == 0) {  // the length of the direction is of no consequence
                auto ground = Ground::open(world);
                ASSERT_TRUE(ground.ok());
                const Ray plain{ray.origin,
                                {ray.direction.x / scale, ray.direction.y / scale, ray.direction.z / scale}};
                const auto a = cast(**ground, ray), b = cast(**ground, plain);
                ASSERT_EQ(a.has_value(), b.has_value());
                if (a) {
                    ASSERT_NEAR(a->distance_m, b->distance_m, 1e-6 * extent_m(world));
                }
                ray = plain;
            }
            ASSERT_NO_FATAL_FAILURE(expect_agrees_with_triangles(world, ray, hits, misses));
        }
    }
    EXPECT_GT(hits, 1000);
    EXPECT_GT(misses, 300);
}

// Through vertices, mid-points of edges and diagonals, from all sides: wherever the ray is above the ground and then
// below it, with nothing but ground between, it has hit before.
TEST(RayCast, NeverPassesFromOneSideToTheOther) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed() + 1);
    std::int64_t crossings = 0;
    for (int w = 0; w < 60; ++w) {
        const SmallWorld world = test::random_world(random, w % 2 == 1);
        const Lattice& l = world.lattice();
        auto ground = Ground::open(world);
        ASSERT_TRUE(ground.ok());
        for (int k = 0; k < 60; ++k) {
            const auto i = test::uniform(random, 0, static_cast<int>(l.cells_x)),
                       j = test::uniform(random, 0, static_cast<int>(l.cells_y));
            Vector3 aim = world.vertex(i, j);
            if (k % 3 > 0) {
                const Vector3 next = world.vertex(i + (k % 2), j + (k % 3) - 1);
                aim = {(aim.x + next.x) / 2, (aim.y + next.y) / 2, (aim.z + next.z) / 2};
            }
            Vector3 eye = random_point(random, world, 0.5);
            if (k % 4 == 0) eye.x = aim.x;                                                    // along a meridian
            if (k % 4 == 1) eye = {aim.x + 3 * l.spacing_m, aim.y + 3 * l.spacing_m, eye.z};  // along diagonals
            if (k % 4 == 2) eye.z = aim.z;
            const Ray ray = from_to(eye, aim);
            if (!(ray.length() > 0)) continue;
            SCOPED_TRACE("world " + std::to_string(w) + " ray " + std::to_string(k));
            const auto hit = cast(**ground, ray);
            const double end = 2 * ray.length(), stop = hit ? hit->distance_m : kInfinity;
            const double resolved = 1e-8 * extent_m(world);
            constexpr int kSamples = 401;  // one falls on the aim, the others mostly between
            std::optional<double> last;
            for (int s = 0; s < kSamples; ++s) {
                const double t = end * s / (kSamples - 1), before = end * std::max(s - 1, 0) / (kSamples - 1);
                const auto now = above(world, ray, t);
                if (now && last && *now * *last < 0 && std::min(std::abs(*now), std::abs(*last)) > resolved &&
                    over_ground(world, ray, before, t)) {
                    ++crossings;
                    ASSERT_LE(stop, t) << "passed from one side to the other";
                    break;
                }
                if (t >= stop) break;
                if (!now || std::abs(*now) > resolved) last = now;
            }
        }
    }
    EXPECT_GT(crossings, 800);
}

// Whole numbers throughout: nothing rounds, so what touches, hits.
TEST(RayCast, MeetsVerticesEdgesAndDiagonalsExactly) {
    const SmallWorld world({},
                           [](std::int64_t i, std::int64_t j) { return static_cast<int>((i * 7 + j * 5) % 11 - 5); });
    auto ground = Ground::open(world);
    ASSERT_TRUE(ground.ok());
    for (int j = 0; j <= 64; ++j)
        for (int i = 0; i <= 64; ++i)
            for (const double way : {1.0, -1.0}) {
                const double x = i / 4.0, y = -j / 4.0;
                const auto height = (*ground)->height(x, y);
                ASSERT_TRUE(height.ok() && height->has_value());
                const auto hit = cast(**ground, {{x, y, -32 * way}, {0, 0, way}});
                ASSERT_TRUE(hit) << i << ", " << j;
                ASSERT_NEAR(hit->position.z, (*height)->height_m, 1e-13);
                ASSERT_NEAR(hit->distance_m, std::abs((*height)->height_m + 32 * way), 1e-13);
                ASSERT_EQ(hit->position.x, x);
            }
    // At the very vertex: horizontally over the border, along it, and from the point itself.
    for (int k = 0; k <= 16; ++k) {
        const Vector3 v = world.vertex(k, 0);
        const auto into = cast(**ground, {{v.x, v.y + 5, v.z}, {0, -1, 0}});
        ASSERT_TRUE(into) << k;
        ASSERT_EQ(into->distance_m, 5);
        const auto on = cast(**ground, {v, {1, 1, 1}}, 0);
        ASSERT_TRUE(on) << k;
        ASSERT_EQ(on->distance_m, 0);
    }
}

// Both cells beside an edge hold it: a ray along the brink of a hole meets the ground that is there.
TEST(RayCast, ClosedCellsHoldTheirEdges) {
    const auto flat = [](std::int64_t, std::int64_t) { return 10; };
    for (const bool hole_east : {false, true}) {
        const SmallWorld world({}, flat, [=](std::int64_t i, std::int64_t) { return (i < 8) == hole_east || i == 0; });
        auto ground = Ground::open(world);
        ASSERT_TRUE(ground.ok());
        const double brink = 8;
        EXPECT_TRUE(cast(**ground, {{brink, -3.25, 50}, {0, 0, -1}}));
        EXPECT_TRUE(cast(**ground, {{brink, -3, 50}, {0, 0, -1}}));
        EXPECT_TRUE(cast(**ground, {{brink, -1, 20}, {0, -1, -1}}));
        const auto north_to_south = cast(**ground, {{brink, 5, 10}, {0, -1, 0}});
        ASSERT_TRUE(north_to_south);
        EXPECT_EQ(north_to_south->distance_m, 5);
        EXPECT_FALSE(cast(**ground, {{hole_east ? 8.5 : 7.5, -3.25, 50}, {0, 0, -1}}));
    }
    for (const bool hole_south : {false, true}) {
        const SmallWorld world({}, flat, [=](std::int64_t, std::int64_t j) { return (j < 8) == hole_south; });
        auto ground = Ground::open(world);
        ASSERT_TRUE(ground.ok());
        EXPECT_TRUE(cast(**ground, {{3.25, -8, 50}, {0, 0, -1}}));
        EXPECT_TRUE(cast(**ground, {{-2, -8, 14}, {1, 0, -1}}));
        EXPECT_TRUE(cast(**ground, {{16, -8, 50}, {0, 0, -1}})) << "the end of the brink";
        EXPECT_FALSE(cast(**ground, {{3.25, hole_south ? -8.25 : -7.75, 50}, {0, 0, -1}}));
    }
}

// Along a line with ground on one side first and on the other side later, the first ground counts.
TEST(RayCast, AlongALineTheNearerSideCounts) {
    for (const bool east_first : {false, true}) {
        const SmallWorld world(
            {}, [](std::int64_t, std::int64_t j) { return j < 4 || j > 9 ? 10 : 0; },
            [=](std::int64_t i, std::int64_t j) { return ((i < 8) == (j < 7)) != east_first; });
        auto ground = Ground::open(world);
        ASSERT_TRUE(ground.ok());
        const auto hit = cast(**ground, {{8, 5, 5}, {0, -1, 0}});
        ASSERT_TRUE(hit);
        EXPECT_NEAR(hit->position.y, -3.5, 1e-12);
    }
}

// Nothing of a wall: through a hole in the ground a ray passes to the other side unseen.
TEST(RayCast, PassesThroughHoles) {
    const SmallWorld world(
        {}, [](std::int64_t, std::int64_t) { return 10; },
        [](std::int64_t i, std::int64_t j) { return i < 6 || i > 9 || j < 6 || j > 9; });
    auto ground = Ground::open(world);
    ASSERT_TRUE(ground.ok());
    EXPECT_FALSE(cast(**ground, {{8, -8, 11}, {0.3, 0.2, -1}}));
    const auto under = cast(**ground, {{4, -8, 12}, {2, 0, -1}}, 6);  // down through the hole at i = 8
    EXPECT_FALSE(under);
    const auto up_again = cast(**ground, {{8, -8, 9.5}, {10, 0, 1}});
    ASSERT_TRUE(up_again) << "from below, beyond the hole";
    EXPECT_NEAR(up_again->position.x, 13, 1e-12);
}

TEST(RayCast, HitsFromBelowAndKeepsToTheDistance) {
    const SmallWorld world({}, [](std::int64_t i, std::int64_t) { return static_cast<int>(i); });
    auto ground = Ground::open(world);
    ASSERT_TRUE(ground.ok());
    const auto up = cast(**ground, {{4.5, -4.5, -100}, {0, 0, 3}});
    ASSERT_TRUE(up);
    EXPECT_NEAR(up->distance_m, 104.5, 1e-13);
    EXPECT_FALSE(cast(**ground, {{4.5, -4.5, -100}, {0, 0, -3}}));
    EXPECT_TRUE(cast(**ground, {{4.5, -4.5, -100}, {0, 0, 3}}, 104.5));
    EXPECT_FALSE(cast(**ground, {{4.5, -4.5, -100}, {0, 0, 3}}, 104.25));
    const auto inside = cast(**ground, {{4.5, -4.5, 2}, {-1, 0, 0}});  // westward out of the slope
    ASSERT_TRUE(inside);
    EXPECT_NEAR(inside->distance_m, 2.5, 1e-13);
    EXPECT_FALSE(cast(**ground, {{-1, -4, 20}, {-1, 0, -0.1}}));
    EXPECT_FALSE(cast(**ground, {{-1, 4, 5}, {1, 0, 0}}));
}

TEST(RayCast, ReachesAcrossAThousandKilometres) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed() + 2);
    test::WorldShape shape;  // slopes of at most 0.2
    shape.cells_x = shape.cells_y = 64;
    shape.origin_x_m = 300000.3;
    shape.origin_y_m = 5400000.7;
    shape.spacing_m = 9.7;
    shape.quantum_m = 0.01;
    const SmallWorld world(shape,
                           [](std::int64_t i, std::int64_t j) { return static_cast<int>((i * i + 31 * j) % 97); });
    auto ground = Ground::open(world);
    ASSERT_TRUE(ground.ok());
    for (int k = 0; k < 2000; ++k) {
        const Vector3 aim{world.x_m(test::uniform_real(random, 1, 63)), world.y_m(test::uniform_real(random, 1, 63)),
                          0};
        const double heading = test::uniform_real(random, 0, 7), up = test::uniform_real(random, 0.4, 1.5);
        const auto from = [&](double metres) {
            return Vector3{aim.x + metres * std::cos(heading) * std::cos(up),
                           aim.y + metres * std::sin(heading) * std::cos(up), aim.z + metres * std::sin(up)};
        };
        const auto far = cast(**ground, from_to(from(1e6), aim)), near = cast(**ground, from_to(from(3), aim));
        ASSERT_TRUE(far && near);
        ASSERT_NEAR(far->position.x, near->position.x, 1e-8);
        ASSERT_NEAR(far->position.y, near->position.y, 1e-8);
        ASSERT_NEAR(far->position.z, near->position.z, 1e-8);
        ASSERT_NEAR(far->distance_m - 1e6, near->distance_m - 3, 1e-8);
    }
}

TEST(RayCast, HorizontalOverFlatGroundTouchesOrMisses) {
    const SmallWorld world({}, [](std::int64_t, std::int64_t) { return 4; });
    auto ground = Ground::open(world);
    ASSERT_TRUE(ground.ok());
    const auto at = [&](double z, double dz) { return cast(**ground, {{-2, -5.3, z}, {1, -0.1, dz}}); };
    ASSERT_TRUE(at(4, 0));
    EXPECT_NEAR(at(4, 0)->position.x, 0, 1e-12);
    EXPECT_FALSE(at(4 + 1e-9, 0));
    EXPECT_FALSE(at(4 - 1e-9, 0));
    EXPECT_FALSE(at(4, 1e-6));
    ASSERT_TRUE(at(4.5, -0.125));
    EXPECT_NEAR(at(4.5, -0.125)->position.x, 2, 1e-12);
}

TEST(RayCast, SaysWhatIsNoRay) {
    const SmallWorld world({}, [](std::int64_t, std::int64_t) { return 4; });
    auto ground = Ground::open(world);
    ASSERT_TRUE(ground.ok());
    const double nan = std::nan("");
    const auto code = [&](const Vector3& o, const Vector3& d, double max_m) {
        const auto hit = (*ground)->cast_ray(o, d, max_m);
        return hit ? 0 : static_cast<int>(hit.error().code);
    };
    const Vector3 o{8, -8, 50}, down{0, 0, -1};
    EXPECT_EQ(code(o, down, 100), 0);
    EXPECT_EQ(code(o, {0, 0, 0}, 100), 2);
    EXPECT_EQ(code(o, {0, -0.0, 0}, 100), 2);
    EXPECT_EQ(code(o, {nan, 0, -1}, 100), 2);
    EXPECT_EQ(code(o, {0, nan, -1}, 100), 2);
    EXPECT_EQ(code(o, {0, 0, nan}, 100), 2);
    EXPECT_EQ(code(o, {0, 0, -kInfinity}, 100), 2);
    EXPECT_EQ(code({nan, -8, 50}, down, 100), 2);
    EXPECT_EQ(code({8, kInfinity, 50}, down, 100), 2);
    EXPECT_EQ(code({8, -8, 1e16}, down, 100), 2);
    EXPECT_EQ(code(o, down, nan), 2);
    EXPECT_EQ(code(o, down, -1), 2);
    EXPECT_EQ(code(o, {0, 0, -1e-310}, kInfinity), 0);
    const auto longest = cast(**ground, {{2, -12, 10}, {1.7e308, 1.7e308, -1.7e308}});
    ASSERT_TRUE(longest);
    EXPECT_NEAR(longest->position.x, 8, 1e-12);
    EXPECT_EQ(code({-1e15, 1e15, 1e15}, {1e15, -1e15, -1e15}, kInfinity), 0);
}

// Tiles that the ray passes above are not opened.
TEST(RayCast, LooksOnlyIntoTilesThatItMayMeet) {
    test::WorldShape shape;
    shape.cells_x = shape.cells_y = 256;
    const SmallWorld world(shape, [](std::int64_t i, std::int64_t j) {
        return static_cast<int>(i > 200 && j > 200 ? 1000 : (i + j) % 7);
    });
    test::PartialSource all(world);
    const auto hit = cast(all, {{10, -10, 900}, {1, -1, -0.5}});
    ASSERT_TRUE(hit);
    EXPECT_LT(hit->position.x, 202);
    EXPECT_GT(hit->position.x, 199);
    EXPECT_LT(all.views, 20) << "a path of 7 tiles, where the diagonal crosses 64";
}

}  // namespace
}  // namespace scree
