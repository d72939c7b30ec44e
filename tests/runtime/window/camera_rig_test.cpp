#include "runtime/window/camera_rig.h"

#include <cmath>
#include <limits>
#include <numbers>

#include "runtime/view/camera.h"
#include "tests/common/test_support.h"

namespace scree {
namespace {

constexpr double kExtent_m = 20000;
constexpr double kFrame_s = 1.0 / 60;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// A thousand metres up, looking north-east and down.
FlightPose home() { return {{300000, 2700000, 1000}, {301000, 2701000, 400}}; }

glm::dvec3 direction(const FlightPose& p) { return glm::normalize(p.look - p.eye); }
double angle(const glm::dvec3& a, const glm::dvec3& b) {
    return std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b));
}
bool finite(const glm::dvec3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

RigInput frame(double seconds = kFrame_s) {
    RigInput in;
    in.seconds = seconds;
    return in;
}

void expect_same_picture(const FlightPose& a, const FlightPose& b, const char* what) {
    EXPECT_LT(glm::length(a.eye - b.eye), 1e-6) << what;
    EXPECT_LT(angle(direction(a), direction(b)), 1e-9) << what;
}

/// Frames until it rests.
int settle(CameraRig& rig, std::optional<double> ground_m, int most = 200) {
    int frames = 0;
    do {
        rig.move(frame(), ground_m);
        ++frames;
    } while (rig.gliding() && frames < most);
    return frames;
}

TEST(CameraRig, BeginsAtHomeAndReturnsThere) {
    CameraRig rig(home(), kExtent_m);
    expect_same_picture(rig.pose(), home(), "begins");
    RigInput in = frame();
    in.ahead = in.turn = in.tilt = 1;
    for (int k = 0; k < 50; ++k) rig.move(in, std::nullopt);
    EXPECT_GT(glm::length(rig.pose().eye - home().eye), 100);
    rig.go_home();
    expect_same_picture(rig.pose(), home(), "returned");
    rig.move(frame(), std::nullopt);
    EXPECT_TRUE(rig.moved());
    rig.move(frame(), std::nullopt);
    EXPECT_FALSE(rig.moved());
}

TEST(CameraRig, FliesWhereItLooksAtItsSpeed) {
    CameraRig rig(home(), kExtent_m);
    const double speed = rig.speed_m_per_s();
    EXPECT_EQ(speed, kExtent_m / 20);
    RigInput in = frame(0.05);
    in.ahead = 1;
    rig.move(in, std::nullopt);
    const glm::dvec3 ahead = direction(home());
    EXPECT_LT(glm::length(rig.pose().eye - (home().eye + ahead * (speed * 0.05))), 1e-6);
    in.ahead = 0;
    in.right = 1;
    in.fast = true;
    const glm::dvec3 before = rig.pose().eye;
    rig.move(in, std::nullopt);
    const glm::dvec3 right = glm::normalize(glm::cross(ahead, glm::dvec3(0, 0, 1)));
    EXPECT_LT(glm::length(rig.pose().eye - (before + right * (4 * speed * 0.05))), 1e-6);
    in.right = 0;
    in.up = -1;
    in.fast = false;
    const double height = rig.pose().eye.z;
    rig.move(in, std::nullopt);
    EXPECT_NEAR(rig.pose().eye.z, height - speed * 0.05, 1e-9);
}

TEST(CameraRig, EightHundredPixelsAreHalfATurnToTheRight) {
    CameraRig rig({{0, 0, 100}, {0, 1000, 100}}, kExtent_m);
    RigInput in = frame();
    in.drag_px = {400, 0};
    rig.move(in, std::nullopt);
    EXPECT_LT(angle(direction(rig.pose()), {1, 0, 0}), 1e-9) << "a quarter from north is east";
    rig.move(in, std::nullopt);
    EXPECT_LT(angle(direction(rig.pose()), {0, -1, 0}), 1e-9);
    in.drag_px = {0, -200};
    rig.move(in, std::nullopt);
    EXPECT_NEAR(std::asin(direction(rig.pose()).z), std::numbers::pi / 4, 1e-9) << "upwards";
    RigInput keys = frame(0.1);
    keys.turn = 1;
    rig.set_pose({{0, 0, 100}, {1000, 0, 100}});
    rig.move(keys, std::nullopt);
    EXPECT_GT(direction(rig.pose()).y, 0) << "from east to the left is north";
}

TEST(CameraRig, CannotBeTiltedOverTheTop) {
    CameraRig rig(home(), kExtent_m);
    RigInput in = frame();
    for (const double sign : {1.0, -1.0}) {
        in.drag_px = {3, sign * 5000};
        for (int k = 0; k < 10; ++k) rig.move(in, std::nullopt);
        const glm::dvec3 d = direction(rig.pose());
        EXPECT_LT(sign * d.z, -0.9999);
        EXPECT_TRUE(look_at(rig.pose().eye, rig.pose().look, 40, 800, 600).ok());
        EXPECT_GT(std::hypot(d.x, d.y), 1e-4) << "still has a heading";
    }
}

TEST(CameraRig, KeepsAPoseThatLooksStraightDown) {
    CameraRig rig(home(), kExtent_m);
    for (const double z : {-1.0, 1.0}) {
        const FlightPose pose{{5, 6, 700}, {5, 6, 700 + 100 * z}};
        rig.set_pose(pose);
        RigInput in = frame();
        in.up = 1;
        rig.move(in, std::nullopt);
        EXPECT_LT(angle(direction(rig.pose()), {0, 0, z}), 1e-9);
        // North is up in the picture, and stays so when the view is tilted from there.
        const auto plumb = look_at(rig.pose().eye, rig.pose().look, 40, 800, 600);
        in.drag_px = {0, 10 * z};
        rig.move(in, std::nullopt);
        const auto tilted = look_at(rig.pose().eye, rig.pose().look, 40, 800, 600);
        ASSERT_TRUE(plumb.ok() && tilted.ok());
        EXPECT_LT(angle(plumb->up, tilted->up), 0.1);
        EXPECT_GT(angle(direction(rig.pose()), {0, 0, z}), 1e-3);
    }
}

TEST(CameraRig, FliesNoLowerThanAnEyeOverTheGround) {
    CameraRig rig(home(), kExtent_m);
    RigInput in = frame();
    in.up = -1;
    for (int k = 0; k < 500; ++k) rig.move(in, 250);
    EXPECT_EQ(rig.pose().eye.z, 250 + kClearance_m);
    rig.move(frame(), 300);
    EXPECT_EQ(rig.pose().eye.z, 300 + kClearance_m);
    EXPECT_TRUE(rig.moved());
    rig.move(frame(), std::nullopt);
    EXPECT_EQ(rig.pose().eye.z, 300 + kClearance_m);
}

TEST(CameraRig, TheWheelSetsTheSpeedWithinLimits) {
    CameraRig rig(home(), kExtent_m);
    const double speed = rig.speed_m_per_s();
    RigInput in = frame();
    in.wheel = 1;
    rig.move(in, std::nullopt);
    EXPECT_NEAR(rig.speed_m_per_s(), 1.25 * speed, 1e-9);
    expect_same_picture(rig.pose(), home(), "a wheel moves nothing in flight");
    in.wheel = 90;
    rig.move(in, std::nullopt);
    EXPECT_EQ(rig.speed_m_per_s(), kExtent_m);
    in.wheel = -100;
    rig.move(in, std::nullopt);
    EXPECT_EQ(rig.speed_m_per_s(), kExtent_m / 1e5);
}

TEST(CameraRig, NobodyIsLostInTheVoid) {
    for (const RigMode mode : {RigMode::fly, RigMode::orbit, RigMode::walk}) {
        CameraRig rig(home(), kExtent_m);
        rig.set_mode(mode);
        settle(rig, 0);
        RigInput in = frame(0.1);
        in.wheel = mode == RigMode::orbit ? -1 : 100;
        in.ahead = in.up = 1;
        in.fast = true;
        for (int k = 0; k < 20000; ++k) rig.move(in, std::nullopt);
        EXPECT_LE(glm::length(rig.pose().eye - home().eye), 41 * kExtent_m) << "target and distance, each 20";
        // And can come back.
        const double away = glm::length(rig.pose().eye - home().eye);
        in.wheel = mode == RigMode::orbit ? 1 : 0;
        in.ahead = in.up = -1;
        for (int k = 0; k < 20; ++k) rig.move(in, std::nullopt);
        EXPECT_LT(glm::length(rig.pose().eye - home().eye), away);
    }
}

TEST(CameraRig, CirclesRoundTheMiddleWithoutAJumpAndAtOneDistance) {
    CameraRig rig(home(), kExtent_m);
    const glm::dvec3 middle = home().eye + 2000.0 * direction(home());
    rig.set_mode(RigMode::orbit, middle);
    expect_same_picture(rig.pose(), home(), "at once");
    rig.move(frame(), 0);
    expect_same_picture(rig.pose(), home(), "a frame on");
    settle(rig, 0);
    ASSERT_TRUE(rig.orbit_distance_m());
    EXPECT_NEAR(*rig.orbit_distance_m(), 2000, 1e-6);
    EXPECT_LT(glm::length(rig.pose().look - middle), 1e-6);
    RigInput in = frame();
    in.drag_px = {7, 2};
    for (int k = 0; k < 40; ++k) {
        rig.move(in, -1e4);
        EXPECT_NEAR(glm::length(rig.pose().eye - middle), 2000, 1e-5);
        EXPECT_LT(angle(direction(rig.pose()), middle - rig.pose().eye), 1e-8);
    }
    EXPECT_GT(glm::length(rig.pose().eye - home().eye), 500);
    EXPECT_GT(rig.pose().eye.z, home().eye.z) << "dragged down, the ground tips towards the eye";
    // At rest nothing moves.
    rig.move(frame(), 0);
    rig.move(frame(), 0);
    EXPECT_FALSE(rig.moved());
    EXPECT_FALSE(rig.gliding());
}

TEST(CameraRig, TurnsToACentreBesideTheMiddleInALittleWhile) {
    CameraRig rig(home(), kExtent_m);
    const glm::dvec3 middle = home().eye + 2000.0 * direction(home()) + glm::dvec3(0, 0, 50);
    rig.set_mode(RigMode::orbit, middle);
    expect_same_picture(rig.pose(), home(), "at once");
    glm::dvec3 last = direction(rig.pose());
    int frames = 0;
    while (rig.gliding()) {
        rig.move(frame(), 0);
        EXPECT_LT(angle(last, direction(rig.pose())), 0.005);
        last = direction(rig.pose());
        ASSERT_LT(++frames, 60);
    }
    EXPECT_LT(glm::length(rig.pose().look - middle), 1e-6);
    EXPECT_LT(glm::length(rig.pose().eye - home().eye), 1e-6);
}

TEST(CameraRig, CirclesWhatWasFocusedOnWhileThatIsInView) {
    CameraRig rig(home(), kExtent_m);
    const glm::dvec3 point = home().eye + 3000.0 * direction(home());
    rig.focus(point);
    settle(rig, 0);
    rig.set_mode(RigMode::orbit, rig.pose().eye + 100.0 * direction(rig.pose()));
    settle(rig, 0);
    EXPECT_LT(glm::length(rig.pose().look - point), 1e-6);
    rig.set_mode(RigMode::fly);
    RigInput turn = frame();
    turn.drag_px = {700, 0};
    rig.move(turn, 0);
    const FlightPose away = rig.pose();
    rig.set_mode(RigMode::orbit);
    settle(rig, 0);
    expect_same_picture(rig.pose(), away, "a point behind is not swung round to");
}

TEST(CameraRig, TheWheelGoesNearerByAShareOfTheDistance) {
    CameraRig rig(home(), kExtent_m);
    rig.set_mode(RigMode::orbit, home().eye + 2000.0 * direction(home()));
    settle(rig, -1e5);
    const glm::dvec3 target = rig.pose().look, view = direction(rig.pose());
    RigInput in;
    in.wheel = 1;
    double distance = 2000;
    for (int k = 0; k < 10; ++k) {
        rig.move(in, -1e5);
        distance /= 1.25;
        EXPECT_NEAR(glm::length(rig.pose().eye - target), distance, 1e-5);
        EXPECT_LT(angle(direction(rig.pose()), view), 1e-7);
    }
    in.wheel = 100;
    for (int k = 0; k < 3; ++k) rig.move(in, -1e5);
    EXPECT_NEAR(*rig.orbit_distance_m(), 2, 1e-9) << "never through the point";
    in.wheel = -100;
    for (int k = 0; k < 3; ++k) rig.move(in, -1e5);
    EXPECT_NEAR(*rig.orbit_distance_m(), 20 * kExtent_m, 1e-6);
}

TEST(CameraRig, PansTheCircleAlongTheGround) {
    CameraRig rig(home(), kExtent_m);
    const glm::dvec3 target = home().eye + 2000.0 * direction(home());
    rig.set_mode(RigMode::orbit, target);
    settle(rig, 0);
    RigInput in = frame(0.1);
    in.right = 1;
    rig.move(in, 0);
    const glm::dvec3 step = rig.pose().look - target;
    EXPECT_NEAR(glm::length(step), 0.1 * rig.speed_m_per_s(), 1e-5);
    EXPECT_NEAR(step.z, 0, 1e-6);
    EXPECT_GT(glm::dot(step, glm::cross(direction(home()), {0, 0, 1})), 0);
    EXPECT_LT(angle(direction(rig.pose()), direction(home())), 1e-8);
    RigInput mouse = frame();
    mouse.pan_px = {100, 0};
    const glm::dvec3 before = rig.pose().look;
    rig.move(mouse, 0);
    EXPECT_NEAR(glm::length(rig.pose().look - before), 0.1 * 2000, 1e-5);
    EXPECT_LT(glm::dot(rig.pose().look - before, step), 0) << "the ground goes with the mouse";
}

TEST(CameraRig, AnOrbitNeverGoesThroughTheGround) {
    CameraRig rig(home(), kExtent_m);
    rig.set_mode(RigMode::orbit, home().eye + 2000.0 * direction(home()));
    settle(rig, 300);
    const glm::dvec3 target = rig.pose().look;
    RigInput down = frame();
    down.drag_px = {0, -40};
    for (int k = 0; k < 30; ++k) {
        rig.move(down, 300);
        EXPECT_GE(rig.pose().eye.z, 300 + kClearance_m);
        EXPECT_LT(glm::length(rig.pose().look - target), 1e-5) << "looks at the point all the same";
    }
    EXPECT_EQ(rig.pose().eye.z, 300 + kClearance_m);
    // Moved over a rise, both are lifted and the view keeps its direction.
    const glm::dvec3 view = direction(rig.pose());
    RigInput ahead = frame();
    ahead.ahead = 1;
    rig.move(ahead, 420);
    EXPECT_EQ(rig.pose().eye.z, 420 + kClearance_m);
    EXPECT_LT(angle(direction(rig.pose()), view), 1e-7);
}

TEST(CameraRig, GlidesToAPointWithinASecondAndNearerByHalf) {
    for (const RigMode mode : {RigMode::fly, RigMode::orbit}) {
        CameraRig rig(home(), kExtent_m);
        rig.set_mode(mode);
        settle(rig, 0);
        const glm::dvec3 eye = rig.pose().eye, point = eye + glm::dvec3(-900, 2400, -1000);
        const double distance = glm::length(point - eye);
        rig.focus(point);
        FlightPose last = rig.pose();
        int frames = 0;
        double fastest = 0;
        while (rig.gliding()) {
            rig.move(frame(), -1e5);
            EXPECT_TRUE(rig.moved());
            const double step = glm::length(rig.pose().eye - last.eye);
            EXPECT_LT(step, 0.04 * distance);
            EXPECT_LT(angle(direction(rig.pose()), direction(last)), 0.15);
            if (frames == 0) {
                EXPECT_LT(step, 0.002 * distance) << "begins gently";
            }
            fastest = std::max(fastest, step);
            last = rig.pose();
            ASSERT_LT(++frames, 60);
        }
        EXPECT_GT(fastest, 0.01 * distance);
        EXPECT_LT(glm::length(rig.pose().eye - 0.5 * (eye + point)), 1e-5);
        EXPECT_LT(angle(direction(rig.pose()), point - rig.pose().eye), 1e-8);
        if (mode == RigMode::orbit) {
            EXPECT_LT(glm::length(rig.pose().look - point), 1e-5);
        }
        rig.move(frame(), -1e5);
        EXPECT_FALSE(rig.moved()) << "rests where it ended";
    }
}

TEST(CameraRig, AGlideTurnsTheShorterWay) {
    for (double heading = -4; heading < 4; heading += 0.1) {
        const glm::dvec3 view{std::cos(heading), std::sin(heading), -0.1};
        const glm::dvec3 point = 500.0 * glm::dvec3(std::cos(heading + 0.5), std::sin(heading + 0.5), -0.1);
        CameraRig rig({{0, 0, 0}, view}, kExtent_m);
        rig.focus(point);
        do {
            const glm::dvec3 before = direction(rig.pose());
            rig.move(frame(), std::nullopt);
            EXPECT_LT(angle(before, direction(rig.pose())), 0.02) << heading;
        } while (rig.gliding());
        EXPECT_LT(angle(direction(rig.pose()), point), 1e-8);
    }
}

TEST(CameraRig, AGlideLooksAtItsPointAlsoWhereTheGroundLiftsIt) {
    CameraRig rig(home(), kExtent_m);
    const glm::dvec3 point = home().eye + glm::dvec3(1000, 1000, -900);
    rig.focus(point);
    while (rig.gliding()) {
        rig.move(frame(), 900);
        EXPECT_GE(rig.pose().eye.z, 900 + kClearance_m);
    }
    EXPECT_EQ(rig.pose().eye.z, 900 + kClearance_m);
    EXPECT_LT(angle(direction(rig.pose()), point - rig.pose().eye), 1e-8);
}

TEST(CameraRig, AWishEndsAGlideWhereItIs) {
    for (const RigMode mode : {RigMode::fly, RigMode::orbit}) {
        CameraRig rig(home(), kExtent_m);
        rig.set_mode(mode);
        settle(rig, 0);
        rig.focus(rig.pose().eye + glm::dvec3(1500, -200, -900));
        for (int k = 0; k < 20; ++k) rig.move(frame(), -1e5);
        ASSERT_TRUE(rig.gliding());
        const FlightPose before = rig.pose();
        RigInput nudge = frame();
        nudge.drag_px = {1, 0};
        rig.move(nudge, -1e5);
        EXPECT_FALSE(rig.gliding());
        EXPECT_LT(angle(direction(before), direction(rig.pose())), 0.005) << "no jump";
        EXPECT_LT(glm::length(before.eye - rig.pose().eye), 0.005 * 2000) << "a pixel's circling";
    }
}

TEST(CameraRig, ComesDownToWalkInAGlideAndStandsThere) {
    CameraRig rig(home(), kExtent_m);
    rig.set_mode(RigMode::walk);
    expect_same_picture(rig.pose(), home(), "at once");
    rig.move(frame(), std::nullopt);
    expect_same_picture(rig.pose(), home(), "no ground is known yet");
    EXPECT_FALSE(rig.gliding()) << "nothing to wait for but an answer";
    double last = rig.pose().eye.z;
    int frames = 0;
    do {
        rig.move(frame(), 200);
        EXPECT_LE(rig.pose().eye.z, last);
        EXPECT_LT(last - rig.pose().eye.z, 25) << "800 m in 90 frames";
        last = rig.pose().eye.z;
        ASSERT_LT(++frames, 120);
    } while (rig.gliding());
    EXPECT_GT(frames, 60);
    EXPECT_EQ(rig.pose().eye.z, 200 + kClearance_m);
    EXPECT_EQ(rig.pose().eye.x, home().eye.x);
    glm::dvec3 level = direction(home());
    ASSERT_LT(level.z, -0.1) << "home looks down";
    level.z = 0;
    EXPECT_LT(angle(direction(rig.pose()), level), 1e-9) << "nobody lands looking at his feet";
    rig.move(frame(), 200);
    EXPECT_FALSE(rig.moved());
}

TEST(CameraRig, LandsWithTheViewThatWasTiltedByHandOrLooksUp) {
    CameraRig rig(home(), kExtent_m);
    rig.set_mode(RigMode::walk);
    for (int k = 0; k < 10; ++k) rig.move(frame(), 200);
    RigInput in = frame();
    in.drag_px = {0, 1};
    rig.move(in, 200);
    const glm::dvec3 tilted = direction(rig.pose());
    settle(rig, 200);
    EXPECT_LT(angle(direction(rig.pose()), tilted), 1e-9);

    const FlightPose upwards{home().eye, home().eye + glm::dvec3(1, 0, 0.5)};
    CameraRig gazing(upwards, kExtent_m);
    gazing.set_mode(RigMode::walk);
    settle(gazing, 200);
    EXPECT_LT(angle(direction(gazing.pose()), direction(upwards)), 1e-9);
}

TEST(CameraRig, WalksOverHillsSmoothlyAndNeverBelowThem) {
    const auto ground = [](const glm::dvec3& p) { return 30 * std::sin(p.x / 40) * std::cos(p.y / 55); };
    CameraRig rig({{0, 0, 100}, {100, 60, 40}}, kExtent_m);
    rig.set_mode(RigMode::walk);
    RigInput in = frame();
    in.wheel = 50;
    rig.move(in, ground(rig.pose().eye));
    EXPECT_NEAR(rig.speed_m_per_s(), 14, 1e-9);
    in.wheel = 0;
    for (int k = 0; k < 200; ++k) rig.move(frame(), ground(rig.pose().eye));
    in.ahead = in.right = 1;
    in.up = 1;
    for (int k = 0; k < 3000; ++k) {
        const glm::dvec3 before = rig.pose().eye;
        const double asked = ground(before);
        rig.move(in, asked);
        const glm::dvec3 after = rig.pose().eye;
        EXPECT_GE(after.z, asked + kClearance_m);
        EXPECT_LT(after.z, asked + kClearance_m + 1.5) << "downhill it lags a little";
        EXPECT_NEAR(glm::length(glm::dvec2(after - before)), 14 * kFrame_s, 1e-6) << "the view's tilt is no slope";
        EXPECT_LT(std::abs(after.z - before.z), 0.3) << "no jolt";
    }
}

TEST(CameraRig, StandingItTurnsToWhatIsFocusedOn) {
    CameraRig rig(home(), kExtent_m);
    rig.set_mode(RigMode::walk);
    settle(rig, 100);
    const glm::dvec3 eye = rig.pose().eye, point = eye + glm::dvec3(-500, 200, 90);
    rig.focus(point);
    EXPECT_LT(settle(rig, 100), 60);
    EXPECT_EQ(rig.pose().eye, eye);
    EXPECT_LT(angle(direction(rig.pose()), point - eye), 1e-8);
}

TEST(CameraRig, HomeFromAWalkIsFlight) {
    CameraRig rig(home(), kExtent_m);
    rig.set_mode(RigMode::walk);
    settle(rig, 100);
    rig.go_home();
    settle(rig, 100);
    EXPECT_EQ(rig.mode(), RigMode::fly);
    expect_same_picture(rig.pose(), home(), "stays at home");
}

TEST(CameraRig, AfterASleepAFrameIsNoLeap) {
    CameraRig rig(home(), kExtent_m);
    RigInput in = frame(3600);
    in.ahead = 1;
    rig.move(in, std::nullopt);
    EXPECT_NEAR(glm::length(rig.pose().eye - home().eye), 0.1 * rig.speed_m_per_s(), 1e-6);
    const FlightPose before = rig.pose();
    in.seconds = -5;
    rig.move(in, std::nullopt);
    expect_same_picture(rig.pose(), before, "time does not run back");
    EXPECT_FALSE(rig.moved());
}

TEST(CameraRig, PosesThatAreNoneArePassedOver) {
    CameraRig rig(home(), kExtent_m);
    for (const FlightPose& bad : {FlightPose{{kNaN, 0, 0}, {1, 0, 0}}, FlightPose{{1, 2, 3}, {1, 2, 3}},
                                  FlightPose{{0, 0, 0}, {kInfinity, 0, 0}}, FlightPose{{1e300, 0, 0}, {0, 0, 0}}}) {
        rig.set_pose(bad);
        expect_same_picture(rig.pose(), home(), "kept");
        const CameraRig lost(bad, kNaN);
        EXPECT_TRUE(look_at(lost.pose().eye, lost.pose().look, 40, 8, 6).ok());
    }
    rig.focus({kNaN, 0, 0});
    rig.focus(home().eye);
    EXPECT_FALSE(rig.gliding());
}

/// Wishes of any kind, and numbers that are none.
class Wishes {
public:
    explicit Wishes(std::uint64_t seed) : random_(seed) {}
    double number(double size) {
        constexpr double kOdd[] = {kNaN, kInfinity, -kInfinity, 1e300, -1e300, 5e-324, -0.0};
        if (test::uniform(random_, 0, 60) == 0) return kOdd[test::uniform(random_, 0, 6)];
        return test::uniform(random_, 0, 2) == 0 ? 0 : size * test::uniform(random_, -1000, 1000) / 1000;
    }
    RigInput input() {
        RigInput in;
        in.seconds = number(0.05) + (test::uniform(random_, 0, 3) > 0 ? kFrame_s : 0);
        if (test::uniform(random_, 0, 3) == 0) return in;
        in.ahead = number(1), in.right = number(1), in.up = number(1);
        in.turn = number(1), in.tilt = number(1);
        in.drag_px = {number(300), number(300)};
        in.pan_px = {number(300), number(300)};
        in.wheel = number(3);
        in.fast = chance(3);
        return in;
    }
    glm::dvec3 place() { return home().eye + glm::dvec3(number(kExtent_m), number(kExtent_m), number(2000)); }
    std::optional<double> ground() { return chance(4) ? std::nullopt : std::optional(number(3000)); }
    bool chance(int one_in) { return test::uniform(random_, 1, one_in) == 1; }
    RigMode mode() { return static_cast<RigMode>(test::uniform(random_, 0, 2)); }

private:
    test::Random random_;
};

TEST(CameraRig, StaysFiniteAboveGroundAndWithoutJumpsWhateverIsWished) {
    SCREE_TRACE_SEED();
    Wishes wishes(test::seed());
    for (int flight = 0; flight < 300; ++flight) {
        CameraRig rig(wishes.chance(5) ? FlightPose{wishes.place(), wishes.place()} : home(),
                      wishes.chance(5) ? wishes.number(1e5) : kExtent_m);
        for (int k = 0; k < 100; ++k) {
            if (wishes.chance(20)) rig.focus(wishes.place());
            if (wishes.chance(30)) rig.set_pose({wishes.place(), wishes.place()});
            if (wishes.chance(60)) rig.go_home();
            if (wishes.chance(8)) {
                const FlightPose before = rig.pose();
                rig.set_mode(wishes.mode(), wishes.chance(2) ? std::optional(wishes.place()) : std::nullopt);
                expect_same_picture(before, rig.pose(), "a change of mode");
            }
            const auto ground_m = wishes.ground();
            rig.move(wishes.input(), ground_m);
            const FlightPose pose = rig.pose();
            ASSERT_TRUE(finite(pose.eye) && finite(pose.look));
            ASSERT_TRUE(look_at(pose.eye, pose.look, 40, 800, 600).ok());
            if (ground_m && std::abs(*ground_m) < 1e9) {
                ASSERT_GE(pose.eye.z, *ground_m + kClearance_m);
            }
            ASSERT_TRUE(std::isfinite(rig.speed_m_per_s()) && rig.speed_m_per_s() > 0);
        }
        settle(rig, 100);
        EXPECT_FALSE(rig.gliding()) << "comes to rest when nothing is wished for";
    }
}

}  // namespace
}  // namespace scree
