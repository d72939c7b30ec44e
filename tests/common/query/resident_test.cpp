// Queries from whatever tiles are there: what they answer is never farther from the truth than they say.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "common/query/ground.h"
#include "tests/common/query/small_world.h"

namespace scree {
namespace {

// All tiles but some.
class Without final : public HeightSource {
public:
    using Missing = std::function<bool(TileId)>;
    Without(const test::SmallWorld& world, Missing missing) : world_(world), missing_(std::move(missing)) {}
    const Dataset& dataset() const override { return world_.dataset(); }
    Result<std::optional<HeightTileView>> view(TileId id) override {
        if (missing_(id)) return std::optional<HeightTileView>{};
        const HeightTile& tile = world_.tiles().at(id);
        return std::optional<HeightTileView>{HeightTileView{&tile.header, tile.samples, tile.presence}};
    }

private:
    const test::SmallWorld& world_;
    Missing missing_;
};

bool in_half(TileId id, int half) { return id.level > 0 && ancestor_at(id, 1).x == half; }

TEST(PartialTiles, KeepTheTrueHeightWithinTheBound) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    std::int64_t coarse = 0, exact = 0;
    double closest = 0;
    for (int w = 0; w < 60; ++w) {
        const auto world = test::random_world(random, w % 2 == 1);
        const Lattice& l = world.lattice();
        const double stated_m = world.dataset().height_quantum_error_m + world.dataset().warp_error_m;
        auto ground = Ground::open(world);
        ASSERT_TRUE(ground.ok());
        test::PartialSource some(world);
        some.drop(random, test::uniform(random, 0, 100));
        for (int k = 0; k < 300; ++k) {
            // Vertices too: there the greatest errors lie. (But on a line between leaves of two depths either may
            // answer.)
            const double fraction = k % 3 == 0 && !world.depth_varies() ? 1 : 256;
            const double off_line = world.depth_varies() ? 1.0 / 512 : 0;
            const double i = std::floor(test::uniform_real(random, 0, static_cast<double>(l.cells_x)) * fraction) /
                                 fraction +
                             off_line,
                         j = std::floor(test::uniform_real(random, 0, static_cast<double>(l.cells_y)) * fraction) /
                                 fraction +
                             off_line;
            const auto truth = (*ground)->height(world.x_m(i), world.y_m(j));
            const auto answer = height_at(some, world.x_m(i), world.y_m(j));
            ASSERT_TRUE(truth.ok() && answer.ok());
            if (!*truth) {
                ASSERT_TRUE(!*answer || !(*answer)->finest) << "leaves know absent cells";
                continue;
            }
            ASSERT_TRUE(answer->has_value());
            const double off = std::abs((*answer)->height_m - (*truth)->height_m);
            const double bound = (*answer)->error_bound_m - stated_m;
            ASSERT_LE(off, bound + 1e-9) << "level " << (*answer)->level;
            if ((*answer)->finest) {
                ++exact;
                ASSERT_EQ((*answer)->error_bound_m, (*truth)->error_bound_m);
            } else {
                ++coarse;
                if (bound > 0) closest = std::max(closest, off / bound);
            }
        }
    }
    EXPECT_GT(coarse, 1500);
    EXPECT_GT(exact, 500);
    EXPECT_GT(closest, 0.999) << "the bound is the tile's own error, not a multiple";
}

TEST(PartialTiles, WithEveryTileAnswerLikeTheGround) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed() + 1);
    for (int w = 0; w < 20; ++w) {
        const auto world = test::random_world(random, w % 2 == 1);
        const Lattice& l = world.lattice();
        auto ground = Ground::open(world);
        ASSERT_TRUE(ground.ok());
        test::PartialSource all(world);
        for (int k = 0; k < 100; ++k) {
            const double x = world.x_m(test::uniform_real(random, -1, static_cast<double>(l.cells_x) + 1)),
                         y = world.y_m(test::uniform_real(random, -1, static_cast<double>(l.cells_y) + 1));
            const auto truth = (*ground)->height(x, y), answer = height_at(all, x, y);
            ASSERT_TRUE(truth.ok() && answer.ok());
            ASSERT_EQ(truth->has_value(), answer->has_value());
            if (*truth) {
                ASSERT_EQ((*truth)->height_m, (*answer)->height_m);
            }
        }
    }
}

// A hit on coarse tiles has the true surface within its bound above or below, steps between levels included; and no ray
// slips through those steps: going from above all ground to below it over ground throughout, it hits.
TEST(PartialTiles, StopEveryRayWithinTheBound) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed() + 2);
    std::int64_t hits = 0, coarse = 0;
    for (int w = 0; w < 150; ++w) {
        const auto world = test::random_world(random, w % 3 == 2);
        const Dataset& d = world.dataset();
        const Lattice& l = world.lattice();
        bool whole = true;
        for (std::int64_t j = 0; j < l.cells_y; ++j)
            for (std::int64_t i = 0; i < l.cells_x; ++i) whole = whole && world.present(i, j);
        auto ground = Ground::open(world);
        ASSERT_TRUE(ground.ok());
        test::PartialSource some(world);
        some.drop(random, test::uniform(random, 0, 60));
        const double stated_m = d.height_quantum_error_m + d.warp_error_m;
        for (int k = 0; k < 60; ++k) {
            const auto point = [&](double n) {
                return Vector3{world.x_m(test::uniform_real(random, 0, static_cast<double>(l.cells_x))),
                               world.y_m(test::uniform_real(random, 0, static_cast<double>(l.cells_y))), d.height_m(n)};
            };
            const bool down = k % 2 == 0;
            const Vector3 from = point(down ? 600 : -600), to = point(down ? -600 : 600);
            const Vector3 along{to.x - from.x, to.y - from.y, to.z - from.z};
            const auto hit = cast_ray(some, from, along, std::hypot(along.x, along.y, along.z));
            ASSERT_TRUE(hit.ok());
            if (whole) {
                ASSERT_TRUE(hit->has_value()) << "world " << w << " ray " << k;
            }
            if (!*hit) continue;
            const auto truth = (*ground)->height((*hit)->position.x, (*hit)->position.y);
            ASSERT_TRUE(truth.ok());
            if (!*truth) continue;
            ++hits;
            coarse += (*hit)->error_bound_m > stated_m ? 1 : 0;
            ASSERT_LE(std::abs((*truth)->height_m - (*hit)->position.z), (*hit)->error_bound_m - stated_m + 1e-6)
                << "world " << w << " ray " << k;
        }
    }
    EXPECT_GT(hits, 2000);
    EXPECT_GT(coarse, 300);
}

