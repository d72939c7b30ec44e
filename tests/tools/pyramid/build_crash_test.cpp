// Builds and updates on a file system that fails at the k-th operation: what has the final name is whole or is not
// there, what was committed is gone on from, and in the end the store is the one of an undisturbed build.
//
// By default a dozen k of each sweep, every one with SCREE_LONG=1.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <iostream>
#include <set>

#include "common/store/page_checksum_vfs.h"
#include "common/store/sqlite_store.h"
#include "tests/common/faulty_vfs.h"
#include "tests/common/test_support.h"
#include "tests/programs/sample_inputs.h"
#include "tools/pyramid/builder.h"
#include "tools/pyramid/updater.h"

namespace scree {
namespace {

namespace fs = std::filesystem;
using test::FaultKind;
using test::FaultyVfs;

constexpr FaultKind kFaults[] = {FaultKind::io_error, FaultKind::io_errors, FaultKind::disk_full,
                                 FaultKind::disk_stays_full, FaultKind::power_loss};
constexpr std::int64_t kShortSweep = 12;

bool long_form() {
    const char* value = std::getenv("SCREE_LONG");
    return value != nullptr && *value != '\0' && *value != '0';
}

/// The k to try, all or about so many of them: the first operations and the last, where names and states change,
/// and some between them, others for other seeds.
std::set<std::int64_t> sweep(std::int64_t operations, test::Random& random, std::int64_t short_form = kShortSweep) {
    std::set<std::int64_t> chosen;
    for (std::int64_t k = 1; k <= operations; ++k)
        if (long_form() || k <= 2 || k > operations - 5) chosen.insert(k);
    const auto wanted = static_cast<std::size_t>(std::min(operations, short_form));
    while (chosen.size() < wanted) chosen.insert(test::uniform(random, 1, static_cast<int>(operations)));
    return chosen;
}

std::string digest_of(const std::string& path) {
    const auto store = SqliteStore::open(path);
    EXPECT_TRUE(store.ok()) << store.error().message;
    if (!store) return {};
    const auto problems = (*store)->integrity_problems();
    EXPECT_EQ(problems ? *problems : problems.error().message, "");
    const auto scan = scan_page_checksums(path);
    EXPECT_TRUE(scan.ok() && scan->damaged.empty());
    const auto digest = (*store)->digest();
    EXPECT_TRUE(digest.ok());
    return digest ? *digest : std::string();
}

template <class T>
void expect_io(const Result<T>& result) {
    EXPECT_TRUE(result.ok() || result.error().code == ErrorCode::io) << result.error().message;
}

/// Counts for the report of a sweep.
struct Tally {
    std::int64_t operations = 0;  ///< of the last undisturbed run
    int faults = 0, reported = 0, survived = 0, resumed = 0;
    void print(const char* what) const {
        std::cout << fmt::format("{}: {} operations, {} faults, {} reported, {} survived, {} gone on from (seed {})\n",
                                 what, operations, faults, reported, survived, resumed, test::seed());
    }
};

// 12 x 32 cells of 10 m and an image of 0.4 m: 2 x 4 districts of 256 texels.
class BuildCrash : public testing::Test {
protected:
    void SetUp() override {
        fs::create_directory(folder_.file("work"));
        dem_ = folder_.file("dem.tif");
        image_ = folder_.file("image.tif");
        test::write_heights(dem_, test::hills(13, 33, 5));
        write_picture(image_, 250, 800, 0, 0, 0);
        build_.dems = {dem_};
        build_.images = {image_};
        add_images();
        build_.out = out_;
        build_.tile_size = 5;
        build_.texture_size = 16;
        build_.threads = 1;
        build_.quiet = true;
    }
    std::int64_t short_sweep_ = kShortSweep;
    virtual void add_images() {}
    /// Of 0.02 m, so that textures end at two levels, four apart: deep districts, in two rows of them.
    void add_insets() {
        short_sweep_ = 8;
        for (const auto& [name, y] : {std::pair("inset.tif", 76), std::pair("lower.tif", 230)}) {
            write_picture(folder_.file(name), 110, 90, 77, y, 50, 0.02);
            build_.images.push_back(folder_.file(name));
        }
    }
    /// `x`, `y`: of its corner, metres from the land's.
    static void write_picture(const std::string& path, int width, int height, double x, double y, int shade,
                              double pixel_m = 0.4) {
        const test::Place place{400000 + x, 5300000 - y, pixel_m, 32633, true};
        test::write_image(path, width, height, 3, 8, &place, [&](int i, int j, int c) {
            return (test::patchwork(i, j, c) + static_cast<std::uint32_t>(shade)) & 255;
        });
    }

