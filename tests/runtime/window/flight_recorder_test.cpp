#include "runtime/window/flight_recorder.h"

#include <cmath>
#include <limits>

#include "tests/common/test_support.h"

namespace scree {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// Straight on at 50 m/s, turning by 20 degrees a second.
FlightPose pose_at(double s) {
    const glm::dvec3 eye{300000 + 50 * s, 2700000 - 10 * s, 900 + s};
    return {eye, eye + 1000.0 * glm::dvec3(std::cos(0.35 * s), std::sin(0.35 * s), -0.2)};
}

double apart(const FlightPose& a, const FlightPose& b) {
    return glm::length(a.eye - b.eye) + glm::length(a.look - b.look) / 1000;
}

TEST(FlightRecorder, TakesThirtyPosesASecondWhateverTheFrameRate) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (const double frame_s : {1.0 / 144, 1.0 / 60, 1.0 / 30, 0.11}) {
        FlightRecorder recorder;
        const double start = 1234.5;
        recorder.start(start, pose_at(0));
        double s = 0;
        while (s < 5) {
            s += frame_s * test::uniform(random, 50, 150) / 100.0;
            recorder.add(start + s, pose_at(s));
        }
        EXPECT_NEAR(recorder.seconds(), s, 1 / kRecordedPerSecond);
        const FlightPath path = recorder.stop();
        ASSERT_EQ(path.size(), static_cast<std::size_t>(std::floor(s * kRecordedPerSecond)) + 1);
        for (std::size_t k = 0; k < path.size(); ++k)
            EXPECT_LT(apart(path[k], pose_at(static_cast<double>(k) / kRecordedPerSecond)), 0.01)
                << frame_s << ' ' << k;
    }
}

TEST(FlightRecorder, PassesOverTimesAndPosesThatAreNone) {
    FlightRecorder recorder;
    recorder.add(1, pose_at(1));
    EXPECT_TRUE(recorder.stop().empty()) << "was not recording";
    recorder.start(0, pose_at(0));
    EXPECT_TRUE(recorder.recording());
    recorder.add(1, pose_at(1));
    recorder.add(0.5, pose_at(7));
    recorder.add(kNaN, pose_at(7));
    recorder.add(1.5, {{kNaN, 0, 0}, {1, 2, 3}});
    recorder.add(2, pose_at(2));
    const FlightPath path = recorder.stop();
    ASSERT_EQ(path.size(), 61u);
    EXPECT_FALSE(recorder.recording());
    for (std::size_t k = 0; k < path.size(); ++k)
        EXPECT_LT(apart(path[k], pose_at(static_cast<double>(k) / kRecordedPerSecond)), 60) << k;
    EXPECT_TRUE(recorder.stop().empty());
}

TEST(FlightRecorder, AForgottenOneTakesNoMoreThanFourHours) {
    FlightRecorder recorder;
    recorder.start(0, pose_at(0));
    EXPECT_FALSE(recorder.full());
    recorder.add(1e9, pose_at(1));
    EXPECT_TRUE(recorder.full());
    recorder.add(2e9, pose_at(1));
    EXPECT_EQ(recorder.stop().size(), kMostRecorded);
}

TEST(FlightRecorder, AMiddleLooksBetweenTheTwoHoweverFarTheyLook) {
    const FlightPose near{{0, 0, 0}, {1, 0, 0}}, far{{0, 0, 0}, {0, 1e6, 0}}, back{{0, 0, 0}, {-1, 0, 0}};
    const FlightPose middle = between(near, far, 0.5);
    EXPECT_NEAR(middle.look.x, middle.look.y, 1e-6) << "45 degrees, not where the longer one looks";
    EXPECT_EQ(between(near, far, 0).look, near.look);
    EXPECT_EQ(between(near, far, 1).look, far.look);
    EXPECT_GT(glm::length(between(near, back, 0.5).look), 0.5) << "always some direction";
}

TEST(FlightReplay, PlaysAtThePaceOfTheRecording) {
    FlightRecorder recorder;
    recorder.start(10, pose_at(0));
    for (int k = 1; k <= 600; ++k) recorder.add(10 + k / 60.0, pose_at(k / 60.0));
    const FlightReplay replay(recorder.stop(), 500);
    EXPECT_NEAR(replay.seconds(), 10, 0.04);
    for (double s = 0; s < replay.seconds(); s += 0.0137) {
        const auto pose = replay.pose(500 + s);
        ASSERT_TRUE(pose);
        EXPECT_LT(apart(*pose, pose_at(s)), 0.01) << s;
    }
    EXPECT_TRUE(replay.pose(499)) << "before it begins: its first pose";
    EXPECT_FALSE(replay.pose(500 + replay.seconds() + 0.01));
    EXPECT_FALSE(replay.pose(kNaN));
    EXPECT_FALSE(FlightReplay({}, 0).pose(0));
    const FlightReplay one({pose_at(3)}, 0);
    EXPECT_TRUE(one.pose(0));
    EXPECT_FALSE(one.pose(0.001));
}

class WrittenPath : public testing::Test {
protected:
    std::string text(const std::string& path) const {
        const auto bytes = test::read_bytes(path);
        return {bytes.begin(), bytes.end()};
    }
    test::TemporaryFolder folder_;
};

TEST_F(WrittenPath, IsReadBackToTheBit) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    FlightPath path;
    for (int k = 0; k < 500; ++k) {
        const auto number = [&] {
            return std::ldexp(static_cast<double>(random()) - 9e18, test::uniform(random, -70, -30));
        };
        path.push_back({{number(), number(), number()}, {number(), number(), number()}});
    }
    path.push_back({{0.1, -0.0, 5e-324}, {1.7e308, 1.0 / 3, 300000.1}});
    const std::string file = folder_.file("flight.csv");
    const auto written = write_flight_path(file, path);
    ASSERT_TRUE(written.ok()) << written.error().message;
    const auto read = read_flight_path(file);
    ASSERT_TRUE(read.ok()) << read.error().message;
    ASSERT_EQ(read->size(), path.size());
    for (std::size_t k = 0; k < path.size(); ++k) {
        EXPECT_EQ((*read)[k].eye, path[k].eye) << k;
        EXPECT_EQ((*read)[k].look, path[k].look) << k;
    }
    EXPECT_NE(text(file).find("\n0.1,-0,5e-324,1.7e+308,0.3333333333333333,300000.1\n"), std::string::npos)
        << "the shortest digits";
}

TEST_F(WrittenPath, LeavesWhatWasThereWhereItCannotBeWhole) {
    const std::string file = folder_.file("flight.csv");
    ASSERT_TRUE(write_flight_path(file, {pose_at(0)}).ok());
    const std::string before = text(file);
    const auto none = write_flight_path(file, {});
    ASSERT_FALSE(none.ok());
    EXPECT_EQ(none.error().code, ErrorCode::usage);
    EXPECT_FALSE(write_flight_path(file, {pose_at(1), {{kNaN, 0, 0}, {1, 1, 1}}}).ok());
    EXPECT_EQ(text(file), before);
    const auto nowhere = write_flight_path(folder_.file("none/flight.csv"), {pose_at(0)});
    ASSERT_FALSE(nowhere.ok());
    EXPECT_EQ(nowhere.error().code, ErrorCode::io);
    EXPECT_NE(nowhere.error().message.find("none/flight.csv"), std::string::npos);
}

}  // namespace
}  // namespace scree
