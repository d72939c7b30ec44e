#include "runtime/view/frustum.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/common/test_support.h"

namespace scree {
namespace {

double any(test::Random& random, double low = -1, double high = 1) {
    return std::uniform_real_distribution<double>(low, high)(random);
}

Camera looking(glm::dvec3 eye, glm::dvec3 look, double fov_deg = 40, int width = 800, int height = 800) {
    auto camera = look_at(eye, look, fov_deg, width, height);
    EXPECT_TRUE(camera.ok());
    return *camera;
}

Camera random_camera(test::Random& random) {
    const glm::dvec3 eye{3e5 + 1e4 * any(random), 2.7e6 + 1e4 * any(random), 500 + 400 * any(random)};
    return looking(eye, eye + glm::dvec3(any(random), any(random), any(random)), any(random, 1, 150),
                   test::uniform(random, 10, 2000), test::uniform(random, 10, 2000));
}

// 17
TEST(Frustum, SeesATileOfTwentyKilometresFromInsideThoughNoCornerIsInView) {
    const Box tile{{3e5, 2.7e6, 0}, {3.2e5, 2.72e6, 800}};
    const glm::dvec3 middle{3.1e5, 2.71e6, 0};
    const Frustum frustum(looking(middle + glm::dvec3(0, -300, 100), middle));
    for (int corner = 0; corner < 8; ++corner)
        EXPECT_FALSE(frustum.contains({corner & 1 ? tile.high.x : tile.low.x, corner & 2 ? tile.high.y : tile.low.y,
                                       corner & 4 ? tile.high.z : tile.low.z}));
    EXPECT_TRUE(frustum.may_see(tile));
}

// 17
TEST(Frustum, CullsWhatLiesBehindTheEyeOrBesideTheView) {
    const Frustum frustum(looking({0, 0, 0}, {0, 100, 0}, 60));
    EXPECT_FALSE(frustum.may_see({{-1, -20, -1}, {1, -10, 1}}));
    EXPECT_FALSE(frustum.may_see({{-1e6, -2e6, -1e6}, {1e6, -1, 1e6}}));
    EXPECT_FALSE(frustum.may_see({{80, 50, -5}, {90, 60, 5}}));                 // right
    EXPECT_FALSE(frustum.may_see({{-90, 50, -5}, {-80, 60, 5}}));               // left
    EXPECT_FALSE(frustum.may_see({{-5, 50, 80}, {5, 60, 90}}));                 // above
    EXPECT_FALSE(frustum.may_see({{-5, 50, -90}, {5, 60, -80}}));               // below
    EXPECT_FALSE(frustum.may_see({{-0.01, 0.01, -0.01}, {0.01, 0.09, 0.01}}));  // nearer than near
    EXPECT_TRUE(frustum.may_see({{-5, 50, -5}, {5, 60, 5}}));
    EXPECT_TRUE(frustum.may_see({{-5, -60, -5}, {5, 60, 5}}));  // the eye is inside
    EXPECT_TRUE(frustum.may_see({{20, 50, -5}, {90, 60, 5}}));  // partly
}

// 17
TEST(Frustum, BoxesOfNoThicknessAreSeen) {
    const Frustum frustum(looking({0, 0, 10}, {0, 100, 0}));
    EXPECT_TRUE(frustum.may_see({{-50, 50, 0}, {50, 150, 0}}));    // flat ground
    EXPECT_TRUE(frustum.may_see({{-50, 100, -9}, {50, 100, 9}}));  // a wall
    EXPECT_TRUE(frustum.may_see({{0, 100, 0}, {0, 100, 0}}));      // a point
    EXPECT_FALSE(frustum.may_see({{0, -100, 0}, {0, -100, 0}}));
    EXPECT_TRUE(frustum.may_see({{-5, 0, 10}, {5, 50, 10}}));  // in the plane of the eye
}

TEST(Frustum, NeverLosesABoxThatHoldsAVisiblePoint) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int k = 0; k < 200000; ++k) {
        const Camera camera = random_camera(random);
        const double u = any(random, -0.9999, 0.9999), v = any(random, -0.9999, 0.9999);
        const double z = camera.near_m * 1.0001 * std::exp(any(random, 0, 14));
        const glm::dvec3 p = camera.eye + z * (camera.forward + u * camera.tan_half_x() * camera.right() +
                                               v * camera.tan_half_y() * camera.up);
        Box box{p, p};
        for (int axis = 0; axis < 3; ++axis) {
            if (test::uniform(random, 0, 2) != 0) box.low[axis] -= std::exp(any(random, -5, 12));
            if (test::uniform(random, 0, 2) != 0) box.high[axis] += std::exp(any(random, -5, 12));
        }
        const Frustum frustum(camera);
        if (z > 1) {
            ASSERT_TRUE(frustum.contains(p));
        }
        if (frustum.contains(p)) {
            ASSERT_TRUE(frustum.may_see(box));
        }
    }
}

