// The window, on a display of its own.
#include <gtest/gtest.h>

#include <chrono>

#include "tests/programs/reports.h"
#include "tests/programs/window_fixture.h"

namespace scree::test {
namespace {

class Window : public WindowFixture {
protected:
    void key(const char* action, const char* name) { run_program("xdotool", {action, name}, options_); }
};

TEST_F(Window, ShowsTheTerrainMovesAndCloses) {
    Picture first, second;
    int step = 0;
    const auto start = std::chrono::steady_clock::now();
    ProgramOptions options = options_;
    options.meanwhile = [&] {
        const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
        if (step == 0 && seconds > 2) {
            if (on_path("import")) first = screenshot(options_, folder_.file("1.png"));
            key("keydown", "w");
            ++step;
        } else if (step == 1 && seconds > 3.5) {
            key("keyup", "w");
            for (const char* name : {"f", "f", "1", "1", "h", "h", "bracketleft", "bracketright", "Home"})
                key("key", name);
            key("keydown", "d");
            ++step;
        } else if (step == 2 && seconds > 4.5) {
            key("keyup", "d");
            if (on_path("import")) second = screenshot(options_, folder_.file("2.png"));
            ++step;
        }
    };
    const auto run = scree_view({store_, "--seconds", "6", "--size", "640x480"}, options);
    EXPECT_EQ(run.exit_code, 0) << describe(run);
    EXPECT_EQ(step, 3) << "the window closed before its keys were pressed\n" << describe(run);
    EXPECT_GE(run.seconds, 5.5);
    if (!on_path("import")) GTEST_SKIP() << "without import (ImageMagick) nobody looks at the picture";
    EXPECT_GT(first.colours, 500u) << "a picture of one colour shows no terrain";
    EXPECT_GT(second.colours, 500u);
    EXPECT_NE(first.rgb, second.rgb) << "keys moved nothing";
}

TEST_F(Window, ShowsBlocksAndDikes) {
    Picture first, second;
    int step = 0;
    double pressed_at = 0;
    const auto start = std::chrono::steady_clock::now();
    ProgramOptions options = options_;
    options.meanwhile = [&] {
        const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
        if (step == 0 && seconds > 2) {
            if (on_path("import")) first = screenshot(options_, folder_.file("1.png"));
            if (first.colours <= 500 && on_path("import") && seconds < 30) return;  // a busy machine: not there yet
            key("key", "f");
            pressed_at = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
            ++step;
        } else if (step == 1 && seconds > pressed_at + 1.5) {
            if (on_path("import")) second = screenshot(options_, folder_.file("2.png"));
            key("key", "Escape");
            ++step;
        }
    };
    const auto run = scree_view({store_, "--lod", "rsg", "--cracks", "dike", "--size", "640x480"}, options);
    EXPECT_EQ(run.exit_code, 0) << describe(run);
    EXPECT_EQ(step, 2) << "the window closed before its keys were pressed\n" << describe(run);
    if (!on_path("import")) GTEST_SKIP() << "without import (ImageMagick) nobody looks at the picture";
    EXPECT_GT(first.colours, 500u) << "a picture of one colour shows no terrain";
    EXPECT_NE(first.rgb, second.rgb) << "F draws edges only";
}

TEST_F(Window, ClosesOnEscape) {
    int waited = 0;
    ProgramOptions options = options_;
    options.meanwhile = [&] {
        if (++waited % 500 == 0) key("key", "Escape");
    };
    const auto run = scree_view({store_, "--size", "320x240"}, options);
    EXPECT_EQ(run.exit_code, 0) << describe(run);
    EXPECT_LT(run.seconds, 30);
}

TEST_F(Window, FlightInAWindowReports) {
    const auto flight =
        report_of(scree_view({"fly", store_, "--frames", "5", "--size", "200x150", "--json", "-"}, options_));
    EXPECT_EQ(flight.value("frames", 0), 5);
    EXPECT_EQ(flight.value("holes", -1), 0);
}

}  // namespace
}  // namespace scree::test
