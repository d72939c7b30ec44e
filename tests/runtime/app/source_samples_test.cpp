#include "runtime/app/source_samples.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <csignal>
#include <functional>
#include <limits>
#include <thread>

#include "common/store/byte_io.h"
#include "tests/common/test_support.h"

namespace scree {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// The fields of docs/measuring.md, as a writer of its own sets them; a test bends one.
struct Fields {
    std::string magic = "SCREESMP";
    std::uint32_t version = 2, count = 1;
    std::uint32_t names = 1, name_bytes = 5;
    std::string name = "a.tif";
    std::uint64_t columns = 3, rows = 2, step = 2;
    std::uint32_t sample_bytes = 4;
    std::uint64_t control_offset = 80;  // 16 + 4 + 4 + 5 + 44 bytes of header, and seven to align
    std::uint64_t offset = 80 + 64;
    std::vector<double> controls{400000.5, 5300000.25, 400020.5, 5300000.25,
                                 400000.5, 5299987.75, 400020.5, 5299987.75};
};

std::vector<std::uint8_t> file_of(const Fields& f, const std::vector<double>& heights) {
    std::vector<std::uint8_t> out;
    ByteWriter w(out);
    for (const char c : f.magic) w.u8(static_cast<std::uint8_t>(c));
    w.u32(f.version);
    w.u32(f.count);
    w.u32(f.names);
    w.u32(f.name_bytes);
    for (const char c : f.name) w.u8(static_cast<std::uint8_t>(c));
    w.u64(f.columns);
    w.u64(f.rows);
    w.u64(f.step);
    w.u32(f.sample_bytes);
    w.u64(f.control_offset);
    w.u64(f.offset);
    while (out.size() % 8 != 0) w.u8(0);
    for (const double v : f.controls) w.f64(v);
    for (const double v : heights) {
        if (f.sample_bytes == 8)
            w.f64(v);
        else
            w.f32(static_cast<float>(v));
    }
    return out;
}

const std::vector<double> kHeights{1, 2.5, kNaN, -4, kInfinity, 6};

class SamplesFile : public ::testing::Test {
protected:
    Result<SourceSamples> read(const std::vector<std::uint8_t>& bytes) const {
        test::write_bytes(path_, bytes);
        return SourceSamples::open(path_);
    }
    void expect_refused(const std::vector<std::uint8_t>& bytes, const std::string& word) const {
        const auto samples = read(bytes);
        ASSERT_FALSE(samples) << "without '" << word << "'";
        EXPECT_EQ(samples.error().code, ErrorCode::input);
        EXPECT_NE(samples.error().message.find(word), std::string::npos) << samples.error().message;
        EXPECT_NE(samples.error().message.find(path_), std::string::npos) << samples.error().message;
    }
    void expect_refused(const std::function<void(Fields&)>& bend, const std::string& word) const {
        Fields fields;
        bend(fields);
        expect_refused(file_of(fields, kHeights), word);
    }

