// Builds and updates that were killed: the same command goes on and ends in the store of an undisturbed run; another
// command is refused, and told why. More rounds with SCREE_LONG=1.
#include <gtest/gtest.h>

#include <algorithm>
#include <csignal>
#include <iostream>
#include <map>

#include "common/store/sqlite_store.h"
#include "tests/common/test_support.h"
#include "tests/programs/reports.h"
#include "tests/programs/sample_inputs.h"

namespace scree::test {
namespace {

namespace fs = std::filesystem;
using List = std::vector<std::string>;

int rounds(int short_form, int long_form) {
    const char* value = std::getenv("SCREE_LONG");
    return value != nullptr && *value != '\0' && *value != '0' ? long_form : short_form;
}

List operator+(List a, const List& b) {
    a.insert(a.end(), b.begin(), b.end());
    return a;
}

std::uintmax_t bytes_of(const std::string& path) {
    std::error_code error;
    const auto bytes = fs::file_size(path, error);
    return error ? 0 : bytes;
}

// Land of 128 x 512 cells of 10 m under two images of 2.5 m: 2 x 8 districts of tiles of 16 texels.
class Resumed : public ::testing::Test {
protected:
    void SetUp() override {
        fs::create_directory(folder_.file("out"));
        fs::create_directory(folder_.file("later"));
        dem_ = folder_.file("dem.tif");
        write_heights(dem_, hills(129, 513, 8));
        north_ = image("north.tif", 520, 1100, 0, 0, 0);
        south_ = image("south.tif", 520, 1000, 10, 2700, 60);
    }
    std::string image(const std::string& name, int width, int height, double x, double y, int shade) const {
        const Place place{400000 + x, 5300000 - y, 2.5, 32633, true};
        write_image(folder_.file(name), width, height, 3, 8, &place, [&](int i, int j, int c) {
            return (patchwork(i, j, c) + static_cast<std::uint32_t>(shade)) & 255;
        });
        return folder_.file(name);
    }
    List inputs() const { return {dem_, "--texture-size", "16", "--imagery", north_, south_}; }
    List command(const List& more = {}) const {
        return List{"build"} + inputs() + List{"-o", store_, "--quiet", "--json", "-"} + more;
    }
    /// Digest and bytes of the store of an undisturbed build.
    void learn_whole() {
        build_store_from(inputs(), whole_);
        digest_ = digest_of(whole_);
        whole_bytes_ = bytes_of(whole_);
    }
    /// Sends a signal once OUT.partial has so many per cent of the bytes of the whole store.
    ProgramRun cut_off(int signal, double percent, const List& more = {}) const {
        ProgramOptions options;
        options.signal = signal;
        options.signal_when = [&, percent] {
            return fs::exists(partial_) &&
                   static_cast<double>(bytes_of(partial_)) >= percent / 100 * static_cast<double>(whole_bytes_);
        };
        return scree(command(more), options);
    }
    /// Cut off amid the textures, and checked to be.
    void begin_a_store() const {
        const auto run = cut_off(SIGKILL, 60);
        ASSERT_TRUE(run.signalled) << "the build was over too soon\n" << describe(run);
        ASSERT_EQ(run.exit_code, 137) << describe(run);
        ASSERT_FALSE(fs::exists(store_));
        expect_at_most_partial(store_);
        ASSERT_TRUE(fs::exists(partial_));
    }
    nlohmann::json expect_ends(const List& more = {}) const {
        const auto report = report_of(scree(command(more)));
        EXPECT_EQ(digest_of(store_), digest_);
        expect_only(folder_.file("out"), {"s.scree"});
        return report;
    }

