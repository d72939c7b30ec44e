// `scree samples`: what it writes is what the sources hold, where they say it stands; what it refuses, a build refuses.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <limits>

#include "runtime/app/source_samples.h"
#include "tests/common/test_support.h"
#include "tests/programs/reports.h"
#include "tests/programs/sample_inputs.h"
#include "tests/tools/source/test_tiff.h"

namespace scree::test {
namespace {

constexpr int kUsage = 2, kInput = 3, kIo = 5;

void expect_grid(const SourceRaster& r, const HeightGrid& grid, const std::function<double(float)>& height) {
    ASSERT_EQ(r.columns, grid.width);
    ASSERT_EQ(r.rows, grid.height);
    for (int j = 0; j < grid.height; ++j)
        for (int i = 0; i < grid.width; ++i) {
            const double expected = height(grid.at(i, j));
            if (std::isnan(expected))
                ASSERT_TRUE(std::isnan(r.at(i, j))) << i << ", " << j;
            else
                ASSERT_EQ(r.at(i, j), expected) << i << ", " << j;
        }
}
double as_it_is(float z) { return z; }

class Samples : public ::testing::Test {
protected:
    Result<SourceSamples> samples_of(std::vector<std::string> arguments) {
        arguments.insert(arguments.begin(), "samples");
        arguments.insert(arguments.end(), {"-o", out_, "--force", "--json", "-", "--quiet"});
        report_ = report_of(scree(arguments));
        return SourceSamples::open(out_);
    }

