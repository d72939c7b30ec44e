#include "tools/partial_file.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "common/store/sqlite_store.h"
#include "tests/common/test_support.h"

namespace scree {
namespace {

using Bytes = std::vector<std::uint8_t>;

class PartialFileTest : public testing::Test {
protected:
    static bool exists(const std::string& path) { return std::filesystem::exists(path); }
    std::unique_ptr<PartialFile> create() const {
        auto file = PartialFile::create(path_);
        EXPECT_TRUE(file.ok());
        return std::move(*file);
    }
    std::unique_ptr<PartialFile> open() const {
        auto file = PartialFile::open_or_create(path_);
        EXPECT_TRUE(file.ok());
        return std::move(*file);
    }

    const test::TemporaryFolder folder_;
    const std::string final_ = folder_.file("out"), path_ = folder_.file("out.partial"), journal_ = path_ + "-journal";
    const Bytes old_{'o', 'l', 'd'};
};

TEST_F(PartialFileTest, GoesWithItsJournalUnlessKept) {
    for (const bool keep : {false, true}) {
        auto file = create();
        test::write_bytes(path_, old_);
        test::write_bytes(journal_, old_);
        if (keep) file->keep();
        file.reset();
        EXPECT_EQ(exists(path_), keep);
        EXPECT_EQ(exists(journal_), keep);
    }
    EXPECT_EQ(test::read_bytes(path_), old_);
}

TEST_F(PartialFileTest, CreatingEmptiesWhatWasKeptAndOpeningDoesNot) {
    test::write_bytes(path_, old_);
    test::write_bytes(journal_, old_);
    open()->keep();
    EXPECT_EQ(test::read_bytes(path_), old_);
    EXPECT_EQ(test::read_bytes(journal_), old_);
    create()->keep();
    EXPECT_EQ(test::read_bytes(path_), Bytes{});
    EXPECT_FALSE(exists(journal_));
}

TEST_F(PartialFileTest, AJournalWithoutItsFileIsNoJournalOfANewOne) {
    test::write_bytes(journal_, old_);
    const auto file = open();
    EXPECT_TRUE(exists(path_));
    EXPECT_FALSE(exists(journal_));
}

TEST_F(PartialFileTest, EmptyingTakesTheJournalAlong) {
    test::write_bytes(path_, old_);
    test::write_bytes(journal_, old_);
    const auto file = open();
    EXPECT_TRUE(file->empty().ok());
    EXPECT_EQ(test::read_bytes(path_), Bytes{});
    EXPECT_FALSE(exists(journal_));
}

TEST_F(PartialFileTest, TwoRunsCannotHoldIt) {
    const auto file = create();
    test::write_bytes(path_, old_);
    for (const auto& second : {PartialFile::create, PartialFile::open_or_create}) {
        const auto refused = second(path_);
        ASSERT_FALSE(refused.ok());
        EXPECT_EQ(refused.error().code, ErrorCode::usage);
    }
    EXPECT_EQ(test::read_bytes(path_), old_) << "the refused run must leave the file as it is";
}

TEST_F(PartialFileTest, IsNotRenamedWhileAJournalSaysThatItIsHalfWritten) {
    const auto file = create();
    test::write_bytes(journal_, old_);
    const auto renamed = file->rename_to(final_);
    ASSERT_FALSE(renamed.ok());
    EXPECT_EQ(renamed.error().code, ErrorCode::io);
    EXPECT_FALSE(exists(final_));
    std::filesystem::remove(journal_);
    EXPECT_TRUE(file->rename_to(final_).ok());
    EXPECT_TRUE(exists(final_));
    EXPECT_FALSE(exists(path_));
}

TEST_F(PartialFileTest, TheJournalOfAReplacedStoreIsNotLeftToTheNewOne) {
    test::write_bytes(final_, old_);
    test::write_bytes(final_ + "-journal", old_);
    const auto file = create();
    test::write_bytes(path_, {'n', 'e', 'w'});
    ASSERT_TRUE(file->rename_to(final_).ok());
    EXPECT_EQ(test::read_bytes(final_), (Bytes{'n', 'e', 'w'}));
    EXPECT_FALSE(exists(final_ + "-journal"));
}

TEST_F(PartialFileTest, AStoreGrowsInItOverTwoRuns) {
    {
        const auto file = create();
        auto writer = SqliteStoreWriter::create(path_);
        ASSERT_TRUE(writer.ok()) << writer.error().message;
        ASSERT_TRUE((*writer)->put(TileKind::height, 1, 0, old_).ok());
        ASSERT_TRUE((*writer)->checkpoint("half").ok());
        ASSERT_TRUE((*writer)->put(TileKind::height, 2, 0, old_).ok());
        writer->reset();
        file->keep();
    }
    const auto file = open();
    auto writer = SqliteStoreWriter::resume(path_);
    ASSERT_TRUE(writer.ok()) << writer.error().message;
    EXPECT_EQ((*writer)->state(), "half");
    TileRow row;
    EXPECT_TRUE(*(*writer)->read(TileKind::height, 1, row));
    EXPECT_FALSE(*(*writer)->read(TileKind::height, 2, row));
    Dataset dataset;
    dataset.lattice = *make_lattice(0, 0, 1, 16, 16, 2);
    dataset.height_tiles = dataset.texture_tiles = dataset.present_cells = 1;
    ASSERT_TRUE((*writer)->finish(dataset).ok());
    ASSERT_TRUE(file->rename_to(final_).ok());
    EXPECT_TRUE(SqliteStore::open(final_).ok());
}

}  // namespace
}  // namespace scree