// One half of the ground drawn by the root, the other by its children: a step of 40 quanta stands between, and a ray
// that passes through the step alone is stopped by it.
TEST(PartialTiles, AStepBetweenLevelsIsNoGap) {
    test::WorldShape shape;
    shape.cells_x = shape.cells_y = 8;
    const test::SmallWorld world(shape, [](std::int64_t i, std::int64_t j) { return i == 4 && j % 2 == 1 ? 40 : 0; });
    for (const int missing : {0, 1}) {
        Without source(world, [=](TileId id) { return in_half(id, missing); });
        // Level with the middle of the step, from the coarse side and from the fine one.
        const auto hit = cast_ray(source, {missing == 1 ? 6.0 : 2.0, -3, 20}, {missing == 1 ? -1.0 : 1.0, 0, 0}, 10);
        ASSERT_TRUE(hit.ok() && hit->has_value());
        EXPECT_EQ((*hit)->position.x, 4);
        EXPECT_GE((*hit)->error_bound_m, 20);
        const auto height = height_at(source, 4, -3);
        ASSERT_TRUE(height.ok() && height->has_value());
        EXPECT_EQ((*height)->height_m, 40) << "the finer of two tiles that meet answers";
        EXPECT_EQ((*height)->error_bound_m, 0);
    }
}

// The coarse side's border rises out of the height range of the small tile beside it, which is never looked into.
TEST(PartialTiles, AStepAboveAllOfATileIsNoGap) {
    test::WorldShape shape;
    shape.cells_x = shape.cells_y = 32;
    const test::SmallWorld world(shape, [](std::int64_t i, std::int64_t j) { return i == 16 && j == 8 ? 80 : 0; });
    Without source(world, [](TileId id) { return in_half(id, 1); });
    for (const double way : {1.0, -1.0}) {
        const auto hit = cast_ray(source, {16 - way, -3, 10}, {way, 0, 0}, 4);
        ASSERT_TRUE(hit.ok() && hit->has_value());
        EXPECT_EQ((*hit)->position.x, 16);
        EXPECT_GE((*hit)->error_bound_m, 10);
    }
}

// The coarse side of a step may be over a hole that it does not know of: then only the other side is true.
TEST(PartialTiles, AStepBesideAHoleIsBoundedByTheGroundThatIsThere) {
    test::WorldShape shape;
    shape.cells_x = shape.cells_y = 32;
    const test::SmallWorld world(
        shape, [](std::int64_t i, std::int64_t j) { return i != 16  ? 0
                                                           : j == 4 ? 22
                                                           : j == 2 ? -50
                                                                    : 0; },
        [](std::int64_t i, std::int64_t j) { return i < 16 || i >= 22 || j >= 8; });
    Without source(world, [](TileId id) { return id.level > 1 && in_half(id, 1); });
    const auto hit = cast_ray(source, {15.5, -2, 10}, {1, 0, 0}, 4);
    ASSERT_TRUE(hit.ok() && hit->has_value());
    EXPECT_EQ((*hit)->position.x, 16);
    EXPECT_GE((*hit)->error_bound_m, 60) << "the ground is at -50, the ray at 10";
}

TEST(PartialTiles, WhereCoarseTilesMeetTheBetterAnswersForBoth) {
    test::WorldShape shape;
    shape.cells_x = shape.cells_y = 32;
    for (const int coarse : {0, 1}) {
        const auto missing = [=](TileId id) { return in_half(id, coarse) || id.level > 1; };
        // A sample of level 1 and not of the root.
        const test::SmallWorld world(shape, [](std::int64_t i, std::int64_t j) { return i == 16 && j == 4 ? 50 : 0; });
        Without source(world, missing);
        const auto height = height_at(source, 16, -4);
        ASSERT_TRUE(height.ok() && height->has_value());
        EXPECT_EQ((*height)->height_m, 50);
        EXPECT_GE((*height)->error_bound_m, 50);
        // A sample of neither, and of no present cell on the better side: its error says nothing of it.
        const test::SmallWorld holed(
            shape, [](std::int64_t i, std::int64_t j) { return i == 16 && j == 2 ? 50 : 0; },
            [=](std::int64_t i, std::int64_t j) { return (i < 16) == (coarse == 0) || j > 8; });
        Without other(holed, missing);
        const auto bounded = height_at(other, 16, -2);
        ASSERT_TRUE(bounded.ok() && bounded->has_value());
        EXPECT_GE((*bounded)->error_bound_m, 50 - (*bounded)->height_m);
    }
}

}  // namespace
}  // namespace scree
