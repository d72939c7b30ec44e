#include "runtime/view/foresight.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/gtc/quaternion.hpp>

#include "tests/common/test_support.h"

namespace scree {
namespace {

double any(test::Random& random, double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
}

Camera looking(glm::dvec3 eye, glm::dvec3 direction, double fov_deg = 40) {
    auto camera = look_at(eye, eye + direction, fov_deg, 800, 600);
    EXPECT_TRUE(camera.ok());
    return *camera;
}

// A level camera that heads `heading` radians from east towards north.
Camera heading_camera(glm::dvec3 eye, double heading) {
    return looking(eye, {std::cos(heading), std::sin(heading), 0});
}

TEST(Foresight, KnowsNothingAtFirst) {
    const Camera camera = looking({1, 2, 3}, {1, 1, -1});
    Foresight foresight;
    EXPECT_EQ(foresight.ahead(camera, 5).eye, camera.eye);
    foresight.see(camera, 10);
    EXPECT_EQ(foresight.ahead(camera, 5).eye, camera.eye);
    EXPECT_EQ(foresight.ahead(camera, 5).forward, camera.forward);
}

TEST(Foresight, ASteadyFlightIsPredictedAtAnyFrameRate) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int flight = 0; flight < 300; ++flight) {
        const glm::dvec3 velocity = 400.0 * glm::dvec3(any(random, -1, 1), any(random, -1, 1), any(random, -1, 1));
        const glm::dvec3 start{3e5, 2.7e6, 900};
        Foresight foresight;
        Camera camera;
        // Frames of any length between 5 and 60 ms.
        for (double now = 100; now < 102.5; now += any(random, 0.005, 0.06)) {
            camera = looking(start + velocity * (now - 100), {1, 0.5, -0.2});
            foresight.see(camera, now);
        }
        const double seconds = any(random, 0, 3);
        const Camera ahead = foresight.ahead(camera, seconds);
        ASSERT_LT(glm::length(ahead.eye - (camera.eye + seconds * velocity)),
                  1e-4 * seconds * glm::length(velocity) + 1e-6);
        ASSERT_LT(glm::length(ahead.forward - camera.forward), 1e-9);
    }
}

TEST(Foresight, ASteadyTurnIsPredictedEitherWayAndNotBeyondWhatIsSensible) {
    for (const double rate : {-2.0, -0.5, 0.1, 0.5, 1.0, 3.0})
        for (const double fps : {8.0, 30.0, 60.0}) {
            Foresight foresight;
            Camera camera;
            double heading = 1;
            for (int k = 0; k < 3 * static_cast<int>(fps); ++k) {
                heading = 1 + rate * k / fps;
                camera = heading_camera({0, 0, 100}, heading);
                foresight.see(camera, k / fps);
            }
            const double turn = std::clamp(0.7 * rate, -1.2, 1.2);
            const Camera ahead = foresight.ahead(camera, 0.7);
            ASSERT_LT(glm::length(ahead.forward - heading_camera({0, 0, 0}, heading + turn).forward), 1e-3)
                << rate << " radians a second at " << fps << " fps";
            ASSERT_LT(glm::length(ahead.up - glm::dvec3(0, 0, 1)), 1e-9);
        }
}

TEST(Foresight, ANoseThatRisesGoesOnRising) {
    Foresight foresight;
    Camera camera;
    for (int k = 0; k <= 90; ++k) {
        const double pitch = -1 + k / 90.0;
        camera = looking({0, 0, 0}, {0, std::cos(pitch), std::sin(pitch)});
        foresight.see(camera, k / 30.0);
    }
    EXPECT_NEAR(std::asin(foresight.ahead(camera, 1).forward.z), 1 / 3.0, 1e-3);
}

class LeapingForesight : public testing::Test {
protected:
    // Frames of a thirtieth of a second, forward at 30 m/s from where the camera is.
    void go(int frames, double step_m = 1) {
        for (int k = 0; k < frames; ++k) {
            camera_.eye.y += step_m;
            foresight_.see(camera_, now_s_ += 1 / 30.0);
        }
    }
    void leap(double metres) {
        camera_.eye.x += metres;
        foresight_.see(camera_, now_s_ += 1 / 30.0);
    }
    double foreseen_m() const { return glm::length(foresight_.ahead(camera_, 1).eye - camera_.eye); }