    TemporaryFolder folder_;
    std::string dem_, north_, south_, digest_;
    const std::string store_ = folder_.file("out/s.scree"), partial_ = store_ + ".partial",
                      whole_ = folder_.file("whole.scree");
    std::uintmax_t whole_bytes_ = 0;
};

TEST_F(Resumed, KilledAtAnyMomentTheSameCommandEndsInTheSameStore) {
    SCREE_TRACE_SEED();
    Random random(seed());
    learn_whole();
    int kills = 0;
    for (int round = 0; round < rounds(5, 100) && !HasFailure(); ++round) {
        double percent = uniform(random, 0, 60);
        for (int k = 0; k < 3 && !fs::exists(store_); ++k, percent += uniform(random, 0, 20)) {
            SCOPED_TRACE("round " + std::to_string(round) + ", killed at per cent " + std::to_string(percent));
            const auto run = cut_off(SIGKILL, percent);
            EXPECT_TRUE(run.exit_code == 137 || fs::exists(store_)) << describe(run);
            if (fs::exists(store_)) break;
            expect_at_most_partial(store_);
            ++kills;
        }
        if (fs::exists(store_))
            EXPECT_EQ(digest_of(store_), digest_);
        else
            expect_ends();
        fs::remove(store_);
    }
    std::cout << kills << " builds killed (seed " << seed() << ")\n";
    EXPECT_GT(kills, 3);
}

TEST_F(Resumed, WhatWasMadeIsNotMadeAgain) {
    learn_whole();
    begin_a_store();
    const auto report = expect_ends();
    expect_keys(report, {"reused_tiles", "height_tiles", "texture_tiles"});
    EXPECT_GT(report.value("reused_tiles", 0), report.value("height_tiles", 0)) << "textures are kept, too";
    EXPECT_LT(report.value("reused_tiles", 0), report.value("height_tiles", 0) + report.value("texture_tiles", 0));
    const auto sound = scree({"verify", store_, "--quiet"});
    EXPECT_EQ(sound.exit_code, 0) << describe(sound);
}

// Resuming reads no DEM: it may be gone as soon as the plan has been made, but the plan wants it to be the same.
TEST_F(Resumed, AnotherBuildIsRefusedAndTheDifferenceNamed) {
    learn_whole();
    begin_a_store();
    const auto refused = [&](const List& arguments, const List& words) {
        const auto run = scree(arguments);
        EXPECT_EQ(run.exit_code, 2) << describe(run);
        for (const std::string& word : words) EXPECT_NE(run.err.find(word), std::string::npos) << word << describe(run);
        EXPECT_NE(run.err.find("--force"), std::string::npos) << describe(run);
        EXPECT_FALSE(fs::exists(store_));
    };
    const List out{"-o", store_, "--quiet", "--texture-size", "16"};
    refused(command({"--texture-quality", "high"}), {"--texture-quality", "high now"});
    refused(command({"--tile-size", "17"}), {"--tile-size", "17 now"});
    refused(command({"--height-quantum", "0.5"}), {"--height-quantum", "0.5 now"});
    refused(command({"--height-codec", "raw"}), {"--height-codec", "raw now"});
    refused(command({"--attribution", "somebody"}), {"attribution", "somebody"});
    refused(List{"build", dem_, "--imagery", south_, north_} + out, {"north.tif, south.tif", "south.tif, north.tif"});
    refused(List{"build", dem_, "--imagery", north_} + out, {"south.tif"});
    refused(List{"build", dem_} + out, {"north.tif", "south.tif"});
    const auto before = read_bytes(south_);
    image("south.tif", 500, 900, 10, 2700, 61);
    refused(command(), {"south.tif", "other content"});
    write_bytes(south_, before);
    EXPECT_GT(expect_ends().value("reused_tiles", 0), 0) << "what was refused has changed nothing";
}

TEST_F(Resumed, ForceStartsAnew) {
    learn_whole();
    begin_a_store();
    const auto other = report_of(scree(command({"--force", "--tile-size", "17"})));
    EXPECT_EQ(other.value("reused_tiles", -1), 0);
    EXPECT_NE(digest_of(store_), digest_);
    fs::remove(store_);
    begin_a_store();
    EXPECT_EQ(expect_ends({"--force"}).value("reused_tiles", -1), 0);
}

TEST_F(Resumed, StoppedByTheUserItSaysHowFarItCame) {
    learn_whole();
    for (const int signal : {SIGINT, SIGTERM}) {
        const auto run = cut_off(signal, 50);
        ASSERT_TRUE(run.signalled) << describe(run);
        EXPECT_EQ(run.exit_code, 130) << describe(run);
        EXPECT_NE(run.err.find("the same command goes on from"), std::string::npos) << describe(run);
        EXPECT_NE(run.err.find("of 8 rows"), std::string::npos) << describe(run);
        EXPECT_GT(expect_ends().value("reused_tiles", 0), 0);
        fs::remove(store_);
    }
}

TEST_F(Resumed, AFileThatLacksOnlyItsNameGetsIt) {
    learn_whole();
    fs::copy_file(whole_, partial_);
    const auto before = read_bytes(partial_);
    const auto report = expect_ends();
    EXPECT_TRUE(read_bytes(store_) == before) << "made again";
    EXPECT_GT(report.value("texture_tiles", 0), 0);
    fs::rename(store_, partial_);
    const auto other = scree(command({"--tile-size", "17"}));
    EXPECT_EQ(other.exit_code, 0) << "a store of other options\n" << describe(other);
    EXPECT_NE(digest_of(store_), digest_);
}

class UpdateKilled : public Resumed {
protected:
    void SetUp() override {
        Resumed::SetUp();
        build_store_from(inputs(), whole_);
        old_digest_ = digest_of(whole_);
        write_heights(folder_.file("later/bump.tif"), hills(20, 20, 3), Place{400400, 5297000, 10, 32633, false});
        image("later/patch.tif", 200, 700, 300, 600, 99);
        restore();
        const auto run = scree(update());
        ASSERT_EQ(run.exit_code, 0) << describe(run);
        seconds_ = run.seconds;
        new_digest_ = digest_of(store_);
        ASSERT_NE(new_digest_, old_digest_);
    }
    List update() const {
        return {"update",
                store_,
                folder_.file("later/bump.tif"),
                "--imagery",
                folder_.file("later/patch.tif"),
                "--sources",
                folder_.file(""),
                "--quiet"};
    }
    void restore() const {
        for (const auto& entry : fs::directory_iterator(folder_.file("out"))) fs::remove(entry.path());
        fs::copy_file(whole_, store_);
    }
    std::string expect_old_or_new() const {
        const std::string digest = digest_of(store_);
        EXPECT_TRUE(digest == old_digest_ || digest == new_digest_);
        const auto sound = scree({"verify", store_, "--quiet"});
        EXPECT_EQ(sound.exit_code, 0) << describe(sound);
        return digest;
    }
    void expect_repeatable() const {
        const auto again = scree(update());
        EXPECT_EQ(again.exit_code, 0) << describe(again);
        EXPECT_EQ(digest_of(store_), new_digest_);
        expect_only(folder_.file("out"), {"s.scree"});
    }

