#include "runtime/view/flight_path.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "common/query/ground.h"
#include "runtime/view/frustum.h"
#include "tests/runtime/lod/memory_store.h"

namespace scree {
namespace {

constexpr const char* kHeader = "eye_x,eye_y,eye_z,look_x,look_y,look_z";

class FlightPathFile : public testing::Test {
protected:
    Result<FlightPath> read(const std::string& text) {
        const std::string path = folder_.file("path.csv");
        test::write_bytes(path, {text.begin(), text.end()});
        return read_flight_path(path);
    }
    test::TemporaryFolder folder_;
};

TEST_F(FlightPathFile, GivesItsPosesInOrder) {
    const auto path = read(std::string(kHeader) + "\n1,2,3,4,5,6\n-1.5,2.5e3,3,-4e-2,5,6.25\n");
    ASSERT_TRUE(path.ok()) << path.error().message;
    ASSERT_EQ(path->size(), 2u);
    EXPECT_EQ((*path)[0].eye, glm::dvec3(1, 2, 3));
    EXPECT_EQ((*path)[0].look, glm::dvec3(4, 5, 6));
    EXPECT_EQ((*path)[1].eye, glm::dvec3(-1.5, 2500, 3));
    EXPECT_EQ((*path)[1].look, glm::dvec3(-0.04, 5, 6.25));
}

TEST_F(FlightPathFile, MayHaveCarriageReturnsEmptyLinesSpacesAndNoLastNewline) {
    const auto path = read(std::string(kHeader) + "\r\n1,2,3,4,5,6\r\n\r\n  \n 7, 8,\t9,10,11,12");
    ASSERT_TRUE(path.ok()) << path.error().message;
    ASSERT_EQ(path->size(), 2u);
    EXPECT_EQ((*path)[0].look.z, 6);
    EXPECT_EQ((*path)[1].eye.z, 9);
    EXPECT_EQ((*path)[1].look.z, 12);
}

TEST_F(FlightPathFile, WithoutItsHeaderIsRefused) {
    for (const char* text : {"", "\n", "1,2,3,4,5,6\n", "eye_x,eye_y,eye_z\n1,2,3,4,5,6\n",
                             "eye_x;eye_y;eye_z;look_x;look_y;look_z\n1;2;3;4;5;6\n"}) {
        const auto path = read(text);
        ASSERT_FALSE(path.ok()) << text;
        EXPECT_EQ(path.error().code, ErrorCode::input);
        EXPECT_NE(path.error().message.find("path.csv"), std::string::npos);
    }
}

// 21
TEST_F(FlightPathFile, RefusesALineThatIsNotSixNumbersAndNamesIt) {
    for (const char* line : {"1,2,3,4,5", "1,2,3,4,5,", "1,2,,4,5,6", "1,2,3,4,5,nan", "inf,2,3,4,5,6",
                             "1,2,3,4,5,-inf", "a,2,3,4,5,6", "1;2;3;4;5;6", "1,2,3,4,5,1e999", "1 2 3 4 5 6"}) {
        const auto path = read(std::string(kHeader) + "\n1,2,3,4,5,6\n" + line + "\n");
        ASSERT_FALSE(path.ok()) << line;
        EXPECT_EQ(path.error().code, ErrorCode::input);
        EXPECT_NE(path.error().message.find("line 3"), std::string::npos) << path.error().message;
    }
}

TEST_F(FlightPathFile, RefusesALineWithMoreThanSixNumbers) {
    for (const char* line : {"1,2,3,4,5,6,7", "1,2,3,4,5,6x", "1,2,3,4,5,6 7", "1,2,3,4,5,6.1.2"})
        EXPECT_FALSE(read(std::string(kHeader) + "\n" + line + "\n").ok()) << line;
    for (const char* line : {"1,2,3,4,5,6 ", "1,2,3,4,5,6\t\r"})
        EXPECT_TRUE(read(std::string(kHeader) + "\n" + line + "\n").ok()) << line;
}

TEST_F(FlightPathFile, WithoutPosesOrMissingIsRefused) {
    EXPECT_FALSE(read(std::string(kHeader) + "\n").ok());
    EXPECT_FALSE(read(std::string(kHeader) + "\n\n \n").ok());
    const auto missing = read_flight_path(folder_.file("no such.csv"));
    ASSERT_FALSE(missing.ok());
    EXPECT_EQ(missing.error().code, ErrorCode::input);
}

TEST(Resample, IsEvenInIndexAndKeepsBothEnds) {
    const FlightPath path{{{0, 0, 0}, {1, 0, 0}}, {{10, 0, 0}, {1, 4, 0}}, {{10, 20, 0}, {1, 4, 8}}};
    const FlightPath five = resample(path, 5);
    ASSERT_EQ(five.size(), 5u);
    EXPECT_EQ(five[0].eye, path[0].eye);
    EXPECT_EQ(five[1].eye, glm::dvec3(5, 0, 0));
    EXPECT_EQ(five[2].eye, path[1].eye);
    EXPECT_EQ(five[3].eye, glm::dvec3(10, 10, 0));
    EXPECT_EQ(five[3].look, glm::dvec3(1, 4, 4));
    EXPECT_EQ(five[4].look, path[2].look);
    EXPECT_EQ(resample(path, 2)[1].eye, path[2].eye);
    EXPECT_EQ(resample(path, 1).size(), 1u);
    EXPECT_EQ(resample(path, 0).size(), 3u);
    EXPECT_EQ(resample({path[0]}, 4).size(), 4u);
    EXPECT_TRUE(resample({}, 4).empty());
    for (const int frames : {7, 100, 1001}) EXPECT_EQ(resample(path, frames).back().eye, path.back().eye);
}

// Of a point on a path of straight runs: metres from its start, measured along it; negative where it is not on it.
double along(const FlightPath& path, glm::dvec3 eye) {
    double before = 0;
    for (std::size_t k = 1; k < path.size(); ++k) {
        const double run = glm::length(path[k].eye - path[k - 1].eye), at = glm::length(eye - path[k - 1].eye);
        if (run > 0 && std::abs(at + glm::length(path[k].eye - eye) - run) < 1e-9 * run) return before + at;
        before += run;
    }
    return -1;
}

const FlightPath kBent{
    {{0, 0, 0}, {5, 5, 5}}, {{30, 0, 0}, {6, 5, 5}}, {{30, 40, 0}, {6, 9, 5}}, {{30, 40, 10}, {6, 9, 7}}};

TEST(Paced, StepsAreEqualAlongThePathThereAndBackAgain) {
    constexpr double kLength = 80;
    for (const double step : {0.5, 7.0, 33.0, 79.0, 80.0, 81.0, 500.0}) {
        const FlightPath path = paced(kBent, step, 400);
        ASSERT_EQ(path.size(), 400u);
        for (std::size_t k = 0; k < path.size(); ++k) {
            double lap = std::fmod(static_cast<double>(k) * step, 2 * kLength);
            if (lap > kLength) lap = 2 * kLength - lap;
            ASSERT_NEAR(along(kBent, path[k].eye), lap, 1e-9) << step << " m, pose " << k;
        }
    }
}

TEST(Paced, TheLookGoesWithTheEye) {
    const FlightPath path = paced(kBent, 15, 5);
    EXPECT_EQ(path[1].look, glm::dvec3(5.5, 5, 5));
    EXPECT_EQ(path[2].look, glm::dvec3(6, 5, 5));
    EXPECT_NEAR(path[4].look.y, 8, 1e-12);
}

TEST(Paced, PosesThatStandStillAreStridden) {
    const FlightPath still{
        {{0, 0, 0}, {1, 0, 0}}, {{0, 0, 0}, {2, 0, 0}}, {{10, 0, 0}, {3, 0, 0}}, {{10, 0, 0}, {4, 0, 0}}};
    const FlightPath path = paced(still, 2.5, 12);
    for (std::size_t k = 0; k < path.size(); ++k) {
        const double lap = std::fmod(2.5 * static_cast<double>(k), 20);
        ASSERT_NEAR(path[k].eye.x, lap <= 10 ? lap : 20 - lap, 1e-12) << k;
        ASSERT_TRUE(std::isfinite(path[k].look.x));
    }
}

TEST(Paced, WithoutLengthOrStepIsEvenInIndex) {
    const FlightPath turning{{{1, 2, 3}, {1, 0, 0}}, {{1, 2, 3}, {2, 0, 0}}};
    const double nan = std::numeric_limits<double>::quiet_NaN();
    for (const double step : {0.0, -1.0, nan}) EXPECT_EQ(paced(kBent, step, 7)[3].eye, resample(kBent, 7)[3].eye);
    EXPECT_EQ(paced(turning, 5, 3)[1].look.x, 1.5);
    EXPECT_EQ(paced({kBent[0]}, 5, 4).size(), 4u);
    EXPECT_TRUE(paced({}, 5, 4).empty());
}

constexpr int kKeyPoses = 301;  // as many as the flight is made of: others are interpolated between them

TEST(DefaultFlight, IsTheSameEveryTimeAboveGroundAndLowThenHighThenSteep) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int world = 0; world < 6; ++world) {
        const auto terrain = test::random_terrain(random);
        const test::MemoryStore store(terrain);
        const auto path = default_flight(store, kKeyPoses), again = default_flight(store, kKeyPoses);
        ASSERT_TRUE(path.ok());
        ASSERT_TRUE(again.ok());
        ASSERT_EQ(path->size(), std::size_t{kKeyPoses});
        auto ground = Ground::open(store);
        ASSERT_TRUE(ground.ok());
        const double extent = terrain.lattice().spacing_m *
                              static_cast<double>(std::max(terrain.lattice().cells_x, terrain.lattice().cells_y));
        for (std::size_t k = 0; k < kKeyPoses; ++k) {
            const FlightPose& pose = (*path)[k];
            ASSERT_EQ(pose.eye, (*again)[k].eye);
            ASSERT_EQ(pose.look, (*again)[k].look);
            ASSERT_TRUE(look_at(pose.eye, pose.look, 40, 800, 800).ok());
            const auto height = (*ground)->height(pose.eye.x, pose.eye.y);
            ASSERT_TRUE(height.ok());
            const double floor = *height ? (*height)->height_m : terrain.dataset().min_height_m;
            ASSERT_GE(pose.eye.z,
                      floor + (k < 100 ? 3 * terrain.lattice().spacing_m : (k < 200 ? 0.1 : 0.04) * extent) - 1e-9);
            const double pitch = std::asin(glm::normalize(pose.look - pose.eye).z) * 57.29577951308232;
            EXPECT_NEAR(pitch, k < 100 ? -4 : k < 200 ? -15 : -60, 1e-6) << k;
        }
    }
}

