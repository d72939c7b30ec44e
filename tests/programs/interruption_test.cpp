// Ctrl-C, full disks, limits: the final name is whole or absent, nothing is left but OUT.partial, and the same command
// makes of it the store of an undisturbed build.
#include <gtest/gtest.h>
#include <sys/mount.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <thread>

#include "tests/common/test_support.h"
#include "tests/programs/reports.h"
#include "tests/programs/sample_inputs.h"

namespace scree::test {
namespace {

// Large enough that a signal meets the build at work.
class Interruption : public ::testing::Test {
protected:
    void SetUp() override {
        ASSERT_EQ(
            scree({"synth", "-o", folder_.file("land"), "--size", "1025", "--imagery-scale", "4", "--quiet"}).exit_code,
            0);
        std::filesystem::create_directory(out_);
    }
    std::vector<std::string> command() const {
        return {"build",     folder_.file("land/dem.tif"),
                "--imagery", folder_.file("land/ortho.tif"),
                "-o",        store_,
                "--threads", "1"};
    }
    ProgramRun interrupted_build(int signal, std::uintmax_t when_bytes, bool force = false) const {
        ProgramOptions options;
        options.signal = signal;
        options.signal_when = [partial = store_ + ".partial", when_bytes] {
            std::error_code error;
            const auto size = std::filesystem::file_size(partial, error);
            return !error && size >= when_bytes;
        };
        auto arguments = command();
        if (force) arguments.push_back("--force");
        return scree(arguments, options);
    }
    std::string undisturbed_digest() const {
        std::vector<std::string> inputs{folder_.file("land/dem.tif"), "--imagery", folder_.file("land/ortho.tif")};
        build_store_from(inputs, folder_.file("whole.scree"));
        return digest_of(folder_.file("whole.scree"));
    }
    /// The same command ends what was begun.
    void expect_ends_in(const std::string& digest) const {
        const auto run = scree(command());
        EXPECT_EQ(run.exit_code, 0) << describe(run);
        EXPECT_EQ(digest_of(store_), digest);
        std::filesystem::remove(store_);
        EXPECT_FALSE(std::filesystem::exists(store_ + ".partial"));
        EXPECT_FALSE(std::filesystem::exists(store_ + ".partial-journal"));
    }