    test::TemporaryFolder folder_;
    const std::string path_ = folder_.file("s.smp");
};

TEST_F(SamplesFile, GivesPlaceAndHeightsOfFloatAndDouble) {
    for (const std::uint32_t sample_bytes : {4u, 8u}) {
        Fields f;
        f.sample_bytes = sample_bytes;
        std::vector<double> heights = kHeights;
        if (sample_bytes == 8) heights[5] = 16777217.25;
        const auto samples = read(file_of(f, heights));
        ASSERT_TRUE(samples) << samples.error().message;
        ASSERT_EQ(samples->layers().size(), 1u);
        const SourceLayer& l = samples->layers()[0];
        EXPECT_EQ(l.names, std::vector<std::string>{"a.tif"});
        ASSERT_EQ(l.columns, 3);
        ASSERT_EQ(l.rows, 2);
        EXPECT_EQ(l.position(0, 0).x, 400000.5);
        EXPECT_EQ(l.position(0, 0).y, 5300000.25);
        EXPECT_EQ(l.position(1, 1).x, 400010.5);
        EXPECT_EQ(l.position(2, 1).y, 5299987.75);
        EXPECT_EQ(l.at(0, 0), 1);
        EXPECT_EQ(l.at(1, 0), 2.5);
        EXPECT_TRUE(std::isnan(l.at(2, 0)));
        EXPECT_FALSE(l.covered(2, 0));
        EXPECT_EQ(l.at(0, 1), -4);
        EXPECT_TRUE(std::isnan(l.at(1, 1))) << "a hidden sample is no truth";
        EXPECT_TRUE(l.covered(1, 1)) << "but there is terrain";
        EXPECT_EQ(l.at(2, 1), heights[5]);
    }
}

TEST_F(SamplesFile, PlacesSamplesBetweenControlPointsAndOnTheLast) {
    Fields f;
    f.columns = 6;
    f.rows = 4;
    f.step = 2;  // control columns 0, 2, 4, 5 and rows 0, 2, 3
    const auto x = [](double c, double r) { return 100 + 10 * c + 2 * r + c * r; };
    const auto y = [](double c, double r) { return 500 + c - 8 * r; };
    f.controls.clear();
    for (const double r : {0.0, 2.0, 3.0})
        for (const double c : {0.0, 2.0, 4.0, 5.0}) {
            f.controls.push_back(x(c, r));
            f.controls.push_back(y(c, r));
        }
    f.offset = f.control_offset + f.controls.size() * 8;
    const auto samples = read(file_of(f, std::vector<double>(24, 7)));
    ASSERT_TRUE(samples) << samples.error().message;
    const SourceLayer& l = samples->layers()[0];
    ASSERT_EQ(l.control_columns(), 4);
    ASSERT_EQ(l.control_rows(), 3);
    for (int r = 0; r < 4; ++r)
        for (int c = 0; c < 6; ++c) {
            EXPECT_NEAR(l.position(c, r).x, x(c, r), 1e-9) << c << ", " << r;
            EXPECT_NEAR(l.position(c, r).y, y(c, r), 1e-9) << c << ", " << r;
        }
    // A control point without a place takes the samples of its cells with it, and no others.
    f.controls[0] = f.controls[1] = kNaN;
    const auto torn = read(file_of(f, std::vector<double>(24, 7)));
    ASSERT_TRUE(torn) << torn.error().message;
    EXPECT_TRUE(std::isnan(torn->layers()[0].position(1, 1).x));
    EXPECT_EQ(torn->layers()[0].position(2, 0).x, x(2, 0));
}

TEST_F(SamplesFile, IsReadAfterItsNameIsGone) {
    auto samples = read(file_of({}, kHeights));
    ASSERT_TRUE(samples);
    std::filesystem::remove(path_);
    const SourceSamples kept = *samples;
    samples = Error{};
    EXPECT_EQ(kept.layers()[0].at(0, 1), -4);
}

TEST_F(SamplesFile, CutOffAnywhereIsRefused) {
    const auto whole = file_of({}, kHeights);
    ASSERT_TRUE(read(whole));
    for (std::size_t size = 0; size < whole.size(); ++size) {
        const auto samples = read({whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size)});
        ASSERT_FALSE(samples) << size << " bytes";
        EXPECT_EQ(samples.error().code, ErrorCode::input);
    }
}

TEST_F(SamplesFile, OfAnotherKindOrVersionIsRefused) {
    expect_refused([](Fields& f) { f.magic = "SCREESMQ"; }, "not a file of samples");
    expect_refused([](Fields& f) { f.version = 1; }, "version 1");
    expect_refused([](Fields& f) { f.version = 0; }, "version 0");
    expect_refused([](Fields& f) { f.count = 0; }, "no layer");
    expect_refused(std::vector<std::uint8_t>(4096, 0), "not a file of samples");
    EXPECT_FALSE(SourceSamples::open(folder_.file("missing")));
    EXPECT_FALSE(SourceSamples::open(folder_.file("")));
}