TEST(DefaultFlight, HasAsManyPosesAsAskedFor) {
    test::Random random(test::seed());
    const auto terrain = test::random_terrain(random);
    const test::MemoryStore store(terrain);
    for (const int frames : {1, 2, 3, 301}) {
        const auto path = default_flight(store, frames);
        ASSERT_TRUE(path.ok());
        EXPECT_EQ(path->size(), static_cast<std::size_t>(frames));
    }
}

TEST(DefaultFlight, IsItsKeyPosesWhenNoNumberIsAskedFor) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    const auto terrain = test::random_terrain(random);
    const test::MemoryStore store(terrain);
    for (const int frames : {0, -1}) {
        const auto path = default_flight(store, frames), keys = default_flight(store, kKeyPoses);
        ASSERT_TRUE(path.ok());
        ASSERT_TRUE(keys.ok());
        ASSERT_EQ(path->size(), std::size_t{kKeyPoses});
        for (std::size_t k = 0; k < kKeyPoses; ++k) {
            ASSERT_EQ((*path)[k].eye, (*keys)[k].eye) << k;
            ASSERT_EQ((*path)[k].look, (*keys)[k].look) << k;
        }
    }
}

TEST(DefaultFlight, HandsOnTheErrorOfADamagedStore) {
    test::Random random(test::seed());
    const auto terrain = test::random_terrain(random);
    test::MemoryStore store(terrain);
    for (const TileId id : terrain.tiles()) store.damage(TileKind::height, id, test::Damage::checksum);
    const auto path = default_flight(store, 10);
    ASSERT_FALSE(path.ok());
    EXPECT_EQ(path.error().code, ErrorCode::store);
}

