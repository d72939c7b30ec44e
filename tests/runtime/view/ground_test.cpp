#include "runtime/view/ground.h"

#include <gtest/gtest.h>

#include "tests/runtime/lod/memory_store.h"

namespace scree {
namespace {

TEST(Ground, IsTheFinestSurfaceWhereCellsArePresentAndNothingElsewhere) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    std::int64_t present = 0, absent = 0;
    for (int world = 0; world < 10; ++world) {
        const auto terrain = test::random_terrain(random);
        const test::MemoryStore store(terrain);
        const Lattice& l = terrain.lattice();
        auto ground = Ground::open(store);
        ASSERT_TRUE(ground.ok());
        for (int k = 0; k < 500; ++k) {
            const auto i = test::uniform(random, 0, static_cast<int>(l.cells_x) - 1),
                       j = test::uniform(random, 0, static_cast<int>(l.cells_y) - 1);
            const double u = test::uniform_real(random, 0.001, 0.999), v = test::uniform_real(random, 0.001, 0.999);
            const auto height = (*ground)->height(l.x_m(i + u), l.y_m(j + v));
            ASSERT_TRUE(height.ok());
            ASSERT_EQ(height->has_value(), terrain.present(i, j));
            ++(terrain.present(i, j) ? present : absent);
            if (!height->has_value()) continue;
            // The two triangles of the cell: split from (i, j) where i + j is even, else across.
            const double nw = terrain.height_m(i, j), ne = terrain.height_m(i + 1, j), sw = terrain.height_m(i, j + 1),
                         se = terrain.height_m(i + 1, j + 1);
            const double z =
                (i + j) % 2 == 0
                    ? (u > v ? nw + u * (ne - nw) + v * (se - ne) : nw + v * (sw - nw) + u * (se - sw))
                    : (u + v < 1 ? nw + u * (ne - nw) + v * (sw - nw) : se + (1 - u) * (sw - se) + (1 - v) * (ne - se));
            ASSERT_NEAR(**height, z, 1e-6);
        }
    }
    EXPECT_GT(present, 1000);
    EXPECT_GT(absent, 100);
}

TEST(Ground, EndsAtTheDataset) {
    test::Random random(test::seed());
    const test::TerrainShape shape;
    const test::SyntheticTerrain terrain(shape, test::rough_heights(3, 300));
    const test::MemoryStore store(terrain);
    const Lattice& l = terrain.lattice();
    auto ground = Ground::open(store);
    ASSERT_TRUE(ground.ok());
    for (const auto& [i, j, there] : {std::tuple(0.0, 0.0, true),
                                      {64.0, 64.0, true},
                                      {64.5, 10.0, false},
                                      {10.0, -0.5, false},
                                      {-1e12, 0.0, false},
                                      {0.0, 1e300, false}}) {
        const auto height = (*ground)->height(l.x_m(i), l.y_m(j));
        ASSERT_TRUE(height.ok());
        EXPECT_EQ(height->has_value(), there) << i << ", " << j;
    }
    // 21
    const auto nowhere = (*ground)->height(std::nan(""), 0);
    ASSERT_TRUE(nowhere.ok());
    EXPECT_FALSE(nowhere->has_value());
}

TEST(Ground, HandsOnTheErrorOfADamagedTile) {
    const test::TerrainShape shape;
    const test::SyntheticTerrain terrain(shape, test::rough_heights(3, 300));
    test::MemoryStore store(terrain);
    store.damage(TileKind::height, {3, 1, 0}, test::Damage::truncated);
    auto ground = Ground::open(store);
    ASSERT_TRUE(ground.ok());
    EXPECT_TRUE((*ground)->height(terrain.lattice().x_m(4), terrain.lattice().y_m(4)).ok());
    EXPECT_FALSE((*ground)->height(terrain.lattice().x_m(12), terrain.lattice().y_m(4)).ok());
}

}  // namespace
}  // namespace scree
