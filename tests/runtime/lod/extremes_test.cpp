// The extremes of lod.md, section 7, that concern blocks. Numbers are its list's.
#include <gtest/gtest.h>

#include "tests/runtime/lod/selection_support.h"

namespace scree {
namespace {

using test::FakeResidency;
using test::SyntheticTerrain;
using test::TerrainShape;

Camera camera_at(glm::dvec3 eye, glm::dvec3 look, double fov_deg = 40) {
    auto camera = look_at(eye, look, fov_deg, 800, 800);
    EXPECT_TRUE(camera.ok());
    return *camera;
}

struct World {
    World(const TerrainShape& shape, const test::HeightFunction& height)
        : terrain(shape, height), residency(terrain), selector(terrain.dataset()) {
        residency.add_all();
    }
    const Selection& select(const Camera& camera, double tau_px) {
        return selector.select({&camera, 1}, test::with_tau(tau_px), residency);
    }
    glm::dvec3 at(double i, double j, double z) const {
        return {terrain.lattice().x_m(i), terrain.lattice().y_m(j), z};
    }
    int finest_exponent(const Selection& s) const {
        int finest = 99;
        for (const DrawItem& item : s.draws[0])
            finest = std::min(finest, terrain.lattice().deepest_level - item.tile.level + item.geomip);
        return finest;
    }
    int coarsest_possible() const { return terrain.lattice().deepest_level + terrain.lattice().tile_cells_log2 - 1; }

    SyntheticTerrain terrain;
    FakeResidency residency;
    Selector selector;
};

constexpr double kTolerances[] = {0, 1e-9, 1e-3, 1, 1e3, 1e9};

// 14, 5
TEST(Extremes, ARampOrAFlatStaysAtItsCoarsestForEveryTolerance) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (const bool flat : {true, false})
        for (int n = 2; n <= 4; ++n) {
            TerrainShape shape;
            shape.tile_cells_log2 = n;
            World world(shape, [&](std::int64_t i, std::int64_t j) {
                return flat ? -17 : static_cast<std::int32_t>(700 * i - 311 * j + 5);
            });
            for (const double tau : kTolerances)
                for (int k = 0; k < 10; ++k) {
                    const Camera camera = test::random_camera(random, world.terrain);
                    const Selection& s = world.select(camera, tau);
                    EXPECT_EQ(s.max_bound_px, 0);
                    for (const DrawItem& item : s.draws[0]) {
                        EXPECT_EQ(item.tile.level, 0);
                        EXPECT_EQ(item.geomip, n - 1);
                    }
                }
        }
}

// 5
TEST(Extremes, AToleranceOfZeroLeavesNoError) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    std::int64_t kept_coarse = 0;
    for (int world = 0; world < 10; ++world) {
        const auto rough = test::rough_heights(random(), 500);
        const SyntheticTerrain half_flat(TerrainShape{},
                                         [=](std::int64_t i, std::int64_t j) { return i < 40 ? 3 : rough(i, j); });
        const SyntheticTerrain terrain = world % 2 == 0 ? half_flat : test::random_terrain(random);
        FakeResidency residency(terrain);
        residency.add_all();
        Selector selector(terrain.dataset());
        for (int k = 0; k < 20; ++k) {
            const Camera camera = test::random_camera(random, terrain);
            const Selection& s = selector.select({&camera, 1}, test::with_tau(0), residency);
            EXPECT_EQ(s.max_bound_px, 0);
            EXPECT_FALSE(s.budget_limited);
            for (const DrawItem& item : s.draws[0]) {
                EXPECT_EQ(test::bound_px(terrain, camera, item), 0);
                kept_coarse += item.tile.level < terrain.lattice().deepest_level ? 1 : 0;
            }
        }
    }
    EXPECT_GT(kept_coarse, 0);  // flat parts are not refined for nothing
}

