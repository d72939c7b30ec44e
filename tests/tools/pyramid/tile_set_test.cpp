#include "tools/pyramid/tile_set.h"

#include <gtest/gtest.h>

#include <set>

#include "tests/common/test_support.h"

namespace scree {
namespace {

TEST(TileSet, HoldsExactlyWhatWasInserted) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    const auto lattice = make_lattice(0, 0, 1, 77, 200, 3);
    ASSERT_TRUE(lattice);
    TileSet tiles(*lattice, lattice->deepest_level);
    std::set<TileId> expected;
    for (int k = 0; k < 60; ++k) {
        const int level = test::uniform(random, 0, lattice->deepest_level);
        const std::int64_t extent = lattice->tile_extent(level);
        const TileId id{level, test::uniform(random, 0, 76) / extent, test::uniform(random, 0, 199) / extent};
        tiles.insert(id);
        expected.insert(id);
    }
    for (int level = -1; level <= lattice->deepest_level + 1; ++level)
        for (std::int64_t y = -1; y < 30; ++y)
            for (std::int64_t x = -1; x < 14; ++x) {
                const TileId id{level, x, y};
                ASSERT_EQ(tiles.contains(id), expected.contains(id)) << level << '/' << x << '/' << y;
                if (level < 0 || x < 0 || y < 0) continue;
                int mask = 0;
                for (int q = 0; q < 4; ++q) mask |= expected.contains(child_of(id, q)) ? 1 << q : 0;
                ASSERT_EQ(tiles.child_mask(id), mask);
            }
}

}  // namespace
}  // namespace scree
