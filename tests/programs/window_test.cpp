// The window, on a display of its own.
#include <OpenImageIO/imageio.h>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <set>
#include <thread>

#include "tests/common/test_support.h"
#include "tests/programs/reports.h"

namespace scree::test {
namespace {

class VirtualDisplay {
public:
    VirtualDisplay() {
        int pipe_ends[2];
        if (::pipe(pipe_ends) != 0) return;
        child_ = ::fork();
        if (child_ == 0) {
            ::close(pipe_ends[0]);
            const int nothing = ::open("/dev/null", O_RDWR);
            ::dup2(nothing, STDOUT_FILENO);
            ::dup2(nothing, STDERR_FILENO);
            const std::string fd = std::to_string(pipe_ends[1]);
            ::execlp("Xvfb", "Xvfb", "-displayfd", fd.c_str(), "-screen", "0", "800x600x24", "-nolisten", "tcp",
                     nullptr);
            ::_exit(127);
        }
        ::close(pipe_ends[1]);
        char buffer[16] = {};
        std::string number;
        for (ssize_t n;
             (n = ::read(pipe_ends[0], buffer, sizeof buffer)) > 0 && number.find('\n') == std::string::npos;)
            number.append(buffer, static_cast<std::size_t>(n));
        ::close(pipe_ends[0]);
        if (const std::size_t end = number.find('\n'); end != std::string::npos && end > 0)
            name_ = ":" + number.substr(0, end);
    }
    ~VirtualDisplay() {
        if (child_ <= 0) return;
        ::kill(child_, SIGTERM);
        ::waitpid(child_, nullptr, 0);
    }
    VirtualDisplay(const VirtualDisplay&) = delete;
    VirtualDisplay& operator=(const VirtualDisplay&) = delete;
    const std::string& name() const { return name_; }

private:
    pid_t child_ = -1;
    std::string name_;
};

struct Screenshot {
    std::vector<std::uint8_t> rgb;
    std::size_t colours = 0;
};

Screenshot screenshot(const ProgramOptions& display, const std::string& file) {
    Screenshot shot;
    if (run_program("import", {"-silent", "-window", "root", file}, display).exit_code != 0) return shot;
    const auto in = OIIO::ImageInput::open(file);
    if (!in) return shot;
    const auto pixels = static_cast<std::size_t>(in->spec().width) * static_cast<std::size_t>(in->spec().height);
    std::vector<std::uint8_t> all(pixels * static_cast<std::size_t>(in->spec().nchannels));
    if (!in->read_image(0, 0, 0, in->spec().nchannels, OIIO::TypeDesc::UINT8, all.data())) return shot;
    std::set<std::uint32_t> colours;
    for (std::size_t k = 0; k < pixels; ++k) {
        const std::uint8_t* p = &all[k * static_cast<std::size_t>(in->spec().nchannels)];
        shot.rgb.insert(shot.rgb.end(), p, p + 3);
        colours.insert(std::uint32_t{p[0]} << 16 | std::uint32_t{p[1]} << 8 | p[2]);
    }
    shot.colours = colours.size();
    return shot;
}

class Window : public ::testing::Test {
protected:
    void SetUp() override {
        if (!on_path("Xvfb") || !on_path("xdotool")) GTEST_SKIP() << "needs Xvfb and xdotool";
        ASSERT_EQ(
            scree({"synth", "-o", folder_.file("land"), "--size", "129", "--imagery-scale", "2", "--quiet"}).exit_code,
            0);
        build_store_from({folder_.file("land/dem.tif"), "--imagery", folder_.file("land/ortho.tif")}, store_);
        display_ = std::make_unique<VirtualDisplay>();
        ASSERT_NE(display_->name(), "") << "Xvfb did not start";
        options_.environment = {"DISPLAY=" + display_->name(), "WAYLAND_DISPLAY"};
        options_.limit_s = 60;
    }
    void key(const char* action, const char* name) { run_program("xdotool", {action, name}, options_); }

    TemporaryFolder folder_;
    std::string store_ = folder_.file("s.scree");
    std::unique_ptr<VirtualDisplay> display_;
    ProgramOptions options_;
};

TEST_F(Window, ShowsTheTerrainMovesAndCloses) {
    Screenshot first, second;
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
            for (const char* name : {"f", "f", "l", "l", "h", "h", "bracketleft", "bracketright", "Home"})
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
    Screenshot first, second;
    int step = 0;
    const auto start = std::chrono::steady_clock::now();
    ProgramOptions options = options_;
    options.meanwhile = [&] {
        const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
        if (step == 0 && seconds > 2) {
            if (on_path("import")) first = screenshot(options_, folder_.file("1.png"));
            key("key", "f");
            ++step;
        } else if (step == 1 && seconds > 3) {
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