TEST_F(SamplesFile, WithFieldsThatLieIsRefused) {
    expect_refused([](Fields& f) { f.count = 2; }, "layer 2 of 2");
    expect_refused([](Fields& f) { f.count = 0xffffffffu; }, "layer 2 of");
    expect_refused([](Fields& f) { f.names = 0; }, "a layer of 0 files");
    expect_refused([](Fields& f) { f.names = 0xffffffffu; }, "a layer of");
    expect_refused([](Fields& f) { f.name_bytes = 0xffffffffu; }, "name");
    for (const double place : {kInfinity, -kInfinity, 1e12, -1e300})
        for (std::size_t k = 0; k < 8; ++k) expect_refused([&](Fields& f) { f.controls[k] = place; }, "no place");
    expect_refused([&](Fields& f) { f.controls[3] = kNaN; }, "no place");  // half a place
    for (const std::uint64_t side : {std::uint64_t{0}, std::uint64_t{1}, std::uint64_t{1} << 31, ~std::uint64_t{0}}) {
        expect_refused([&](Fields& f) { f.columns = side; }, "samples; a side");
        expect_refused([&](Fields& f) { f.rows = side; }, "samples; a side");
    }
    for (const std::uint64_t step : {std::uint64_t{0}, std::uint64_t{1} << 32, ~std::uint64_t{0}})
        expect_refused([&](Fields& f) { f.step = step; }, "control points every");
    for (const std::uint32_t bytes : {0u, 2u, 5u, 16u, 0xffffffffu})
        expect_refused([&](Fields& f) { f.sample_bytes = bytes; }, "4 and 8");
    expect_refused([](Fields& f) { f.offset = 84; }, "multiple of 8");
    expect_refused([](Fields& f) { f.control_offset = 84; }, "multiple of 8");
    for (const std::uint64_t offset :
         {std::uint64_t{0}, std::uint64_t{64}, std::uint64_t{168}, std::uint64_t{1} << 63, ~std::uint64_t{7}}) {
        expect_refused([&](Fields& f) { f.offset = offset; }, "do not lie within");
        expect_refused([&](Fields& f) { f.control_offset = offset; }, "do not lie within");
    }
    expect_refused([](Fields& f) { f.columns = 4; }, "do not lie within");
    expect_refused([](Fields& f) { f.rows = 3; }, "do not lie within");
    expect_refused([](Fields& f) { f.step = 1; }, "do not lie within");
    // The products of the sides and the sizes pass 2^64.
    expect_refused([](Fields& f) { f.columns = f.rows = std::uint64_t{1} << 30; }, "do not lie within");
    expect_refused([](Fields& f) { f.columns = f.rows = (std::uint64_t{1} << 30) + 1, f.step = 1; },
                   "do not lie within");
}

TEST_F(SamplesFile, DamagedAtRandomIsRefusedOrReadWithinItself) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    int accepted = 0;
    for (int round = 0; round < 3000; ++round) {
        auto bytes = file_of({}, kHeights);
        for (int k = test::uniform(random, 1, 3); k > 0; --k)
            bytes[static_cast<std::size_t>(test::uniform(random, 0, static_cast<int>(bytes.size()) - 1))] =
                static_cast<std::uint8_t>(test::uniform(random, 0, 255));
        const auto samples = read(bytes);
        if (!samples) continue;
        ++accepted;
        const SourceLayer& l = samples->layers()[0];
        for (std::int64_t row = 0; row < l.rows; ++row)
            for (std::int64_t column = 0; column < l.columns; ++column) {
                ASSERT_FALSE(std::isinf(l.at(column, row)));
                ASSERT_FALSE(std::isinf(l.position(static_cast<double>(column), static_cast<double>(row)).x));
            }
    }
    EXPECT_GT(accepted, 100);
}

// A program that stands in for `scree`.
class Sampling : public ::testing::Test {
protected:
    SamplingOptions program(const std::string& script) const {
        const std::string path = folder_.file("stand-in");
        const std::string text = "#!/bin/sh\n" + script + "\n";
        test::write_bytes(path, {text.begin(), text.end()});
        std::filesystem::permissions(path, std::filesystem::perms::owner_all);
        SamplingOptions options;
        options.program = path;
        return options;
    }
    void expect_failure(const std::string& script, ErrorCode code, const std::string& word) const {
        const SamplingOptions options = program(script);
        const auto samples = sample_sources({"a.tif"}, options);
        ASSERT_FALSE(samples) << script;
        EXPECT_EQ(samples.error().code, code) << samples.error().message;
        EXPECT_NE(samples.error().message.find(word), std::string::npos) << samples.error().message;
        EXPECT_NE(samples.error().message.find(options.program), std::string::npos) << samples.error().message;
    }

    test::TemporaryFolder folder_;
};

TEST_F(Sampling, PassesTheReadingOnToTheLetterAndMapsWhatIsWritten) {
    test::write_bytes(folder_.file("ready"), file_of({}, kHeights));
    SamplingOptions options = program(
        "printf '%s\\n' \"$@\" > \"$(dirname \"$0\")/words\"\n"
        "cat \"$(dirname \"$0\")/ready\" >&${3#--fd=}");
    options.crs = "EPSG:32633";
    options.assume_crs = "+proj=utm +zone=33";
    options.assume_same_datum = true;
    options.spacing_m = 0.1;
    options.height_scale = 1.0 / 3;
    options.height_offset_m = -5;
    options.nodata = -32767;
    const auto samples = sample_sources({"a b.tif", "-odd.tif"}, options);
    ASSERT_TRUE(samples) << samples.error().message;
    EXPECT_EQ(samples->layers()[0].at(0, 1), -4);
    const auto bytes = test::read_bytes(folder_.file("words"));
    std::string words(bytes.begin(), bytes.end());
    const std::size_t fd = words.find("--fd=") + 5;
    words.erase(fd, words.find('\n', fd) - fd);
    EXPECT_EQ(words,
              "samples\n--quiet\n--fd=\n--crs=EPSG:32633\n--assume-crs=+proj=utm "
              "+zone=33\n--assume-same-datum\n--spacing=0.1\n--height-scale=0.3333333333333333\n--height-offset=-5\n"
              "--nodata=-32767\n--\na b.tif\n-odd.tif\n");
}

