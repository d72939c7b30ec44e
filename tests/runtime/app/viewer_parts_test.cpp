// What the viewer counts and names, without a window.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "runtime/app/hud_text.h"
#include "runtime/app/picture_writer.h"
#include "runtime/app/profile_tool.h"
#include "runtime/app/second_view.h"
#include "runtime/app/stage_lines.h"
#include "runtime/window/sun_clock.h"
#include "runtime/window/toasts.h"
#include "tests/common/test_support.h"

namespace scree::test {
namespace {

Camera some_camera() { return *look_at({100, 200, 300}, {900, 1000, 50}, 40, 640, 480); }

TEST(StageLines, ARayThroughThePictureComesBackToItsPixel) {
    const Camera camera = some_camera();
    for (const glm::dvec2 px : {glm::dvec2(0, 0), glm::dvec2(320, 240), glm::dvec2(600, 17), glm::dvec2(3, 470)}) {
        const glm::dvec3 ray = ray_through(camera, px);
        EXPECT_NEAR(glm::length(ray), 1, 1e-12);
        const glm::vec4 clip = clip_from_relative(camera) * glm::vec4(glm::vec3(1000.0 * ray), 1);
        EXPECT_NEAR((clip.x / clip.w + 1) / 2 * 640, px.x, 1e-2);
        EXPECT_NEAR((1 - clip.y / clip.w) / 2 * 480, px.y, 1e-2);
    }
}

TEST(StageLines, ABoxHasTwelveEdgesOfItsOwnLengths) {
    std::vector<LineSegment> lines;
    add_box({{0, 0, 0}, {1, 2, 4}}, {1, 2, 3, 4}, lines);
    ASSERT_EQ(lines.size(), 12u);
    double length = 0;
    for (const LineSegment& line : lines) length += glm::length(line.to - line.from);
    EXPECT_DOUBLE_EQ(length, 4 * (1 + 2 + 4));
}

TEST(StageLines, AFrustumsEdgesLieAtItsSides) {
    const Camera camera = some_camera();
    std::vector<LineSegment> lines;
    add_frustum(camera, 500, {255, 255, 255, 255}, lines);
    ASSERT_EQ(lines.size(), 12u);
    const Frustum frustum(camera);
    for (const LineSegment& line : lines) {
        if (line.from != camera.eye) continue;
        const glm::dvec3 at = line.to - camera.eye;
        EXPECT_NEAR(glm::dot(at, camera.forward), 500, 1e-6);
        EXPECT_TRUE(frustum.contains(camera.eye + 0.999 * at + 0.001 * 500.0 * camera.forward));
        EXPECT_FALSE(frustum.contains(camera.eye + 1.01 * at - 0.01 * 500.0 * camera.forward));
    }
}

TEST(StageLines, LongLinesBendWithTheEarth) {
    const LineSegment straight{{-10'000, 0, 100}, {10'000, 0, 100}, {1, 2, 3, 4}};
    const double half_curvature = 1 / (2 * 6.37e6);
    const auto bent = lowered({&straight, 1}, {0, 0, 0}, half_curvature);
    ASSERT_GT(bent.size(), 8u);
    EXPECT_NEAR(bent.front().from.z, 100 - 1e8 * half_curvature, 1e-9);
    double highest = -1e9;
    for (std::size_t k = 0; k < bent.size(); ++k) {
        highest = std::max(highest, bent[k].to.z);
        if (k > 0) {
            EXPECT_EQ(bent[k].from, bent[k - 1].to);
        }
    }
    EXPECT_NEAR(highest, 100, 1e-2) << "its middle is under the eye";
    EXPECT_EQ(lowered({&straight, 1}, {0, 0, 0}, 0).size(), 1u);
}

Profile some_profile() {
    Profile profile{{0, 0}, {400, 300}, {}};
    const std::array<std::optional<double>, 5> heights{20.0, 40.0, std::nullopt, 10.0, 30.0};
    for (std::size_t k = 0; k < 5; ++k) profile.points.push_back({125.0 * static_cast<double>(k), heights[k]});
    return profile;
}

TEST(ProfileTool, SumsUpWhatTheGroundHasAndNotWhatIsDrawn) {
    const ProfileSummary s = summary_of(some_profile(), 2);
    EXPECT_EQ(s.length_m, 500);
    EXPECT_EQ(s.low_m, 5);
    EXPECT_EQ(s.high_m, 20);
    EXPECT_EQ(s.ascent_m, 10 + 10);
    EXPECT_EQ(s.descent_m, 0) << "over a gap nobody knows the way";
    EXPECT_FALSE(summary_of({{0, 0}, {1, 0}, {{0, {}}, {1, {}}}}, 1).low_m.has_value());
}

TEST(ProfileTool, WritesALineAPointAndNoHeightWhereThereIsNoGround) {
    Dataset dataset;
    dataset.exaggeration = 2;
    EXPECT_EQ(csv_of(some_profile(), dataset),
              "along_m,x_m,y_m,height_m,longitude_deg,latitude_deg,crs\n0.000,0.000,0.000,10.000,,,\n"
              "125.000,100.000,75.000,20.000,,,\n250.000,200.000,150.000,,,,\n375.000,300.000,225.000,5.000,,,\n"
              "500.000,400.000,300.000,15.000,,,\n");
    dataset.crs = "EPSG:32651";
    dataset.geo_grid = GeoGrid{2, 2, {0, 0, 1000, 1000}, {}, 0};
    for (const double latitude : {30.0, 60.0})
        for (int k = 0; k < 2; ++k) dataset.geo_grid->normals.push_back(normal_of({90, latitude}));
    EXPECT_NE(csv_of(some_profile(), dataset).find("0.000,0.000,0.000,10.000,90.0000000,60.0000000,EPSG:32651\n"),
              std::string::npos)
        << csv_of(some_profile(), dataset);
    dataset.crs = "PROJCRS[\"a page\",of,it]";
    dataset.crs_name = "Lambert, conic";
    EXPECT_NE(csv_of(some_profile(), dataset).find(",60.0000000,Lambert  conic\n"), std::string::npos);
}

TEST(ProfileTool, TakesTheAnswerToItsOwnQuestionOnly) {
    ProfileTool tool;
    tool.start();
    EXPECT_FALSE(tool.add_end({0, 0, 10}).has_value());
    EXPECT_FALSE(tool.take(std::make_shared<Profile>(some_profile()))) << "nothing was asked yet";
    EXPECT_TRUE(tool.add_end({400, 300, 10}).has_value());
    Profile other = some_profile();
    other.to_m = {1, 1};
    EXPECT_FALSE(tool.take(std::make_shared<Profile>(other)));
    const auto mine = std::make_shared<Profile>(some_profile());
    EXPECT_TRUE(tool.take(mine));
    EXPECT_FALSE(tool.take(mine)) << "the same again is no news";
    const std::size_t unmarked = tool.lines({0, 0, 1000}).size();
    EXPECT_EQ(unmarked, 2u + 2u) << "two pieces with ground at both ends, two ends";
    EXPECT_TRUE(tool.point_at(3));
    EXPECT_EQ(tool.lines({0, 0, 1000}).size(), unmarked + 1);
    EXPECT_FALSE(tool.point_at(3));
    EXPECT_FALSE(tool.add_end({0, 0, 10}).has_value()) << "a third click begins another one";
    EXPECT_EQ(tool.profile(), nullptr);
}

TEST(PictureWriter, NamesAreFreeAndGivenOnce) {
    const TemporaryFolder folder;
    std::ofstream(folder.file("scree-a-002.png")) << "x";
    std::filesystem::create_symlink("nowhere", folder.file("scree-a-003.png"));
    int first = 1;
    const auto name = [&] { return next_free_file(folder.file("."), "a", "png", first)->filename().string(); };
    EXPECT_EQ(name(), "scree-a-001.png");
    EXPECT_EQ(name(), "scree-a-004.png") << "not written yet, but given away; a link to nowhere is taken";
    first = 10000;
    EXPECT_FALSE(next_free_file(folder.file("."), "a", "png", first).ok());
}

TEST(PictureWriter, TellsOfEveryPictureOnce) {
    const TemporaryFolder folder;
    PictureWriter writer({});
    writer.write(folder.file("a.png"), 2, 1, {1, 2, 3, 4, 5, 6});
    writer.write(folder.file("no/such/b.png"), 2, 1, {1, 2, 3, 4, 5, 6});
    const auto done = writer.take_done(true);
    ASSERT_EQ(done.size(), 2u);
    EXPECT_TRUE(done[0].outcome.ok());
    EXPECT_TRUE(std::filesystem::exists(folder.file("a.png")));
    EXPECT_FALSE(done[1].outcome.ok());
    EXPECT_TRUE(writer.take_done(true).empty());
}

TEST(SecondView, LooksStraightDownWithinTheData) {
    Dataset d;
    d.lattice = *make_lattice(0, 1000, 1, 1000, 1000, 5);
    const Camera above = *view_from_above(*look_at({-5000, 500, 400}, {0, 500, 300}, 40, 640, 480), d, 100, 64, 48);
    EXPECT_NEAR(above.forward.z, -1, 1e-9);
    EXPECT_NEAR(above.up.y, 1, 1e-9) << "north is up";
    EXPECT_GE(above.eye.x, 0);
    EXPECT_GT(above.eye.z, 100);
    EXPECT_EQ(above.width_px, 64);
}

TEST(HudText, WritesNumbersAsPeopleReadThem) {
    EXPECT_EQ(grouped(0), "0");
    EXPECT_EQ(grouped(999), "999");
    EXPECT_EQ(grouped(1000), "1 000");
    EXPECT_EQ(grouped(-123456), "-123 456");
    EXPECT_EQ(grouped(1234567), "1 234 567");
    EXPECT_EQ(length_text(9.94), "9.9 m");
    EXPECT_EQ(length_text(850), "850 m");
    EXPECT_EQ(length_text(12'345), "12.3 km");
    EXPECT_EQ(speed_text(2000), "2.0 km/s");
    EXPECT_EQ(megabytes(9'500'000), "9.5");
    EXPECT_EQ(megabytes(96'200'000), "96");
    EXPECT_EQ(hour_text(15), "15:00");
    EXPECT_EQ(hour_text(23.9999), "0:00");
    Dataset d;
    d.exaggeration = 2;
    EXPECT_EQ(place_text({1, 2, 30}, d), "1.0 E, 2.0 N, 15.0 m");
    EXPECT_FALSE(lon_lat_text({1, 2, 30}, d).has_value());
}

TEST(SunClock, RisesInTheEastAndSetsInTheWest) {
    const glm::dvec3 noon = sun_at(12), morning = sun_at(6), evening = sun_at(18);
    EXPECT_NEAR(glm::degrees(std::asin(noon.z)), kNoonAltitude_deg, 1e-9);
    EXPECT_LT(noon.y, 0) << "in the south";
    EXPECT_NEAR(morning.x, 1, 1e-9);
    EXPECT_NEAR(evening.x, -1, 1e-9);
    EXPECT_NEAR(morning.z, 0, 1e-9);
    EXPECT_LT(sun_at(0).z, 0);
    for (double hour = 0; hour < 24; hour += 0.7) {
        EXPECT_NEAR(glm::length(sun_at(hour)), 1, 1e-12);
        EXPECT_NEAR(sun_hour_of(sun_at(hour)), hour, 1e-9);
    }
    EXPECT_NEAR(later(23.5, 1), 0.5, 1e-12);
    EXPECT_NEAR(later(0.5, -1), 23.5, 1e-12);
}

TEST(Toasts, AreOverAfterAWhileAndSaidAgainLastLonger) {
    Toasts toasts;
    EXPECT_FALSE(toasts.next_end_s().has_value());
    toasts.say("one", 0);
    const double end_s = *toasts.next_end_s();
    EXPECT_GT(end_s, 1);
    toasts.say("one", 1);
    EXPECT_EQ(toasts.texts().size(), 1u);
    EXPECT_DOUBLE_EQ(*toasts.next_end_s(), end_s + 1);
    EXPECT_FALSE(toasts.expire(end_s));
    EXPECT_TRUE(toasts.expire(end_s + 1));
    EXPECT_TRUE(toasts.texts().empty());
    for (int k = 0; k < 9; ++k) toasts.say(std::to_string(k), 0);
    EXPECT_LE(toasts.texts().size(), 4u);
    EXPECT_EQ(toasts.texts().back(), "8");
}

}  // namespace
}  // namespace scree::test
