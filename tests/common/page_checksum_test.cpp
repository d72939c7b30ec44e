#include "common/store/page_checksum_vfs.h"

#include <gtest/gtest.h>
#include <sqlite3.h>

#include "common/store/sqlite_store.h"
#include "tests/common/test_support.h"

namespace scree {
namespace {

void write_small_store(const std::string& path) {
    auto writer = SqliteStoreWriter::create(path);
    ASSERT_TRUE(writer.ok()) << writer.error().message;
    test::Random random(3);
    for (std::int64_t key = 1; key < 40; ++key) {
        std::vector<std::uint8_t> payload(1 + random() % 6000);
        for (auto& byte : payload) byte = static_cast<std::uint8_t>(random());
        ASSERT_TRUE((*writer)->put(key % 2 == 0 ? TileKind::height : TileKind::texture, key, 0, payload).ok());
    }
    Dataset dataset;
    dataset.lattice = *make_lattice(0, 0, 1, 4, 4, 2);
    dataset.height_tiles = dataset.texture_tiles = dataset.present_cells = 1;
    ASSERT_TRUE((*writer)->finish(dataset).ok());
}

TEST(PageChecksums, AFreshStoreIsSound) {
    const test::TemporaryFolder folder;
    const std::string path = folder.file("a b.scree");
    write_small_store(path);
    const auto scan = scan_page_checksums(path);
    ASSERT_TRUE(scan.ok()) << scan.error().message;
    EXPECT_TRUE(scan->damaged.empty());
    EXPECT_EQ(static_cast<std::size_t>(scan->pages) * 16384, test::read_bytes(path).size());
    EXPECT_TRUE(SqliteStore::open(path).ok());
}

TEST(PageChecksums, EveryFlippedBitIsFound) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    const test::TemporaryFolder folder;
    const std::string path = folder.file("store.scree"), damaged = folder.file("damaged.scree");
    write_small_store(path);
    const auto bytes = test::read_bytes(path);
    const auto found = [&](std::size_t bit) {
        auto copy = bytes;
        copy[bit / 8] ^= static_cast<std::uint8_t>(1u << bit % 8);
        test::write_bytes(damaged, copy);
        const auto scan = scan_page_checksums(damaged);
        return !scan.ok() ||
               (scan->damaged.size() == 1 && scan->damaged[0] == static_cast<std::int64_t>(bit / 8 / 16384) + 1);
    };
    for (std::size_t bit = 0; bit < 800; ++bit) ASSERT_TRUE(found(bit)) << "bit " << bit;  // the database header
    for (std::size_t page = 1; page <= bytes.size() / 16384; ++page)                       // the checksums themselves
        for (std::size_t bit = page * 16384 * 8 - 64; bit < page * 16384 * 8; bit += 7)
            ASSERT_TRUE(found(bit)) << "bit " << bit;
    for (int k = 0; k < 500; ++k) {
        const std::size_t bit = random() % (bytes.size() * 8);
        ASSERT_TRUE(found(bit)) << "bit " << bit;
    }
}

void remove_rows(const std::string& path) {
    auto writer = SqliteStoreWriter::amend(path);
    ASSERT_TRUE(writer.ok()) << writer.error().message;
    for (std::int64_t key = 10; key < 40; ++key)
        ASSERT_TRUE((*writer)->remove(key % 2 == 0 ? TileKind::height : TileKind::texture, key).ok());
    ASSERT_TRUE((*writer)->finish((*SqliteStore::open(path))->dataset()).ok());
}

// SQLite need not write the leaves of its free list; its trunk, which says which they are, it must.
TEST(PageChecksums, OnlyPagesThatHoldNothingGoUnchecked) {
    const test::TemporaryFolder folder;
    const std::string path = folder.file("store.scree");
    write_small_store(path);
    remove_rows(path);
    const auto bytes = test::read_bytes(path);
    EXPECT_EQ(scan_page_checksums(path)->damaged, std::vector<std::int64_t>{});
    const std::int64_t free_pages = bytes[36] << 24 | bytes[37] << 16 | bytes[38] << 8 | bytes[39];
    ASSERT_GT(free_pages, 3);
    std::int64_t unchecked = 0;
    for (std::int64_t page = 1; page <= static_cast<std::int64_t>(bytes.size()) / 16384; ++page) {
        auto copy = bytes;
        copy[static_cast<std::size_t>(page) * 16384 - 100] ^= 1;
        test::write_bytes(path, copy);
        const auto damaged = scan_page_checksums(path)->damaged;
        unchecked += damaged.empty() ? 1 : 0;
        if (!damaged.empty()) {
            EXPECT_EQ(damaged, std::vector<std::int64_t>{page});
        }
    }
    EXPECT_EQ(unchecked, free_pages - 1);
}

TEST(PageChecksums, AFreeListThatGoesInACircleOrOutOfTheFileEnds) {
    const test::TemporaryFolder folder;
    const std::string path = folder.file("store.scree");
    write_small_store(path);
    remove_rows(path);
    const auto bytes = test::read_bytes(path);
    const std::size_t trunk = std::size_t{bytes[34]} << 8 | bytes[35];
    ASSERT_GT(trunk, 1u);
    const auto with = [&](std::uint32_t next, std::uint32_t leaves, std::uint32_t leaf) {
        auto copy = bytes;
        std::uint8_t* page = &copy[(trunk - 1) * 16384];
        const auto put = [&](std::size_t at, std::uint32_t value) {
            for (std::size_t k = 0; k < 4; ++k) page[at + k] = static_cast<std::uint8_t>(value >> (24 - 8 * k));
        };
        put(0, next);
        put(4, leaves);
        put(8, leaf);
        const std::uint64_t sum = page_checksum({page, 16384}, trunk);
        for (std::size_t k = 0; k < 8; ++k) page[16376 + k] = static_cast<std::uint8_t>(sum >> (8 * k));
        test::write_bytes(path, copy);
        return scan_page_checksums(path);
    };
    const auto self = static_cast<std::uint32_t>(trunk);
    for (const std::uint32_t next : {self, 0xFFFFFFFFu, 0u})
        for (const std::uint32_t leaves : {0u, 4092u, 4093u, 0xFFFFFFFFu})
            for (const std::uint32_t leaf : {0u, 1u, 0xFFFFFFFFu}) EXPECT_TRUE(with(next, leaves, leaf).ok());
}

TEST(PageChecksums, PagesThatChangedPlacesAreFound) {
    const test::TemporaryFolder folder;
    const std::string path = folder.file("store.scree");
    write_small_store(path);
    auto bytes = test::read_bytes(path);
    ASSERT_GE(bytes.size(), 5u * 16384);
    std::swap_ranges(bytes.begin() + 3 * 16384, bytes.begin() + 4 * 16384, bytes.begin() + 4 * 16384);
    test::write_bytes(path, bytes);
    const auto scan = scan_page_checksums(path);
    ASSERT_TRUE(scan.ok());
    EXPECT_EQ(scan->damaged, (std::vector<std::int64_t>{4, 5}));
}

TEST(PageChecksums, ATruncatedPageIsFound) {
    const test::TemporaryFolder folder;
    const std::string path = folder.file("store.scree");
    write_small_store(path);
    auto bytes = test::read_bytes(path);
    bytes.pop_back();
    test::write_bytes(path, bytes);
    const auto scan = scan_page_checksums(path);
    ASSERT_TRUE(scan.ok());
    EXPECT_EQ(scan->damaged, std::vector<std::int64_t>{scan->pages});
}

TEST(PageChecksums, FilesOfOtherKindsAreRefused) {
    const test::TemporaryFolder folder;
    EXPECT_EQ(scan_page_checksums(folder.file("missing")).error().code, ErrorCode::io);
    test::write_bytes(folder.file("empty"), {});
    EXPECT_EQ(scan_page_checksums(folder.file("empty")).error().code, ErrorCode::store);
    test::write_bytes(folder.file("text"), std::vector<std::uint8_t>(5000, 'x'));
    EXPECT_EQ(scan_page_checksums(folder.file("text")).error().code, ErrorCode::store);
    sqlite3* db = nullptr;  // a database that reserves nothing
    ASSERT_EQ(sqlite3_open(folder.file("plain.db").c_str(), &db), SQLITE_OK);
    ASSERT_EQ(sqlite3_exec(db, "CREATE TABLE t(x)", nullptr, nullptr, nullptr), SQLITE_OK);
    sqlite3_close(db);
    EXPECT_EQ(scan_page_checksums(folder.file("plain.db")).error().code, ErrorCode::store);
}

}  // namespace
}  // namespace scree
