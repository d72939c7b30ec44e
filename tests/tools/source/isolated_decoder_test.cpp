// What a file may do to its decoder, and what becomes of it. The decoders here are those of
// misbehaving_decoder_main.cpp.
#include "tools/source/isolated_decoder.h"

#include <dirent.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <thread>
#include <vector>

#include "tests/tools/source/temp_directory.h"
#include "tests/tools/source/test_tiff.h"

namespace scree {
namespace {

#if defined(__SANITIZE_ADDRESS__)
constexpr bool kSanitized = true;  // has its own ends for overflows and no bounds on memory
#else
constexpr bool kSanitized = false;
#endif

constexpr std::int64_t kSide = 16;

std::vector<pid_t> children_of(const std::string& process) {
    std::vector<pid_t> found;
    std::error_code error;
    for (const auto& task : std::filesystem::directory_iterator("/proc/" + process + "/task", error)) {
        std::ifstream file(task.path() / "children");
        for (pid_t child = 0; file >> child;) found.push_back(child);
    }
    return found;
}

// Processes that decode a file: children of our children, the servers.
std::size_t decoding_processes() {
    std::size_t count = 0;
    for (const pid_t server : children_of("self")) count += children_of(std::to_string(server)).size();
    return count;
}

bool comes_true(const auto& condition) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(30);
    while (!condition() && std::chrono::steady_clock::now() < end)
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
    return condition();
}

class IsolatedDecoders : public ::testing::Test {
protected:
    IsolatedDecoders() { ::setenv("SCREE_DECODERS", SCREE_MISBEHAVING_DECODERS, 1); }

    std::string file(const std::string& name) const {
        const std::vector<std::uint8_t> values(kSide * kSide);
        EXPECT_TRUE(
            test::write_tiff(directory_.path(name), test::layout_of<std::uint8_t>(kSide, kSide), values.data()));
        return directory_.path(name);
    }
    static Result<std::unique_ptr<BandDecoder>> open(const std::string& path) {
        const auto header = read_image_header(path);
        EXPECT_TRUE(header.ok()) << header.error().message;
        return open_isolated_decoder(path, *header, limits());
    }
    static DecoderLimits limits() {
        DecoderLimits limits;
        limits.memory_bytes = std::int64_t{64} << 20;
        limits.cpu_seconds = 1;
        limits.wall_seconds = kSanitized ? 1 : 10;  // times ten
        return limits;
    }
    // Every sample of row r is r + 1.
    static void expect_rows(BandDecoder& decoder, std::int64_t begin, std::int64_t end) {
        const auto rows = decoder.decode(begin, end);
        ASSERT_TRUE(rows.ok()) << rows.error().message;
        for (std::int64_t row = begin; row < end; ++row)
            for (std::int64_t column = 0; column < kSide; ++column)
                ASSERT_EQ((*rows)[(row - begin) * kSide + column], static_cast<std::byte>(row + 1));
    }
    void expect_fate(const std::string& name, const std::string& words) {
        SCOPED_TRACE(name);
        {
            auto decoder = open(file(name));
            ASSERT_TRUE(decoder.ok()) << decoder.error().message;
            expect_rows(**decoder, 0, 8);
            const auto bad = (*decoder)->decode(8, 16);
            ASSERT_FALSE(bad.ok());
            EXPECT_EQ(bad.error().code, ErrorCode::input);
            EXPECT_NE(bad.error().message.find(words), std::string::npos) << bad.error().message;
            expect_rows(**decoder, 2, 6);  // rows that do no harm are still to be had
        }
        const auto opened = open(file("open-" + name));
        ASSERT_FALSE(opened.ok());
        EXPECT_EQ(opened.error().code, ErrorCode::input);
        EXPECT_NE(opened.error().message.find(words), std::string::npos) << opened.error().message;
        EXPECT_TRUE(comes_true([] { return decoding_processes() == 0; })) << "a process was left";
    }