    TemporaryFolder folder_;
    const std::string out_ = folder_.file("s.smp"), dem_ = folder_.file("h\xC3\xB6hen 1.tif");
    nlohmann::json report_;
};

TEST_F(Samples, StandWhereTheirFilesSayAndAreTheirValues) {
    HeightGrid point = hills(70, 41, 3), area = hills(33, 90, 4);
    point.at(5, 6) = point.at(69, 40) = -9999;
    point.at(7, 8) = std::numeric_limits<float>::quiet_NaN();
    point.at(9, 9) = -std::numeric_limits<float>::infinity();
    write_heights(dem_, point, {400000, 5300000, 10, 32633, false}, "-9999");
    const Place place{600000, 5200000, 25, 32633, true};
    write_heights_u16(folder_.file("area.tif"), area, &place);
    const auto samples = samples_of({dem_, folder_.file("area.tif")});
    ASSERT_TRUE(samples) << samples.error().message;
    ASSERT_EQ(samples->rasters().size(), 2u);
    const SourceRaster &first = samples->rasters()[0], &second = samples->rasters()[1];
    EXPECT_EQ(first.name, "h\xC3\xB6hen 1.tif");
    EXPECT_EQ(first.x0, 400000);
    EXPECT_EQ(first.y0, 5300000);
    EXPECT_EQ(first.dx, 10);
    EXPECT_EQ(first.dy, 10);
    EXPECT_EQ(first.sample_bytes, 4u);
    expect_grid(first, point, [](float z) { return z == -9999 || !std::isfinite(z) ? NAN : as_it_is(z); });
    EXPECT_EQ(second.name, "area.tif");
    EXPECT_EQ(second.x0, 600012.5) << "the centre of the pixel";
    EXPECT_EQ(second.y0, 5199987.5);
    EXPECT_EQ(second.dx, 25);
    expect_grid(second, area, as_it_is);
    ASSERT_EQ(report_["sources"].size(), 2u);
    EXPECT_EQ(report_["sources"][0]["samples"], nlohmann::json({70, 41}));
    EXPECT_EQ(report_["sources"][0]["valid_samples"], 70 * 41 - 4);
    EXPECT_EQ(report_["sources"][1]["height_range_m"],
              nlohmann::json(
                  {*std::min_element(area.z.begin(), area.z.end()), *std::max_element(area.z.begin(), area.z.end())}));
}

TEST_F(Samples, FollowSpacingScaleOffsetAndNodata) {
    HeightGrid grid = hills(50, 60, 5);
    grid.at(3, 3) = 7;
    write_heights_u16(dem_, grid, nullptr);
    const auto samples =
        samples_of({dem_, "--spacing", "0.1", "--height-scale", "0.3", "--height-offset", "-11.5", "--nodata", "7"});
    ASSERT_TRUE(samples) << samples.error().message;
    const SourceRaster& r = samples->rasters()[0];
    EXPECT_EQ(r.x0, 0);
    EXPECT_EQ(r.y0, 0);
    EXPECT_EQ(r.dx, 0.1);
    EXPECT_EQ(r.dy, 0.1);
    EXPECT_EQ(r.sample_bytes, 8u) << "a float would round the products";
    expect_grid(r, grid, [](float z) { return z == 7 ? NAN : static_cast<double>(z) * 0.3 + -11.5; });
}

template <class T>
void write_numbers(const std::string& path, const std::vector<T>& numbers, std::uint32_t width) {
    TestTiff t = layout_of<T>(width, static_cast<std::uint32_t>(numbers.size()) / width);
    ASSERT_TRUE(write_tiff(path, t, numbers.data()));
}

TEST_F(Samples, KeepEveryBitOfWideTypes) {
    const std::vector<std::int32_t> integers{16777217, -2147483647, 3, 2147483647, 0, -16777219};
    const std::vector<double> doubles{1.0 / 3, -1e-300, 123456789.123456789, NAN, 1e300, 5};
    write_numbers(folder_.file("i32.tif"), integers, 3);
    write_numbers(folder_.file("f64.tif"), doubles, 2);
    const auto samples = samples_of({folder_.file("i32.tif"), folder_.file("f64.tif"), "--spacing", "5"});
    ASSERT_TRUE(samples) << samples.error().message;
    for (std::size_t k = 0; k < 6; ++k) {
        const auto n = static_cast<std::int64_t>(k);
        EXPECT_EQ(samples->rasters()[0].at(n % 3, n / 3), integers[k]);
        if (k != 3) {
            EXPECT_EQ(samples->rasters()[1].at(n % 2, n / 2), doubles[k]);
        }
    }
    EXPECT_TRUE(std::isnan(samples->rasters()[1].at(1, 1)));
}

TEST_F(Samples, AreRefusedAsABuildRefusesThem) {
    const auto refused = [&](std::vector<std::string> inputs, int code) {
        std::vector<std::string> build{"build", "--quiet", "-o", folder_.file("s.scree")};
        std::vector<std::string> samples{"samples", "--quiet", "-o", out_};
        build.insert(build.end(), inputs.begin(), inputs.end());
        samples.insert(samples.end(), inputs.begin(), inputs.end());
        const auto b = scree(build), s = scree(samples);
        EXPECT_EQ(s.exit_code, code) << describe(s);
        EXPECT_EQ(b.exit_code, code) << describe(b);
        const auto message = [](const std::string& text) { return text.substr(text.find(':') + 1); };
        EXPECT_EQ(message(s.err), message(b.err));
    };
    write_heights(dem_, hills(20, 20, 2));
    const std::string bare = folder_.file("bare.tif"), degrees = folder_.file("degrees.tif"),
                      row = folder_.file("row.tif"), image = folder_.file("image.tif"), text = folder_.file("text.tif");
    write_heights_u16(bare, hills(20, 20, 2), nullptr);
    write_geographic_heights(degrees, hills(20, 20, 2));
    write_heights(row, hills(20, 1, 2));
    write_image(image, 40, 40, 3, 8, nullptr, patchwork);
    write_bytes(text, {'h', 'e', 'l', 'l', 'o'});
    refused({bare}, kInput);
    refused({degrees}, kInput);
    refused({row}, kInput);
    refused({image}, kInput);
    refused({text}, kInput);
    refused({folder_.file("missing.tif")}, kInput);
    refused({dem_, "--spacing", "30"}, kUsage);
    refused({bare, "--spacing", "-1"}, kUsage);
    refused({bare, "--spacing", "30", "--height-scale", "0"}, kUsage);
    refused({bare, "--spacing", "30", "--height-offset", "nan"}, kUsage);
    write_heights(folder_.file("far.tif"), hills(20, 20, 2), {4e9, 0, 10, 32633, false});
    EXPECT_EQ(scree({"samples", "--quiet", "-o", out_, folder_.file("far.tif")}).exit_code, kInput);
    EXPECT_FALSE(std::filesystem::exists(out_));
    EXPECT_FALSE(std::filesystem::exists(out_ + ".partial"));
}

TEST_F(Samples, WrongUseIsTwo) {
    write_heights(dem_, hills(20, 20, 2));
    for (const std::vector<std::string>& arguments : std::vector<std::vector<std::string>>{
             {"samples"},
             {"samples", dem_},
             {"samples", "-o", out_},
             {"samples", dem_, "-o", out_, "--fd", "3"},
             {"samples", dem_, "--fd", "1"},
             {"samples", dem_, "--fd", "999"},
             {"samples", dem_, "-o", out_, "--memory", "10M"},
             {"samples", dem_, "-o", dem_, "--force"},
             {"samples", dem_, "-o", "/dev/null", "--force"},
         }) {
        const auto run = scree(arguments);
        EXPECT_EQ(run.exit_code, kUsage) << describe(run);
        EXPECT_NE(run.err, "");
    }
    EXPECT_FALSE(std::filesystem::exists(out_));
    write_bytes(out_, {'o', 'l', 'd'});
    EXPECT_EQ(scree({"samples", dem_, "-o", out_}).exit_code, kUsage);
    EXPECT_EQ(read_bytes(out_), (std::vector<std::uint8_t>{'o', 'l', 'd'}));
}

TEST_F(Samples, NotFiniteAfterScalingIsRefused) {
    write_numbers(dem_, std::vector<double>{1, 2, 1e308, 4}, 2);
    const auto run = scree({"samples", dem_, "--spacing", "1", "--height-scale", "10", "-o", out_, "--quiet"});
    EXPECT_EQ(run.exit_code, kInput) << describe(run);
    EXPECT_NE(run.err.find("1e+308"), std::string::npos) << describe(run);
    expect_only(folder_.file(""), {"h\xC3\xB6hen 1.tif"});
}

TEST_F(Samples, OfALargeFileCostNoMoreMemoryThanThoseOfASmallOne) {
    if (kSanitized) GTEST_SKIP() << "resident memory says nothing here";
    ASSERT_EQ(
        scree({"synth", "-o", folder_.file("land"), "--size", "4097", "--imagery-scale", "0", "--quiet"}).exit_code, 0);
    write_heights(dem_, hills(20, 20, 2));
    const auto small = scree({"samples", dem_, "-o", out_, "--quiet"});
    const auto large = scree({"samples", folder_.file("land/dem.tif"), "-o", out_, "--force", "--quiet"});
    EXPECT_EQ(large.exit_code, 0) << describe(large);
    EXPECT_EQ(std::filesystem::file_size(out_), 16u + 4 + 7 + 60 + 1 + 4097ull * 4097 * 4);
    EXPECT_LT(large.peak_rss_bytes, small.peak_rss_bytes + (std::int64_t{16} << 20)) << "of 67 MB";
}

TEST_F(Samples, AreWholeOrAbsent) {
    write_heights(dem_, hills(1025, 1025, 2));
    const std::string folder = folder_.file("out"), out = folder_.file("out/s.smp");
    std::filesystem::create_directory(folder);
    ProgramOptions full;
    full.largest_file_bytes = 1'000'000;
    const auto run = scree({"samples", dem_, "-o", out, "--quiet"}, full);
    EXPECT_EQ(run.exit_code, kIo) << describe(run);
    EXPECT_NE(run.err.find(out), std::string::npos) << describe(run);
    expect_only(folder, {});

    std::vector<std::string> long_work{"samples", "-o", out, "--quiet"};
    long_work.insert(long_work.end(), 200, dem_);
    for (const int signal : {SIGINT, SIGTERM}) {
        ProgramOptions stopped;
        stopped.signal = signal;
        stopped.signal_when = [partial = out + ".partial"] {
            std::error_code error;
            return std::filesystem::file_size(partial, error) > 100000 && !error;
        };
        std::uintmax_t largest = 0;
        stopped.meanwhile = [&largest, partial = out + ".partial"] {
            std::error_code error;
            const auto size = std::filesystem::file_size(partial, error);
            if (!error) largest = std::max(largest, size);
        };
        const auto end = scree(long_work, stopped);
        ASSERT_TRUE(end.signalled) << describe(end);
        EXPECT_EQ(end.exit_code, 130) << describe(end);
        EXPECT_LT(largest, 100ull * 1025 * 1025 * 4) << "half of the work was done after the signal";
        expect_only(folder, {});
    }
}

TEST_F(Samples, CutShortInAnOpenFileAreNotTakenForWhole) {
    write_heights(dem_, hills(1025, 1025, 2));
    const int fd = ::open(out_.c_str(), O_RDWR | O_CREAT | O_TRUNC, 0600);  // for the child, too
    ASSERT_GE(fd, 3);
    ProgramOptions full;
    full.largest_file_bytes = 2'000'000;
    const auto run = scree({"samples", dem_, "--fd", std::to_string(fd), "--quiet"}, full);
    EXPECT_EQ(run.exit_code, kIo) << describe(run);
    EXPECT_FALSE(SourceSamples::map(fd, "cut"));
    EXPECT_EQ(scree({"samples", dem_, "--fd", std::to_string(fd), "--quiet"}).exit_code, 0);
    EXPECT_TRUE(SourceSamples::map(fd, "whole"));
    ::close(fd);

    const int appending = ::open(out_.c_str(), O_WRONLY | O_APPEND);
    const int reading = ::open(out_.c_str(), O_RDONLY);
    for (const int wrong : {appending, reading})
        EXPECT_EQ(scree({"samples", dem_, "--fd", std::to_string(wrong), "--quiet"}).exit_code, kUsage);
    ::close(appending);
    ::close(reading);
}

TEST_F(Samples, ReachAnotherProgramThroughAnUnnamedFile) {
    const HeightGrid grid = hills(30, 40, 6);
    write_heights_u16(dem_, grid, nullptr);
    SamplingOptions options;
    options.program = SCREE_PROGRAM;
    options.spacing_m = 12.5;
    options.height_scale = 0.1;
    options.nodata = -1;
    const auto samples = sample_sources({dem_}, options);
    ASSERT_TRUE(samples) << samples.error().message;
    EXPECT_EQ(samples->rasters()[0].dx, 12.5);
    expect_grid(samples->rasters()[0], grid, [](float z) { return static_cast<double>(z) * 0.1; });

    const auto missing = sample_sources({folder_.file("missing.tif")}, options);
    ASSERT_FALSE(missing);
    EXPECT_EQ(static_cast<int>(missing.error().code), kInput);
    expect_only(folder_.file(""), {"h\xC3\xB6hen 1.tif"});
}

}  // namespace
}  // namespace scree::test