TEST(Frustum, HoldsThePointsThatProjectIntoThePicture) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    int inside = 0;
    for (int k = 0; k < 100000; ++k) {
        const Camera camera = random_camera(random);
        const glm::dvec3 relative = 1000.0 * glm::dvec3(any(random), any(random), any(random));
        const double w = glm::dot(relative, camera.forward);
        const double x = glm::dot(relative, camera.right()) / camera.tan_half_x() / w,
                     y = glm::dot(relative, camera.up) / camera.tan_half_y() / w;
        const double margin = std::max(std::abs(x), std::abs(y));
        if (std::abs(margin - 1) < 1e-6 || std::abs(w - camera.near_m) < 1e-3) continue;
        const bool seen = w > camera.near_m && margin < 1;
        ASSERT_EQ(Frustum(camera).contains(camera.eye + relative), seen);
        inside += seen ? 1 : 0;
    }
    EXPECT_GT(inside, 1000);
}

// The frustum is convex: a box lies in it as a whole exactly when its corners do, and none of it is in view when one
// plane has all corners behind it.
struct ByCorners {
    bool all = true, none = false;
    double closest = 1e300;  ///< of a corner to a plane, relative to its distance from the eye
    ByCorners(const Camera& camera, const Box& box) {
        const double tx = camera.tan_half_x(), ty = camera.tan_half_y();
        const auto judge = [&](auto&& depth) {
            int behind = 0;
            for (int corner = 0; corner < 8; ++corner) {
                const glm::dvec3 p =
                    glm::dvec3(corner & 1 ? box.high.x : box.low.x, corner & 2 ? box.high.y : box.low.y,
                               corner & 4 ? box.high.z : box.low.z) -
                    camera.eye;
                const double d = depth(p);
                closest = std::min(closest, std::abs(d) / (1e-300 + glm::length(p)));
                behind += d < 0 ? 1 : 0;
            }
            all = all && behind == 0;
            none = none || behind == 8;
        };
        const glm::dvec3 right = camera.right(), up = camera.up, forward = camera.forward;
        judge([&](glm::dvec3 p) { return glm::dot(p, forward) - camera.near_m; });
        judge([&](glm::dvec3 p) { return glm::dot(p, forward) * tx - glm::dot(p, right); });
        judge([&](glm::dvec3 p) { return glm::dot(p, forward) * tx + glm::dot(p, right); });
        judge([&](glm::dvec3 p) { return glm::dot(p, forward) * ty - glm::dot(p, up); });
        judge([&](glm::dvec3 p) { return glm::dot(p, forward) * ty + glm::dot(p, up); });
    }
};