TEST(RoamingFlight, IsTheSameForTheSameSeedAndAnotherForAnother) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    const auto terrain = test::random_terrain(random);
    const test::MemoryStore store(terrain);
    const auto path = roaming_flight(store, 500, 7), again = roaming_flight(store, 500, 7),
               longer = roaming_flight(store, 800, 7), other = roaming_flight(store, 500, 8);
    ASSERT_TRUE(path.ok() && again.ok() && longer.ok() && other.ok());
    ASSERT_EQ(path->size(), 500u);
    int apart = 0;
    for (std::size_t k = 0; k < 500; ++k) {
        ASSERT_EQ((*path)[k].eye, (*again)[k].eye);
        ASSERT_EQ((*path)[k].look, (*again)[k].look);
        ASSERT_EQ((*path)[k].eye, (*longer)[k].eye);
        apart += (*path)[k].eye != (*other)[k].eye ? 1 : 0;
    }
    EXPECT_EQ(apart, 500);
}

TEST(RoamingFlight, StaysAboveGroundAndLeapsTurnsAndGoesStraight) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int world = 0; world < 6; ++world) {
        const auto terrain = test::random_terrain(random);
        const test::MemoryStore store(terrain);
        const auto path = roaming_flight(store, 3000, random());
        ASSERT_TRUE(path.ok());
        auto ground = Ground::open(store);
        ASSERT_TRUE(ground.ok());
        const Lattice& l = terrain.lattice();
        const double extent = l.spacing_m * static_cast<double>(std::max(l.cells_x, l.cells_y));
        int leaps = 0, turns = 0, straight = 0;
        for (std::size_t k = 0; k < path->size(); ++k) {
            const FlightPose& pose = (*path)[k];
            ASSERT_TRUE(look_at(pose.eye, pose.look, 40, 800, 800).ok()) << k;
            const auto height = (*ground)->height(pose.eye.x, pose.eye.y);
            ASSERT_TRUE(height.ok());
            ASSERT_GE(pose.eye.z,
                      (*height ? (*height)->height_m : terrain.dataset().min_height_m) + 1.99 * l.spacing_m);
            if (k == 0) continue;
            const FlightPose& before = (*path)[k - 1];
            const glm::dvec2 moved(pose.eye - before.eye), was(before.look - before.eye), is(pose.look - pose.eye);
            const double turn = std::abs(was.x * is.y - was.y * is.x) / (glm::length(was) * glm::length(is));
            // A run's speed is at most a fiftieth of the extent.
            if (glm::length(moved) > 0.1 * extent)
                ++leaps;
            else
                ++(turn > 1e-9 ? turns : straight);
        }
        EXPECT_GE(leaps, 5);
        EXPECT_GE(turns, 100);
        EXPECT_GE(straight, 1000);
    }
}

