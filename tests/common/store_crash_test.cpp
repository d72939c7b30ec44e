// Stores on a file system that fails: at every operation, in every way, the file is at its last checkpoint, and a store
// that is amended is the old one or the new one.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <functional>
#include <map>
#include <optional>

#include "common/store/page_checksum_vfs.h"
#include "common/store/sqlite_store.h"
#include "tests/common/faulty_vfs.h"
#include "tests/common/test_support.h"

namespace scree {
namespace {

using test::FaultKind;
using test::FaultyVfs;
using Bytes = std::vector<std::uint8_t>;
using Rows = std::map<std::pair<TileKind, std::int64_t>, Bytes>;  // an empty payload: the row is removed

constexpr FaultKind kErrors[] = {FaultKind::io_error, FaultKind::io_errors, FaultKind::disk_full,
                                 FaultKind::disk_stays_full};

Dataset dataset_named(const std::string& attribution) {
    Dataset dataset;
    dataset.lattice = *make_lattice(0, 0, 1, 16, 16, 2);
    dataset.texture_size_log2 = 4;
    dataset.height_tiles = dataset.texture_tiles = dataset.present_cells = 1;
    dataset.attribution = attribution;
    return dataset;
}

/// What is put, replaced and removed between one checkpoint and the next.
struct Chapter {
    Rows changes;
    std::string state;
};

void change_rows(Rows& rows, const Rows& changes) {
    for (const auto& [place, payload] : changes)
        if (payload.empty())
            rows.erase(place);
        else
            rows[place] = payload;
}

Rows random_changes(test::Random& random, const Rows& rows, int count, int largest) {
    Rows changes;
    for (int k = 0; k < count; ++k) {
        const TileKind kind = kTileKinds[random() % kTileKinds.size()];
        Bytes payload(1 + random() % static_cast<std::uint64_t>(largest));
        for (auto& byte : payload) byte = static_cast<std::uint8_t>(random());
        changes[{kind, test::uniform(random, 1, 1000)}] = std::move(payload);
    }
    for (const auto& [place, payload] : rows) switch (random() % 6) {
            case 0:
                changes[place] = {};
                break;
            case 1:
                changes[place] = Bytes(1 + random() % static_cast<std::uint64_t>(largest), std::uint8_t{7});
                break;
        }
    return changes;
}

std::vector<Chapter> random_story(std::uint64_t seed, int chapters, int rows_each, int largest = 40000) {
    test::Random random(seed);
    std::vector<Chapter> story;
    Rows rows;
    for (int k = 0; k < chapters; ++k) {
        story.push_back({random_changes(random, rows, rows_each, largest), fmt::format("chapter {}", k + 1)});
        change_rows(rows, story.back().changes);
    }
    return story;
}

Result<void> put_all(SqliteStoreWriter& writer, const Rows& changes) {
    for (const auto& [place, payload] : changes) {
        auto ok = payload.empty() ? writer.remove(place.first, place.second)
                                  : writer.put(place.first, place.second, 1, payload);
        if (!ok) return ok;
    }
    return {};
}

/// How far a run has come: chapters that are surely on the disk, of all if it has been finished too.
struct Progress {
    std::size_t chapters = 0;
    bool finished = false;
    std::optional<Error> error;
};

// What follows an error would stand in the file without what came before it.
void expect_refuses(SqliteStoreWriter& writer) {
    TileRow row;
    EXPECT_FALSE(writer.put(TileKind::height, 2000, 0, Bytes{1}).ok());
    EXPECT_FALSE(writer.remove(TileKind::height, 1).ok());
    EXPECT_FALSE(writer.read(TileKind::height, 1, row).ok());
    EXPECT_FALSE(writer.for_each_key(TileKind::height, [](std::int64_t) {}).ok());
    EXPECT_FALSE(writer.checkpoint("too late").ok());
    EXPECT_FALSE(writer.finish(dataset_named("too late")).ok());
}

/// Writes the chapters from `first` on, and finishes.
Progress tell(Result<std::unique_ptr<SqliteStoreWriter>> writer, const std::vector<Chapter>& story, std::size_t first) {
    Progress progress{first, false, std::nullopt};
    const auto stopped = [&](const Result<void>& ok) {
        if (ok) return false;
        progress.error = ok.error();
        expect_refuses(**writer);
        return true;
    };
    if (!writer) {
        progress.error = writer.error();
        return progress;
    }
    for (std::size_t k = first; k < story.size(); ++k) {
        if (stopped(put_all(**writer, story[k].changes))) return progress;
        if (stopped((*writer)->checkpoint(story[k].state))) return progress;
        progress.chapters = k + 1;
    }
    progress.finished = !stopped((*writer)->finish(dataset_named("told")));
    return progress;
}

Rows rows_of(const SqliteStoreWriter& writer) {
    Rows rows;
    TileRow row;
    for (const TileKind kind : kTileKinds) {
        std::vector<std::int64_t> keys;
        EXPECT_TRUE(writer.for_each_key(kind, [&](std::int64_t key) { keys.push_back(key); }).ok());
        for (const std::int64_t key : keys) {
            const auto found = writer.read(kind, key, row);
            EXPECT_TRUE(found.ok() && *found) << (found.ok() ? "missing" : found.error().message);
            rows[{kind, key}] = row.payload;
        }
    }
    return rows;
}

Rows rows_after(const std::vector<Chapter>& story, std::size_t chapters) {
    Rows rows;
    for (std::size_t k = 0; k < chapters; ++k) change_rows(rows, story[k].changes);
    return rows;
}

void expect_sound_pages(const std::string& path) {
    const auto scan = scan_page_checksums(path);
    ASSERT_TRUE(scan.ok()) << scan.error().message;
    EXPECT_TRUE(scan->damaged.empty()) << "page " << scan->damaged.front();
}

std::string digest_of(const std::string& path) {
    const auto store = SqliteStore::open(path);
    EXPECT_TRUE(store.ok()) << store.error().message;
    if (!store.ok()) return {};
    EXPECT_EQ(*(*store)->integrity_problems(), "");
    expect_sound_pages(path);
    const auto digest = (*store)->digest();
    EXPECT_TRUE(digest.ok()) << digest.error().message;
    return digest.ok() ? *digest : std::string();
}

void expect_io(const std::optional<Error>& error) {
    if (!error) return;
    EXPECT_EQ(error->code, ErrorCode::io) << error->message;
}

class StoreCrash : public testing::Test {
protected:
    void SetUp() override { std::filesystem::create_directory(folder_.file("work")); }
    void start_afresh() const {
        std::filesystem::remove(path_);
        std::filesystem::remove(path_ + "-journal");
    }
    std::string told_digest(const std::vector<Chapter>& story) const {
        start_afresh();
        EXPECT_TRUE(tell(SqliteStoreWriter::create(path_), story, 0).finished);
        return digest_of(path_);
    }

