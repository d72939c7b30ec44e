// Real elevation data under $SCREE_DATA (facts about each file: its README).
#include <gtest/gtest.h>

#include <cstdlib>

#include "tests/common/test_support.h"
#include "tests/programs/reports.h"

namespace scree::test {
namespace {

std::string data(const std::string& name) {
    const char* root = std::getenv("SCREE_DATA");
    if (root == nullptr) return {};
    const std::string path = std::string(root) + "/" + name;
    return std::filesystem::exists(path) ? path : std::string();
}
#define SCREE_NEEDS(variable, name)          \
    const std::string variable = data(name); \
    if (variable.empty()) GTEST_SKIP() << "needs " << (name) << " in the folder that $SCREE_DATA names"

TEST(RealData, TaipeiMarginsAreAbsentWithoutSpikes) {
    SCREE_NEEDS(dem, "taipei/derived_aster_taipei_40m_twd97.tif");
    const TemporaryFolder folder;
    build_store_from({dem}, folder.file("s.scree"));
    const auto info = expect_sound_store(folder.file("s.scree"), {0.5, 1, 2, 8}, {"4M", "32M"});
    EXPECT_EQ(info["crs"], "EPSG:3826");
    EXPECT_EQ(info["spacing_m"], 40.0);
    EXPECT_EQ(info["cells"], nlohmann::json({631, 561}));
    EXPECT_LT(info["present_cells"].get<int>(), 631 * 561);
    EXPECT_GT(info["present_cells"].get<int>(), 631 * 561 / 2);
    EXPECT_GE(info["height_range_m"][0].get<double>(), 3.0);
    EXPECT_LE(info["height_range_m"][1].get<double>(), 838.0);
}

TEST(RealData, TaipeiWindowOfThePaper) {
    SCREE_NEEDS(dem, "taipei/window_660_30m.tif");
    const TemporaryFolder folder;
    build_store_from({dem}, folder.file("s.scree"));
    const auto info = expect_sound_store(folder.file("s.scree"), {0.5, 1, 2, 8}, {"32M"});
    EXPECT_EQ(info["cells"], nlohmann::json({659, 659}));
}

TEST(RealData, PugetSoundWithItsTexture) {
    SCREE_NEEDS(dem, "puget/ps_height_1k.png");
    SCREE_NEEDS(texture, "puget/ps_texture_1k.png");
    const TemporaryFolder folder;
    build_store_from({dem, "--imagery", texture, "--spacing", "160", "--height-scale", "0.1"}, folder.file("s.scree"));
    const auto info = expect_sound_store(folder.file("s.scree"), {1}, {"4M", "32M"});
    EXPECT_EQ(info["levels"], 6);
    EXPECT_EQ(info["present_cells"], 1024 * 1024);
    EXPECT_NEAR(info["height_range_m"][1].get<double>(), 4379.8, 1e-9);
    EXPECT_EQ(info["height_quantum_error_m"], 0.0);
}

TEST(RealData, AQuadThatIsSlantedAgainstItsGridIsAbsentOutside) {
    SCREE_NEEDS(dem, "formats/SainteHelens.dem");
    const TemporaryFolder folder;
    build_store_from({dem}, folder.file("s.scree"));
    const auto info = expect_sound_store(folder.file("s.scree"), {1, 4}, {"4M", "32M"});
    EXPECT_EQ(info["crs"], "EPSG:26710");
    EXPECT_EQ(info["spacing_m"], 30.0);
    EXPECT_EQ(info["cells"], nlohmann::json({326, 465}));
    EXPECT_LT(info["present_cells"].get<int>(), 148885);
    EXPECT_GT(info["present_cells"].get<int>(), 147000);
    EXPECT_EQ(info["height_range_m"], nlohmann::json({682.0, 2543.0}));
}

TEST(RealData, WhatCannotBeBuiltIsRefusedWithAMessage) {
    if (std::getenv("SCREE_DATA") == nullptr) GTEST_SKIP() << "needs the folder that $SCREE_DATA names";
    const struct {
        const char *file, *words;
    } refused[] = {{"craterlake/craterlake-imagery-30m.tif", "channels"},
                   {"rmnp/rmnp-rgb.tif", "channels"},
                   {"formats/terrarium_fuji.png", "channels"},
                   {"world/earth-topology.png", "--spacing"},
                   {"world/earth-blue-marble.jpg", "channels"},
                   {"taipei/aster_taipei.nc", "not an image"}};
    const TemporaryFolder folder;
    for (const auto& [file, words] : refused) {
        const std::string path = data(file);
        if (path.empty()) continue;
        const auto run = scree({"build", path, "-o", folder.file("s.scree"), "--quiet"});
        EXPECT_EQ(run.exit_code, 3) << file << '\n' << describe(run);
        EXPECT_NE(run.err.find(words), std::string::npos) << file << '\n' << describe(run);
        EXPECT_NE(run.err.find(path), std::string::npos) << file << '\n' << describe(run);
    }
    expect_only(folder.file(""), {});
}

TEST(RealData, BrokenFilesNeverCrashOrHangABuild) {
    if (std::getenv("SCREE_DATA") == nullptr) GTEST_SKIP() << "needs the folder that $SCREE_DATA names";
    const TemporaryFolder folder;
    int tried = 0;
    for (const auto& entry : std::filesystem::directory_iterator(std::string(std::getenv("SCREE_DATA")) + "/bad")) {
        if (!entry.is_regular_file() || std::hash<std::string>{}(entry.path().filename().string()) % 20 != 0) continue;
        ++tried;
        const auto run = scree(
            {"build", entry.path().string(), "-o", folder.file("s.scree"), "--spacing", "30", "--quiet", "--force"},
            within(30));
        EXPECT_TRUE(run.exit_code == 0 || run.exit_code == 2 || run.exit_code == 3) << entry.path() << '\n'
                                                                                    << describe(run);
        EXPECT_TRUE(kSanitized || run.peak_rss_bytes <= std::int64_t{256} << 20)
            << entry.path() << ": " << run.peak_rss_bytes;
    }
    RecordProperty("files", tried);
}

}  // namespace
}  // namespace scree::test