TEST(RoamingFlight, HandsOnTheErrorOfADamagedStore) {
    test::Random random(test::seed());
    const auto terrain = test::random_terrain(random);
    test::MemoryStore store(terrain);
    for (const TileId id : terrain.tiles()) store.damage(TileKind::height, id, test::Damage::checksum);
    EXPECT_FALSE(roaming_flight(store, 100, 1).ok());
}

TEST(Overview, ShowsTheWholeTerrainAndFillsThePicture) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int world = 0; world < 10; ++world) {
        const auto terrain = test::random_terrain(random);
        const Dataset& d = terrain.dataset();
        const Lattice& l = d.lattice;
        for (const int width : {400, 800, 2000})
            for (const double fov : {20.0, 40.0, 90.0}) {
                const FlightPose pose = overview(d, fov, width / 800.0);
                const auto sees_all = [&](glm::dvec3 eye) {
                    const auto camera = look_at(eye, pose.look, fov, width, 800);
                    EXPECT_TRUE(camera.ok());
                    for (int corner = 0; corner < 8; ++corner)
                        if (!Frustum(*camera).contains({l.x_m(corner & 1 ? static_cast<double>(l.cells_x) : 0),
                                                        l.y_m(corner & 2 ? static_cast<double>(l.cells_y) : 0),
                                                        corner & 4 ? d.max_height_m : d.min_height_m}))
                            return false;
                    return true;
                };
                EXPECT_TRUE(sees_all(pose.eye));
                EXPECT_FALSE(sees_all(pose.look + 0.85 * (pose.eye - pose.look)));
            }
    }
}

}  // namespace
}  // namespace scree
