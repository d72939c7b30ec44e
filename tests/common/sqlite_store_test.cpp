#include "common/store/sqlite_store.h"

#include <gtest/gtest.h>
#include <sqlite3.h>

#include <map>

#include "tests/common/test_support.h"

namespace scree {
namespace {

using Rows = std::map<std::pair<TileKind, std::int64_t>, std::vector<std::uint8_t>>;

Dataset small_dataset() {
    Dataset dataset;
    dataset.lattice = *make_lattice(0, 0, 1, 16, 16, 2);
    dataset.texture_size_log2 = 4;
    dataset.height_tiles = dataset.texture_tiles = dataset.present_cells = 1;
    return dataset;
}

Rows random_rows(test::Random& random, const Lattice& lattice) {
    Rows rows;
    for (const TileKind kind : {TileKind::height, TileKind::texture})
        for (int level = 0; level <= 2; ++level)
            for (std::int64_t y = 0; y < lattice.tiles_y(level); ++y)
                for (std::int64_t x = 0; x < lattice.tiles_x(level); ++x) {
                    std::vector<std::uint8_t> payload(random() % 40000);
                    for (auto& byte : payload) byte = static_cast<std::uint8_t>(random());
                    rows[{kind, *tile_key(lattice, {level, x, y})}] = payload;
                }
    return rows;
}

void write_store(const std::string& path, const Rows& rows, bool backwards = false) {
    auto writer = SqliteStoreWriter::create(path);
    ASSERT_TRUE(writer.ok()) << writer.error().message;
    const auto put = [&](const auto& row) {
        ASSERT_TRUE((*writer)->put(row.first.first, row.first.second, 1, row.second).ok());
    };
    if (backwards)
        std::for_each(rows.rbegin(), rows.rend(), put);
    else
        std::for_each(rows.begin(), rows.end(), put);
    ASSERT_TRUE((*writer)->finish(small_dataset()).ok());
}

void run_sql(const std::string& path, const std::string& sql) {
    sqlite3* db = nullptr;
    ASSERT_EQ(sqlite3_open(path.c_str(), &db), SQLITE_OK);
    ASSERT_EQ(sqlite3_exec(db, sql.c_str(), nullptr, nullptr, nullptr), SQLITE_OK) << sqlite3_errmsg(db);
    sqlite3_close(db);
}

class SqliteStoreTest : public testing::Test {
protected:
    void SetUp() override {
        test::Random random(test::seed());
        rows_ = random_rows(random, small_dataset().lattice);
        write_store(path_, rows_);
    }
    test::TemporaryFolder folder_;
    std::string path_ = folder_.file("store.scree");
    Rows rows_;
};

TEST_F(SqliteStoreTest, EveryRowComesBackThroughReadersAndScans) {
    const auto store = SqliteStore::open(path_);
    ASSERT_TRUE(store.ok()) << store.error().message;
    EXPECT_EQ(dataset_to_json((*store)->dataset()), dataset_to_json(small_dataset()));
    const auto reader = (*store)->open_reader();
    ASSERT_TRUE(reader.ok());
    TileRow row;
    for (const auto& [place, payload] : rows_) {
        const auto found = (*reader)->read(place.first, *tile_from_key((*store)->dataset().lattice, place.second), row);
        ASSERT_TRUE(found.ok() && *found);
        EXPECT_EQ(row.payload, payload);
        EXPECT_EQ(row.codec, 1);
    }
    for (const TileKind kind : {TileKind::height, TileKind::texture}) {
        std::int64_t previous = 0, count = 0;
        ASSERT_TRUE((*store)
                        ->for_each(kind,
                                   [&](const SqliteStore::RowView& view) {
                                       EXPECT_GT(view.key, previous);
                                       EXPECT_TRUE(view.checksum_ok);
                                       const auto& expected = rows_.at({kind, view.key});
                                       EXPECT_TRUE(std::equal(view.payload.begin(), view.payload.end(),
                                                              expected.begin(), expected.end()));
                                       previous = view.key;
                                       ++count;
                                       return true;
                                   })
                        .ok());
        EXPECT_EQ(count, 21);
    }
    const auto contents = (*store)->contents();
    ASSERT_TRUE(contents.ok());
    EXPECT_EQ(contents->height_rows, 21);
    EXPECT_EQ(contents->texture_rows, 21);
    EXPECT_EQ(*(*store)->integrity_problems(), "");
}

TEST_F(SqliteStoreTest, MissingTilesAreNotErrorsUntilDecodedOnesAreAskedFor) {
    const auto store = SqliteStore::open(path_);
    const auto reader = (*store)->open_reader();
    TileRow row;
    for (const TileId id : {TileId{3, 0, 0}, TileId{0, 5, 0}, TileId{-1, 0, 0}}) {
        const auto found = (*reader)->read(TileKind::height, id, row);
        ASSERT_TRUE(found.ok());
        EXPECT_FALSE(*found);
    }
    const auto tile = read_height_tile(**reader, (*store)->dataset(), {3, 1, 2});
    ASSERT_FALSE(tile.ok());
    EXPECT_EQ(tile.error().code, ErrorCode::store);
    EXPECT_NE(tile.error().message.find("3/1/2"), std::string::npos);
}

TEST_F(SqliteStoreTest, TheDigestDoesNotDependOnTheOrderOfWriting) {
    const std::string other = folder_.file("backwards.scree");
    write_store(other, rows_, true);
    const auto a = (*SqliteStore::open(path_))->digest(), b = (*SqliteStore::open(other))->digest();
    ASSERT_TRUE(a.ok() && b.ok());
    EXPECT_EQ(*a, *b);
    EXPECT_EQ(a->size(), 64u);
}

TEST_F(SqliteStoreTest, TheDigestChangesWithEveryPayload) {
    Rows changed = rows_;
    changed.begin()->second.push_back(1);
    const std::string other = folder_.file("changed.scree");
    write_store(other, changed);
    EXPECT_NE(*(*SqliteStore::open(path_))->digest(), *(*SqliteStore::open(other))->digest());
}

TEST_F(SqliteStoreTest, ADamagedRowIsFoundWhicheverColumnChanged) {
    for (const char* change : {"payload = zeroblob(length(payload))", "codec = 0", "checksum = checksum + 1",
                               "payload = payload || x'00'", "key = 999999"}) {
        const std::string copy = folder_.file("copy.scree");
        std::filesystem::copy_file(path_, copy, std::filesystem::copy_options::overwrite_existing);
        run_sql(copy, std::string("UPDATE height SET ") + change + " WHERE key = 7");
        const auto store = SqliteStore::open(copy);
        ASSERT_TRUE(store.ok());
        int damaged = 0;
        ASSERT_TRUE((*store)
                        ->for_each(TileKind::height,
                                   [&](const SqliteStore::RowView& view) {
                                       damaged += view.checksum_ok ? 0 : 1;
                                       return true;
                                   })
                        .ok());
        EXPECT_EQ(damaged, 1) << change;
        EXPECT_FALSE((*store)->digest().ok()) << change;
        const auto reader = (*store)->open_reader();
        TileRow row;
        const auto id = *tile_from_key((*store)->dataset().lattice, 7);
        const auto read = (*reader)->read(TileKind::height, id, row);
        EXPECT_TRUE(read.ok() ? !*read : read.error().code == ErrorCode::store) << change;
    }
}

TEST_F(SqliteStoreTest, ARowMovedToTheOtherTableIsFound) {
    run_sql(path_, "DELETE FROM texture WHERE key = 7; INSERT INTO texture SELECT * FROM height WHERE key = 7");
    const auto store = SqliteStore::open(path_);
    const auto reader = (*store)->open_reader();
    TileRow row;
    EXPECT_FALSE((*reader)->read(TileKind::texture, *tile_from_key((*store)->dataset().lattice, 7), row).ok());
}

TEST_F(SqliteStoreTest, ANewerVersionIsRefusedAndBothAreNamed) {
    run_sql(path_, "PRAGMA user_version = 83");
    const auto store = SqliteStore::open(path_);
    ASSERT_FALSE(store.ok());
    EXPECT_EQ(static_cast<int>(store.error().code), 4);
    EXPECT_NE(store.error().message.find("83"), std::string::npos) << store.error().message;
    EXPECT_NE(store.error().message.find("version 1"), std::string::npos) << store.error().message;
    EXPECT_NE(store.error().message.find(path_), std::string::npos) << store.error().message;
}

TEST_F(SqliteStoreTest, StoresWithoutAnIdentityOrDescriptionAreRefused) {
    for (const char* change : {"PRAGMA application_id = 5", "DELETE FROM dataset", "UPDATE dataset SET payload = '{}'",
                               "DROP TABLE dataset"}) {
        const std::string copy = folder_.file("copy.scree");
        std::filesystem::copy_file(path_, copy, std::filesystem::copy_options::overwrite_existing);
        run_sql(copy, change);
        const auto store = SqliteStore::open(copy);
        ASSERT_FALSE(store.ok()) << change;
        EXPECT_EQ(store.error().code, ErrorCode::store) << change;
    }
}

TEST(SqliteStoreOpen, WhatIsNoStoreIsRefusedWithTheRightCode) {
    const test::TemporaryFolder folder;
    EXPECT_EQ(SqliteStore::open(folder.file("missing.scree")).error().code, ErrorCode::input);
    EXPECT_EQ(SqliteStore::open(folder.file("")).error().code, ErrorCode::input);
    test::write_bytes(folder.file("text"), std::vector<std::uint8_t>(5000, 'x'));
    EXPECT_EQ(SqliteStore::open(folder.file("text")).error().code, ErrorCode::store);
    test::write_bytes(folder.file("empty"), {});
    EXPECT_EQ(SqliteStore::open(folder.file("empty")).error().code, ErrorCode::store);
}

TEST(SqliteStoreOpen, AStoreThatWasNotFinishedIsRefused) {
    const test::TemporaryFolder folder;
    {
        auto writer = SqliteStoreWriter::create(folder.file("half.scree"));
        ASSERT_TRUE(writer.ok());
        const std::vector<std::uint8_t> payload(100, 1);
        ASSERT_TRUE((*writer)->put(TileKind::height, 1, 0, payload).ok());
    }
    const auto store = SqliteStore::open(folder.file("half.scree"));
    ASSERT_FALSE(store.ok());
    EXPECT_EQ(store.error().code, ErrorCode::store);
}

}  // namespace
}  // namespace scree
