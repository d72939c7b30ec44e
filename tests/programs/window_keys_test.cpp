// What keys and mouse do in the window, by what it reports when it is closed.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <thread>

#include "tests/programs/reports.h"
#include "tests/programs/window_fixture.h"

namespace scree::test {
namespace {

using Json = nlohmann::json;

class WindowKeys : public WindowFixture {
protected:
    void SetUp() override {
        WindowFixture::SetUp();
        std::filesystem::create_directory(folder_.file("here"));
    }

    // Opens the window with "here" as the working directory, does what `doing` says to xdotool, and closes it.
    Json report_after(std::vector<std::string> doing, const std::vector<std::string>& arguments = {}) {
        std::vector<std::string> command{
            "-C", folder_.file("here"), SCREE_VIEW_PROGRAM, store_, "--size", "640x480", "--json", "-", "--seconds",
            "60"};
        command.insert(command.end(), arguments.begin(), arguments.end());
        std::thread user([&] {
            std::vector<std::string> all{"search", "--sync", "--name", "Scree - s", "sleep", "1.5"};
            all.insert(all.end(), doing.begin(), doing.end());
            // Esc closes what is open on top first.
            for (int k = 0; k < 3; ++k) all.insert(all.end(), {"sleep", "0.3", "key", "Escape"});
            run_program("xdotool", all, options_);
        });
        const ProgramRun run = run_program("env", command, options_);
        user.join();
        EXPECT_LT(run.seconds, 55) << "nobody closed the window\n" << describe(run);
        return report_of(run);
    }
    std::string here(const std::string& name) const { return folder_.file("here/" + name); }
};

std::vector<std::string> said(const Json& report) { return report.at("said").get<std::vector<std::string>>(); }

bool has(const std::vector<std::string>& all, const std::string& part) {
    return std::any_of(all.begin(), all.end(), [&](const std::string& s) { return s.find(part) != std::string::npos; });
}

TEST_F(WindowKeys, NothingIsDrawnWhileNothingChanges) {
    const Json report = report_after({"sleep", "6"});
    EXPECT_GT(report.at("seconds"), 6);
    // The first pictures, while tiles come and grow, and the frames of three keys.
    EXPECT_LE(report.at("pictures"), 40);
    EXPECT_LE(report.at("overlays"), 50);
    EXPECT_GE(report.at("pictures"), 1);
}

TEST_F(WindowKeys, EachKeyDoesWhatItSays) {
    const Json before = report_after({});
    EXPECT_EQ(before.at("mode"), "fly");
    EXPECT_EQ(before.at("method"), "geomip");
    EXPECT_EQ(before.at("highlight"), "none");
    for (const char* off : {"wireframe", "boxes", "frozen", "second_view", "help", "fullscreen"})
        EXPECT_EQ(before.at(off), false) << off;
    EXPECT_EQ(before.at("hud"), true);

    const Json after = report_after({"key", "f",   "key", "2",           "key", "b",           "key",   "v",     "key",
                                     "h",   "key", "u",   "key",         "x",   "key",         "m",     "sleep", "1",
                                     "key", "z",   "key", "bracketleft", "key", "bracketleft", "sleep", "1"});
    EXPECT_EQ(after.at("wireframe"), true);
    EXPECT_EQ(after.at("highlight"), "geomip");
    EXPECT_EQ(after.at("boxes"), true);
    EXPECT_EQ(after.at("frozen"), true);
    EXPECT_EQ(after.at("second_view"), true);
    EXPECT_EQ(after.at("hud"), false);
    EXPECT_EQ(after.at("exaggeration"), 1.5);
    EXPECT_EQ(after.at("method"), "block-rsg");
    EXPECT_DOUBLE_EQ(after.at("tau_px"), 1.25 * 1.25);
    EXPECT_DOUBLE_EQ(after.at("tau_effective_px"), 1.25 * 1.25);
    EXPECT_NEAR(after.at("sun_hour").get<double>(), before.at("sun_hour").get<double>() + 1, 1e-9);
}

TEST_F(WindowKeys, KeysPressedTwiceUndoWhatTheyDid) {
    const Json report = report_after({"key", "f", "key", "f",       "key", "1", "key", "3",       "key",   "3",
                                      "key", "x", "key", "shift+x", "key", "u", "key", "shift+u", "key",   "m",
                                      "key", "m", "key", "m",       "key", "z", "key", "z",       "sleep", "1"});
    EXPECT_EQ(report.at("wireframe"), false);
    EXPECT_EQ(report.at("highlight"), "none");
    EXPECT_EQ(report.at("exaggeration"), 1.0);
    EXPECT_EQ(report.at("method"), "geomip") << "three methods in a ring";
    EXPECT_EQ(report.at("frozen"), false);
}

TEST_F(WindowKeys, CirclesAndWalks) {
    EXPECT_EQ(report_after({"key", "o", "sleep", "1"}).at("mode"), "orbit");
    const Json walk = report_after({"key", "g", "sleep", "1"});
    EXPECT_EQ(walk.at("mode"), "walk");
}

TEST_F(WindowKeys, AClickGlidesThereAndADragDoesNot) {
    const Json clicked = report_after({"mousemove", "320", "260", "sleep", "0.5", "click", "1", "sleep", "2.5"});
    EXPECT_EQ(clicked.at("focused"), 1);
    const Json dragged = report_after(
        {"mousemove", "320", "260", "mousedown", "1", "mousemove", "400", "260", "mouseup", "1", "sleep", "1"});
    EXPECT_EQ(dragged.at("focused"), 0);
    EXPECT_NE(clicked.at("eye"), dragged.at("eye"));
    EXPECT_NE(dragged.at("look"), report_after({}).at("look")) << "a drag looks round";
}

TEST_F(WindowKeys, WritesScreenshotsUnderNamesThatAreFree) {
    std::ofstream(here("scree-s-001.png")) << "another's";
    const Json report = report_after({"key", "F12", "key", "F12", "sleep", "2"});
    EXPECT_EQ(report.at("screenshots"), Json({"scree-s-002.png", "scree-s-003.png"}));
    const Picture first = picture_of(here("scree-s-002.png")), second = picture_of(here("scree-s-003.png"));
    EXPECT_GT(first.colours, 500u) << "a picture of one colour shows no terrain";
    EXPECT_EQ(first.rgb.size(), std::size_t{640} * 480 * 3);
    EXPECT_EQ(first.rgb, second.rgb);
    EXPECT_EQ(std::filesystem::file_size(here("scree-s-001.png")), 9u) << "overwritten";
}

TEST_F(WindowKeys, BoxesAndColoursAreInThePictureAndPanelsAreNot) {
    const Json report = report_after({"sleep", "1",   "key", "F12", "key", "h",   "key", "F12", "key", "h",     "key",
                                      "b",     "key", "F12", "key", "b",   "key", "1",   "key", "F12", "sleep", "2"});
    ASSERT_EQ(report.at("screenshots").size(), 4u);
    std::vector<Picture> pictures;
    for (const auto& name : report.at("screenshots")) pictures.push_back(picture_of(here(name)));
    EXPECT_EQ(pictures[0].rgb, pictures[1].rgb);
    EXPECT_NE(pictures[1].rgb, pictures[2].rgb) << "no boxes";
    EXPECT_NE(pictures[1].rgb, pictures[3].rgb) << "no colours";
    EXPECT_NE(pictures[2].rgb, pictures[3].rgb);
}

TEST_F(WindowKeys, WhatIsFrozenIsNotChosenAnewWhileTheEyeMoves) {
    const std::vector<std::string> ahead{"keydown", "w", "sleep", "2", "keyup", "w", "sleep", "1"};
    std::vector<std::string> frozen{"key", "z"};
    frozen.insert(frozen.end(), ahead.begin(), ahead.end());
    const std::vector<std::string> method{"--lod", "rsg"};
    const Json stood = report_after({"sleep", "1"}, method), flew = report_after(ahead, method),
               froze = report_after(frozen, method);
    EXPECT_NE(flew.at("triangles"), stood.at("triangles")) << "the flight tells nothing";
    EXPECT_NE(froze.at("eye"), stood.at("eye"));
    EXPECT_EQ(froze.at("triangles"), stood.at("triangles"));
}

TEST_F(WindowKeys, WhatIsRecordedIsFlownAgain) {
    const Json report = report_after({"key", "F9", "keydown", "w", "sleep", "1.5", "keyup", "w", "key", "F9", "key",
                                      "Home", "key", "F10", "sleep", "4"});
    EXPECT_EQ(report.at("recordings"), Json({"scree-s-001.csv"}));
    EXPECT_GT(report.at("recorded_poses"), 20);
    EXPECT_EQ(report.at("replays"), 1);
    EXPECT_TRUE(has(said(report), "The flight is over."));
    const Json flight = report_of(scree_view({"fly", store_, "--path", here("scree-s-001.csv"), "--frames", "5",
                                              "--headless", "--wait", "--size", "200x150", "--json", "-"}));
    EXPECT_EQ(flight.value("frames", 0), 5);
    const Json replayed = report_after({"key", "F10", "sleep", "4"}, {"--path", here("scree-s-001.csv")});
    EXPECT_EQ(replayed.at("replays"), 1);
    for (int axis = 0; axis < 3; ++axis)
        EXPECT_NEAR(replayed.at("eye")[axis].get<double>(), report.at("eye")[axis].get<double>(), 1e-6)
            << "a replay ends where the flight did";
}

TEST_F(WindowKeys, AProfileNeedsTwoClicksAndIsSaved) {
    // The button stands at the panel's upper right.
    const Json report = report_after({"key",   "p",   "mousemove", "280", "260",   "sleep", "0.5", "click",     "1",
                                      "sleep", "1",   "mousemove", "380", "280",   "sleep", "0.5", "click",     "1",
                                      "sleep", "1.5", "mousemove", "517", "319",   "sleep", "0.7", "mousedown", "1",
                                      "sleep", "0.5", "mouseup",   "1",   "sleep", "1"});
    EXPECT_EQ(report.at("profile_points"), 512);
    EXPECT_EQ(report.at("focused"), 0) << "a click for the profile moves nothing";
    ASSERT_EQ(report.at("profiles"), Json({"scree-s-001.profile.csv"}));
    std::ifstream csv(here("scree-s-001.profile.csv"));
    std::string line;
    int lines = 0;
    while (std::getline(csv, line)) ++lines;
    EXPECT_EQ(lines, 513);
}

TEST_F(WindowKeys, BlocksRefuseWhatTheyCannotDoAndSayWhy) {
    const Json report = report_after({"key", "1", "key", "v", "key", "m", "key", "b", "key", "z", "key", "x", "sleep",
                                      "1", "key", "bracketright", "sleep", "1"},
                                     {"--lod", "rsg", "--cracks", "dike"});
    EXPECT_EQ(report.at("highlight"), "none");
    EXPECT_EQ(report.at("second_view"), false);
    EXPECT_EQ(report.at("method"), "rsg");
    EXPECT_EQ(report.at("boxes"), true);
    EXPECT_EQ(report.at("exaggeration"), 1.5);
    EXPECT_DOUBLE_EQ(report.at("tau_px"), 1 / 1.25);
    for (const char* why : {"no levels", "one view", "one method"}) EXPECT_TRUE(has(said(report), why)) << why;
}

TEST_F(WindowKeys, AMethodThatTheBudgetCannotHoldIsRefused) {
    // What geomip fits into, and a mesher does not.
    const Json report = report_after({"key", "m", "sleep", "1"}, {"--budget", "3M"});
    EXPECT_EQ(report.at("method"), "geomip");
    EXPECT_TRUE(has(said(report), "geomip stays")) << report.at("said").dump();
}

}  // namespace
}  // namespace scree::test