// 14
TEST(Extremes, ASpikeIsRefinedExactlyWhenItsPixelsPassTheTolerance) {
    constexpr std::int32_t kSpike = 400;
    TerrainShape shape;
    shape.tile_cells_log2 = 3;
    shape.quantum_m = 0.5;
    World world(shape, [](std::int64_t i, std::int64_t j) { return i == 21 && j == 43 ? kSpike : 0; });
    const TileId leaf{3, 2, 5};
    const double height_m = kSpike * 0.5;
    const HeightBounds& own = world.terrain.tile(leaf)->header.own;
    ASSERT_EQ(own.error_n[0], 0);  // inside the tile: thinning its border does not touch it
    for (TileId id = leaf; id.level >= 0; id = parent_of(id))
        for (std::size_t g = id == leaf ? 1 : 0; g < 3; ++g)
            ASSERT_EQ(world.terrain.tile(id)->header.own.error_n[g], kSpike);
    const Box box = world.terrain.box_of(leaf);
    for (const glm::dvec3 eye :
         {world.at(21, 43, 5000), world.at(600, -900, 300), world.at(21, -2000, 60), world.at(-40, 43, 55)}) {
        const Camera camera = camera_at(eye, world.at(20, 44, 50));
        const double distance = distance_to_box(eye, box);
        const double px = camera.focal_px() * camera.off_axis_factor() * height_m / distance;
        EXPECT_EQ(world.finest_exponent(world.select(camera, px * (1 - 1e-9))), 0) << distance;
        EXPECT_GE(world.finest_exponent(world.select(camera, px * (1 + 1e-9))), 1) << distance;
    }
    // Straight above it every ancestor is as near: one threshold for the whole chain, but that successive levels are
    // left a quarter further off each.
    const glm::dvec3 above = world.at(21, 43, 5000);
    const Camera camera = camera_at(above, world.at(21, 43, 50));
    const double px = camera.focal_px() * camera.off_axis_factor() * height_m / (5000 - 50 - height_m);
    EXPECT_EQ(world.finest_exponent(world.select(camera, px * 1.25 * 1.25 * (1 + 1e-9))), world.coarsest_possible());
    EXPECT_LT(world.finest_exponent(world.select(camera, px * 1.25 * 1.25 * (1 - 1e-4))), world.coarsest_possible());
    EXPECT_EQ(world.select(camera, px * (1 + 1e-9)).draws[0].size(), 1u);
}

// 14 on a border: thinning the edge removes the spike, so the neighbour has to follow.
TEST(Extremes, ASpikeOnATileBorderIsNeverThinnedAwayBelowTheTolerance) {
    TerrainShape shape;
    shape.tile_cells_log2 = 3;
    World world(shape, [](std::int64_t i, std::int64_t j) { return i == 21 && j == 40 ? 400 : 0; });
    const Camera camera = camera_at(world.at(21, 43, 900), world.at(21, 40, 50));
    const Selection& s = world.select(camera, 0.01);
    EXPECT_LE(s.max_bound_px, 0.01);
    for (const DrawItem& item : s.draws[0])
        if (item.tile == TileId{3, 2, 5} || item.tile == TileId{3, 2, 4}) {
            EXPECT_EQ(item.geomip, 0);
            EXPECT_EQ(item.edge_mask & (item.tile.y == 5 ? kEdgeNorth : kEdgeSouth), 0u);
        }
}

// 15: corrections of +1 at each of three levels add up; a level-to-level bound would stop too soon.
TEST(Extremes, LevelToLevelErrorsThatAddUpAreBoundedTogether) {
    constexpr std::int32_t kUnit = 64;
    // Along i, period 8: mid-point corrections of kUnit at strides 4, 2 and 1.
    const auto ridge = [](std::int64_t i, std::int64_t) {
        const std::int64_t p = i % 8;
        const auto tent = [&](std::int64_t period) {
            const std::int64_t q = p % period, half = period / 2;
            return kUnit * (half - std::abs(q - half)) / half;
        };
        return static_cast<std::int32_t>(tent(8) + tent(4) + tent(2));
    };
    TerrainShape shape;
    shape.tile_cells_log2 = 2;
    shape.cells_x = shape.cells_y = 32;
    World world(shape, ridge);
    const int levels = world.terrain.lattice().deepest_level;
    const std::int32_t truth = ridge(3, 0);
    ASSERT_GT(truth, 2 * kUnit);
    const Camera camera = camera_at(world.at(16, 16, 3000), world.at(16, 16, 50));
    const double px_per_unit = camera.focal_px() * camera.off_axis_factor() * 0.25 /
                               distance_to_box(camera.eye, world.terrain.box_of({0, 0, 0}));
    // Stride 8 (exponent 3) misses by `truth`, not by one level's correction.
    const TileId pages[] = {{levels - 2, 0, 0}, {levels - 1, 0, 0}};
    EXPECT_GE(world.terrain.tile(pages[1])->header.own.error_n[1], kUnit);
    EXPECT_EQ(world.terrain.tile(pages[0])->header.own.error_n[1], truth);
    EXPECT_LT(world.finest_exponent(world.select(camera, px_per_unit * 1.5 * kUnit)), 3);
    EXPECT_EQ(world.finest_exponent(world.select(camera, px_per_unit * 1.25 * (truth + 1))), world.coarsest_possible());
}