    // What is left is what `progress` tells or the step that was under way, and from there the story ends as ever.
    void expect_resumable(const std::vector<Chapter>& story, const Progress& progress,
                          const std::string& digest) const {
        if (SqliteStore::open(path_).ok()) {
            EXPECT_EQ(progress.chapters, story.size()) << "finished too soon";
            EXPECT_EQ(digest_of(path_), digest);
            return;
        }
        EXPECT_FALSE(progress.finished);
        auto writer = SqliteStoreWriter::resume(path_);
        std::size_t found = 0;
        SCOPED_TRACE(writer ? "resumed" : writer.error().message);
        if (writer) {
            while (found < story.size() && story[found].state != (*writer)->state()) ++found;
            ASSERT_LT(found++, story.size()) << "unknown state " << (*writer)->state();
            EXPECT_EQ(rows_of(**writer), rows_after(story, found));
        } else {
            EXPECT_EQ(writer.error().code, ErrorCode::store) << writer.error().message;
            writer = SqliteStoreWriter::create(path_);
        }
        EXPECT_GE(found, progress.chapters) << "a checkpoint was lost";
        EXPECT_LE(found, progress.chapters + 1);
        EXPECT_TRUE(tell(std::move(writer), story, found).finished);
        EXPECT_EQ(digest_of(path_), digest);
    }