TEST_F(Sampling, AsksForHeightsAboveTheDatasetsDatumUnlessTheyAreTakenAsTheyAre) {
    test::write_bytes(folder_.file("ready"), file_of({}, kHeights));
    SamplingOptions options = program(
        "printf '%s\\n' \"$@\" > \"$(dirname \"$0\")/words\"\n"
        "cat \"$(dirname \"$0\")/ready\" >&${3#--fd=}");
    options.vertical_crs = "EPSG:5773";
    for (const bool as_they_are : {false, true}) {
        options.assume_same_datum = as_they_are;
        ASSERT_TRUE(sample_sources({"a.tif"}, options));
        const auto bytes = test::read_bytes(folder_.file("words"));
        const std::string words(bytes.begin(), bytes.end());
        EXPECT_EQ(words.find("--vertical-crs=EPSG:5773\n") == std::string::npos, as_they_are) << words;
    }
}

TEST_F(Sampling, FailsWithTheExitCodeOfTheProgram) {
    expect_failure("exit 3", ErrorCode::input, "exit code 3");
    expect_failure("exit 2", ErrorCode::usage, "exit code 2");
    expect_failure("exit 5", ErrorCode::io, "exit code 5");
    expect_failure("exit 130", ErrorCode::interrupted, "exit code 130");
    expect_failure("exit 1", ErrorCode::io, "exit code 1");
    expect_failure("exit 77", ErrorCode::io, "exit code 77");
    expect_failure("kill -9 $$", ErrorCode::io, "signal 9");
    expect_failure("exit 0", ErrorCode::input, "not a file of samples");
}

TEST_F(Sampling, NamesTheProgramThatIsMissing) {
    SamplingOptions options;
    options.program = folder_.file("nowhere");
    const auto samples = sample_sources({"a.tif"}, options);
    ASSERT_FALSE(samples);
    EXPECT_EQ(samples.error().code, ErrorCode::io);
    EXPECT_NE(samples.error().message.find(options.program), std::string::npos) << samples.error().message;
}

TEST_F(Sampling, LeavesNothingWhereTemporaryFilesGo) {
    const std::string temporary = folder_.file("tmp");
    std::filesystem::create_directory(temporary);
    const char* old = std::getenv("TMPDIR");
    const std::string kept = old != nullptr ? old : "";
    ::setenv("TMPDIR", temporary.c_str(), 1);
    test::write_bytes(folder_.file("ready"), file_of({}, kHeights));
    const auto samples = sample_sources({"a.tif"}, program("cat \"$(dirname \"$0\")/ready\" >&${3#--fd=}"));
    ::setenv("TMPDIR", (temporary + "/none").c_str(), 1);
    const auto nowhere = sample_sources({"a.tif"}, program("exit 0"));
    old != nullptr ? ::setenv("TMPDIR", kept.c_str(), 1) : ::unsetenv("TMPDIR");
    EXPECT_TRUE(samples);
    EXPECT_TRUE(std::filesystem::is_empty(temporary));
    ASSERT_FALSE(nowhere);
    EXPECT_EQ(nowhere.error().code, ErrorCode::io);
    EXPECT_NE(nowhere.error().message.find(temporary), std::string::npos) << nowhere.error().message;
}

TEST_F(Sampling, AnInterruptionEndsTheProgram) {
    std::atomic<bool> stop{false};
    // Says when it is at work and when it is asked to stop; without being asked it would go on for ever.
    SamplingOptions options = program(
        "folder=$(dirname \"$0\")\ntrap 'touch \"$folder/asked\"; exit 130' INT\n"
        "touch \"$folder/working\"\nwhile :; do sleep 0.01; done");
    options.stop = &stop;
    std::jthread user([&] {
        while (!std::filesystem::exists(folder_.file("working")))
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
        stop = true;
    });
    const auto samples = sample_sources({"a.tif"}, options);
    ASSERT_FALSE(samples);
    EXPECT_EQ(samples.error().code, ErrorCode::interrupted);
    EXPECT_TRUE(std::filesystem::exists(folder_.file("asked")));
}

}  // namespace
}  // namespace scree
