#include "tools/source/synth.h"

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/tools/source/temp_directory.h"
#include "tools/source/band_pipeline.h"
#include "tools/source/image_source.h"
#include "tools/source/landscape.h"

namespace scree {
namespace {

using test::TempDirectory;

SynthOptions small(const TempDirectory& directory, const std::string& name) {
    SynthOptions options;
    options.directory = directory.path(name);
    options.size = 193;
    options.imagery_scale = 3;
    options.threads = 1;
    return options;
}

std::string dem_bytes(const SynthOptions& options) { return test::read_bytes(options.directory + "/dem.tif"); }

std::string ortho_bytes(const SynthOptions& options) { return test::read_bytes(options.directory + "/ortho.tif"); }

TEST(Synth, TheBytesDoNotDependOnTheThreads) {
    const TempDirectory directory;
    SynthOptions one = small(directory, "one");
    one.size = 1601;  // several bands
    one.imagery_scale = 1;
    SynthOptions three = one;
    three.directory = directory.path("three");
    three.threads = 3;
    ASSERT_TRUE(synthesize(one, {}).ok());
    ASSERT_TRUE(synthesize(three, {}).ok());
    EXPECT_GT(dem_bytes(one).size(), std::size_t{1601} * 1601 * 4);
    EXPECT_EQ(dem_bytes(one), dem_bytes(three));
    EXPECT_EQ(ortho_bytes(one), ortho_bytes(three));
}

TEST(Synth, AnotherSeedIsAnotherLandscape) {
    const TempDirectory directory;
    SynthOptions one = small(directory, "one");
    SynthOptions other = small(directory, "other");
    other.seed = 2;
    ASSERT_TRUE(synthesize(one, {}).ok());
    ASSERT_TRUE(synthesize(other, {}).ok());
    EXPECT_NE(dem_bytes(one), dem_bytes(other));
    EXPECT_NE(ortho_bytes(one), ortho_bytes(other));
}

TEST(Synth, TheFilesSayWhereTheyLieAndCoincide) {
    const TempDirectory directory;
    const SynthOptions options = small(directory, "out");
    const auto report = synthesize(options, {});
    ASSERT_TRUE(report.ok()) << report.error().message;
    const auto dem = ImageSource::open(report->dem_path);
    const auto ortho = ImageSource::open(report->ortho_path);
    ASSERT_TRUE(dem.ok() && ortho.ok());
    EXPECT_EQ((*dem)->info().width, 193);
    EXPECT_EQ((*dem)->info().type, SampleType::f32);
    EXPECT_EQ((*ortho)->info().width, 192 * 3);
    EXPECT_EQ((*ortho)->info().channels, 3);
    const Georeference heights = (*dem)->georeference().value();
    const Georeference colours = (*ortho)->georeference().value();
    EXPECT_TRUE(heights.raster_is_point);
    EXPECT_FALSE(colours.raster_is_point);
    EXPECT_EQ(heights.crs, "EPSG:32633");
    EXPECT_EQ(colours.crs, "EPSG:32633");
    EXPECT_EQ(heights.first_x, 400000);
    EXPECT_EQ(heights.row_y, -10);
    // From the outer edge of the first pixel to that of the last: the extent of the samples.
    EXPECT_DOUBLE_EQ(colours.first_x - colours.column_x / 2, heights.first_x);
    EXPECT_DOUBLE_EQ(colours.first_y - colours.row_y / 2, heights.first_y);
    EXPECT_DOUBLE_EQ(colours.column_x * 192 * 3, heights.column_x * 192);
}

TEST(Synth, TheReportHoldsTheRangeOfTheHeights) {
    const TempDirectory directory;
    const auto report = synthesize(small(directory, "out"), {});
    ASSERT_TRUE(report.ok());
    const auto dem = ImageSource::open(report->dem_path);
    ASSERT_TRUE(dem.ok());
    std::vector<float> values(193 * 193);
    ASSERT_TRUE((*dem)->read_channel(0, 193, std::span<float>(values)).ok());
    EXPECT_EQ(report->lowest_m, *std::min_element(values.begin(), values.end()));
    EXPECT_EQ(report->highest_m, *std::max_element(values.begin(), values.end()));
}

TEST(Synth, CoarserSpacingSamplesTheSameLandscape) {
    const Landscape landscape(1);
    const TempDirectory directory;
    SynthOptions options = small(directory, "coarse");
    options.size = 33;
    options.spacing_m = 80;
    options.imagery_scale = 0;
    const auto report = synthesize(options, {});
    ASSERT_TRUE(report.ok());
    const auto dem = ImageSource::open(report->dem_path);
    ASSERT_TRUE(dem.ok());
    std::vector<float> values(33 * 33);
    ASSERT_TRUE((*dem)->read_channel(0, 33, std::span<float>(values)).ok());
    for (int row = 0; row < 33; ++row)
        for (int column = 0; column < 33; ++column)
            ASSERT_EQ(values[static_cast<std::size_t>(row * 33 + column)],
                      landscape.height_m(80.0 * column, 80.0 * row));
}

TEST(Synth, TheLandscapeHasTheReliefOfMountainsAndFlatLakes) {
    const Landscape landscape(1);
    float highest = 0;
    int lake_samples = 0;
    for (int row = 0; row < 200; ++row) {
        for (int column = 0; column < 200; ++column) {
            const float height = landscape.height_m(column * 204.8, row * 204.8);
            EXPECT_GE(height, Landscape::kLakeLevel_m);
            highest = std::max(highest, height);
            lake_samples += height == Landscape::kLakeLevel_m ? 1 : 0;
        }
    }
    EXPECT_GT(highest, 2000);
    EXPECT_LT(highest, 4500);
    EXPECT_GT(lake_samples, 0);
    EXPECT_LT(lake_samples, 200 * 200 / 4);
}

TEST(Synth, ExistingFilesAreKeptWithoutForceAndReplacedWithIt) {
    const TempDirectory directory;
    SynthOptions options = small(directory, "out");
    std::filesystem::create_directories(options.directory);
    directory.write("out/ortho.tif", "mine");
    const auto refused = synthesize(options, {});
    ASSERT_FALSE(refused.ok());
    EXPECT_NE(refused.error().message.find("--force"), std::string::npos);
    EXPECT_EQ(ortho_bytes(options), "mine");
    options.force = true;
    EXPECT_TRUE(synthesize(options, {}).ok());
    EXPECT_GT(ortho_bytes(options).size(), 1000u);
}

TEST(Synth, StoppingLeavesNothingBehind) {
    const TempDirectory directory;
    SynthOptions options = small(directory, "out");
    const std::atomic<bool> stop{true};
    options.stop = &stop;
    const auto stopped = synthesize(options, {});
    ASSERT_FALSE(stopped.ok());
    EXPECT_EQ(stopped.error().code, ErrorCode::interrupted);
    EXPECT_TRUE(std::filesystem::is_empty(options.directory));
}

TEST(Synth, OptionsOutOfRangeAreUsageErrorsThatNameTheValue) {
    const TempDirectory directory;
    const auto expect_usage = [&](auto change, const std::string& value) {
        SynthOptions options = small(directory, "never");
        change(options);
        const auto refused = synthesize(options, {});
        ASSERT_FALSE(refused.ok()) << value;
        EXPECT_EQ(refused.error().code, ErrorCode::usage);
        EXPECT_NE(refused.error().message.find(value), std::string::npos) << refused.error().message;
        EXPECT_FALSE(std::filesystem::exists(options.directory));
    };
    expect_usage([](SynthOptions& o) { o.size = 2; }, "--size 2");
    expect_usage([](SynthOptions& o) { o.size = (1 << 20) + 1; }, "--size 1048577");
    expect_usage([](SynthOptions& o) { o.spacing_m = 0; }, "--spacing 0");
    expect_usage([](SynthOptions& o) { o.spacing_m = 1e300; }, "wide");
    expect_usage([](SynthOptions& o) { o.imagery_scale = 65; }, "--imagery-scale 65");
    expect_usage([](SynthOptions& o) { o.threads = -1; }, "--threads -1");
}

TEST(Synth, AsMuchAsADiskHoldsIsRefusedBeforeWriting) {
    const TempDirectory directory;
    SynthOptions options = small(directory, "out");
    options.size = 1 << 20;
    options.spacing_m = 1;
    options.imagery_scale = 16;  // 4.4 TB of heights, 844 TB of image
    const auto refused = synthesize(options, {});
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.error().code, ErrorCode::io);
    EXPECT_NE(refused.error().message.find("free"), std::string::npos);
}

TEST(Synth, ProgressEndsAtTheTotal) {
    const TempDirectory directory;
    std::vector<SynthProgress> seen;
    ASSERT_TRUE(synthesize(small(directory, "out"), [&](const SynthProgress& p) { seen.push_back(p); }).ok());
    ASSERT_FALSE(seen.empty());
    EXPECT_EQ(seen.back().pixels_done, seen.back().pixels_total);
    EXPECT_EQ(seen.back().pixels_total, 193 * 193 + 576 * 576);
}

TEST(BandPipeline, BandsAreWrittenInOrderOnceEach) {
    std::vector<std::int64_t> written;
    BandPipeline pipeline;
    pipeline.bands = 200;
    pipeline.threads = 4;
    pipeline.make = [](int, std::int64_t) -> Result<void> { return {}; };
    pipeline.write = [&](int, std::int64_t band) -> Result<void> {
        written.push_back(band);
        return {};
    };
    ASSERT_TRUE(run_bands(pipeline).ok());
    ASSERT_EQ(written.size(), 200u);
    for (std::size_t i = 0; i < written.size(); ++i) EXPECT_EQ(written[i], static_cast<std::int64_t>(i));
}

TEST(BandPipeline, AFailureOrExceptionEndsTheRunWithItsError) {
    for (const bool throws : {false, true}) {
        BandPipeline pipeline;
        pipeline.bands = 50;
        pipeline.threads = 3;
        pipeline.make = [&](int, std::int64_t band) -> Result<void> {
            if (band == 20 && throws) throw std::bad_alloc();
            if (band == 20) return Error{ErrorCode::io, "band 20"};
            return {};
        };
        pipeline.write = [](int, std::int64_t band) -> Result<void> {
            EXPECT_LT(band, 20);
            return {};
        };
        const auto result = run_bands(pipeline);
        ASSERT_FALSE(result.ok());
        EXPECT_EQ(result.error().code, ErrorCode::io);
    }
}

}  // namespace
}  // namespace scree
