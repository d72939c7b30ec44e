// Heights that had to be resampled: what the build states of its cost is true, by the files themselves.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/common/test_support.h"
#include "tests/programs/reports.h"
#include "tests/programs/sample_inputs.h"

namespace scree::test {
namespace {

constexpr double kStepDeg = 0.001;  // of write_geographic_heights

// A smooth land of longitude and latitude, `sharp` of it in waves of 20 samples.
HeightGrid analytic(int width, int height, double sharp, int shifted = 0) {
    HeightGrid grid{width, height,
                    std::vector<float>(static_cast<std::size_t>(width) * static_cast<std::size_t>(height))};
    for (int j = 0; j < height; ++j)
        for (int i = 0; i < width; ++i) {
            const double u = (i + shifted) * kStepDeg, v = j * kStepDeg;
            grid.at(i, j) = static_cast<float>(900 + 500 * std::sin(40 * u + 1) * std::cos(35 * v) +
                                               sharp * std::sin(314 * u) * std::sin(300 * v));
        }
    return grid;
}

class Warped : public ::testing::Test {
protected:
    ProgramRun audit(const std::vector<std::string>& against, const std::string& tau,
                     const std::string& exaggeration = "1") {
        std::vector<std::string> arguments{"audit",    store_, "--tau",  tau, "--exaggeration", exaggeration,
                                           "--frames", "6",    "--json", "-", "--against"};
        arguments.insert(arguments.end(), against.begin(), against.end());
        ProgramOptions options;
        options.environment = {"PATH=" + std::filesystem::path(SCREE_PROGRAM).parent_path().string()};
        return scree_view(arguments, options);
    }
    void expect_kept(const std::vector<std::string>& against, std::int64_t least_samples) {
        for (const auto& [tau, exaggeration] :
             {std::pair("0.05", "1"), std::pair("1", "1"), std::pair("4", "1"), std::pair("1", "10")}) {
            const auto report = report_of(audit(against, tau, exaggeration));
            EXPECT_EQ(report.value("kept", false), true);
            ASSERT_TRUE(report.contains("against")) << report.dump();
            EXPECT_EQ(report["against"]["samples_not_drawn"], 0);
            // High above, less is in view.
            EXPECT_GT(report["against"]["samples"], std::string(exaggeration) == "1" ? least_samples : 500);
            EXPECT_LE(report["against"]["max_error_less_stated_px"].get<double>(), std::stod(tau) + 1e-3);
        }
    }
    void expect_verified() {
        const auto report = report_of(scree({"verify", store_, "--quiet", "--json", "-"}));
        EXPECT_EQ(report.value("bound_violations", -1), 0);
    }

    TemporaryFolder folder_;
    const std::string store_ = folder_.file("s.scree"), dem_ = folder_.file("d.tif");
};

TEST_F(Warped, ADemInDegreesIsBuiltInItsUtmZoneAndWithinWhatIsStatedOfItsFile) {
    write_geographic_heights(dem_, analytic(240, 200, 20));
    const auto built = build_store_from({dem_}, store_);
    EXPECT_EQ(report_of(scree({"info", store_, "--json", "-"})).value("crs", ""), "EPSG:32633");
    expect_verified();
    expect_kept({dem_}, 20000);
    // At most what linear interpolation over a cell and a sample's distance loses of waves of 20 samples, each way.
    const double error_m = built.value("warp_error_m", -1.0), rms_m = built.value("warp_rms_m", -1.0);
    EXPECT_GT(error_m, rms_m);
    EXPECT_GT(rms_m, 0.01);
    EXPECT_LT(error_m, 20 * 2 * std::pow(2 * 3.1416 / 20, 2) / 4 * 2);
    EXPECT_EQ(report_of(scree({"info", store_, "--json", "-"})).value("warp_error_m", -1.0), error_m);
}

TEST_F(Warped, AnotherFileOrAnotherPlaceIsSeen) {
    write_geographic_heights(dem_, analytic(240, 200, 0));
    build_store_from({dem_}, store_);
    write_geographic_heights(folder_.file("moved.tif"), analytic(240, 200, 0, 1));
    const auto run = audit({folder_.file("moved.tif")}, "1");
    EXPECT_EQ(run.exit_code, 1) << describe(run);
}

TEST_F(Warped, WhatIsStatedDoesNotDependOnThreads) {
    write_geographic_heights(dem_, hills(200, 150, 7));
    const auto one = build_store_from({dem_, "--threads", "1", "--force"}, store_);
    const std::string digest = digest_of(store_);
    const auto four = build_store_from({dem_, "--threads", "4", "--force"}, store_);
    EXPECT_EQ(one["warp_error_m"], four["warp_error_m"]);
    EXPECT_EQ(one["warp_rms_m"], four["warp_rms_m"]);
    EXPECT_EQ(digest, digest_of(store_));
}

TEST_F(Warped, LayersOfTwoGridsWithVoidsAreWithinWhatIsStatedOfBothFiles) {
    HeightGrid below = analytic(240, 200, 20);
    for (int j = 50; j < 80; ++j)
        for (int i = 20; i < 40; ++i) below.at(i, j) = -9999;
    write_geographic_heights(dem_, below);
    // A metric grid of 40 m in the middle, 30 m higher, with a void in it.
    HeightGrid above = hills(120, 90, 3, 100);
    for (int j = 40; j < 50; ++j)
        for (int i = 40; i < 60; ++i) above.at(i, j) = -9999;
    write_heights(folder_.file("top.tif"), above, {468000, 5228000, 40, 32633, false});
    build_store_from({dem_, folder_.file("top.tif"), "--nodata", "-9999", "--crs", "EPSG:32633"}, store_);
    expect_verified();
    expect_kept({dem_, folder_.file("top.tif"), "--nodata", "-9999"}, 30000);
}

TEST_F(Warped, CopiedHeightsStateNoCost) {
    write_heights(dem_, hills(100, 80, 3));
    const auto built = build_store_from({dem_}, store_);
    EXPECT_EQ(built.value("warp_error_m", -1.0), 0);
    EXPECT_EQ(report_of(scree({"info", store_, "--json", "-"})).value("warp_error_m", -1.0), 0);
    expect_kept({dem_}, 2000);
}

}  // namespace
}  // namespace scree::test