    test::TemporaryFolder folder_;
    std::string path_ = folder_.file("work/store.scree.partial");
};

TEST_F(StoreCrash, APowerLossAtAnyOperationLeavesTheLastCheckpoint) {
    SCREE_TRACE_SEED();
    const auto story = random_story(test::seed(), 3, 5);
    const std::string digest = told_digest(story);
    test::Random random(test::seed());
    int cuts = 0;
    for (std::int64_t k = 1;; ++k) {
        bool over = false;
        for (int repeat = 0; repeat < 4; ++repeat) {
            const std::uint64_t seed = random();
            SCOPED_TRACE(fmt::format("operation {}, disk seed {}", k, seed));
            start_afresh();
            FaultyVfs disk(seed);
            disk.fail_at(k, FaultKind::power_loss);
            const Progress progress = tell(SqliteStoreWriter::create(path_), story, 0);
            over = !disk.struck();
            EXPECT_TRUE(progress.finished || !over);
            expect_io(progress.error);
            disk.reboot();
            expect_resumable(story, progress, digest);
            ++cuts;
            if (HasFailure()) return;
        }
        if (over) break;
    }
    EXPECT_GT(cuts, 200);
}

TEST_F(StoreCrash, AnErrorAtAnyOperationIsReportedAndLeavesTheLastCheckpoint) {
    SCREE_TRACE_SEED();
    const auto story = random_story(test::seed() + 1, 3, 5);
    const std::string digest = told_digest(story);
    for (const FaultKind kind : kErrors)
        for (std::int64_t k = 1;; ++k) {
            SCOPED_TRACE(fmt::format("operation {}, fault {}", k, static_cast<int>(kind)));
            start_afresh();
            FaultyVfs disk(test::seed());
            disk.fail_at(k, kind);
            const Progress progress = tell(SqliteStoreWriter::create(path_), story, 0);
            EXPECT_EQ(progress.finished, !progress.error);
            expect_io(progress.error);
            if (!disk.struck()) {
                EXPECT_TRUE(progress.finished);
                break;
            }
            disk.fail_no_more();
            expect_resumable(story, progress, digest);
            if (HasFailure()) return;
        }
}

TEST_F(StoreCrash, APowerLossWhileItIsBroughtBackChangesNothing) {
    SCREE_TRACE_SEED();
    const auto story = random_story(test::seed() + 2, 3, 5);
    const std::string digest = told_digest(story);
    test::Random random(test::seed());
    int second_cuts = 0;
    for (int repeat = 0; repeat < 300; ++repeat) {
        const std::uint64_t seed = random();
        SCOPED_TRACE(fmt::format("repeat {}, disk seed {}", repeat, seed));
        start_afresh();
        FaultyVfs disk(seed);
        disk.fail_at(test::uniform(random, 1, 80), FaultKind::power_loss);
        const Progress progress = tell(SqliteStoreWriter::create(path_), story, 0);
        disk.reboot();
        for (int again = 0; again < 3; ++again) {
            disk.fail_at(test::uniform(random, 1, 12), FaultKind::power_loss);
            (void)SqliteStoreWriter::resume(path_);
            second_cuts += disk.struck() ? 1 : 0;
            disk.reboot();
        }
        expect_resumable(story, progress, digest);
        if (HasFailure()) return;
    }
    EXPECT_GT(second_cuts, 100);
}

// More between two checkpoints than SQLite's cache holds: pages reach the file before their commit.
TEST_F(StoreCrash, APowerLossAmidPagesThatWereWrittenEarly) {
    SCREE_TRACE_SEED();
    auto story = random_story(test::seed() + 3, 1, 40);
    test::Random random(test::seed());
    story.push_back({random_changes(random, story[0].changes, 800, 40000), "chapter 2"});
    story.push_back({random_changes(random, rows_after(story, 2), 5, 40000), "chapter 3"});
    const std::string digest = told_digest(story);
    std::int64_t operations = 0;
    {
        start_afresh();
        const FaultyVfs disk(1);
        tell(SqliteStoreWriter::create(path_), story, 0);
        operations = disk.operations();
    }
    ASSERT_GT(operations, 1000);
    for (int repeat = 0; repeat < 25; ++repeat) {
        const std::uint64_t seed = random();
        const int k = test::uniform(random, 1, static_cast<int>(operations));
        SCOPED_TRACE(fmt::format("operation {} of {}, disk seed {}", k, operations, seed));
        start_afresh();
        FaultyVfs disk(seed);
        disk.fail_at(k, FaultKind::power_loss);
        const Progress progress = tell(SqliteStoreWriter::create(path_), story, 0);
        disk.reboot();
        expect_resumable(story, progress, digest);
        if (HasFailure()) return;
    }
}

/// A finished store, and changes that lead to another.
class AmendCrash : public StoreCrash {
protected:
    void SetUp() override {
        StoreCrash::SetUp();
        story_ = random_story(test::seed() + 4, 1, 12);
        old_digest_ = told_digest(story_);
        std::filesystem::copy_file(path_, original_);
        test::Random random(test::seed() + 5);
        changes_ = random_changes(random, story_[0].changes, 6, 40000);
        EXPECT_TRUE(amend().ok());
        new_digest_ = digest_of(path_);
        EXPECT_NE(new_digest_, old_digest_);
    }
    void restore() const {
        start_afresh();
        std::filesystem::copy_file(original_, path_);
    }
    Result<void> amend() const {
        auto writer = SqliteStoreWriter::amend(path_);
        if (!writer) return writer.error();
        if (auto ok = put_all(**writer, changes_); !ok) return ok;
        return (*writer)->finish(dataset_named("amended"));
    }
    void expect_old_or_new(bool surely_new) const {
        const std::string digest = digest_of(path_);
        if (surely_new)
            EXPECT_EQ(digest, new_digest_) << "a finished update was lost";
        else
            EXPECT_TRUE(digest == old_digest_ || digest == new_digest_);
        const auto ok = amend();  // the same changes once more, whatever the store is
        EXPECT_TRUE(ok.ok()) << ok.error().message;
        EXPECT_EQ(digest_of(path_), new_digest_);
    }

