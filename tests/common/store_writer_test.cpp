// What the writer of a store promises where nothing fails: rows replaced and removed, checkpoints, updates beside
// readers.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sqlite3.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <csignal>
#include <set>
#include <thread>

#include "common/store/page_checksum_vfs.h"
#include "common/store/sqlite_store.h"
#include "tests/common/faulty_vfs.h"
#include "tests/common/test_support.h"

namespace scree {
namespace {

using Bytes = std::vector<std::uint8_t>;

Dataset small_dataset(const std::string& attribution = {}) {
    Dataset dataset;
    dataset.lattice = *make_lattice(0, 0, 1, 64, 64, 2);
    dataset.texture_size_log2 = 4;
    dataset.height_tiles = dataset.texture_tiles = dataset.present_cells = 1;
    dataset.attribution = attribution;
    return dataset;
}

void run_sql(const std::string& path, const std::string& sql) {
    sqlite3* db = nullptr;
    ASSERT_EQ(sqlite3_open(path.c_str(), &db), SQLITE_OK);
    ASSERT_EQ(sqlite3_exec(db, sql.c_str(), nullptr, nullptr, nullptr), SQLITE_OK) << sqlite3_errmsg(db);
    sqlite3_close(db);
}

class StoreWriter : public testing::Test {
protected:
    std::unique_ptr<SqliteStoreWriter> create() const { return opened(SqliteStoreWriter::create(path_)); }
    std::unique_ptr<SqliteStoreWriter> resume() const { return opened(SqliteStoreWriter::resume(path_)); }
    std::unique_ptr<SqliteStoreWriter> amend() const { return opened(SqliteStoreWriter::amend(path_)); }
    static std::unique_ptr<SqliteStoreWriter> opened(Result<std::unique_ptr<SqliteStoreWriter>> writer) {
        EXPECT_TRUE(writer.ok()) << writer.error().message;
        return writer ? std::move(*writer) : nullptr;
    }
    std::unique_ptr<SqliteStore> open() const {
        auto store = SqliteStore::open(path_);
        EXPECT_TRUE(store.ok()) << store.error().message;
        return std::move(*store);
    }
    static Bytes read(const SqliteStoreWriter& writer, TileKind kind, std::int64_t key) {
        TileRow row;
        const auto found = writer.read(kind, key, row);
        EXPECT_TRUE(found.ok()) << found.error().message;
        return *found ? row.payload : Bytes{};
    }
    static std::vector<std::int64_t> keys(const SqliteStoreWriter& writer, TileKind kind) {
        std::vector<std::int64_t> result;
        EXPECT_TRUE(writer.for_each_key(kind, [&](std::int64_t key) { result.push_back(key); }).ok());
        return result;
    }
    void write_store() const {
        auto writer = create();
        for (const TileKind kind : kTileKinds)
            for (const std::int64_t key : {1, 4, 5}) ASSERT_TRUE(writer->put(kind, key, 0, Bytes(2000, 1)).ok());
        ASSERT_TRUE(writer->finish(small_dataset()).ok());
    }