TEST(Frustum, SightTellsAllSomeAndNoneAsTheCornersDo) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    int all = 0, some = 0, none = 0;
    for (int k = 0; k < 200000; ++k) {
        const Camera camera = random_camera(random);
        const double z = std::exp(any(random, -3, 12)), size = z * std::exp(any(random, -6, 2));
        const glm::dvec3 p =
            camera.eye + z * (camera.forward + 1.5 * any(random) * camera.tan_half_x() * camera.right() +
                              1.5 * any(random) * camera.tan_half_y() * camera.up);
        const glm::dvec3 half = size * glm::dvec3(any(random, 0, 1), any(random, 0, 1), any(random, 0, 1));
        const Box box{p - half, p + half};
        const ByCorners truth(camera, box);
        if (truth.closest < 1e-7) continue;
        const Frustum frustum(camera);
        const Sight sight = frustum.sight(box);
        ASSERT_EQ(sight == Sight::none, truth.none);
        ASSERT_EQ(sight == Sight::all, truth.all);
        ASSERT_EQ(sight != Sight::none, frustum.may_see(box));
        all += sight == Sight::all ? 1 : 0;
        some += sight == Sight::some ? 1 : 0;
        none += sight == Sight::none ? 1 : 0;
    }
    EXPECT_GT(all, 10000);
    EXPECT_GT(some, 10000);
    EXPECT_GT(none, 10000);
}

// What is called all is not looked into again: then it must be so for every point of the box.
TEST(Frustum, SightOfAllHoldsForEveryPointAndOfNoneForNone) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int k = 0; k < 30000; ++k) {
        const Camera camera = random_camera(random);
        const double z = std::exp(any(random, 0, 12));
        const glm::dvec3 p =
            camera.eye + z * (camera.forward + 1.2 * any(random) * camera.tan_half_x() * camera.right());
        const glm::dvec3 half = 0.2 * z * glm::dvec3(any(random, 0, 1), any(random, 0, 1), any(random, 0, 1));
        const Frustum frustum(camera);
        const Sight sight = frustum.sight({p - half, p + half});
        if (sight == Sight::some) continue;
        for (int n = 0; n < 8; ++n) {
            const glm::dvec3 q = p + 0.999999 * half * glm::dvec3(any(random), any(random), any(random));
            ASSERT_EQ(frustum.contains(q), sight == Sight::all);
        }
    }
}

TEST(DistanceToBox, IsZeroInsideAndTheNearestPointsOutside) {
    const Box box{{0, 0, 0}, {10, 20, 30}};
    EXPECT_EQ(distance_to_box({5, 5, 5}, box), 0);
    EXPECT_EQ(distance_to_box({0, 20, 30}, box), 0);
    EXPECT_EQ(distance_to_box({-3, 5, 5}, box), 3);    // a face
    EXPECT_EQ(distance_to_box({13, 24, 5}, box), 5);   // an edge
    EXPECT_EQ(distance_to_box({-2, 22, 31}, box), 3);  // a corner
    EXPECT_EQ(distance_to_box({5, 5, 40}, {{0, 0, 0}, {10, 20, 0}}), 40);
}

TEST(DistanceToBox, IsNeverMoreThanTheDistanceToAnyPointOfTheBox) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int k = 0; k < 100000; ++k) {
        const glm::dvec3 low{any(random), any(random), any(random)},
            size{any(random, 0, 1), any(random, 0, 1), any(random, 0, 1)};
        const Box box{low, low + size};
        const glm::dvec3 p = low + size * glm::dvec3(any(random, 0, 1), any(random, 0, 1), any(random, 0, 1));
        const glm::dvec3 eye{any(random, -3, 3), any(random, -3, 3), any(random, -3, 3)};
        ASSERT_LE(distance_to_box(eye, box), glm::length(eye - p) + 1e-12);
    }
}

// 9: far and near in one dataset, in UTM.
TEST(DistanceToBox, SeesATenthOfAMetreInUtmAndDoesNotOverflowFarAway) {
    const Box box{{3e5, 2.7e6, 100}, {3.01e5, 2.701e6, 200}};
    for (int k = 0; k < 1000; ++k) {
        const glm::dvec3 eye{3.005e5, 2.7e6 - 50 - 0.1 * k, 150};
        ASSERT_NEAR(distance_to_box(eye - glm::dvec3(0, 0.1, 0), box) - distance_to_box(eye, box), 0.1, 1e-8);
    }
    for (const double far : {4e9, 1e10, 1e18}) {
        const double distance = distance_to_box({3e5, 2.7e6, far}, box);
        EXPECT_TRUE(std::isfinite(distance));
        EXPECT_NEAR(distance, far - 200, 1e-9 * far);
    }
}

}  // namespace
}  // namespace scree
