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
    std::uint32_t version = 1, count = 1;
    std::uint32_t name_bytes = 5;
    std::string name = "a.tif";
    double x = 400000.5, y = 5300000.25, dx = 10, dy = 12.5;
    std::uint64_t columns = 3, rows = 2;
    std::uint32_t sample_bytes = 4;
    std::uint64_t offset = 88;  // 16 + 4 + 5 + 60 bytes of header, and three to align
};

std::vector<std::uint8_t> file_of(const Fields& f, const std::vector<double>& heights) {
    std::vector<std::uint8_t> out;
    ByteWriter w(out);
    for (const char c : f.magic) w.u8(static_cast<std::uint8_t>(c));
    w.u32(f.version);
    w.u32(f.count);
    w.u32(f.name_bytes);
    for (const char c : f.name) w.u8(static_cast<std::uint8_t>(c));
    for (const double v : {f.x, f.y, f.dx, f.dy}) w.f64(v);
    w.u64(f.columns);
    w.u64(f.rows);
    w.u32(f.sample_bytes);
    w.u64(f.offset);
    while (out.size() % 8 != 0) w.u8(0);
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
        ASSERT_EQ(samples->rasters().size(), 1u);
        const SourceRaster& r = samples->rasters()[0];
        EXPECT_EQ(r.name, "a.tif");
        EXPECT_EQ(r.x0, 400000.5);
        EXPECT_EQ(r.y0, 5300000.25);
        EXPECT_EQ(r.dx, 10);
        EXPECT_EQ(r.dy, 12.5);
        ASSERT_EQ(r.columns, 3);
        ASSERT_EQ(r.rows, 2);
        EXPECT_EQ(r.at(0, 0), 1);
        EXPECT_EQ(r.at(1, 0), 2.5);
        EXPECT_TRUE(std::isnan(r.at(2, 0)));
        EXPECT_EQ(r.at(0, 1), -4);
        EXPECT_TRUE(std::isnan(r.at(1, 1))) << "an infinity is no height";
        EXPECT_EQ(r.at(2, 1), heights[5]);
    }
}

TEST_F(SamplesFile, IsReadAfterItsNameIsGone) {
    auto samples = read(file_of({}, kHeights));
    ASSERT_TRUE(samples);
    std::filesystem::remove(path_);
    const SourceSamples kept = *samples;
    samples = Error{};
    EXPECT_EQ(kept.rasters()[0].at(0, 1), -4);
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
    expect_refused([](Fields& f) { f.version = 2; }, "version 2");
    expect_refused([](Fields& f) { f.version = 0; }, "version 0");
    expect_refused([](Fields& f) { f.count = 0; }, "no source");
    expect_refused(std::vector<std::uint8_t>(4096, 0), "not a file of samples");
    EXPECT_FALSE(SourceSamples::open(folder_.file("missing")));
    EXPECT_FALSE(SourceSamples::open(folder_.file("")));
}

TEST_F(SamplesFile, WithFieldsThatLieIsRefused) {
    expect_refused([](Fields& f) { f.count = 2; }, "source 2 of 2");
    expect_refused([](Fields& f) { f.count = 0xffffffffu; }, "source 2 of");
    expect_refused([](Fields& f) { f.name_bytes = 0xffffffffu; }, "name");
    for (const double spacing : {0.0, -10.0, kNaN, kInfinity, 1e-9, 1e9}) {
        expect_refused([&](Fields& f) { f.dx = spacing; }, "spacing");
        expect_refused([&](Fields& f) { f.dy = spacing; }, "spacing");
    }
    for (const double place : {kNaN, kInfinity, -kInfinity, 1e12, -1e300}) {
        expect_refused([&](Fields& f) { f.x = place; }, "no place");
        expect_refused([&](Fields& f) { f.y = place; }, "no place");
    }
    for (const std::uint64_t side : {std::uint64_t{0}, std::uint64_t{1} << 31, ~std::uint64_t{0}}) {
        expect_refused([&](Fields& f) { f.columns = side; }, "samples; a side");
        expect_refused([&](Fields& f) { f.rows = side; }, "samples; a side");
    }
    for (const std::uint32_t bytes : {0u, 2u, 5u, 16u, 0xffffffffu})
        expect_refused([&](Fields& f) { f.sample_bytes = bytes; }, "4 and 8");
    expect_refused([](Fields& f) { f.offset = 84; }, "multiple of 8");
    for (const std::uint64_t offset : {std::uint64_t{0}, std::uint64_t{80}, std::uint64_t{96}, std::uint64_t{112},
                                       std::uint64_t{120}, std::uint64_t{1} << 63, ~std::uint64_t{7}})
        expect_refused([&](Fields& f) { f.offset = offset; }, "do not lie within");
    expect_refused([](Fields& f) { f.columns = 4; }, "do not lie within");
    expect_refused([](Fields& f) { f.rows = 3; }, "do not lie within");
    // The product of the sides and the size of a sample passes 2^62.
    expect_refused([](Fields& f) { f.columns = f.rows = std::uint64_t{1} << 30; }, "do not lie within");
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
        const SourceRaster& r = samples->rasters()[0];
        for (std::int64_t row = 0; row < r.rows; ++row)
            for (std::int64_t column = 0; column < r.columns; ++column) ASSERT_FALSE(std::isinf(r.at(column, row)));
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
    options.spacing_m = 0.1;
    options.height_scale = 1.0 / 3;
    options.height_offset_m = -5;
    options.nodata = -32767;
    const auto samples = sample_sources({"a b.tif", "-odd.tif"}, options);
    ASSERT_TRUE(samples) << samples.error().message;
    EXPECT_EQ(samples->rasters()[0].at(0, 1), -4);
    const auto bytes = test::read_bytes(folder_.file("words"));
    std::string words(bytes.begin(), bytes.end());
    const std::size_t fd = words.find("--fd=") + 5;
    words.erase(fd, words.find('\n', fd) - fd);
    EXPECT_EQ(words,
              "samples\n--quiet\n--fd=\n--spacing=0.1\n--height-scale=0.3333333333333333\n--height-offset=-5\n"
              "--nodata=-32767\n--\na b.tif\n-odd.tif\n");
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
