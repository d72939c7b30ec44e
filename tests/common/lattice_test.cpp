#include "common/lattice.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/common/test_support.h"

namespace scree {
namespace {

TEST(MakeLattice, SquareDataGetOneRoot) {
    const auto lattice = make_lattice(500000, 2700000, 30, 4096, 4096, 5);
    ASSERT_TRUE(lattice.ok());
    EXPECT_EQ(lattice->root_columns, 1);
    EXPECT_EQ(lattice->root_rows, 1);
    EXPECT_EQ(lattice->deepest_level, 7);
    EXPECT_EQ(lattice->tile_extent(0), 4096);
    EXPECT_EQ(lattice->step(0), 128);
}

TEST(MakeLattice, OneCellMoreDoublesTheRoot) {
    const auto lattice = make_lattice(0, 0, 1, 4097, 4097, 5);
    ASSERT_TRUE(lattice.ok());
    EXPECT_EQ(lattice->tile_extent(0), 8192);
    EXPECT_EQ(lattice->root_columns * lattice->root_rows, 1);
}

TEST(MakeLattice, LongDataGetARowOfRoots) {
    const auto lattice = make_lattice(0, 0, 1, 1000, 100, 5);
    ASSERT_TRUE(lattice.ok());
    EXPECT_EQ(lattice->tile_extent(0), 128);
    EXPECT_EQ(lattice->root_columns, 8);
    EXPECT_EQ(lattice->root_rows, 1);
}

TEST(MakeLattice, RootsNeverPassTheirLimitAndTheirExtentCoversTheData) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int k = 0; k < 20000; ++k) {
        const std::int64_t cells_x =
            1 + static_cast<std::int64_t>(random() % (std::uint64_t{1} << test::uniform(random, 0, 30)));
        const std::int64_t cells_y =
            1 + static_cast<std::int64_t>(random() % (std::uint64_t{1} << test::uniform(random, 0, 30)));
        const int n = test::uniform(random, kMinTileCellsLog2, kMaxTileCellsLog2);
        const auto lattice = make_lattice(0, 0, 1, cells_x, cells_y, n);
        ASSERT_TRUE(lattice.ok()) << cells_x << " x " << cells_y << ": " << lattice.error().message;
        EXPECT_LE(lattice->root_columns * lattice->root_rows, kMaxRoots);
        EXPECT_EQ(std::min(lattice->root_columns, lattice->root_rows), 1);
        EXPECT_GE(lattice->root_columns * lattice->tile_extent(0), cells_x);
        EXPECT_GE(lattice->root_rows * lattice->tile_extent(0), cells_y);
        EXPECT_LT((lattice->root_columns - 1) * lattice->tile_extent(0), cells_x);
        EXPECT_LT((lattice->root_rows - 1) * lattice->tile_extent(0), cells_y);
        EXPECT_TRUE(lattice->check().ok());
    }
}

TEST(MakeLattice, TheLargestExtentsAreAccepted) {
    for (const auto& [x, y] : {std::pair{kMaxCellsPerSide, kMaxCellsPerSide},
                               {kMaxCellsPerSide, std::int64_t{1}},
                               {std::int64_t{1}, kMaxCellsPerSide},
                               {kMaxCellsPerSide - 1, kMaxCellsPerSide / 2 + 1}})
        EXPECT_TRUE(make_lattice(0, 0, 1, x, y, 5).ok()) << x << " x " << y;
}

TEST(MakeLattice, RefusesWhatTheFormatCannotHold) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const double infinity = std::numeric_limits<double>::infinity();
    const auto refused = [](double x, double y, double spacing, std::int64_t cx, std::int64_t cy, int n) {
        const auto lattice = make_lattice(x, y, spacing, cx, cy, n);
        return !lattice.ok() && lattice.error().code == ErrorCode::input && !lattice.error().message.empty();
    };
    EXPECT_TRUE(refused(0, 0, 1, kMaxCellsPerSide + 1, 10, 5));
    EXPECT_TRUE(refused(0, 0, 1, 10, kMaxCellsPerSide + 1, 5));
    EXPECT_TRUE(refused(0, 0, 1, 0, 10, 5));
    EXPECT_TRUE(refused(0, 0, 1, 10, -1, 5));
    EXPECT_TRUE(refused(0, 0, 1, std::numeric_limits<std::int64_t>::max(), 1, 5));
    EXPECT_TRUE(refused(0, 0, 0, 10, 10, 5));
    EXPECT_TRUE(refused(0, 0, -1, 10, 10, 5));
    EXPECT_TRUE(refused(0, 0, nan, 10, 10, 5));
    EXPECT_TRUE(refused(0, 0, infinity, 10, 10, 5));
    EXPECT_TRUE(refused(nan, 0, 1, 10, 10, 5));
    EXPECT_TRUE(refused(0, -infinity, 1, 10, 10, 5));
    EXPECT_TRUE(refused(2e9, 0, 1, 10, 10, 5));
    for (const int n : {-1, 0, 1, 9, 31, 64, std::numeric_limits<int>::max(), std::numeric_limits<int>::min()})
        EXPECT_TRUE(refused(0, 0, 1, 10, 10, n)) << n;
}

TEST(LatticeCheck, RefusesFieldsThatDoNotBelongTogether) {
    Lattice good = *make_lattice(0, 0, 1, 100, 50, 3);
    ASSERT_TRUE(good.check().ok());
    const auto refused = [&](auto change) {
        Lattice lattice = good;
        change(lattice);
        return !lattice.check().ok();
    };
    EXPECT_TRUE(refused([](Lattice& l) { l.deepest_level = -1; }));
    EXPECT_TRUE(refused([](Lattice& l) { l.deepest_level = 31; }));
    EXPECT_TRUE(refused([](Lattice& l) { l.deepest_level = 28; }));
    EXPECT_TRUE(refused([](Lattice& l) { l.root_rows = 0; }));
    EXPECT_TRUE(refused([](Lattice& l) { l.root_rows = 65; }));
    EXPECT_TRUE(refused([](Lattice& l) { l.root_rows = 8, l.root_columns = 9; }));
    EXPECT_TRUE(refused([](Lattice& l) { l.root_rows = l.root_columns = std::numeric_limits<std::int64_t>::max(); }));
    EXPECT_TRUE(refused([](Lattice& l) { l.cells_x = 10000; }));
    EXPECT_TRUE(refused([](Lattice& l) { l.tile_cells_log2 = 40; }));
}

TEST(Lattice, MetresAndLatticeUnitsAreInverse) {
    const Lattice lattice = *make_lattice(304000, 2780000, 20, 100, 100, 5);
    EXPECT_EQ(lattice.x_m(3), 304060);
    EXPECT_EQ(lattice.y_m(3), 2779940);
    EXPECT_EQ(lattice.i_of(lattice.x_m(17)), 17);
    EXPECT_EQ(lattice.j_of(lattice.y_m(17)), 17);
}

}  // namespace
}  // namespace scree
