// Heights of another vertical datum, from file to store and back.
#include <gtest/gtest.h>

#include <filesystem>

#include "tests/common/test_support.h"
#include "tests/programs/reports.h"
#include "tests/tools/source/test_tiff.h"

namespace scree::test {
namespace {

constexpr int kUsage = 2, kInput = 3;

// A bowl of 40 x 40 samples, 0 in the middle and 64 m in the corners, by default as depths.
std::string write_bowl(const std::string& path, int vertical) {
    auto t = layout_of<float>(40, 40);
    t.scale = {25, 25, 0};
    t.tie_points = {0, 0, 0, 500000, 4400000, 0};
    t.model_type = ModelTypeProjected;
    t.projected = 32613;
    t.raster_type = RasterPixelIsPoint;
    t.vertical = vertical;
    std::vector<float> z;
    for (int r = 0; r < 40; ++r)
        for (int c = 0; c < 40; ++c) z.push_back(static_cast<float>((c - 20) * (c - 20) + (r - 20) * (r - 20)) / 12.5F);
    EXPECT_TRUE(write_tiff(path, t, z.data()));
    return path;
}

TEST(PlacementOfDatums, DepthsLieBelowTheSeaTheyAreMeasuredFrom) {
    const TemporaryFolder folder;
    const std::string dem = write_bowl(folder.file("depths.tif"), 5715), store = folder.file("s.scree");
    build_store_from({dem, "--vertical-crs", "EPSG:5714"}, store);
    EXPECT_EQ(report_of(scree({"info", store, "--json", "-"}))["vertical_datum"], "EPSG:5714");
    const auto at = [&](const std::string& x, const std::string& y) {
        return report_of(scree({"height", store, x, y, "--json", "-"}))["points"][0]["height_m"].get<double>();
    };
    EXPECT_NEAR(at("500500", "4399500"), 0, 1.0 / 64);
    EXPECT_NEAR(at("500000", "4400000"), -64, 1.0 / 64);
    // The audit reads the file above the datum of the store.
    ProgramOptions beside;
    beside.environment = {"PATH=" + std::filesystem::path(SCREE_PROGRAM).parent_path().string()};
    const auto audit = report_of(scree_view({"audit", store, "--against", dem, "--json", "-"}, beside));
    EXPECT_GT(audit["against"]["samples"].get<int>(), 1000);
    EXPECT_LT(audit["against"]["max_error_px"].get<double>(), 1.5);
    EXPECT_EQ(scree({"verify", store, "--quiet"}).exit_code, 0);
}

TEST(PlacementOfDatums, WhatCannotBeConvertedIsRefusedAndLeavesNothing) {
    const TemporaryFolder folder;
    const std::string dem = write_bowl(folder.file("heights.tif"), 5703), store = folder.file("s.scree");
    const auto expect_refused = [&](const std::string& datum, int code, const std::string& words) {
        const ProgramRun run = scree({"build", dem, "-o", store, "--vertical-crs", datum});
        EXPECT_EQ(run.exit_code, code) << describe(run);
        EXPECT_NE(run.err.find(words), std::string::npos) << describe(run);
        expect_only(folder.file(""), {"heights.tif"});
    };
    expect_refused("EPSG:3855", kInput, "grid that is not installed");
    expect_refused("EPSG:5715", kUsage, "metres upwards");
    expect_refused("EGM96", kUsage, "\"EGM96\"");
}

}  // namespace
}  // namespace scree::test
