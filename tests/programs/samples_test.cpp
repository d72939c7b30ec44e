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
#include "tools/source/crs.h"

namespace scree::test {
namespace {

constexpr int kUsage = 2, kInput = 3, kIo = 5;

void expect_grid(const SourceLayer& r, const HeightGrid& grid, const std::function<double(float)>& height) {
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

void expect_at(const SourceLayer& l, double column, double row, double x, double y, double within = 1e-6) {
    EXPECT_NEAR(l.position(column, row).x, x, within) << column << ", " << row;
    EXPECT_NEAR(l.position(column, row).y, y, within) << column << ", " << row;
}

TEST_F(Samples, StandWhereTheirFilesSayAndAreTheirValues) {
    HeightGrid point = hills(70, 41, 3), area = hills(33, 90, 4);
    point.at(5, 6) = point.at(69, 40) = -9999;
    point.at(7, 8) = std::numeric_limits<float>::quiet_NaN();
    point.at(9, 9) = -std::numeric_limits<float>::infinity();
    write_heights(dem_, point, {400000, 5300000, 10, 32633, false}, "-9999");
    const Place place{400700, 5300000, 25, 32633, true};
    write_heights_u16(folder_.file("area.tif"), area, &place);
    const auto samples = samples_of({dem_, folder_.file("area.tif")});
    ASSERT_TRUE(samples) << samples.error().message;
    ASSERT_EQ(samples->layers().size(), 2u);
    const SourceLayer &first = samples->layers()[0], &second = samples->layers()[1];
    EXPECT_EQ(first.names, std::vector<std::string>{"h\xC3\xB6hen 1.tif"});
    expect_at(first, 0, 0, 400000, 5300000);
    expect_at(first, 69, 40, 400690, 5299600);
    expect_at(first, 7, 13, 400070, 5299870);
    EXPECT_EQ(first.sample_bytes, 4u);
    expect_grid(first, point, [](float z) { return z == -9999 || !std::isfinite(z) ? NAN : as_it_is(z); });
    EXPECT_EQ(second.names, std::vector<std::string>{"area.tif"});
    expect_at(second, 0, 0, 400712.5, 5299987.5);  // the centre of the pixel
    expect_at(second, 2, 4, 400762.5, 5299887.5);
    expect_grid(second, area, as_it_is);
    ASSERT_EQ(report_["layers"].size(), 2u);
    EXPECT_EQ(report_["crs"], "EPSG:32633");
    EXPECT_EQ(report_["layers"][0]["samples"], nlohmann::json({70, 41}));
    EXPECT_EQ(report_["layers"][0]["valid_samples"], 70 * 41 - 4);
    EXPECT_EQ(report_["layers"][1]["height_range_m"],
              nlohmann::json(
                  {*std::min_element(area.z.begin(), area.z.end()), *std::max_element(area.z.begin(), area.z.end())}));
}

TEST_F(Samples, OfFilesOfOneGridAreOneLayerAsTheyLieOverOneAnother) {
    HeightGrid left = hills(40, 30, 3), right = hills(40, 30, 4);
    for (float& z : right.z) z += 5000;
    right.at(1, 1) = std::numeric_limits<float>::quiet_NaN();  // shows what lies under it
    write_heights(dem_, left, {400000, 5300000, 10, 32633, false});
    write_heights(folder_.file("b.tif"), right, {400300, 5299900, 10, 32633, false});
    const auto samples = samples_of({dem_, folder_.file("b.tif")});
    ASSERT_TRUE(samples) << samples.error().message;
    ASSERT_EQ(samples->layers().size(), 1u);
    const SourceLayer& l = samples->layers()[0];
    EXPECT_EQ(l.names, (std::vector<std::string>{"h\xC3\xB6hen 1.tif", "b.tif"}));
    ASSERT_EQ(l.columns, 70);
    ASSERT_EQ(l.rows, 40);
    for (int r = 0; r < 40; ++r)
        for (int c = 0; c < 70; ++c) {
            const bool on_right = c >= 30 && r >= 10 && !(c == 31 && r == 11), on_left = c < 40 && r < 30;
            if (!on_right && !on_left)
                ASSERT_FALSE(l.covered(c, r)) << c << ", " << r;
            else
                ASSERT_EQ(l.at(c, r), on_right ? right.at(c - 30, r - 10) : left.at(c, r)) << c << ", " << r;
        }
}

TEST_F(Samples, UnderALayerAboveAreHiddenWhereItHasAValueAndNowhereElse) {
    HeightGrid base = hills(50, 50, 3), top = hills(21, 21, 4);
    for (int j = 8; j <= 12; ++j)
        for (int i = 8; i <= 12; ++i) top.at(i, j) = std::numeric_limits<float>::quiet_NaN();
    base.at(20, 20) = std::numeric_limits<float>::quiet_NaN();
    write_heights(dem_, base, {400000, 5300000, 10, 32633, false});
    // Samples 4 m apart over (401..481, 299..219 m) of the base: its columns and rows 11 to 18 are under it.
    write_heights(folder_.file("top.tif"), top, {400101, 5299899, 4, 32633, false});
    const auto samples = samples_of({dem_, folder_.file("top.tif")});
    ASSERT_TRUE(samples) << samples.error().message;
    ASSERT_EQ(samples->layers().size(), 2u);
    const SourceLayer& l = samples->layers()[0];
    for (int r = 0; r < 50; ++r)
        for (int c = 0; c < 50; ++c) {
            const double u = (10.0 * c - 101) / 4, v = (10.0 * r - 101) / 4;
            const bool inside = u >= 0 && u <= 20 && v >= 0 && v <= 20;
            const bool in_void = std::abs(u - 10) < 2.5 && std::abs(v - 10) < 2.5;  // the nearest sample is one
            const bool is_void = c == 20 && r == 20;
            EXPECT_EQ(std::isnan(l.at(c, r)), is_void || (inside && !in_void)) << c << ", " << r;
            EXPECT_EQ(l.covered(c, r), !is_void) << c << ", " << r;
        }
    EXPECT_EQ(report_["layers"][0]["hidden_samples"], 8 * 8 - 4);
    EXPECT_EQ(report_["layers"][1]["hidden_samples"], 0);
}

TEST_F(Samples, StandInTheCrsThatIsAskedForToAThousandthOfASample) {
    const HeightGrid grid = hills(150, 120, 5);
    write_geographic_heights(dem_, grid);
    const auto samples = samples_of({dem_, "--crs", "EPSG:32633"});
    ASSERT_TRUE(samples) << samples.error().message;
    const SourceLayer& l = samples->layers()[0];
    expect_grid(l, grid, as_it_is);
    EXPECT_GT(l.step, 1) << "one control point a sample is no grid";
    // The same samples, each placed by PROJ: an area of two times two samples is all control points.
    auto degrees = Crs::parse("EPSG:4326"), utm = Crs::parse("EPSG:32633");
    ASSERT_TRUE(degrees && utm);
    const auto transform = CrsTransform::make(*degrees, *utm);
    ASSERT_TRUE(transform);
    for (int r = 0; r < grid.height; r += 7)
        for (int c = 0; c < grid.width; c += 7) {
            std::vector<double> x{14.5 + 0.001 * c}, y{47.25 - 0.001 * r};
            transform->apply(x, y);
            expect_at(l, c, r, x[0], y[0], 1e-3 * 75);
        }
    EXPECT_EQ(report_["crs"], "EPSG:32633");
    EXPECT_EQ(samples_of({dem_})->layers()[0].position(3, 4).x, l.position(3, 4).x) << "the zone that a build chooses";
}

TEST_F(Samples, FollowSpacingScaleOffsetAndNodata) {
    HeightGrid grid = hills(50, 60, 5);
    grid.at(3, 3) = 7;
    write_heights_u16(dem_, grid, nullptr);
    const auto samples =
        samples_of({dem_, "--spacing", "0.1", "--height-scale", "0.3", "--height-offset", "-11.5", "--nodata", "7"});
    ASSERT_TRUE(samples) << samples.error().message;
    const SourceLayer& l = samples->layers()[0];
    expect_at(l, 0, 0, 0, 0);
    expect_at(l, 10, 20, 1, -2);
    EXPECT_EQ(l.sample_bytes, 8u) << "a float would round the products";
    expect_grid(l, grid, [](float z) { return z == 7 ? NAN : static_cast<double>(z) * 0.3 + -11.5; });
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
    for (const std::string name : {"i32.tif", "f64.tif"}) {
        const auto samples = samples_of({folder_.file(name), "--spacing", "5"});
        ASSERT_TRUE(samples) << samples.error().message;
        const SourceLayer& l = samples->layers()[0];
        for (std::size_t k = 0; k < 6; ++k) {
            const auto n = static_cast<std::int64_t>(k);
            const double at = l.at(n % l.columns, n / l.columns);
            if (name == "i32.tif")
                EXPECT_EQ(at, integers[k]);
            else if (k != 3)
                EXPECT_EQ(at, doubles[k]);
            else
                EXPECT_TRUE(std::isnan(at));
        }
    }
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
    const std::string bare = folder_.file("bare.tif"), row = folder_.file("row.tif"), image = folder_.file("image.tif"),
                      text = folder_.file("text.tif");
    write_heights_u16(bare, hills(20, 20, 2), nullptr);
    write_heights(row, hills(20, 1, 2));
    write_image(image, 40, 40, 3, 8, nullptr, patchwork);
    write_bytes(text, {'h', 'e', 'l', 'l', 'o'});
    refused({bare}, kInput);
    refused({row}, kInput);
    refused({image}, kInput);
    refused({text}, kInput);
    refused({folder_.file("missing.tif")}, kInput);
    refused({bare, dem_, "--spacing", "30"}, kInput);
    refused({dem_, "--crs", "EPSG:4326"}, kUsage);
    refused({dem_, "--crs", "nonsense"}, kUsage);
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
    EXPECT_EQ(std::filesystem::file_size(out_), 16u + 4 + 4 + 7 + 44 + 5 + 4 * 16 + 4097ull * 4097 * 4);
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

    const std::string wide = folder_.file("wide.tif");  // above, so that all below is hidden, sample by sample
    write_heights(wide, hills(1025, 1025, 3), {400005, 5300005, 10, 32633, false});
    std::vector<std::string> long_work{"samples", "-o", out, "--quiet"};
    for (int k = 0; k < 20; ++k) long_work.insert(long_work.end(), {dem_, wide});
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
        EXPECT_LT(largest, 20ull * 1025 * 1025 * 4) << "half of the work was done after the signal";
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
    EXPECT_EQ(samples->layers()[0].position(1, 0).x, 12.5);
    expect_grid(samples->layers()[0], grid, [](float z) { return static_cast<double>(z) * 0.1; });

    const auto missing = sample_sources({folder_.file("missing.tif")}, options);
    ASSERT_FALSE(missing);
    EXPECT_EQ(static_cast<int>(missing.error().code), kInput);
    expect_only(folder_.file(""), {"h\xC3\xB6hen 1.tif"});
}

}  // namespace
}  // namespace scree::test
