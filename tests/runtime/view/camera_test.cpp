#include "runtime/view/camera.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/common/test_support.h"

namespace scree {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

Camera camera_of(double fov_deg, int width, int height) {
    auto camera = look_at({0, 0, 0}, {0, 1, 0}, fov_deg, width, height);
    EXPECT_TRUE(camera.ok());
    return *camera;
}

// 1, and section 0.
TEST(Camera, FocalLengthAndOffAxisFactorAreThoseOfTheMathematics) {
    EXPECT_NEAR(camera_of(40, 800, 800).focal_px(), 1098.99097, 5e-6);
    EXPECT_NEAR(camera_of(40, 800, 800).off_axis_factor(), 1.26495, 5e-6);
    EXPECT_NEAR(camera_of(60, 800, 800).off_axis_factor(), 1.66667, 5e-6);
    EXPECT_NEAR(camera_of(90, 800, 800).off_axis_factor(), 3, 1e-12);
    EXPECT_NEAR(camera_of(90, 1920, 1080).off_axis_factor(), 5.16049, 5e-6);
    EXPECT_NEAR(camera_of(40, 1600, 800).focal_px(), 1098.99097, 5e-6);  // fov is vertical
    // 1: a vertical metre at g = 2000 m is 0.549495 px.
    EXPECT_NEAR(camera_of(40, 800, 800).focal_px() / 2000, 0.549495, 5e-7);
}

// 21
TEST(Camera, RefusesWhatIsNoNumberAndWhatIsNoDirection) {
    const glm::dvec3 here{1, 2, 3}, there{4, 5, 6};
    for (const double bad : {kNan, kInfinity, -kInfinity})
        for (int k = 0; k < 3; ++k) {
            glm::dvec3 broken = here;
            broken[k] = bad;
            EXPECT_FALSE(look_at(broken, there, 40, 800, 800).ok());
            EXPECT_FALSE(look_at(there, broken, 40, 800, 800).ok());
        }
    EXPECT_FALSE(look_at(here, here, 40, 800, 800).ok());
    for (const double fov : {0.0, -40.0, 0.0009, 179.001, 180.0, 1e9, kNan, kInfinity})
        EXPECT_FALSE(look_at(here, there, fov, 800, 800).ok()) << fov;
    for (const double fov : {0.001, 179.0}) EXPECT_TRUE(look_at(here, there, fov, 800, 800).ok()) << fov;
    for (const int size : {0, -1, 16385}) {
        EXPECT_FALSE(look_at(here, there, 40, size, 800).ok());
        EXPECT_FALSE(look_at(here, there, 40, 800, size).ok());
    }
    EXPECT_EQ(look_at(here, here, 40, 800, 800).error().code, ErrorCode::usage);
}

TEST(Camera, ADirectionTooLongToMeasureIsRefusedOrRight) {
    for (const double far : {1e150, 1e200, 1e308})
        for (const glm::dvec3 target : {glm::dvec3(far, 0, 0), glm::dvec3(far, -far, far)}) {
            const auto camera = look_at({-far, 0, 0}, target, 40, 800, 800);
            if (!camera.ok()) continue;
            EXPECT_NEAR(glm::length(camera->forward), 1, 1e-12) << far;
            EXPECT_NEAR(glm::length(camera->up), 1, 1e-12) << far;
        }
}

TEST(Camera, StandsUprightWhateverItLooksAt) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    std::uniform_real_distribution<double> any(-1, 1);
    for (int k = 0; k < 20000; ++k) {
        const glm::dvec3 eye{3e5 + 1e4 * any(random), 2.7e6 + 1e4 * any(random), 1e3 * any(random)};
        const double steep = k % 3 == 0 ? 1e-7 : 1;
        const glm::dvec3 look =
            eye + std::exp(10 * any(random)) * glm::dvec3(steep * any(random), steep * any(random), any(random));
        const auto camera = look_at(eye, look, 40, 800, 600);
        if (!camera.ok()) continue;
        ASSERT_NEAR(glm::length(camera->forward), 1, 1e-12);
        ASSERT_NEAR(glm::length(camera->up), 1, 1e-12);
        ASSERT_NEAR(glm::dot(camera->forward, camera->up), 0, 1e-12);
        ASSERT_NEAR(camera->right().z, 0, 1e-8);  // all but vertical directions count as vertical
        ASSERT_GE(camera->up.z, -1e-8);
        ASSERT_GT(glm::dot(camera->forward, look - eye), 0);
    }
}