    std::string old_digest_, new_digest_;
    double seconds_ = 0;
};

TEST_F(UpdateKilled, AtAnyMomentTheStoreIsTheOldOneOrTheNewOne) {
    SCREE_TRACE_SEED();
    Random random(seed());
    int kills = 0, amid = 0;
    for (int round = 0; round < rounds(6, 150) && !HasFailure(); ++round) {
        restore();
        ProgramOptions options;
        options.signal = SIGKILL;
        int polls = round % 2 == 0 ? 0 : uniform(random, 1, static_cast<int>(seconds_ * 900));
        SCOPED_TRACE("round " + std::to_string(round) + ", poll " + std::to_string(polls));
        options.signal_when = [&] {  // amid the transaction, or anywhere
            if (round % 2 == 0) return fs::exists(store_ + "-journal");
            return polls-- <= 0;
        };
        const auto run = scree(update(), options);
        kills += run.exit_code == 137 ? 1 : 0;
        amid += fs::exists(store_ + "-journal") ? 1 : 0;
        EXPECT_TRUE(run.exit_code == 137 || run.exit_code == 0) << describe(run);
        const std::string digest = expect_old_or_new();
        EXPECT_TRUE(run.exit_code == 137 || digest == new_digest_);
        expect_repeatable();
    }
    std::cout << kills << " updates killed, " << amid << " amid their transaction\n";
    EXPECT_GT(kills, 0);
}

TEST_F(UpdateKilled, StoppedByTheUserTheStoreIsTheOldOne) {
    restore();
    ProgramOptions options;
    options.signal = SIGINT;
    options.signal_when = [&] { return fs::exists(store_ + ".update"); };
    const auto run = scree(update(), options);
    ASSERT_TRUE(run.signalled) << describe(run);
    EXPECT_EQ(run.exit_code, 130) << describe(run);
    EXPECT_NE(run.err.find("the store is as it was"), std::string::npos) << describe(run);
    EXPECT_EQ(expect_old_or_new(), old_digest_);
    expect_only(folder_.file("out"), {"s.scree"});
    expect_repeatable();
}

// The rows of all tiles and seeds, without the list of sources.
std::map<std::pair<TileKind, std::int64_t>, std::vector<std::uint8_t>> tiles_of(const std::string& path) {
    std::map<std::pair<TileKind, std::int64_t>, std::vector<std::uint8_t>> rows;
    const auto store = SqliteStore::open(path);
    EXPECT_TRUE(store.ok());
    if (!store) return rows;
    for (const TileKind kind : kTileKinds) {
        const auto ok = (*store)->for_each(kind, [&](const SqliteStore::RowView& row) {
            rows[{kind, row.key}].assign(row.payload.begin(), row.payload.end());
            return true;
        });
        EXPECT_TRUE(ok.ok());
    }
    return rows;
}

TEST_F(Resumed, NeitherThreadsMemoryOrderNorInterruptionsShow) {
    SCREE_TRACE_SEED();
    Random random(seed());
    // Images that lie apart, beside each other, so that their order means nothing.
    List images;
    for (int k = 0; k < 4; ++k)
        images.push_back(image("i" + std::to_string(k) + ".tif", 200, 400, k % 2 * 600, k / 2 * 2000 + 100, 40 * k));
    const List first{dem_, "--texture-size", "16", "--imagery"};
    build_store_from(first + images, whole_);
    whole_bytes_ = bytes_of(whole_);
    digest_ = digest_of(whole_);
    const auto tiles = tiles_of(whole_);
    ASSERT_GT(tiles.size(), 1000u);
    for (int round = 0; round < rounds(5, 80) && !HasFailure(); ++round) {
        List shuffled = images;
        if (round % 2 == 1) std::shuffle(shuffled.begin(), shuffled.end(), random);
        std::string trace = "round " + std::to_string(round) + ":";
        for (int attempt = 0; !fs::exists(store_); ++attempt) {
            const List way{"--threads", std::to_string(uniform(random, 1, 4)), "--memory",
                           std::to_string(uniform(random, 192, 600)) + "M"};
            const double percent = attempt < 3 ? uniform(random, 0, 150) : 1000;
            ProgramOptions options;
            options.signal = uniform(random, 0, 1) == 0 ? SIGKILL : SIGINT;
            options.signal_when = [&] {
                return fs::exists(partial_) &&
                       static_cast<double>(bytes_of(partial_)) >= percent / 100 * static_cast<double>(whole_bytes_);
            };
            const auto run = scree(List{"build"} + first + shuffled + List{"-o", store_, "--quiet"} + way, options);
            trace += " " + way[1] + " threads, " + way[3] + ", signal " + std::to_string(options.signal) + " at " +
                     std::to_string(percent) + " per cent;";
            ASSERT_TRUE(run.exit_code == 0 || run.exit_code == 137 || run.exit_code == 130) << trace << describe(run);
        }
        EXPECT_TRUE(tiles_of(store_) == tiles) << trace;
        EXPECT_TRUE(shuffled != images || digest_of(store_) == digest_) << trace;
        fs::remove(store_);
    }
}

}  // namespace
}  // namespace scree::test