    test::TemporaryFolder folder_;
    std::string path_ = folder_.file("store.scree");
};

TEST_F(StoreWriter, RowsAreReplacedRemovedAndReadBeforeTheyAreCommitted) {
    auto writer = create();
    ASSERT_TRUE(writer->put(TileKind::seed, 4, 1, Bytes{1, 2}).ok());
    ASSERT_TRUE(writer->put(TileKind::seed, 4, 2, Bytes(70000, 3)).ok());
    ASSERT_TRUE(writer->put(TileKind::seed, 2, 1, Bytes{}).ok());
    ASSERT_TRUE(writer->put(TileKind::texture, 9, 1, Bytes{5}).ok());
    EXPECT_EQ(read(*writer, TileKind::seed, 4), Bytes(70000, 3));
    EXPECT_EQ(keys(*writer, TileKind::seed), (std::vector<std::int64_t>{2, 4}));
    EXPECT_EQ(keys(*writer, TileKind::height), std::vector<std::int64_t>{});
    ASSERT_TRUE(writer->remove(TileKind::seed, 4).ok());
    ASSERT_TRUE(writer->remove(TileKind::seed, 77).ok());
    EXPECT_EQ(keys(*writer, TileKind::seed), (std::vector<std::int64_t>{2}));
    TileRow row;
    EXPECT_FALSE(*writer->read(TileKind::seed, 4, row));
    ASSERT_TRUE(*writer->read(TileKind::seed, 2, row));
    EXPECT_TRUE(row.payload.empty());
    ASSERT_TRUE(writer->finish(small_dataset()).ok());
    const auto contents = open()->contents();
    ASSERT_TRUE(contents.ok());
    EXPECT_EQ(contents->height_rows, 0);
    EXPECT_EQ(contents->texture_rows, 1);
    EXPECT_EQ(contents->seed_rows, 1);
    EXPECT_EQ(contents->texture_bytes, 1);
    EXPECT_TRUE(scan_page_checksums(path_)->damaged.empty());
}

TEST_F(StoreWriter, ResumingFindsTheLastCheckpointAndNothingAfterIt) {
    auto writer = create();
    EXPECT_EQ(writer->state(), "");
    for (const std::string state : {"one", "", "three\n\xC3\xA9"}) {
        ASSERT_TRUE(writer->put(TileKind::height, 1, 0, Bytes{1}).ok());
        ASSERT_TRUE(writer->checkpoint(state).ok());
        EXPECT_EQ(writer->state(), state);
        ASSERT_TRUE(writer->put(TileKind::height, 1, 0, Bytes{2}).ok());
        ASSERT_TRUE(writer->put(TileKind::height, 2, 0, Bytes{2}).ok());
        writer.reset();
        writer = resume();
        EXPECT_EQ(writer->state(), state);
        EXPECT_EQ(read(*writer, TileKind::height, 1), Bytes{1});
        EXPECT_EQ(keys(*writer, TileKind::height), std::vector<std::int64_t>{1});
    }
    writer.reset();
    EXPECT_EQ(SqliteStore::open(path_).error().code, ErrorCode::store) << "unfinished";
    ASSERT_TRUE(resume()->finish(small_dataset()).ok());
    EXPECT_TRUE(open()->digest().ok());
    EXPECT_EQ(SqliteStoreWriter::resume(path_).error().code, ErrorCode::store) << "finished: there is no checkpoint";
    EXPECT_FALSE(std::filesystem::exists(path_ + "-journal"));
}

TEST_F(StoreWriter, ThereIsNothingToResumeWhereThereIsNoCheckpoint) {
    const auto code = [&] { return SqliteStoreWriter::resume(path_).error().code; };
    EXPECT_EQ(code(), ErrorCode::store) << "no file";
    EXPECT_FALSE(std::filesystem::exists(path_));
    test::write_bytes(path_, {});
    EXPECT_EQ(code(), ErrorCode::store) << "empty";
    test::write_bytes(path_, Bytes(50000, 'x'));
    EXPECT_EQ(code(), ErrorCode::store) << "not SQLite";
    std::filesystem::remove(path_);
    run_sql(path_, "CREATE TABLE height(key)");
    EXPECT_EQ(code(), ErrorCode::store) << "not ours";
    EXPECT_TRUE(create()->put(TileKind::height, 1, 0, Bytes{1}).ok());
    EXPECT_EQ(code(), ErrorCode::store) << "cut off before the first checkpoint";

    auto writer = create();
    for (int key = 1; key < 20; ++key) ASSERT_TRUE(writer->put(TileKind::height, key, 0, Bytes(20000, 1)).ok());
    ASSERT_TRUE(writer->checkpoint("state").ok());
    writer.reset();
    auto bytes = test::read_bytes(path_);
    for (const std::size_t at : {std::size_t{60}, std::size_t{5 * 16384 + 9}, bytes.size() - 1}) {
        auto damaged = bytes;
        damaged[at] ^= 4;
        test::write_bytes(path_, damaged);
        EXPECT_EQ(code(), ErrorCode::store) << "byte " << at;
    }
    test::write_bytes(path_, bytes);
    EXPECT_EQ(resume()->state(), "state");
}

TEST_F(StoreWriter, CreatingEmptiesWhatIsThere) {
    write_store();
    test::write_bytes(path_ + "-journal", {'x'});
    auto writer = create();
    EXPECT_EQ(keys(*writer, TileKind::height), std::vector<std::int64_t>{});
    ASSERT_TRUE(writer->finish(small_dataset()).ok());
    EXPECT_EQ((*open()->contents()).height_rows, 0);
}

TEST_F(StoreWriter, SeedsCountInTheDigestAfterTheTextures) {
    write_store();
    const std::string with = *open()->digest();
    {
        auto writer = amend();
        for (const std::int64_t key : {1, 4, 5}) ASSERT_TRUE(writer->remove(TileKind::seed, key).ok());
        ASSERT_TRUE(writer->finish(small_dataset()).ok());
    }
    const std::string without = *open()->digest();
    EXPECT_NE(with, without);
    run_sql(path_, "DROP TABLE seed");  // a store made before there were seeds
    EXPECT_EQ(*open()->digest(), without);
    EXPECT_EQ((*open()->contents()).seed_rows, 0);
    const auto store = open();
    const auto reader = store->open_reader();
    ASSERT_TRUE(reader.ok());
    TileRow row;
    EXPECT_FALSE(*(*reader)->read(TileKind::seed, {0, 0, 0}, row));
    EXPECT_TRUE(*(*reader)->read(TileKind::height, {0, 0, 0}, row));
    {
        auto writer = amend();
        for (const std::int64_t key : {1, 4, 5}) ASSERT_TRUE(writer->put(TileKind::seed, key, 0, Bytes(2000, 1)).ok());
        ASSERT_TRUE(writer->finish(small_dataset()).ok());
    }
    EXPECT_EQ(*open()->digest(), with);
    EXPECT_TRUE(*(*(*open()).open_reader())->read(TileKind::seed, {0, 0, 0}, row));
}

TEST_F(StoreWriter, AViewOrVirtualTableOfSeedsIsNotQueried) {
    write_store();
    run_sql(path_, "DROP TABLE seed; CREATE VIEW seed AS SELECT * FROM nowhere");
    EXPECT_TRUE(open()->digest().ok());
    EXPECT_TRUE(open()->open_reader().ok());
    if (sqlite3_compileoption_used("ENABLE_FTS5") == 0) GTEST_SKIP() << "SQLite has no virtual table to try";
    run_sql(path_,
            "DROP VIEW seed; CREATE VIRTUAL TABLE seed USING fts5(key, codec, checksum, payload);"
            "INSERT INTO seed VALUES(1, 2, 3, 4)");
    EXPECT_TRUE(open()->digest().ok());
    EXPECT_TRUE(open()->open_reader().ok());
}

TEST_F(StoreWriter, AnUpdateIsSeenAsAWholeWhenItIsFinishedAndNotAtAllWhenItIsNot) {
    write_store();
    const auto before = open();
    const std::string digest = *before->digest();
    auto writer = amend();
    ASSERT_TRUE(writer->put(TileKind::height, 1, 0, Bytes(30000, 9)).ok());
    ASSERT_TRUE(writer->remove(TileKind::texture, 5).ok());
    EXPECT_EQ(*open()->digest(), digest);
    EXPECT_FALSE(before->has_changed());
    writer.reset();
    EXPECT_EQ(*open()->digest(), digest);

    writer = amend();
    EXPECT_EQ(writer->state(), "");
    ASSERT_TRUE(writer->put(TileKind::height, 1, 0, Bytes(30000, 9)).ok());
    ASSERT_TRUE(writer->finish(small_dataset("updated")).ok());
    const auto after = open();
    EXPECT_EQ(after->dataset().attribution, "updated");
    EXPECT_NE(*after->digest(), digest);
    EXPECT_EQ(*before->digest(), *after->digest()) << "the digest is that of the file as it is";
    EXPECT_TRUE(before->has_changed());
    EXPECT_FALSE(after->has_changed());
    EXPECT_EQ(*after->integrity_problems(), "");
}

TEST_F(StoreWriter, AnUpdateHasNoCheckpoints) {
    write_store();
    const std::string digest = *open()->digest();
    auto writer = amend();
    ASSERT_TRUE(writer->put(TileKind::height, 1, 0, Bytes(30000, 9)).ok());
    EXPECT_EQ(writer->checkpoint("half").error().code, ErrorCode::usage);
    writer.reset();
    EXPECT_EQ(*open()->digest(), digest);
}

TEST_F(StoreWriter, TheSecondOfTwoWritersIsRefused) {
    write_store();
    auto first = amend();
    ASSERT_TRUE(first->put(TileKind::height, 1, 0, Bytes(30000, 9)).ok());
    const auto second = SqliteStoreWriter::amend(path_);
    ASSERT_FALSE(second.ok());
    EXPECT_EQ(second.error().code, ErrorCode::usage) << second.error().message;
    EXPECT_TRUE(first->finish(small_dataset()).ok()) << "the first is not disturbed";
    EXPECT_TRUE(amend()->finish(small_dataset("second")).ok());
}

TEST_F(StoreWriter, OnlyACompleteStoreIsAmended) {
    EXPECT_EQ(SqliteStoreWriter::amend(path_).error().code, ErrorCode::input);
    ASSERT_TRUE(create()->checkpoint("half").ok());
    EXPECT_EQ(SqliteStoreWriter::amend(path_).error().code, ErrorCode::store);
    test::write_bytes(path_, Bytes(50000, 'x'));
    EXPECT_EQ(SqliteStoreWriter::amend(path_).error().code, ErrorCode::store);
}

TEST_F(StoreWriter, TriggersInAStoreDoNotRun) {
    write_store();
    run_sql(path_, "CREATE TRIGGER t AFTER INSERT ON height BEGIN DELETE FROM texture; END");
    auto writer = amend();
    ASSERT_TRUE(writer->put(TileKind::height, 16, 0, Bytes{1}).ok());
    EXPECT_EQ(keys(*writer, TileKind::texture).size(), 3u);
}

TEST_F(StoreWriter, AFileThatWasReplacedHasChanged) {
    write_store();
    const auto store = open();
    EXPECT_FALSE(store->has_changed());
    std::filesystem::copy_file(path_, folder_.file("copy"));
    std::filesystem::last_write_time(folder_.file("copy"), std::filesystem::last_write_time(path_));
    EXPECT_FALSE(store->has_changed());
    std::filesystem::rename(folder_.file("copy"), path_);
    EXPECT_TRUE(store->has_changed()) << "another file of the same size and time";
    std::filesystem::remove(path_);
    EXPECT_TRUE(store->has_changed());
}

/// A store whose rows all say which version of it they are of.
class StoreVersions : public StoreWriter {
protected:
    static constexpr int kKeys = 60;
    static Bytes payload(std::int64_t key, int version) {
        Bytes bytes(static_cast<std::size_t>(500 + (key * 977 + version * 131) % 30000), std::uint8_t{0});
        for (std::size_t k = 0; k < bytes.size(); ++k) bytes[k] = static_cast<std::uint8_t>(version + k * 7 / 5);
        return bytes;
    }
    /// -1: rows of more than one version, or none of any.
    static int version_of(std::int64_t key, std::span<const std::uint8_t> bytes) {
        if (bytes.empty()) return -1;
        const Bytes expected = payload(key, bytes[0]);
        return std::equal(bytes.begin(), bytes.end(), expected.begin(), expected.end()) ? bytes[0] : -1;
    }
    Result<void> write_version(SqliteStoreWriter& writer, int version) const {
        for (std::int64_t key = 64; key < 64 + kKeys; ++key)
            for (const TileKind kind : {TileKind::height, TileKind::texture})
                if (auto ok = writer.put(kind, key, 0, payload(key, version)); !ok) return ok;
        return writer.finish(small_dataset(std::to_string(version)));
    }
    Result<void> amend_to(int version) const {
        auto writer = SqliteStoreWriter::amend(path_);
        if (!writer) return writer.error();
        return write_version(**writer, version);
    }
    void SetUp() override { ASSERT_TRUE(write_version(*create(), 0).ok()); }