    TemporaryFolder folder_;
    std::string out_ = folder_.file("out"), store_ = folder_.file("out/s.scree");
};

TEST_F(Interruption, EndsABuildWith130AndTheSameCommandGoesOn) {
    const std::string digest = undisturbed_digest();
    for (const int signal : {SIGINT, SIGTERM})
        for (const std::uintmax_t when_bytes : {0u, 100000u}) {
            const auto run = interrupted_build(signal, when_bytes);
            ASSERT_TRUE(run.signalled) << "the build was over too soon\n" << describe(run);
            EXPECT_EQ(run.exit_code, 130) << describe(run);
            EXPECT_LT(run.seconds, 20);
            expect_at_most_partial(store_);
            if (when_bytes == 0) expect_only(out_, {});
            expect_ends_in(digest);
        }
}

TEST_F(Interruption, KeepsTheStoreThatForceWouldReplace) {
    write_bytes(store_, {'o', 'l', 'd'});
    const auto run = interrupted_build(SIGINT, 100000, true);
    EXPECT_EQ(run.exit_code, 130) << describe(run);
    EXPECT_EQ(read_bytes(store_), (std::vector<std::uint8_t>{'o', 'l', 'd'}));
    expect_at_most_partial(store_, {"s.scree"});
}

TEST_F(Interruption, ReplacesAnAbandonedPartialFile) {
    write_bytes(store_ + ".partial", {'j', 'u', 'n', 'k'});
    EXPECT_EQ(scree({"build", folder_.file("land/dem.tif"), "-o", store_, "--quiet"}).exit_code, 0);
    expect_only(out_, {"s.scree"});
    EXPECT_EQ(scree({"verify", store_, "--quiet"}).exit_code, 0);
}

TEST_F(Interruption, WritesThatFailHalfWayAreFiveAndTheSameCommandGoesOn) {
    const std::string digest = undisturbed_digest();
    std::filesystem::create_directory(folder_.file("more land"));
    for (const std::int64_t limit : {20000, 300000, 3000000}) {
        ProgramOptions options;
        options.largest_file_bytes = limit;
        const auto run = scree(command(), options);
        EXPECT_EQ(run.exit_code, 5) << "limit " << limit << '\n' << describe(run);
        EXPECT_NE(run.err, "");
        expect_at_most_partial(store_);
        expect_ends_in(digest);
        const auto land = scree({"synth", "-o", folder_.file("more land"), "--size", "1025", "--quiet"}, options);
        EXPECT_EQ(land.exit_code, 5) << describe(land);
        expect_only(folder_.file("more land"), {});
    }
}

TEST_F(Interruption, AFullDiskIsFoundBeforeAndDuringTheBuild) {
    const std::string digest = undisturbed_digest();
    if (::mount("scree test", out_.c_str(), "tmpfs", 0, "size=2m") != 0)
        GTEST_SKIP() << "needs the right to mount a tmpfs";
    const auto before = scree(command());
    expect_only(out_, {});
    ASSERT_EQ(::umount2(out_.c_str(), MNT_DETACH), 0);
    EXPECT_EQ(before.exit_code, 5) << describe(before);
    EXPECT_NE(before.err.find("are free"), std::string::npos) << describe(before);

    for (const std::uintmax_t when_bytes : {0u, 500000u}) {  // another program takes the space meanwhile
        ASSERT_EQ(::mount("scree test", out_.c_str(), "tmpfs", 0, "size=128m"), 0);
        ProgramOptions options;
        bool filled = false;
        options.meanwhile = [&] {
            std::error_code error;
            const auto size = std::filesystem::file_size(store_ + ".partial", error);
            if (filled || error || size < when_bytes) return;
            filled = true;
            std::ofstream filler(out_ + "/filler", std::ios::binary);
            const std::vector<char> block(1 << 20);
            while (filler.write(block.data(), static_cast<std::streamsize>(block.size())) && filler.flush()) {
            }
        };
        const auto during = scree(command(), options);
        EXPECT_TRUE(filled);
        expect_at_most_partial(store_, {"filler"});
        EXPECT_EQ(during.exit_code, 5) << describe(during);
        std::filesystem::remove(out_ + "/filler");
        expect_ends_in(digest);
        EXPECT_EQ(::umount2(out_.c_str(), MNT_DETACH), 0);
    }
}

TEST_F(Interruption, TwoBuildsOfOneStoreNeverLeaveHalfOfIt) {
    const std::vector<std::string> arguments{"build",     folder_.file("land/dem.tif"),
                                             "--imagery", folder_.file("land/ortho.tif"),
                                             "-o",        store_,
                                             "--threads", "1",
                                             "--quiet",   "--force"};
    std::atomic<bool> first_ended{false};
    ProgramRun first;
    std::thread builder([&] {
        first = scree(arguments);
        first_ended = true;
    });
    while (!std::filesystem::exists(store_ + ".partial") && !first_ended)
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    ProgramOptions options;  // killed the moment the first one says that it is done
    options.signal = SIGKILL;
    options.signal_when = [&] { return first_ended.load(); };
    const auto second = scree(arguments, options);
    builder.join();
    EXPECT_EQ(first.exit_code, 0) << describe(first);
    EXPECT_TRUE(second.signalled || second.exit_code == 0 || second.exit_code == 5 || second.exit_code == 2)
        << describe(second);
    const auto verified = scree({"verify", store_, "--quiet"});
    EXPECT_EQ(verified.exit_code, 0) << "what stands under the final name must be whole\n" << describe(verified);
}

TEST_F(Interruption, EndsSynthWith130AndLeavesNothing) {
    ProgramOptions options;
    options.signal = SIGINT;
    options.signal_when = [this] { return !std::filesystem::is_empty(out_); };
    const auto run = scree({"synth", "-o", out_, "--size", "4097", "--quiet"}, options);
    ASSERT_TRUE(run.signalled);
    EXPECT_EQ(run.exit_code, 130) << describe(run);
    expect_only(out_, {});
}

TEST_F(Interruption, EndsReadersWith130) {
    EXPECT_EQ(scree({"build", folder_.file("land/dem.tif"), "-o", store_, "--quiet"}).exit_code, 0);
    const std::vector<std::vector<std::string>> readers = {
        {"audit", store_, "--frames", "100000"},
        {"fly", store_, "--headless", "--frames", "100000", "--size", "64x64"},
        {"fly", store_, "--headless", "--wait", "--frames", "100000", "--size", "64x64"}};
    for (const auto& arguments : readers) {
        ProgramOptions options;
        options.signal = SIGINT;
        options.limit_s = 30;
        int waited = 0;
        options.signal_when = [&] { return ++waited > 500; };
        const auto run = scree_view(arguments, options);
        ASSERT_TRUE(run.signalled) << describe(run);
        EXPECT_EQ(run.exit_code, 130) << arguments[0] << '\n' << describe(run);
        EXPECT_LT(run.seconds, 10) << arguments[0];
    }
    expect_only(out_, {"s.scree"});
}

}  // namespace
}  // namespace scree::test
