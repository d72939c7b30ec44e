#include "runtime/render/edge_parts.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/common/test_support.h"

namespace scree {
namespace {

TEST(EdgeParts, HoldEveryCellOfTheBandOnceAndLittleElse) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int round = 0; round < 300; ++round) {
        const int cells_log2 = static_cast<int>(test::uniform(random, 2, 4));
        const auto cells = [&] { return test::uniform(random, 1, 3 << cells_log2); };
        const Lattice lattice = *make_lattice(0, 0, 2, cells(), cells(), cells_log2);
        // Cells of the field are those of the lattice; a void somewhere.
        const auto shape = EdgeField::shape_of(lattice, lattice.deepest_level + cells_log2);
        ASSERT_EQ(shape.cell_side, 1);
        std::vector<std::uint8_t> present(static_cast<std::size_t>(shape.columns * shape.rows), 1);
        present[static_cast<std::size_t>(test::uniform(random, 0, static_cast<int>(present.size()) - 1))] = 0;
        const EdgeField field(shape, present, static_cast<double>(test::uniform(random, 1, 10)));
        const int finest = static_cast<int>(test::uniform(random, 0, 3));
        DrawItem item;
        const int level = static_cast<int>(test::uniform(random, 0, lattice.deepest_level));
        item.tile = {level, test::uniform(random, 0, (static_cast<int>(lattice.root_columns) << level) - 1),
                     test::uniform(random, 0, (static_cast<int>(lattice.root_rows) << level) - 1)};
        if (test::uniform(random, 0, 2) == 0) item.part = {1, 1, 0};
        const LatticePoint corner = lattice.corner(item.tile);
        const std::int64_t side = lattice.tile_extent(item.tile.level);
        const auto holds = [&](TilePart part, std::int64_t i, std::int64_t j) {
            const double size = std::ldexp(static_cast<double>(side), -part.level);
            return std::floor(static_cast<double>(i) / size) == part.x &&
                   std::floor(static_cast<double>(j) / size) == part.y;
        };
        EdgeParts parts(field);
        const auto found = parts.of(item, finest);
        for (const TilePart part : found) EXPECT_LE(part.level, std::max(finest, item.part.level));
        for (std::int64_t j = 0; j < side; ++j)
            for (std::int64_t i = 0; i < side; ++i) {
                const std::int64_t x = corner.i + i, y = corner.j + j;
                if (x >= lattice.cells_x || y >= lattice.cells_y || !holds(item.part, i, j)) continue;
                const auto times =
                    std::count_if(found.begin(), found.end(), [&](TilePart p) { return holds(p, i, j); });
                ASSERT_LE(times, 1);
                if (field.values()[static_cast<std::size_t>(y * shape.columns + x)] < EdgeField::kFar) {
                    ASSERT_EQ(times, 1) << i << ' ' << j;
                }
            }
        // None is without a place near an end, and no four make a whole.
        for (const TilePart part : found) {
            EXPECT_TRUE(field.is_near_end(level + part.level, (item.tile.x << part.level) + part.x,
                                          (item.tile.y << part.level) + part.y));
            const auto siblings = std::count_if(found.begin(), found.end(), [&](TilePart p) {
                return p.level == part.level && p.x / 2 == part.x / 2 && p.y / 2 == part.y / 2;
            });
            EXPECT_TRUE(siblings < 4 || part.level == item.part.level);
        }
    }
}

}  // namespace
}  // namespace scree