    Result<BuildReport> build() const {
        auto plan = plan_build(build_);
        if (!plan) return plan.error();
        if (auto ok = announce_build(*plan, build_); !ok) return ok.error();
        return build_store(std::move(*plan), build_, stop_);
    }
    void empty_work() const {
        for (const auto& entry : fs::directory_iterator(folder_.file("work"))) fs::remove_all(entry.path());
    }
    void expect_nothing_but(const std::set<std::string>& names) const {
        for (const auto& entry : fs::directory_iterator(folder_.file("work")))
            EXPECT_EQ(names.count(entry.path().filename().string()), 1u) << entry.path() << " was left";
    }
    std::int64_t operations_of(const std::function<bool()>& work) const {
        const FaultyVfs disk(1);
        EXPECT_TRUE(work());
        return disk.operations();
    }
    std::string undisturbed_digest() const {
        empty_work();
        const auto report = build();
        EXPECT_TRUE(report.ok()) << report.error().message;
        const std::string digest = digest_of(out_);
        empty_work();
        return digest;
    }

    /// The same command on a disk that fails, on one that fails no more, and the store.
    void expect_heals(FaultyVfs& disk, const std::string& digest, Tally& tally) const {
        const auto disturbed = build();
        const bool struck = disk.struck();
        expect_io(disturbed);
        EXPECT_TRUE(disturbed.ok() || struck);
        disk.reboot();
        expect_nothing_but({"s.scree", "s.scree.partial", "s.scree.partial-journal"});
        const bool named = fs::exists(out_);
        EXPECT_TRUE(named || !disturbed.ok());
        EXPECT_TRUE(!named || digest_of(out_) == digest) << "what has the final name is not whole";
        ++tally.faults;
        ++(disturbed ? tally.survived : tally.reported);
        if (disturbed) tally.resumed += disturbed->reused_tiles > 0 ? 1 : 0;
        if (named) return;
        const auto again = build();
        ASSERT_TRUE(again.ok()) << again.error().message;
        EXPECT_EQ(digest_of(out_), digest);
        expect_nothing_but({"s.scree"});
        tally.resumed += again->reused_tiles > 0 ? 1 : 0;
    }

    void fault_at_any_operation();
    void fault_while_taken_up();

