// The same picture from a fresh start as after a long flight to the same place; and from the same command twice.
#include <gtest/gtest.h>

#include "runtime/app/display.h"
#include "runtime/view/flight_path.h"
#include "tests/common/test_support.h"
#include "tests/programs/child_program.h"

namespace scree::test {
namespace {

constexpr int kWidth = 240, kHeight = 180;

class Picture : public ::testing::Test {
protected:
    void SetUp() override {
        ASSERT_EQ(
            scree({"synth", "-o", folder_.file("land"), "--size", "513", "--imagery-scale", "2", "--quiet"}).exit_code,
            0);
        const auto built = scree({"build", folder_.file("land/dem.tif"), "--imagery", folder_.file("land/ortho.tif"),
                                  "-o", store_file_, "--texture-size", "64", "--quiet"});
        ASSERT_EQ(built.exit_code, 0) << describe(built);
        auto store = SqliteStore::open(store_file_);
        ASSERT_TRUE(store) << store.error().message;
        store_ = std::move(*store);
    }

    struct View {
        std::unique_ptr<Scene> scene;
        std::unique_ptr<Display> display;
    };
    View open(std::int64_t budget_bytes) {
        SceneOptions options;
        options.budget_bytes = budget_bytes;
        auto scene = Scene::open(*store_, options);
        EXPECT_TRUE(scene) << (scene ? "" : scene.error().message);
        auto display = Display::create(**scene, {kWidth, kHeight});
        if (!display) return {};
        EXPECT_TRUE((*scene)->start(**display));
        return {std::move(*scene), std::move(*display)};
    }
    static Camera camera(const FlightPose& pose) { return *look_at(pose.eye, pose.look, 40, kWidth, kHeight); }
    static std::vector<std::uint8_t> picture(View& view, const Camera& at) {
        auto frame = view.scene->complete({&at, 1});
        EXPECT_TRUE(frame) << (frame ? "" : frame.error().message);
        if (!frame) return {};
        view.display->draw(at, frame->selection->to_render(0), frame->half_curvature);
        return view.display->target().read_pixels();
    }

    TemporaryFolder folder_;
    std::string store_file_ = folder_.file("s.scree");
    std::unique_ptr<SqliteStore> store_;
};

TEST_F(Picture, IsTheSameAfterALongFlightAsFromAFreshStart) {
    auto path = default_flight(*store_, 40);
    ASSERT_TRUE(path) << path.error().message;
    for (const std::int64_t budget : {std::int64_t{3} << 20, std::int64_t{5} << 20, std::int64_t{64} << 20})
        for (const std::size_t last : {12u, 25u, 39u}) {
            SCOPED_TRACE("budget " + std::to_string(budget) + ", frame " + std::to_string(last));
            const Camera end = camera((*path)[last]);
            std::vector<std::uint8_t> flown;
            {  // one context at a time
                View view = open(budget);
                if (!view.display) GTEST_SKIP() << "needs OpenGL 4.5 by surfaceless EGL";
                for (std::size_t k = 0; k < last; ++k) {
                    const Camera at = camera((*path)[k]);
                    const SceneFrame frame = view.scene->advance(
                        {&at, 1}, 0.03 * static_cast<double>(k));  // never waits: tiles arrive in any order
                    view.display->draw(at, frame.selection->to_render(0), frame.half_curvature);
                }
                flown = picture(view, end);
            }
            View fresh = open(budget);
            ASSERT_TRUE(fresh.display);
            const auto expected = picture(fresh, end);
            ASSERT_EQ(flown.size(), expected.size());
            std::size_t differing = 0;
            for (std::size_t k = 0; k < flown.size(); ++k) differing += flown[k] != expected[k] ? 1 : 0;
            EXPECT_EQ(differing, 0u) << "bytes of " << expected.size();
        }
}

TEST_F(Picture, IsTheSameFromTheSameCommandTwice) {
    for (const char* name : {"1.png", "2.png"}) {
        const auto run = scree_view({"shot", store_file_, "-o", folder_.file(name), "--size", "200x200"});
        if (run.exit_code == 6) GTEST_SKIP() << run.err;
        ASSERT_EQ(run.exit_code, 0) << describe(run);
    }
    EXPECT_EQ(read_bytes(folder_.file("1.png")), read_bytes(folder_.file("2.png")));
}

TEST_F(Picture, LooksChangeWhatIsShownAndTheirDefaultsSaidAloudDoNot) {
    const auto shot = [&](const std::vector<std::string>& looks) {
        const std::string png = folder_.file("look.png");
        std::vector<std::string> arguments{"shot", store_file_, "-o", png, "--size", "240x180"};
        arguments.insert(arguments.end(), looks.begin(), looks.end());
        const auto run = scree_view(arguments);
        EXPECT_EQ(run.exit_code, 0) << describe(run);
        return read_bytes(png);
    };
    if (!create_headless_context()) GTEST_SKIP() << "needs OpenGL 4.5 by surfaceless EGL";
    const auto plain = shot({});
    EXPECT_EQ(shot({"--msaa", "0", "--anisotropy", "1", "--edge", "soft"}), plain);
    for (const std::vector<std::string>& looks : {std::vector<std::string>{"--msaa", "4"},
                                                  {"--anisotropy", "8"},
                                                  {"--edge", "hard"},
                                                  {"--sun", "0,20"},
                                                  {"--colour", "level"},
                                                  {"--colour", "geomip"},
                                                  {"--colour", "error"}})
        EXPECT_NE(shot(looks), plain) << looks[0] << ' ' << looks[1];
    EXPECT_EQ(shot({"--sun", "360,20"}), shot({"--sun", "0,20"}));
    // Magenta shows every pixel that no terrain covers, whatever the edge.
    EXPECT_EQ(shot({"--magenta"}), shot({"--magenta", "--edge", "hard"}));
}

}  // namespace
}  // namespace scree::test
