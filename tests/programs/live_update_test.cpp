// A store that is updated under the eyes of the viewer: never a hole, no damage, and in the end the picture of a fresh
// start.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <thread>

#include "runtime/app/coverage.h"
#include "runtime/app/display.h"
#include "tests/common/test_support.h"
#include "tests/programs/reports.h"
#include "tests/programs/sample_inputs.h"

namespace scree::test {
namespace {

constexpr int kWidth = 200, kHeight = 150;
constexpr double kWestX = 400000, kNorthY = 5300000;  // of the land

using List = std::vector<std::string>;

// Land of 400 x 320 cells of 10 m, images of 2.5 m.
class LiveUpdate : public ::testing::Test {
protected:
    void SetUp() override {
        HeightGrid grid = hills(400, 320, 3);
        write_heights(folder_.file("base.tif"), grid);
        image("under.tif", 1600, 1280, 0, 0, 0);
        build(store_file_, {folder_.file("base.tif"), "--imagery", folder_.file("under.tif")});
    }
    void build(const std::string& store, List arguments) {
        arguments.insert(arguments.end(), {"--texture-size", "16", "--force"});
        build_store_from(arguments, store);
    }
    std::string image(const std::string& name, int width, int height, double x, double y, int shade) {
        const Place place{kWestX + x, kNorthY - y, 2.5, 32633, true};
        write_image(folder_.file(name), width, height, 3, 8, &place, [&](int i, int j, int c) {
            return (patchwork(i, j, c) + static_cast<std::uint32_t>(shade)) & 255;
        });
        return folder_.file(name);
    }
    std::string dem(const std::string& name, int width, int height, double x, double y, std::uint64_t seed) {
        Place place;
        place.x += x;
        place.y -= y;
        write_heights(folder_.file(name), hills(width, height, seed, 250), place);
        return folder_.file(name);
    }
    void update(const List& arguments) {
        List all{"update", store_file_};
        all.insert(all.end(), arguments.begin(), arguments.end());
        all.insert(all.end(), {"--quiet", "--sources", folder_.file("")});
        const ProgramRun run = scree(all);
        ASSERT_EQ(run.exit_code, 0) << describe(run);
    }
    // Changes of imagery, of heights, of both; the last leaves other numbers of tiles where `more` makes room.
    void change(int k) {
        switch (k % 3) {
            case 0:
                return update({"--imagery", image("patch.tif", 500, 400, 900, 700, 90 + 7 * k)});
            case 1:
                return update({dem("dent.tif", 90, 70, 1200, 900, 20 + static_cast<std::uint64_t>(k))});
            default:
                return update({"--remove", "patch.tif", "--imagery", image("other.tif", 300, 700, 2500, 300, 11 * k)});
        }
    }

    struct View {
        std::unique_ptr<Scene> scene;
        std::unique_ptr<Display> display;
    };
    View open(std::int64_t budget_bytes) {
        auto store = SqliteStore::open(store_file_);
        EXPECT_TRUE(store) << store.error().message;
        SceneOptions options;
        options.budget_bytes = budget_bytes;
        options.follow = true;
        auto scene = Scene::open(std::move(*store), options);
        EXPECT_TRUE(scene) << scene.error().message;
        auto display = Display::create(**scene, {kWidth, kHeight});
        if (!display) return {};
        EXPECT_TRUE((*scene)->start(**display));
        // In this order: the scene's threads end before what they fill.
        return {std::move(*scene), std::move(*display)};
    }
    // Round the land, looking across it.
    static Camera camera(double turn) {
        const double x = kWestX + 2000, y = kNorthY - 1600;
        const glm::dvec3 eye{x + 1500 * std::cos(turn), y + 1300 * std::sin(turn), 1600};
        return *look_at(eye, {x, y, 150}, 50, kWidth, kHeight);
    }
    static std::vector<std::uint8_t> picture(View& view, const Camera& at) {
        auto frame = view.scene->complete({&at, 1});
        EXPECT_TRUE(frame) << (frame ? "" : frame.error().message);
        if (!frame) return {};
        view.display->draw(at, frame->selection->to_render(0), frame->half_curvature);
        return view.display->target().read_pixels();
    }
    static std::size_t differing(const std::vector<std::uint8_t>& a, const std::vector<std::uint8_t>& b) {
        if (a.size() != b.size()) return std::max(a.size(), b.size());
        std::size_t count = 0;
        for (std::size_t k = 0; k < a.size(); ++k) count += a[k] != b[k] ? 1 : 0;
        return count;
    }
    std::string write_path() {
        const std::string path = folder_.file("path.csv");
        std::ofstream out(path);
        out << "eye_x,eye_y,eye_z,look_x,look_y,look_z\n";
        for (int k = 0; k <= 24; ++k) {
            const Camera at = camera(0.2 * k);
            const glm::dvec3 look = at.eye + 1000.0 * at.forward;
            out.precision(17);
            out << at.eye.x << ',' << at.eye.y << ',' << at.eye.z << ',' << look.x << ',' << look.y << ',' << look.z
                << '\n';
        }
        return path;
    }
    // Flies while the store changes `changes` times; ever longer flights, until one saw the last change.
    nlohmann::json fly_through(List arguments, int changes, const std::function<void(int)>& change) {
        for (int frames = 600; frames <= 600 << 6; frames *= 2) {
            int made = 0, looks = 0;
            ProgramOptions options = within(280);
            options.meanwhile = [&] {
                // Not before it has opened the store.
                if (made < changes && !HasFatalFailure() && ++looks > 300) change(made++);
            };
            List all{"fly",     store_file_, "--headless",          "--json", "-", "--size",
                     "160x120", "--frames",  std::to_string(frames)};
            all.insert(all.end(), arguments.begin(), arguments.end());
            const ProgramRun run = scree_view(all, options);
            if (run.exit_code == 6) return {};
            EXPECT_EQ(run.exit_code, 0) << describe(run);
            if (run.exit_code != 0 || HasFatalFailure()) return {};
            const auto report = report_of(run);
            EXPECT_EQ(run.err, "");
            if (made == changes && report.value("store_updates", 0) >= 1) return report;
        }
        ADD_FAILURE() << "no flight was long enough to see an update";
        return {};
    }

