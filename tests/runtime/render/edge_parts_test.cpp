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
        const double band_m = static_cast<double>(test::uniform(random, 1, 20));
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
        EdgeParts parts(lattice, band_m);
        const auto found = parts.of(item, finest);
        for (const TilePart part : found) EXPECT_LE(part.level, std::max(finest, item.part.level));
        for (std::int64_t j = 0; j < side; ++j)
            for (std::int64_t i = 0; i < side; ++i) {
                const std::int64_t x = corner.i + i, y = corner.j + j;
                if (x >= lattice.cells_x || y >= lattice.cells_y || !holds(item.part, i, j)) continue;
                const std::int64_t inside = std::min({x, y, lattice.cells_x - 1 - x, lattice.cells_y - 1 - y});
                const auto times =
                    std::count_if(found.begin(), found.end(), [&](TilePart p) { return holds(p, i, j); });
                ASSERT_LE(times, 1);
                if (static_cast<double>(inside) * lattice.spacing_m < band_m) {
                    ASSERT_EQ(times, 1) << i << ' ' << j;
                }
            }
        // None lies wholly inside or outside.
        for (const TilePart part : found) {
            const double size = std::ldexp(static_cast<double>(side), -part.level);
            const double west = static_cast<double>(corner.i) + part.x * size,
                         north = static_cast<double>(corner.j) + part.y * size;
            const auto wide = static_cast<double>(lattice.cells_x), high = static_cast<double>(lattice.cells_y);
            EXPECT_TRUE(west < wide && north < high);
            EXPECT_LT(std::min({west, north, wide - west - size, high - north - size}) * lattice.spacing_m, band_m);
        }
    }
}

}  // namespace
}  // namespace scree
