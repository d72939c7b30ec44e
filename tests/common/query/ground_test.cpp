#include "common/query/ground.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/common/query/small_world.h"

namespace scree {
namespace {

TEST(Ground, IsTheFinestSurfaceWhereCellsArePresentAndNothingElsewhere) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    std::int64_t present = 0, absent = 0;
    for (int world = 0; world < 40; ++world) {
        const auto terrain = test::random_world(random, world % 2 == 1);
        const Dataset& d = terrain.dataset();
        auto ground = Ground::open(terrain);
        ASSERT_TRUE(ground.ok());
        for (int k = 0; k < 500; ++k) {
            const auto i = test::uniform(random, 0, static_cast<int>(d.lattice.cells_x) - 1),
                       j = test::uniform(random, 0, static_cast<int>(d.lattice.cells_y) - 1);
            const double u = test::uniform_real(random, 0.001, 0.999), v = test::uniform_real(random, 0.001, 0.999);
            const auto height = (*ground)->height(terrain.x_m(i + u), terrain.y_m(j + v));
            ASSERT_TRUE(height.ok());
            ASSERT_EQ(height->has_value(), terrain.present(i, j));
            ++(terrain.present(i, j) ? present : absent);
            if (!height->has_value()) continue;
            ASSERT_NEAR((*height)->height_m, terrain.surface_m(i, j, i + u, j + v), 1e-6);
            ASSERT_EQ((*height)->error_bound_m, d.height_quantum_error_m + d.warp_error_m);
            ASSERT_EQ((*height)->level, terrain.leaf_cell(i, j).level);
            ASSERT_TRUE((*height)->finest);
        }
    }
    EXPECT_GT(present, 5000);
    EXPECT_GT(absent, 500);
}

// Vertices lie where the lattice says, rounding and all: their samples answer as they are, if any cell there is
// present.
TEST(Ground, AnswersEveryVertexOfAPresentCellWithItsSample) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    std::int64_t beside_holes = 0;
    for (int world = 0; world < 40; ++world) {
        const auto terrain = test::random_world(random);
        auto ground = Ground::open(terrain);
        ASSERT_TRUE(ground.ok());
        for (std::int64_t j = 0; j <= terrain.lattice().cells_y; ++j)
            for (std::int64_t i = 0; i <= terrain.lattice().cells_x; ++i) {
                const int cells = terrain.present(i, j) + terrain.present(i - 1, j) + terrain.present(i, j - 1) +
                                  terrain.present(i - 1, j - 1);
                const Vector3 p = terrain.vertex(i, j);
                const auto height = (*ground)->height(p.x, p.y);
                ASSERT_TRUE(height.ok());
                ASSERT_EQ(height->has_value(), cells > 0) << i << ", " << j;
                if (cells > 0) {
                    ASSERT_EQ((*height)->height_m, p.z) << i << ", " << j;
                }
                const auto down = (*ground)->cast_ray({p.x, p.y, p.z + 100}, {0, 0, -1}, 200);
                ASSERT_TRUE(down.ok());
                ASSERT_EQ(down->has_value(), cells > 0) << i << ", " << j;
                beside_holes += cells > 0 && !terrain.present(i, j) ? 1 : 0;
            }
    }
    EXPECT_GT(beside_holes, 100);
}