    /// Reads until told to stop: single rows, and all of a table in one transaction. An empty text, or what was wrong.
    std::string read_until(const std::function<bool()>& stop, std::atomic<int>& sweeps,
                           std::set<std::string>* digests = nullptr) const {
        auto store = SqliteStore::open(path_);
        if (!store) return store.error().message;
        auto reader = (*store)->open_reader();
        if (!reader) return reader.error().message;
        TileRow row;
        std::int64_t last_version = 0;
        while (!stop()) {
            for (std::int64_t key = 64; key < 64 + kKeys; ++key) {
                const auto id = tile_from_key((*store)->dataset().lattice, key);
                const auto found = (*reader)->read(TileKind::height, *id, row);
                if (!found) return found.error().message;
                const int version = *found ? version_of(key, row.payload) : -1;
                if (version < last_version) return fmt::format("row {} of version {}", key, version);
                last_version = version;
            }
            std::optional<int> swept;
            bool mixed = false;
            auto ok = (*store)->for_each(TileKind::texture, [&](const SqliteStore::RowView& view) {
                const int version = view.checksum_ok ? version_of(view.key, view.payload) : -1;
                mixed = mixed || version < 0 || (swept && *swept != version);
                swept = version;
                return true;
            });
            if (!ok) return ok.error().message;
            if (mixed) return "a table of several versions";
            if (digests != nullptr) {
                const auto digest = (*store)->digest();
                if (!digest) return digest.error().message;
                digests->insert(*digest);
            }
            ++sweeps;
        }
        return {};
    }
};

TEST_F(StoreVersions, ThreadsThatReadWhileItIsUpdatedSeeOneVersionOrTheOther) {
    struct Reading {
        std::atomic<int> sweeps{0};
        std::atomic<bool> ended{false};
        std::string wrong;
        std::set<std::string> digests;
    };
    std::set<std::string> digests{*open()->digest()};
    std::atomic<bool> stop{false};
    std::array<Reading, 3> readings;
    std::vector<std::thread> threads;
    for (auto& reading : readings)
        threads.emplace_back([&] {
            reading.wrong = read_until([&] { return stop.load(); }, reading.sweeps, &reading.digests);
            reading.ended = true;
        });
    for (int version = 1; version <= 12; ++version) {
        const auto ok = amend_to(version);
        EXPECT_TRUE(ok.ok()) << ok.error().message;
        digests.insert(*open()->digest());
        // None is left behind: what is read is read beside this update or the next.
        for (auto& reading : readings)
            for (const int before = reading.sweeps; reading.sweeps == before && !reading.ended;)
                std::this_thread::yield();
    }
    stop = true;
    for (auto& thread : threads) thread.join();
    for (const auto& reading : readings) {
        EXPECT_EQ(reading.wrong, "");
        EXPECT_TRUE(std::includes(digests.begin(), digests.end(), reading.digests.begin(), reading.digests.end()))
            << "a digest of parts of two versions";
    }
    EXPECT_EQ(open()->dataset().attribution, "12");
}

TEST_F(StoreVersions, SoDoesAnotherProgram) {
    int told[2], asked[2];
    ASSERT_EQ(::pipe(told), 0);
    ASSERT_EQ(::pipe(asked), 0);
    std::signal(SIGPIPE, SIG_IGN);
    const pid_t child = ::fork();
    if (child == 0) {
        ::close(asked[1]);
        std::atomic<int> sweeps{0};
        bool said = false;
        const auto stop = [&] {
            if (sweeps > 0 && !said) said = ::write(told[1], "r", 1) == 1;
            // One sweep more for each byte, until the pipe is closed.
            char byte = 0;
            return said && ::read(asked[0], &byte, 1) == 0;
        };
        const std::string wrong = read_until(stop, sweeps);
        if (!wrong.empty()) fmt::print(stderr, "{}\n", wrong);
        ::_exit(wrong.empty() ? 0 : 1);
    }
    ::close(asked[0]);
    ::close(told[1]);
    char byte = 0;
    ASSERT_EQ(::read(told[0], &byte, 1), 1) << "the reader has begun";
    for (int version = 1; version <= 12; ++version) {
        EXPECT_EQ(::write(asked[1], "ss", 2), 2);
        const auto ok = amend_to(version);
        EXPECT_TRUE(ok.ok()) << ok.error().message;
    }
    ::close(asked[1]);
    int status = 0;
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
    ::close(told[0]);
}

TEST_F(StoreVersions, AReaderGoesOnAfterAWriterDiedAmidItsCommit) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    const auto store = open();
    const auto reader = store->open_reader();
    ASSERT_TRUE(reader.ok());
    int journals = 0;
    bool over = false;
    for (std::int64_t k = 1; !over; k += test::uniform(random, 1, 15)) {
        SCOPED_TRACE(k);
        int version = 0;
        {
            test::FaultyVfs disk(random());
            version = store->open_reader().ok() ? static_cast<int>(k % 250) : -1;
            disk.fail_at(k, test::FaultKind::power_loss);
            (void)amend_to(version);
            over = !disk.struck();
            disk.reboot();
        }
        journals += std::filesystem::exists(path_ + "-journal") ? 1 : 0;
        TileRow row;
        std::optional<int> seen;
        for (std::int64_t key = 64; key < 64 + kKeys; ++key) {
            const auto found = (*reader)->read(TileKind::height, *tile_from_key(store->dataset().lattice, key), row);
            ASSERT_TRUE(found.ok()) << found.error().message;
            ASSERT_TRUE(*found);
            const int of_row = version_of(key, row.payload);
            EXPECT_EQ(of_row, seen.value_or(of_row));
            seen = of_row;
        }
    }
    EXPECT_GT(journals, 5) << "there was something to bring back";
}

/// The superuser may do everything, and so cannot test what is not permitted.
class AsNobody {
public:
    AsNobody() : self_(::geteuid()) { EXPECT_EQ(self_ == 0 ? ::seteuid(65534) : 0, 0); }
    ~AsNobody() { EXPECT_EQ(::seteuid(self_), 0); }

private:
    uid_t self_;
};

TEST_F(StoreVersions, WhatMayNotBeBroughtBackIsAnErrorThatSaysSo) {
    const std::string journal = path_ + "-journal", folder = std::filesystem::path(path_).parent_path().string();
    std::int64_t operations = 0;
    const auto cut_at = [&](std::int64_t k) {
        test::FaultyVfs disk(static_cast<std::uint64_t>(k));
        disk.fail_at(k, test::FaultKind::power_loss);
        (void)amend_to(1);
        operations = disk.operations();
        disk.reboot();
    };
    const auto must_be_rolled_back = [&] {
        sqlite3* db = nullptr;
        EXPECT_EQ(sqlite3_open_v2(path_.c_str(), &db, SQLITE_OPEN_READONLY, nullptr), SQLITE_OK);
        sqlite3_exec(db, "SELECT * FROM sqlite_master", nullptr, nullptr, nullptr);
        const bool must = sqlite3_extended_errcode(db) == SQLITE_READONLY_ROLLBACK;
        sqlite3_close(db);
        return must;
    };
    cut_at(1000000);
    do {
        ASSERT_GT(operations, 1) << "no power loss left a journal to be played back";
        cut_at(operations - 1);
    } while (!must_be_rolled_back());

    const auto permit = [&](unsigned folder_mode, unsigned file_mode) {
        std::filesystem::permissions(folder, std::filesystem::perms(folder_mode));
        for (const auto& file : {path_, journal}) std::filesystem::permissions(file, std::filesystem::perms(file_mode));
    };
    for (const unsigned file_mode : {0444u, 0666u}) {
        permit(0555, file_mode);
        std::optional<Result<std::unique_ptr<SqliteStore>>> refused;
        {
            const AsNobody nobody;
            refused = SqliteStore::open(path_);
        }
        permit(0755, 0644);
        ASSERT_FALSE(refused->ok());
        EXPECT_EQ(refused->error().code, ErrorCode::io);
        for (const std::string& text : {path_, std::string("cut off"), std::string("the right to write")})
            EXPECT_NE(refused->error().message.find(text), std::string::npos) << refused->error().message;
    }
    EXPECT_TRUE(SqliteStore::open(path_).ok());
}

}  // namespace
}  // namespace scree
