// Golden pictures: the whole way from a synthetic landscape to a PNG, compared with pictures that were looked at.
// Drivers round differently, so a share of the pixels may differ a little. SCREE_UPDATE_GOLDEN=1 rewrites them: look
// before committing.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <string>

#include "tests/runtime/render/image_compare.h"

namespace scree {
namespace {

namespace fs = std::filesystem;

int run(const std::string& command) { return std::system(command.c_str()); }

// One landscape and two stores for all tests of this file: with its image, and with the tint alone.
class Golden : public ::testing::Test {
protected:
    static void SetUpTestSuite() {
        folder_ = fs::temp_directory_path() / fmt::format("scree golden {}", ::getpid());
        fs::create_directories(folder_);
        const std::string scree = fmt::format("\"{}\"", SCREE_PROGRAM);
        ready_ = run(fmt::format("{} synth -o \"{}\" --size 257 --spacing 80 --imagery-scale 4 --quiet", scree,
                                 folder_.string())) == 0 &&
                 run(fmt::format("{} build \"{}/dem.tif\" --imagery \"{}/ortho.tif\" -o \"{}/image.scree\" --quiet",
                                 scree, folder_.string(), folder_.string(), folder_.string())) == 0 &&
                 run(fmt::format("{} build \"{}/dem.tif\" -o \"{}/tint.scree\" --quiet", scree, folder_.string(),
                                 folder_.string())) == 0;
    }
    static void TearDownTestSuite() {
        std::error_code ignored;
        fs::remove_all(folder_, ignored);
    }

    // LIBGL_ALWAYS_SOFTWARE: the same rasteriser on every machine.
    static void expect_picture(const std::string& name, const std::string& store, const std::string& view) {
        ASSERT_TRUE(ready_) << "synth or build failed";
        const fs::path golden = fs::path(SCREE_GOLDEN_FOLDER) / (name + ".png");
        const fs::path found = folder_ / (name + ".png");
        const int status = run(
            fmt::format("LIBGL_ALWAYS_SOFTWARE=1 \"{}\" shot \"{}/{}.scree\" -o \"{}\" --size 320x200 {} > /dev/null",
                        SCREE_VIEW_PROGRAM, folder_.string(), store, found.string(), view));
        ASSERT_EQ(status, 0);
        if (std::getenv("SCREE_UPDATE_GOLDEN") != nullptr)
            fs::copy_file(found, golden, fs::copy_options::overwrite_existing);
        const fs::path difference = fs::path("golden_difference_" + name + ".png");
        const auto expected = load_png(golden);
        const auto actual = load_png(found);
        ASSERT_TRUE(expected.ok()) << expected.error().message;
        ASSERT_TRUE(actual.ok()) << actual.error().message;
        const auto result = compare_images(*expected, *actual, {12, 0.02}, difference);
        EXPECT_TRUE(result.same) << result.message << "; see " << fs::absolute(difference);
    }

    static inline fs::path folder_;
    static inline bool ready_ = false;
};

TEST_F(Golden, OverviewShowsTheWholeTerrain) { expect_picture("overview", "image", "--fov 45"); }

TEST_F(Golden, LowViewShowsRidgesUnderTheSky) {
    expect_picture("low", "image", "--fov 50 --eye 409000,5289000,2300 --look 414000,5295000,1300");
}

TEST_F(Golden, TintShowsReliefWhereThereIsNoImagery) {
    expect_picture("tint", "tint", "--fov 50 --eye 409000,5289000,2300 --look 414000,5295000,1300");
}

TEST_F(Golden, StraightDownHasNorthAtTheTop) {
    expect_picture("down", "image", "--fov 40 --eye 410240,5289760,26000 --look 410240,5289760,0");
}

}  // namespace
}  // namespace scree