TEST(Ground, OnALineBetweenLeavesOfTwoDepthsTheDeeperAnswers) {
    // The south-east quarter has every second sample, its far corner every one, the others every fourth.
    test::WorldShape shape;
    shape.cells_x = shape.cells_y = 32;
    const auto heights = [](std::int64_t i, std::int64_t j) { return static_cast<int>(i * i + 7 * (j / 2 % 2)); };
    shape.depth = test::DepthMap::path_to({3, 7, 7});
    const test::SmallWorld world(shape, heights);
    ASSERT_TRUE(world.tiles().at({1, 0, 1}).header.is_leaf());
    ASSERT_TRUE(world.tiles().at({2, 2, 2}).header.is_leaf());
    ASSERT_EQ(world.lattice().deepest_level, 3);
    auto ground = Ground::open(world);
    ASSERT_TRUE(ground.ok());
    // West of i = 16 the sample at j = 22 is not stored: the coarse leaf's edge is straight there.
    for (const auto& [j, height_m] : {std::tuple(22, 256.0 + 7), {24, 256.0}}) {
        const auto height = (*ground)->height(world.x_m(16), world.y_m(j));
        ASSERT_TRUE(height.ok() && height->has_value());
        EXPECT_EQ((*height)->height_m, height_m);
        EXPECT_EQ((*height)->level, 2);
    }
    const auto west = (*ground)->height(world.x_m(16 - 1e-9), world.y_m(22));
    ASSERT_TRUE(west.ok() && west->has_value());
    EXPECT_NEAR((*west)->height_m, 256, 1e-5);
    EXPECT_EQ((*west)->level, 1);
}

TEST(Ground, EndsAtTheDataset) {
    const test::SmallWorld terrain({}, [](std::int64_t i, std::int64_t j) { return static_cast<int>(i * j); });
    auto ground = Ground::open(terrain);
    ASSERT_TRUE(ground.ok());
    const double nan = std::nan("");
    for (const auto& [i, j, there] : {std::tuple(0.0, 0.0, true),
                                      {16.0, 16.0, true},
                                      {16.5, 10.0, false},
                                      {10.0, -0.5, false},
                                      {-1e12, 0.0, false},
                                      {0.0, 1e300, false},
                                      {nan, 0.0, false},
                                      {0.0, nan, false}}) {
        const auto height = (*ground)->height(terrain.x_m(i), terrain.y_m(j));
        ASSERT_TRUE(height.ok());
        EXPECT_EQ(height->has_value(), there) << i << ", " << j;
    }
}

TEST(Ground, ReadsOneTileForAPointAndNoneTwice) {
    const test::SmallWorld terrain({}, [](std::int64_t i, std::int64_t j) { return static_cast<int>(i * j); });
    auto ground = Ground::open(terrain);
    ASSERT_TRUE(ground.ok());
    for (int k = 0; k < 3; ++k) ASSERT_TRUE((*ground)->height(terrain.x_m(1.5 + 0.5 * k), terrain.y_m(1.5)).ok());
    EXPECT_EQ(terrain.reads, 1);
}

TEST(Ground, TellsALostTileFromAbsentGroundAndHandsOnErrors) {
    test::SmallWorld terrain(
        {}, [](std::int64_t, std::int64_t) { return 3; },
        [](std::int64_t i, std::int64_t j) { return i < 8 || j < 8; });
    terrain.cut = {{2, 1, 0}};
    terrain.lost = {{2, 0, 1}, {1, 1, 0}};
    auto ground = Ground::open(terrain);
    ASSERT_TRUE(ground.ok());
    const auto height = [&](double i, double j) { return (*ground)->height(terrain.x_m(i), terrain.y_m(j)); };
    ASSERT_TRUE(height(2.5, 2.5).ok());
    ASSERT_TRUE(height(12.5, 12.5).ok());
    EXPECT_FALSE(height(12.5, 12.5)->has_value());
    for (const auto& [i, j, name] : {std::tuple(6.5, 2.5, "2/1/0"), {2.5, 6.5, "2/0/1"}}) {
        const auto failed = height(i, j);
        ASSERT_FALSE(failed.ok());
        EXPECT_EQ(failed.error().code, ErrorCode::store);
        EXPECT_NE(failed.error().message.find(name), std::string::npos) << failed.error().message;
    }
    // A ray that needs a lost tile says so; one that passes above it needs it not.
    const auto down = (*ground)->cast_ray({terrain.x_m(9.5), terrain.y_m(1.5), 100}, {0, 0, -1}, 200);
    ASSERT_FALSE(down.ok());
    EXPECT_EQ(down.error().code, ErrorCode::store);
    EXPECT_TRUE((*ground)->cast_ray({terrain.x_m(9.5), terrain.y_m(1.5), 100}, {1, 0, 0}, 200).ok());
}

}  // namespace
}  // namespace scree