    TemporaryFolder folder_;
    const std::string store_file_ = folder_.file("s.scree");
};

TEST_F(LiveUpdate, AFlightGoesOnOverUpdatesWithoutAHole) {
    const auto report = fly_through({"--path", write_path(), "--budget", "4M"}, 4, [&](int k) { change(k); });
    if (report.is_null()) GTEST_SKIP() << "needs OpenGL 4.5 by surfaceless EGL";
    EXPECT_EQ(report.value("holes", -1), 0);
    EXPECT_EQ(report.value("damaged_tiles", -1), 0);
    EXPECT_LE(report.value("peak_resident_bytes", std::int64_t{0}), report.value("budget_bytes", std::int64_t{0}));
}

TEST_F(LiveUpdate, TheLastPictureOfAFlightIsThatOfAFreshOne) {
    const std::string path = write_path();
    const auto report = fly_through({"--path", path, "--wait", "--last-frame", folder_.file("flown.png")}, 1,
                                    [&](int k) { change(k); });
    if (report.is_null()) GTEST_SKIP() << "needs OpenGL 4.5 by surfaceless EGL";
    EXPECT_EQ(report.value("holes", -1), 0);
    EXPECT_EQ(report.value("frames_with_stand_ins", -1), 0);
    EXPECT_EQ(report.value("damaged_tiles", -1), 0);
    const ProgramRun fresh = scree_view({"fly", store_file_, "--headless", "--size", "160x120", "--path", path,
                                         "--frames", "2", "--wait", "--last-frame", folder_.file("fresh.png")});
    ASSERT_EQ(fresh.exit_code, 0) << describe(fresh);
    EXPECT_EQ(read_bytes(folder_.file("flown.png")), read_bytes(folder_.file("fresh.png")));
}

TEST_F(LiveUpdate, PicturesSettleToThoseOfAFreshStartUnderAnyBudget) {
    int changes = 0;
    for (const std::int64_t budget : {std::int64_t{3} << 20, std::int64_t{6} << 20, std::int64_t{64} << 20}) {
        SCOPED_TRACE("budget " + std::to_string(budget));
        std::vector<std::uint8_t> flown, before;
        const Camera end = camera(1.3);
        {  // one context at a time
            View view = open(budget);
            if (!view.display) GTEST_SKIP() << "needs OpenGL 4.5 by surfaceless EGL";
            before = picture(view, end);
            std::int64_t holes = 0, both = 0;
            const auto start = std::chrono::steady_clock::now();
            const auto fly_until = [&](const std::function<bool()>& done) {
                for (int k = 0; !done() && !HasFatalFailure(); ++k) {
                    ASSERT_TRUE(view.scene->follow());
                    const Camera at = camera(1.3 + 0.002 * k);
                    const double now_s =
                        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
                    const SceneFrame frame = view.scene->advance({&at, 1}, now_s);
                    both += frame.taking_over ? 1 : 0;
                    view.display->draw(at, frame.selection->to_render(0), frame.half_curvature);
                    holes += count_holes(view.scene->dataset(), view.scene->pager().residency(), at,
                                         frame.selection->draws[0], frame.half_curvature);
                    ASSERT_LE(view.scene->memory().resident_bytes, budget);
                    ASSERT_LE(k, 200000) << "an update is never taken up";
                }
            };
            for (int k = 0; k < 3; ++k) {
                std::thread updating([&] { change(changes++); });
                const std::int64_t seen = view.scene->updates();
                fly_until([&] { return view.scene->updates() > seen; });
                updating.join();
            }
            EXPECT_EQ(holes, 0);
            EXPECT_GT(both, 0);
            EXPECT_EQ(view.scene->counters().damaged_tiles, 0);
            // What the last one left, if it was seen half-way: has_changed() is the viewer's own question.
            fly_until([&] { return !view.scene->shared_store()->has_changed(); });
            flown = picture(view, end);
        }
        View fresh = open(budget);
        ASSERT_TRUE(fresh.display);
        const auto expected = picture(fresh, end);
        EXPECT_EQ(differing(flown, expected), 0u) << "bytes of " << expected.size();
        EXPECT_GT(differing(before, expected), expected.size() / 20) << "the updates are to be seen";
    }
}

TEST_F(LiveUpdate, AStoreThatNeedsItsMemoryDividedAnewIsTakenUpAsWell) {
    // Half of the land is void at first: other numbers of tiles, other slots.
    HeightGrid grid = hills(400, 320, 3);
    for (int j = 0; j < 320; ++j)
        for (int i = 90; i < 400; ++i) grid.at(i, j) = -9999;
    write_heights(folder_.file("half.tif"), grid, {}, "-9999");
    build(store_file_, {folder_.file("half.tif"), "--imagery", folder_.file("under.tif")});
    const std::string rest = dem("rest.tif", 300, 300, 1000, 100, 5);
    const Camera end = camera(2.1);
    std::vector<std::uint8_t> flown;
    {
        View view = open(std::int64_t{64} << 20);
        if (!view.display) GTEST_SKIP() << "needs OpenGL 4.5 by surfaceless EGL";
        picture(view, end);
        const MemoryPlan before = view.scene->memory();
        update({rest});
        while (view.scene->updates() == 0) {
            ASSERT_TRUE(view.scene->follow());
            const SceneFrame frame = view.scene->advance({&end, 1}, 0);
            view.display->draw(end, frame.selection->to_render(0), frame.half_curvature);
            EXPECT_EQ(count_holes(view.scene->dataset(), view.scene->pager().residency(), end,
                                  frame.selection->draws[0], frame.half_curvature),
                      0);
        }
        EXPECT_GT(view.scene->memory().height_slots, before.height_slots);
        flown = picture(view, end);
        EXPECT_EQ(view.scene->counters().damaged_tiles, 0);
    }
    View fresh = open(std::int64_t{64} << 20);
    EXPECT_EQ(fresh.scene->updates(), 0);
    const auto expected = picture(fresh, end);
    EXPECT_EQ(differing(flown, expected), 0u) << "bytes of " << expected.size();
}

TEST_F(LiveUpdate, AReplacedStoreIsTakenUpWhereItsLatticeIsTheSame) {
    const auto report = fly_through({"--path", write_path()}, 1, [&](int) {
        build(store_file_, {folder_.file("base.tif"), "--imagery", image("fresh.tif", 1600, 1280, 0, 0, 120)});
    });
    if (report.is_null()) GTEST_SKIP() << "needs OpenGL 4.5 by surfaceless EGL";
    EXPECT_EQ(report.value("holes", -1), 0);
    EXPECT_EQ(report.value("damaged_tiles", -1), 0);
}

TEST_F(LiveUpdate, AnotherStoreInItsPlaceEndsTheFlight) {
    const std::string path = write_path(), large = dem("large.tif", 500, 500, 0, 0, 9);
    ProgramOptions options = within(250);
    int waited_ms = 0;
    options.meanwhile = [&] {
        if (++waited_ms == 300) build(store_file_, {large});
    };
    const ProgramRun run = scree_view({"fly", store_file_, "--headless", "--size", "160x120", "--path", path,
                                       "--frames", "1000000", "--budget", "8M"},
                                      options);
    if (run.exit_code == 6) GTEST_SKIP() << run.err;
    EXPECT_EQ(run.exit_code, 4) << describe(run);
    EXPECT_NE(run.err.find("another store has taken its place, with another lattice"), std::string::npos) << run.err;
}

}  // namespace
}  // namespace scree::test
