#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>

#include "common/lattice.h"
#include "tests/common/test_support.h"

namespace scree {
namespace {

Lattice lattice_with_roots(std::int64_t rows, std::int64_t columns) {
    Lattice lattice;
    lattice.root_rows = rows;
    lattice.root_columns = columns;
    return lattice;
}

TEST(TileKey, EveryTileOfTheFirstLevelsComesBackAndKeysAreUnique) {
    for (const auto& [rows, columns] : {std::pair{1, 1}, {1, 3}, {5, 1}, {8, 8}}) {
        const Lattice lattice = lattice_with_roots(rows, columns);
        std::map<std::int64_t, TileId> seen;
        for (int level = 0; level <= 4; ++level)
            for (std::int64_t y = 0; y < lattice.tiles_y(level); ++y)
                for (std::int64_t x = 0; x < lattice.tiles_x(level); ++x) {
                    const TileId id{level, x, y};
                    const auto key = tile_key(lattice, id);
                    ASSERT_TRUE(key.has_value());
                    EXPECT_TRUE(seen.emplace(*key, id).second) << *key;
                    EXPECT_EQ(tile_from_key(lattice, *key), id);
                }
    }
}

TEST(TileKey, KnownValuesOfTheFormat) {
    // Level 2, x = 3, y = 1 in one root: 1 | y1x1 y0x0 = 1 01 11.
    EXPECT_EQ(tile_key(lattice_with_roots(1, 1), {2, 3, 1}), 0b10111);
    // Level 1, x = 5, y = 0 over 1 x 3 roots: root 2, local x 1: (1 01) * 3 + 2.
    EXPECT_EQ(tile_key(lattice_with_roots(1, 3), {1, 5, 0}), 17);
    EXPECT_EQ(tile_key(lattice_with_roots(1, 1), {0, 0, 0}), 1);
}

TEST(TileKey, CoarserLevelsComeFirst) {
    const Lattice lattice = lattice_with_roots(2, 3);
    for (int level = 0; level < 12; ++level) {
        const TileId last{level, lattice.tiles_x(level) - 1, lattice.tiles_y(level) - 1};
        const TileId first{level + 1, 0, 0};
        EXPECT_LT(*tile_key(lattice, last), *tile_key(lattice, first));
    }
}

TEST(TileKey, ThirtyLevelsFitWithUpToFourRootsAndOverflowIsRefused) {
    for (const std::int64_t roots : {1, 2, 3, 4, 5, 7, 8, 16, 64}) {
        const Lattice lattice = lattice_with_roots(1, roots);
        for (int level = 0; level <= kMaxLevel; ++level) {
            const TileId last{level, lattice.tiles_x(level) - 1, lattice.tiles_y(level) - 1};
            // The last key of a level is (2^(2l+1) - 1) * roots + roots - 1.
            const long double exact = (std::ldexp(1.0L, 2 * level + 1) - 1) * static_cast<long double>(roots) +
                                      static_cast<long double>(roots - 1);
            const auto key = tile_key(lattice, last);
            EXPECT_EQ(key.has_value(), exact < std::ldexp(1.0L, 63)) << roots << " roots, level " << level;
            if (key) {
                EXPECT_EQ(tile_from_key(lattice, *key), last);
            }
        }
    }
}

TEST(TileKey, RandomDeepTilesComeBack) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int k = 0; k < 20000; ++k) {
        const Lattice lattice = lattice_with_roots(test::uniform(random, 1, 8), test::uniform(random, 1, 8));
        const int level = test::uniform(random, 0, 28);
        const TileId id{level, std::uniform_int_distribution<std::int64_t>(0, lattice.tiles_x(level) - 1)(random),
                        std::uniform_int_distribution<std::int64_t>(0, lattice.tiles_y(level) - 1)(random)};
        const auto key = tile_key(lattice, id);
        ASSERT_TRUE(key.has_value());
        ASSERT_EQ(tile_from_key(lattice, *key), id);
    }
}

TEST(TileKey, TilesOutsideTheLatticeHaveNone) {
    const Lattice lattice = lattice_with_roots(1, 2);
    for (const TileId id : {TileId{0, 2, 0}, TileId{0, 0, 1}, TileId{0, -1, 0}, TileId{-1, 0, 0}, TileId{1, 0, 2},
                            TileId{kMaxLevel + 1, 0, 0}, TileId{1, 0, -1}})
        EXPECT_FALSE(tile_key(lattice, id).has_value()) << id.level << "/" << id.x << "/" << id.y;
}

TEST(TileKey, IntegersThatAreNoKeysAreRefused) {
    const Lattice one = lattice_with_roots(1, 1);
    // A prefix has an odd number of bits: 2, 3, 8..15 have none.
    for (const std::int64_t key : {std::int64_t{0}, std::int64_t{-1}, std::int64_t{2}, std::int64_t{3}, std::int64_t{8},
                                   std::int64_t{15}, std::numeric_limits<std::int64_t>::min()})
        EXPECT_FALSE(tile_from_key(one, key).has_value()) << key;
    const Lattice three = lattice_with_roots(1, 3);
    for (std::int64_t key = -3; key < 3; ++key) EXPECT_FALSE(tile_from_key(three, key).has_value()) << key;
    EXPECT_FALSE(
        tile_from_key(one, std::numeric_limits<std::int64_t>::max()).has_value());  // level 31 has an even bit count
}

TEST(TileKey, EveryIntegerIsEitherRefusedOrTheKeyOfItsTile) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int k = 0; k < 20000; ++k) {
        const Lattice lattice = lattice_with_roots(test::uniform(random, 1, 8), test::uniform(random, 1, 8));
        const auto key = static_cast<std::int64_t>(random() >> test::uniform(random, 0, 63));
        const auto id = tile_from_key(lattice, key);
        if (!id) continue;
        ASSERT_TRUE(lattice.contains(*id));
        ASSERT_EQ(tile_key(lattice, *id), key);
    }
}

TEST(TileId, ChildrenAndParentsAgree) {
    const TileId id{7, 41, 90};
    for (int q = 0; q < 4; ++q) {
        const TileId child = child_of(id, q);
        EXPECT_EQ(parent_of(child), id);
        EXPECT_EQ(quadrant_of(child), q);
        EXPECT_EQ(ancestor_at(child, 7), id);
    }
    EXPECT_EQ(ancestor_at(id, 0), (TileId{0, 0, 0}));
}

}  // namespace
}  // namespace scree
