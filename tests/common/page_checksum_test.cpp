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
