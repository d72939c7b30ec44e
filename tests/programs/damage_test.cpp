// Any flipped bit of a store is found, and no reader crashes on one.
#include <gtest/gtest.h>

#include <random>

#include "tests/common/test_support.h"
#include "tests/programs/reports.h"
#include "tests/programs/sample_inputs.h"

namespace scree::test {
namespace {

class Damage : public ::testing::Test {
protected:
    void SetUp() override {
        HeightGrid grid = hills(30, 27, 4);
        for (int j = 0; j < 9; ++j)
            for (int i = 0; i < 12; ++i) grid.at(i, j) = -9999;
        write_heights(folder_.file("d.tif"), grid, {}, "-9999");
        build_store_from({folder_.file("d.tif"), "--tile-size", "9", "--texture-size", "16"}, store_);
        bytes_ = read_bytes(store_);
        ASSERT_EQ(scree({"verify", store_, "--quiet"}).exit_code, 0);
    }
    void flip(std::size_t position, int bit) {
        bytes_[position] = static_cast<std::uint8_t>(bytes_[position] ^ (1 << bit));
    }

    TemporaryFolder folder_;
    std::string store_ = folder_.file("d.scree"), damaged_ = folder_.file("damaged.scree");
    std::vector<std::uint8_t> bytes_;
};

TEST_F(Damage, VerifyFindsEveryFlippedBit) {
    SCREE_TRACE_SEED();
    Random random(seed());
    std::vector<std::size_t> positions{
        0, 15, 16, 18, 19, 20, 24, 27, 28, 44, 52, 56, 63, 71, 92, 96, 100, bytes_.size() - 1, bytes_.size() - 9};
    while (positions.size() < 119) positions.push_back(random() % bytes_.size());
    for (const std::size_t position : positions) {
        const int bit = uniform(random, 0, 7);
        flip(position, bit);
        write_bytes(damaged_, bytes_);
        flip(position, bit);
        const auto run = scree({"verify", damaged_, "--quiet"});
        EXPECT_TRUE(run.exit_code == 1 || run.exit_code == 4) << "byte " << position << " bit " << bit << '\n'
                                                              << describe(run);
    }
}

TEST_F(Damage, NoReaderCrashesOnAFlippedBit) {
    SCREE_TRACE_SEED();
    Random random(seed() + 1);
    for (int k = 0; k < 24; ++k) {
        const std::size_t position = random() % bytes_.size();
        const int bit = uniform(random, 0, 7);
        flip(position, bit);
        write_bytes(damaged_, bytes_);
        flip(position, bit);
        const auto run = k % 2 == 0 ? scree({"info", damaged_, "--digest"})
                                    : scree_view({"audit", damaged_, "--frames", "2", "--size", "64x64"}, within(20));
        EXPECT_TRUE(run.exit_code == 0 || run.exit_code == 1 || run.exit_code == 4)
            << "byte " << position << " bit " << bit << '\n'
            << describe(run);
    }
}

TEST_F(Damage, VerifyFindsEveryTruncationAndExtraBytes) {
    SCREE_TRACE_SEED();
    Random random(seed() + 2);
    for (int k = 0; k < 12; ++k) {
        const std::size_t size = k == 0 ? bytes_.size() - 1 : random() % bytes_.size();
        write_bytes(damaged_, {bytes_.begin(), bytes_.begin() + static_cast<std::ptrdiff_t>(size)});
        const auto run = scree({"verify", damaged_, "--quiet"});
        EXPECT_TRUE(run.exit_code == 1 || run.exit_code == 4) << size << " of " << bytes_.size() << " bytes\n"
                                                              << describe(run);
    }
    for (const std::size_t extra : {1u, 16384u}) {
        auto longer = bytes_;
        longer.resize(bytes_.size() + extra);
        write_bytes(damaged_, longer);
        const auto run = scree({"verify", damaged_, "--quiet"});
        EXPECT_TRUE(run.exit_code == 1 || run.exit_code == 4) << extra << " extra bytes\n" << describe(run);
    }
}

}  // namespace
}  // namespace scree::test