    test::TemporaryFolder folder_;
    std::string dem_, image_, out_ = folder_.file("work/s.scree");
    BuildOptions build_;
    std::atomic<bool> stop_{false};
};

class DeepBuildCrash : public BuildCrash {
protected:
    void add_images() override { add_insets(); }
    void expect_deep_seeds() const {
        const auto store = SqliteStore::open(out_);
        ASSERT_TRUE(store.ok());
        const Dataset& d = (*store)->dataset();
        ASSERT_TRUE(d.coarsest_texture_level);
        std::set<std::int64_t> rows;
        const auto ok = (*store)->for_each(TileKind::seed, [&](const SqliteStore::RowView& row) {
            const TileId id = *tile_from_key(d.lattice, row.key);
            if (id.level == *d.coarsest_texture_level) rows.insert(id.y);
            return true;
        });
        EXPECT_TRUE(ok.ok());
        EXPECT_GE(rows.size(), 2u) << "no checkpoint would stand between deep districts";
    }
};

void BuildCrash::fault_at_any_operation() {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    const std::string digest = undisturbed_digest();
    const std::int64_t operations = operations_of([&] { return build().ok(); });
    Tally tally;
    tally.operations = operations;
    for (const FaultKind kind : kFaults)
        for (const std::int64_t k : sweep(operations, random, short_sweep_)) {
            const std::uint64_t seed = random();
            SCOPED_TRACE(
                fmt::format("operation {} of {}, fault {}, disk seed {}", k, operations, static_cast<int>(kind), seed));
            empty_work();
            build_.threads = 1 + static_cast<int>(k % 2);
            FaultyVfs disk(seed);
            disk.fail_at(k, kind);
            expect_heals(disk, digest, tally);
            if (HasFailure()) return;
        }
    tally.print("build");
    EXPECT_GT(tally.resumed, tally.faults / 3) << "checkpoints are lost";
    EXPECT_GT(tally.reported, tally.faults / 2);
}

TEST_F(BuildCrash, AFaultAtAnyOperationLeavesNoHalfStoreAndIsGoneOnFrom) { fault_at_any_operation(); }
TEST_F(DeepBuildCrash, AFaultAtAnyOperationLeavesNoHalfStoreAndIsGoneOnFrom) {
    ASSERT_TRUE(build().ok());
    expect_deep_seeds();
    fault_at_any_operation();
}

// A build that was cut off, taken up and cut off again.
void BuildCrash::fault_while_taken_up() {
    SCREE_TRACE_SEED();
    test::Random random(test::seed() + 1);
    const std::string digest = undisturbed_digest();
    const std::int64_t operations = operations_of([&] { return build().ok(); });
    Tally tally;
    for (const FaultKind first : {FaultKind::power_loss, FaultKind::disk_stays_full}) {
        const fs::path kept = folder_.file("kept " + std::to_string(static_cast<int>(first)));
        empty_work();
        {
            FaultyVfs disk(random());
            disk.fail_at(operations * 3 / 5, first);
            EXPECT_FALSE(build().ok());
            disk.reboot();
        }
        fs::copy(folder_.file("work"), kept);
        const auto restore = [&] {
            empty_work();
            fs::copy(kept, folder_.file("work"));
        };
        std::int64_t reused = 0;
        const std::int64_t left = operations_of([&] {
            const auto report = build();
            if (report) reused = report->reused_tiles;
            return report.ok();
        });
        EXPECT_GT(reused, 0);
        tally.operations = left;
        for (const FaultKind kind : kFaults)
            for (const std::int64_t k : sweep(left, random, short_sweep_)) {
                const std::uint64_t seed = random();
                SCOPED_TRACE(fmt::format("operation {} of {}, fault {} after {}, disk seed {}", k, left,
                                         static_cast<int>(kind), static_cast<int>(first), seed));
                restore();
                const int resumed = tally.resumed;
                FaultyVfs disk(seed);
                disk.fail_at(k, kind);
                expect_heals(disk, digest, tally);
                if (!fs::exists(out_) || HasFailure()) return;
                // A store that only lacks its name is not counted.
                EXPECT_TRUE(tally.resumed > resumed || k > left / 2) << "the checkpoints of before were lost";
            }
    }
    tally.print("build taken up");
}

TEST_F(BuildCrash, AFaultWhileABuildIsTakenUpLosesNoCheckpoint) { fault_while_taken_up(); }
TEST_F(DeepBuildCrash, AFaultWhileABuildIsTakenUpLosesNoCheckpoint) { fault_while_taken_up(); }

TEST_F(BuildCrash, PowerLostAgainAndAgainEndsInTheSameStore) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed() + 2);
    const std::string digest = undisturbed_digest();
    const std::int64_t operations = operations_of([&] { return build().ok(); });
    const int rounds = long_form() ? 200 : 6;
    int cuts = 0;
    for (int round = 0; round < rounds; ++round) {
        empty_work();
        for (int attempt = 0; attempt < 12 && !fs::exists(out_); ++attempt) {
            const std::uint64_t seed = random();
            const int k = test::uniform(random, 1, static_cast<int>(operations));
            SCOPED_TRACE(fmt::format("round {}, attempt {}, operation {}, disk seed {}", round, attempt, k, seed));
            build_.threads = 1 + static_cast<int>(random() % 2);
            FaultyVfs disk(seed);
            disk.fail_at(k, FaultKind::power_loss);
            const auto report = build();
            cuts += disk.struck() ? 1 : 0;
            disk.reboot();
            expect_io(report);
            EXPECT_TRUE(!report.ok() || fs::exists(out_));
        }
        EXPECT_TRUE(fs::exists(out_) || build().ok());
        EXPECT_EQ(digest_of(out_), digest) << "round " << round;
        if (HasFailure()) return;
    }
    std::cout << fmt::format("{} stores, power lost {} times (seed {})\n", rounds, cuts, test::seed());
    EXPECT_GT(cuts, rounds / 2);
}

TEST_F(BuildCrash, AFinishedFileThatLacksItsNameGetsItAndADamagedOneDoesNot) {
    const std::string digest = undisturbed_digest(), partial = out_ + ".partial";
    ASSERT_TRUE(build().ok());
    fs::rename(out_, partial);
    auto report = build();
    ASSERT_TRUE(report.ok()) << report.error().message;
    EXPECT_EQ(digest_of(out_), digest);
    EXPECT_GT(report->texture_tiles, 0);
    fs::rename(out_, partial);
    auto bytes = test::read_bytes(partial);
    bytes[bytes.size() / 2] ^= 0x55;
    test::write_bytes(partial, bytes);
    report = build();
    ASSERT_TRUE(report.ok()) << report.error().message;
    EXPECT_EQ(digest_of(out_), digest);
    expect_nothing_but({"s.scree"});
}