    Camera camera_ = looking({0, 0, 100}, {0, 1, 0});
    Foresight foresight_;
    double now_s_ = 0;
};

TEST_F(LeapingForesight, ForgetsTheMotionAtALeapAndLearnsItAgain) {
    go(60);
    ASSERT_NEAR(foreseen_m(), 30, 0.1);
    leap(5000);
    EXPECT_EQ(foreseen_m(), 0);
    go(1);
    EXPECT_LE(foreseen_m(), 30);
    go(60);
    EXPECT_NEAR(foreseen_m(), 30, 0.1);
}

TEST_F(LeapingForesight, ALeapFromRestIsNoSpeed) {
    go(30, 0);
    for (int k = 0; k < 20; ++k) {
        leap(50000);
        EXPECT_EQ(foreseen_m(), 0);
        go(10, 0);
        EXPECT_EQ(foreseen_m(), 0);
    }
}

TEST_F(LeapingForesight, AStartFromRestIsSeenFromItsSecondFrameOn) {
    go(30, 0);
    go(2);
    EXPECT_GT(foreseen_m(), 1);
    go(58);
    EXPECT_NEAR(foreseen_m(), 30, 0.1);
}

TEST_F(LeapingForesight, AStandstillIsForeseenSoonAfterwards) {
    go(60);
    go(60, 0);
    EXPECT_LT(foreseen_m(), 0.01);
}

TEST_F(LeapingForesight, AClockThatStandsOrGoesBackForgets) {
    for (const double step_s : {0.0, -0.5}) {
        go(60);
        ASSERT_GT(foreseen_m(), 29);
        camera_.eye.y += 1;
        foresight_.see(camera_, now_s_ += step_s);
        EXPECT_EQ(foreseen_m(), 0);
        EXPECT_EQ(foresight_.turn_per_s(), glm::dvec3(0));
    }
}

TEST(Foresight, WhateverItHasSeenTheCameraIsSoundAndSeesNoLess) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int flight = 0; flight < 300; ++flight) {
        Foresight foresight;
        double now = 0;
        glm::dvec3 eye{3e5, 2.7e6, 0};
        for (int k = 0; k < 50; ++k) {
            const double size = std::exp(any(random, -20, 12));
            eye += size * glm::dvec3(any(random, -1, 1), any(random, -1, 1), any(random, -1, 1));
            glm::dvec3 direction{any(random, -1, 1), any(random, -1, 1), any(random, -1, 1)};
            if (test::uniform(random, 0, 5) == 0) direction = {0, 0, test::uniform(random, 0, 1) == 0 ? -1 : 1};
            const Camera camera = looking(eye, direction, any(random, 0.001, 179));
            now += test::uniform(random, 0, 9) == 0 ? any(random, -1, 0) : std::exp(any(random, -12, 3));
            foresight.see(camera, now);
            const Camera ahead = foresight.ahead(camera, any(random, 0, 10));
            ASSERT_NEAR(glm::length(ahead.forward), 1, 1e-12);
            ASSERT_NEAR(glm::length(ahead.up), 1, 1e-12);
            ASSERT_NEAR(glm::dot(ahead.forward, ahead.up), 0, 1e-9);
            ASSERT_GE(ahead.fov_deg, camera.fov_deg);
            ASSERT_LE(ahead.fov_deg, 179);
            ASSERT_TRUE(std::isfinite(ahead.eye.x + ahead.eye.y + ahead.eye.z));
            ASSERT_EQ(ahead.width_px, camera.width_px);
            ASSERT_EQ(ahead.height_px, camera.height_px);
            ASSERT_EQ(ahead.near_m, camera.near_m);
        }
    }
    EXPECT_GT(Foresight().ahead(looking({0, 0, 0}, {1, 0, 0}, 40), 1).fov_deg, 45);  // a head may turn
}

}  // namespace
}  // namespace scree