TEST(Camera, StraightDownAndStraightUpTakeNorthAsThePicturesUp) {
    for (const double side : {-1.0, 1.0}) {
        const auto camera = look_at({10, 20, 30}, {10, 20, 30 + 25 * side}, 40, 800, 800);
        ASSERT_TRUE(camera.ok());
        EXPECT_EQ(camera->forward, glm::dvec3(0, 0, side));
        EXPECT_NEAR(glm::length(camera->up - glm::dvec3(0, 1, 0)), 0, 1e-12)
            << "looking " << (side > 0 ? "up" : "down");
    }
}

float depth_at(const Camera& camera, double distance) {
    const glm::vec4 clip = clip_from_relative(camera) * glm::vec4(glm::vec3(camera.forward * distance), 1.0f);
    return clip.z / clip.w;
}

// 19
TEST(Camera, DepthIsOneAtNearAndFallsToZeroAtInfinity) {
    const Camera camera = camera_of(40, 800, 800);
    EXPECT_FLOAT_EQ(depth_at(camera, camera.near_m), 1);
    double before = 2;
    for (double distance = camera.near_m; distance < 1e30; distance *= 1.5) {
        const float depth = depth_at(camera, distance);
        ASSERT_LT(depth, before);
        ASSERT_GT(depth, 0);
        before = depth;
    }
    EXPECT_LT(before, 1e-30);
    EXPECT_LT(depth_at(camera, 0.05), 1e9f);
    EXPECT_GT(depth_at(camera, 0.05), 1);  // nearer than near: clipped
}

// 19
TEST(Camera, ADepthStepAtTenKilometresIsAtMostTwelveTenthsOfAMillimetre) {
    const Camera camera = camera_of(40, 800, 800);
    const auto step = [&](double distance) {
        const float depth = depth_at(camera, distance);
        return camera.near_m / static_cast<double>(std::nextafter(depth, 0.0f)) -
               camera.near_m / static_cast<double>(depth);
    };
    EXPECT_LE(step(10e3), 1.2e-3);
    EXPECT_LE(step(100), 2e-5);
    EXPECT_LE(step(100e3), 1.2e-2);
}

TEST(Camera, ProjectsTheCornersOfItsFieldOfViewToTheCornersOfThePicture) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    std::uniform_real_distribution<double> any(-1, 1);
    for (int k = 0; k < 2000; ++k) {
        const auto camera = look_at({0, 0, 0}, {any(random), any(random), any(random)}, 50 + 40 * any(random),
                                    test::uniform(random, 300, 2000), test::uniform(random, 300, 2000));
        ASSERT_TRUE(camera.ok());
        const double u = any(random), v = any(random), z = std::exp(8 * any(random));
        const double ty = std::tan(camera->fov_deg * 3.14159265358979 / 360),
                     tx = ty * camera->width_px / camera->height_px;
        const glm::dvec3 p = z * (camera->forward + u * tx * camera->right() + v * ty * camera->up);
        const glm::vec4 clip = clip_from_relative(*camera) * glm::vec4(glm::vec3(p), 1.0f);
        ASSERT_NEAR(clip.x / clip.w, u, 1e-4);  // right is right
        ASSERT_NEAR(clip.y / clip.w, v, 1e-4);  // up is up
        ASSERT_NEAR(clip.w, z, 1e-4 * z);
    }
    // Looking north: east is right.
    EXPECT_NEAR(glm::length(camera_of(40, 800, 800).right() - glm::dvec3(1, 0, 0)), 0, 1e-12);
}

}  // namespace
}  // namespace scree