// 16: the same error at every level, and an eye inside the box.
TEST(Extremes, APlateauOfErrorsAndAnEyeInsideTheBoxGiveFiniteBoundsAndTheFinestMesh) {
    TerrainShape shape;
    shape.tile_cells_log2 = 3;
    World world(shape, [](std::int64_t i, std::int64_t j) { return (i + j) % 2 == 0 ? 0 : 200; });
    for (std::size_t g = 0; g < 3; ++g) ASSERT_EQ(world.terrain.tile({0, 0, 0})->header.own.error_n[g], 200);
    const glm::dvec3 inside = world.at(32.3, 31.7, 75);
    const Camera camera = camera_at(inside, world.at(40, 20, 60));
    ASSERT_EQ(distance_to_box(inside, world.terrain.box_of({0, 0, 0})), 0);
    for (const double tau : {0.0, 0.1, 1.0, 100.0}) {
        const Selection& s = world.select(camera, tau);
        ASSERT_TRUE(std::isfinite(s.max_bound_px));
        EXPECT_LE(s.max_bound_px, tau);
        for (const DrawItem& item : s.draws[0]) {
            ASSERT_TRUE(item.morph >= 0 && item.morph < 1);
            for (const float weight : item.edge_morph) ASSERT_TRUE(weight >= 0 && weight < 1);
        }
        for (const DrawItem& item : s.draws[0])
            if (distance_to_box(inside, world.terrain.box_of(item.tile)) == 0) {
                EXPECT_EQ(item.tile.level, 3);
                EXPECT_EQ(item.geomip, 0);
            }
    }
    // With the roots alone the bound is large, stated, and still a number.
    FakeResidency roots(world.terrain);
    roots.add_roots();
    Selector selector(world.terrain.dataset());
    const Selection& s = selector.select({&camera, 1}, test::with_tau(1), roots);
    EXPECT_NEAR(s.max_bound_px, camera.focal_px() * camera.off_axis_factor() * 50 / camera.near_m, 1e-3);
}

// 9: very narrow views, tolerances from 1e-3 to 1e3, an eye 1e10 m away.
TEST(Extremes, NarrowViewsAndHugeDistancesNeitherOverflowNorLoseTheTerrain) {
    TerrainShape shape;
    World world(shape, test::rough_heights(3, 2000));
    for (const double fov : {0.001, 0.01, 40.0})
        for (const double distance : {1e3, 1e6, 4e9, 1e10})
            for (const double tau : {1e-3, 1.0, 1e3}) {
                const glm::dvec3 middle = world.at(32, 32, 50);
                const Camera camera =
                    camera_at(middle + glm::normalize(glm::dvec3(0.3, -1, 0.5)) * distance, middle, fov);
                const Selection& s = world.select(camera, tau);
                ASSERT_FALSE(s.draws[0].empty()) << fov << " deg at " << distance;
                ASSERT_TRUE(std::isfinite(s.max_bound_px));
                EXPECT_LE(s.max_bound_px, tau * (1 + 1e-12));
                EXPECT_TRUE(s.complete);
            }
    // A narrow view from afar needs what a wide one from near does: f / d decides.
    const glm::dvec3 middle = world.at(32, 32, 50);
    EXPECT_EQ(world.finest_exponent(world.select(camera_at(middle + glm::dvec3(0, 0, 1e6), middle, 0.02), 0.5)), 0);
    EXPECT_GT(world.finest_exponent(world.select(camera_at(middle + glm::dvec3(0, 0, 1e6), middle, 40), 0.5)), 3);
}

// 20: K holds for every direction, so turning changes nothing but what is in view.
TEST(Extremes, TurningTheCameraDoesNotChangeTheCutOfWhatStaysInView) {
    TerrainShape shape;
    World world(shape, test::rough_heights(11, 1500));
    const glm::dvec3 eye = world.at(32, 90, 1800);
    const Selection straight = world.select(camera_at(eye, world.at(32, 32, 50), 60), 2);
    ASSERT_GT(straight.draws[0].size(), 4u);
    for (const glm::dvec3 look : {world.at(28, 30, 50), world.at(36, 34, 80), world.at(32, 26, 0)}) {
        const Selection& turned = world.select(camera_at(eye, look, 60), 2);
        EXPECT_TRUE(test::same_draws(straight.draws[0], turned.draws[0]));
    }
}

}  // namespace
}  // namespace scree