    const test::TempDirectory directory_;
};

TEST_F(IsolatedDecoders, AnAbortIsTheFilesError) { expect_fate("abort.tif", "its decoder was killed by signal 6"); }
TEST_F(IsolatedDecoders, AnOverflowOfTheStackIsTheFilesError) {
    expect_fate("overflow.tif", kSanitized ? "its decoder ended" : "its decoder was killed by signal 11");
}
TEST_F(IsolatedDecoders, AnEndWithoutAWordIsTheFilesError) {
    expect_fate("leave.tif", "its decoder ended without an answer");
}
TEST_F(IsolatedDecoders, ADecoderThatComputesForEverIsStopped) {
    expect_fate("spin.tif", "of processor time without an answer");
}
TEST_F(IsolatedDecoders, ADecoderThatWaitsForEverIsStopped) { expect_fate("sleep.tif", "gave no answer within"); }
TEST_F(IsolatedDecoders, MemoryIsBounded) {
    if (kSanitized) GTEST_SKIP() << "sanitizers keep no bounds on memory";
    expect_fate("grow.tif", "more memory than the 64 MiB");
    EXPECT_LT(decoder_usage().peak_rss_bytes, std::int64_t{160} << 20);
}

TEST_F(IsolatedDecoders, WhatADecoderQuotesIsOneLine) { expect_fate("refuse.tif", "strip 8 is odd  [31m"); }

TEST_F(IsolatedDecoders, AnErrorOnOpeningNamesTheFile) {
    const auto opened = open(file("open-abort.tif"));
    ASSERT_FALSE(opened.ok());
    EXPECT_EQ(opened.error().message.find(directory_.path("open-abort.tif") + ": its decoder was killed"), 0U)
        << opened.error().message;
}

TEST_F(IsolatedDecoders, ThousandsOfFilesNeedFewProcesses) {
    std::vector<std::unique_ptr<BandDecoder>> decoders;
    const std::string path = file("good.tif");
    for (int i = 0; i < 50; ++i) {
        auto decoder = open(path);
        ASSERT_TRUE(decoder.ok()) << decoder.error().message;
        decoders.push_back(std::move(*decoder));
    }
    EXPECT_TRUE(comes_true([] { return decoding_processes() <= 16; }));
    for (std::int64_t row = 0; row < 3; ++row)
        for (const auto& decoder : decoders) expect_rows(*decoder, row, row + 1 + row % 2);
    EXPECT_TRUE(comes_true([] { return decoding_processes() <= 16; }));
    decoders.clear();
    EXPECT_TRUE(comes_true([] { return decoding_processes() == 0; })) << "a process was left";
}

TEST_F(IsolatedDecoders, FilesOfManyThreadsDoNotMeet) {
    const std::string path = file("good.tif");
    std::vector<std::jthread> threads;
    for (int thread = 0; thread < 4; ++thread)
        threads.emplace_back([&path] {
            for (int i = 0; i < 20; ++i) {
                auto decoder = open(path);
                ASSERT_TRUE(decoder.ok()) << decoder.error().message;
                for (std::int64_t row = 0; row < kSide; ++row) expect_rows(**decoder, row, row + 1);
            }
        });
}

TEST_F(IsolatedDecoders, AServerThatWasKilledIsReplaced) {
    auto decoder = open(file("good.tif"));
    ASSERT_TRUE(decoder.ok()) << decoder.error().message;
    expect_rows(**decoder, 0, 4);
    for (const pid_t server : children_of("self")) ::kill(server, SIGKILL);
    EXPECT_TRUE(comes_true([] { return decoding_processes() == 0; }));
    EXPECT_FALSE((*decoder)->decode(4, 8).ok());
    expect_rows(**decoder, 4, 8);
}

TEST_F(IsolatedDecoders, ABrokenInstallationIsNoFaultOfTheFile) {
    ::setenv("SCREE_DECODERS", directory_.path("").c_str(), 1);
    std::ofstream(directory_.path("scree-decoder")) << "#!/bin/false\n";
    std::filesystem::permissions(directory_.path("scree-decoder"), std::filesystem::perms::owner_all);
    for (const pid_t server : children_of("self")) ::kill(server, SIGKILL);
    EXPECT_TRUE(comes_true([] { return decoding_processes() == 0; }));
    const auto opened = open(file("good.tif"));
    ASSERT_FALSE(opened.ok());
    EXPECT_EQ(opened.error().code, ErrorCode::io) << "no fault of the file: " << opened.error().message;
}

}  // namespace
}  // namespace scree
