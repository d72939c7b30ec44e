// From a GeoTIFF to a checked flight, the way a user goes: build, info, verify, audit, fly.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/common/test_support.h"
#include "tests/programs/reports.h"
#include "tests/programs/sample_inputs.h"

namespace scree::test {
namespace {

constexpr float kVoid = std::numeric_limits<float>::quiet_NaN();

TEST(Pipeline, SyntheticLandscapeWithImageryKeepsEveryPromise) {
    const TemporaryFolder folder;
    ASSERT_EQ(scree({"synth", "-o", folder.file("land"), "--size", "257", "--imagery-scale", "4", "--quiet"}).exit_code,
              0);
    build_store_from({folder.file("land/dem.tif"), "--imagery", folder.file("land/ortho.tif")}, folder.file("s.scree"));
    const auto info = expect_sound_store(folder.file("s.scree"));
    EXPECT_EQ(info["crs"], "EPSG:32633");
    EXPECT_EQ(info["levels"], 4);
    EXPECT_EQ(info["texture_levels"], 3);
    EXPECT_EQ(info["roots"], nlohmann::json({1, 1}));
}

TEST(Pipeline, OddShapesKeepEveryPromise) {
    const TemporaryFolder folder;
    const struct {
        int width, height;
        const char* tile;
    } shapes[] = {{2, 2, "33"},  {2, 131, "5"},   {131, 2, "9"},  {34, 33, "33"},
                  {97, 41, "9"}, {63, 130, "17"}, {300, 37, "65"}};
    for (const auto& shape : shapes) {
        SCOPED_TRACE(std::to_string(shape.width) + " x " + std::to_string(shape.height));
        const std::string dem = folder.file("d.tif"), store = folder.file("d.scree");
        write_heights(dem, hills(shape.width, shape.height, 5));
        build_store_from({dem, "--tile-size", shape.tile, "--texture-size", "32", "--force"}, store);
        const auto info = expect_sound_store(store, {1}, {"8M"});
        EXPECT_EQ(info["present_cells"], (shape.width - 1) * (shape.height - 1));
    }
}

TEST(Pipeline, NanMarginsAreAbsentAndRaiseNoSpikes) {
    const TemporaryFolder folder;
    HeightGrid grid = hills(150, 121, 6);
    float low = 1e9F, high = -1e9F;
    for (int j = 0; j < grid.height; ++j)
        for (int i = 0; i < grid.width; ++i) {
            if (i + j / 2 < 40 || i - j > 70 || j > 110) grid.at(i, j) = kVoid;
            if (std::isnan(grid.at(i, j))) continue;
            low = std::min(low, grid.at(i, j));
            high = std::max(high, grid.at(i, j));
        }
    int present = 0;
    for (int j = 0; j + 1 < grid.height; ++j)
        for (int i = 0; i + 1 < grid.width; ++i)
            present +=
                !std::isnan(grid.at(i, j) + grid.at(i + 1, j) + grid.at(i, j + 1) + grid.at(i + 1, j + 1)) ? 1 : 0;
    write_heights(folder.file("d.tif"), grid);
    build_store_from({folder.file("d.tif"), "--tile-size", "9", "--texture-size", "16"}, folder.file("d.scree"));
    const auto info = expect_sound_store(folder.file("d.scree"));
    EXPECT_EQ(info["present_cells"], present);
    EXPECT_EQ(info["height_range_m"], nlohmann::json({low, high}));
}

TEST(Pipeline, NodataTagOfAnIntegerFileIsVoidAndHeightsStayLossless) {
    const TemporaryFolder folder;
    HeightGrid grid = hills(70, 90, 7);
    for (int j = 30; j < 50; ++j)
        for (int i = 10; i < 33; ++i) grid.at(i, j) = -32768;
    write_heights_i16(folder.file("d.tif"), grid, {}, "-32768");
    build_store_from({folder.file("d.tif"), "--fill", "none"}, folder.file("d.scree"));
    const auto info = expect_sound_store(folder.file("d.scree"), {1}, {"4M"});
    EXPECT_EQ(info["present_cells"], 69 * 89 - 24 * 21);
    EXPECT_EQ(info["height_quantum_m"], 1.0);
    EXPECT_EQ(info["height_quantum_error_m"], 0.0);
    EXPECT_GT(info["height_range_m"][0], -1000.0);

    // The same without a tag: the option says it.
    write_heights_i16(folder.file("e.tif"), grid, {});
    build_store_from({folder.file("e.tif"), "--nodata", "-32768"}, folder.file("e.scree"));
    EXPECT_EQ(report_of(scree({"info", folder.file("e.scree"), "--json", "-"}))["height_range_m"],
              info["height_range_m"]);
}

TEST(Pipeline, HeightScaleAndOffsetOfAnUnplacedIntegerFile) {
    const TemporaryFolder folder;
    const HeightGrid grid = hills(80, 60, 8);
    write_heights_u16(folder.file("d.tif"), grid, nullptr);
    build_store_from({folder.file("d.tif"), "--spacing", "160", "--height-scale", "0.1", "--height-offset", "-50"},
                     folder.file("d.scree"));
    const auto info = expect_sound_store(folder.file("d.scree"), {0.5, 2}, {"4M"});
    const auto [low, high] = std::minmax_element(grid.z.begin(), grid.z.end());
    EXPECT_EQ(info["spacing_m"], 160.0);
    EXPECT_EQ(info["crs"], "");
    EXPECT_EQ(info["origin_m"], nlohmann::json({0.0, 0.0}));
    EXPECT_EQ(info["height_quantum_m"], 0.1);
    EXPECT_NEAR(info["height_range_m"][0].get<double>(), *low * 0.1 - 50, 1e-9);
    EXPECT_NEAR(info["height_range_m"][1].get<double>(), *high * 0.1 - 50, 1e-9);
}

TEST(Pipeline, ImageryOfAnotherExtentAndResolution) {
    const TemporaryFolder folder;
    write_heights(folder.file("d.tif"), hills(120, 90, 9));
    const Place partly{400000 - 333, 5300000 - 127.5, 3.7, 32633, true};
    write_image(folder.file("i.tif"), 251, 97, 3, 8, &partly, patchwork);
    build_store_from({folder.file("d.tif"), "--imagery", folder.file("i.tif"), "--texture-size", "64"},
                     folder.file("d.scree"));
    const auto info = expect_sound_store(folder.file("d.scree"), {1}, {"4M"});
    EXPECT_EQ(info["has_imagery"], true);
    EXPECT_LE(info["texel_m"].get<double>(), 1.1 * 3.7);
    EXPECT_GT(info["texel_m"].get<double>(), 1.1 * 3.7 / 2);
}

TEST(Pipeline, ImageryFinerThanEightTexelsACellMakesTexturesDeeperThanHeights) {
    const TemporaryFolder folder;
    HeightGrid grid = hills(20, 17, 10);
    grid.at(12, 9) = kVoid;
    write_heights(folder.file("d.tif"), grid);
    const Place whole{400000, 5300000, 0.9, 32633, true};
    write_image(folder.file("i.tif"), 211, 178, 3, 8, &whole, patchwork);
    build_store_from(
        {folder.file("d.tif"), "--imagery", folder.file("i.tif"), "--tile-size", "17", "--texture-size", "16"},
        folder.file("d.scree"));
    const auto info = expect_sound_store(folder.file("d.scree"), {1}, {"4M"});
    EXPECT_GE(info["spacing_m"].get<double>() / info["texel_m"].get<double>(), 8.0);
    EXPECT_GT(info["texture_levels"].get<int>(), info["levels"].get<int>());
}

TEST(Pipeline, GreyAlphaAndSixteenBitImagery) {
    const TemporaryFolder folder;
    write_heights(folder.file("d.tif"), hills(40, 40, 11));
    const Place whole{399995, 5300005, 5, 32633, true};
    const struct { int channels, bits; } kinds[] = {{1, 8}, {2, 8}, {3, 16}, {4, 8}, {4, 16}, {1, 16}};
    for (const auto& kind : kinds) {
        SCOPED_TRACE(std::to_string(kind.channels) + " channels of " + std::to_string(kind.bits) + " bits");
        write_image(folder.file("i.tif"), 80, 80, kind.channels, kind.bits, &whole, [&](int x, int y, int c) {
            if (kind.channels % 2 == 0 && c == kind.channels - 1) return x < 40 ? (1u << kind.bits) - 1 : 0u;
            return patchwork(x, y, c) << (kind.bits - 8);
        });
        build_store_from({folder.file("d.tif"), "--imagery", folder.file("i.tif"), "--force"}, folder.file("d.scree"));
        expect_sound_store(folder.file("d.scree"), {1}, {"4M"});
    }
}

TEST(Pipeline, MemoryCeilingBoundsTheResidentSize) {
    if (kSanitized) GTEST_SKIP() << "AddressSanitizer's own memory hides the program's";
    const TemporaryFolder folder;
    ASSERT_EQ(
        scree({"synth", "-o", folder.file("land"), "--size", "1025", "--imagery-scale", "4", "--quiet"}).exit_code, 0);
    for (const char* memory : {"192M", "256M"}) {
        const auto run = scree({"build", folder.file("land/dem.tif"), "--imagery", folder.file("land/ortho.tif"), "-o",
                                folder.file("s.scree"), "--memory", memory, "--quiet", "--force"});
        EXPECT_EQ(run.exit_code, 0) << describe(run);
        EXPECT_LE(run.peak_rss_bytes, (memory[0] == '1' ? std::int64_t{192} : std::int64_t{256}) << 20);
    }
}

}  // namespace
}  // namespace scree::test