    const std::string original_ = folder_.file("original.scree");
    std::vector<Chapter> story_;
    Rows changes_;
    std::string old_digest_, new_digest_;
};

TEST_F(AmendCrash, APowerLossAtAnyOperationLeavesTheOldStoreOrTheNewOne) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (std::int64_t k = 1;; ++k) {
        bool over = false;
        for (int repeat = 0; repeat < 6; ++repeat) {
            const std::uint64_t seed = random();
            SCOPED_TRACE(fmt::format("operation {}, disk seed {}", k, seed));
            restore();
            FaultyVfs disk(seed);
            disk.fail_at(k, FaultKind::power_loss);
            const auto amended = amend();
            over = !disk.struck();
            expect_io(amended ? std::nullopt : std::optional(amended.error()));
            disk.reboot();
            expect_old_or_new(amended.ok());
            if (HasFailure()) return;
        }
        if (over) break;
    }
}

TEST_F(AmendCrash, AnErrorAtAnyOperationLeavesTheOldStoreOrTheNewOne) {
    SCREE_TRACE_SEED();
    for (const FaultKind kind : kErrors)
        for (std::int64_t k = 1;; ++k) {
            SCOPED_TRACE(fmt::format("operation {}, fault {}", k, static_cast<int>(kind)));
            restore();
            FaultyVfs disk(test::seed());
            disk.fail_at(k, kind);
            const auto amended = amend();
            if (!disk.struck()) {
                EXPECT_TRUE(amended.ok());
                break;
            }
            expect_io(amended ? std::nullopt : std::optional(amended.error()));
            disk.fail_no_more();
            expect_old_or_new(amended.ok());
            if (HasFailure()) return;
        }
}

}  // namespace
}  // namespace scree