/// A finished store, and what is laid over it.
class UpdateCrash : public BuildCrash {
protected:
    void SetUp() override {
        BuildCrash::SetUp();
        old_digest_ = undisturbed_digest();
        EXPECT_TRUE(build().ok());
        fs::copy_file(out_, original_);
        write_picture(folder_.file("patch.tif"), 100, 200, 20, 100, 77);
        test::Place place;
        place.x += 40;
        place.y -= 40;
        auto bump = test::hills(5, 5, 9);
        for (float& z : bump.z) z = 1010;  // within the land's range
        test::write_heights(folder_.file("bump.tif"), bump, place);
        update_.store = out_;
        update_.images = {folder_.file("patch.tif")};
        update_.dems = {folder_.file("bump.tif")};
        change_images();
        update_.sources = {folder_.file("")};
        update_.threads = 1;
        update_.quiet = true;
        restore();
        const auto report = update();
        ASSERT_TRUE(report.ok()) << report.error().message;
        new_digest_ = digest_of(out_);
        EXPECT_NE(new_digest_, old_digest_);
    }
    virtual void change_images() {}
    void fault_during_an_update();
    Result<UpdateReport> update() const { return update_store(update_, stop_); }
    void restore() const {
        empty_work();
        fs::copy_file(original_, out_);
    }

    const std::string original_ = folder_.file("original.scree");
    UpdateOptions update_;
    std::string old_digest_, new_digest_;
};

/// One of two insets goes, another comes.
class DeepUpdateCrash : public UpdateCrash {
protected:
    void add_images() override { add_insets(); }
    void change_images() override {
        write_picture(folder_.file("third.tif"), 90, 110, 33, 150, 90, 0.02);
        update_.images.push_back(folder_.file("third.tif"));
        update_.remove = {"inset.tif"};
    }
};

void UpdateCrash::fault_during_an_update() {
    SCREE_TRACE_SEED();
    test::Random random(test::seed() + 3);
    restore();
    const std::int64_t operations = operations_of([&] { return update().ok(); });
    Tally tally;
    tally.operations = operations;
    int found_new = 0;
    for (const FaultKind kind : kFaults)
        for (const std::int64_t k : sweep(operations, random, short_sweep_)) {
            const std::uint64_t seed = random();
            SCOPED_TRACE(
                fmt::format("operation {} of {}, fault {}, disk seed {}", k, operations, static_cast<int>(kind), seed));
            restore();
            FaultyVfs disk(seed);
            disk.fail_at(k, kind);
            const auto disturbed = update();
            expect_io(disturbed);
            EXPECT_TRUE(disturbed.ok() || disk.struck());
            disk.reboot();
            ++tally.faults;
            ++(disturbed ? tally.survived : tally.reported);
            expect_nothing_but({"s.scree", "s.scree-journal", "s.scree.update", "s.scree.update-journal"});
            const std::string digest = digest_of(out_);
            EXPECT_TRUE(digest == new_digest_ || (digest == old_digest_ && !disturbed.ok())) << disturbed.ok();
            found_new += digest == new_digest_ ? 1 : 0;
            // What is removed cannot be removed again.
            if (digest == old_digest_ || update_.remove.empty()) {
                const auto again = update();
                ASSERT_TRUE(again.ok()) << again.error().message;
                expect_nothing_but({"s.scree"});
            }
            EXPECT_EQ(digest_of(out_), new_digest_);
            if (HasFailure()) return;
        }
    tally.print("update");
    EXPECT_GT(tally.reported, tally.faults / 2);
    EXPECT_LT(found_new, tally.faults);
}

TEST_F(UpdateCrash, AFaultAtAnyOperationLeavesTheOldStoreOrTheNewOne) { fault_during_an_update(); }
TEST_F(DeepUpdateCrash, AFaultAtAnyOperationLeavesTheOldStoreOrTheNewOne) { fault_during_an_update(); }

// As when an old store is built anew after its update was cut off: the journal of the update is not played into it.
TEST_F(UpdateCrash, ABuildOverAnUpdateThatWasCutOffIsWhole) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed() + 4);
    restore();
    const std::int64_t operations = operations_of([&] { return update().ok(); });
    build_.images.push_back(folder_.file("patch.tif"));
    build_.dems.push_back(folder_.file("bump.tif"));
    build_.force = true;
    int journals = 0;
    for (int round = 0; round < (long_form() ? 60 : 6); ++round) {
        const std::int64_t k = operations - round % 12;
        const std::uint64_t seed = random();
        SCOPED_TRACE(fmt::format("operation {} of {}, disk seed {}", k, operations, seed));
        restore();
        {
            FaultyVfs disk(seed);
            disk.fail_at(k, FaultKind::power_loss);
            (void)update();
            disk.reboot();
        }
        journals += fs::exists(out_ + "-journal") ? 1 : 0;
        const auto report = build();
        ASSERT_TRUE(report.ok()) << report.error().message;
        EXPECT_EQ(digest_of(out_), new_digest_) << "updated or built, the store is the same";
        if (HasFailure()) return;
    }
    EXPECT_GT(journals, 0);
}

}  // namespace
}  // namespace scree
