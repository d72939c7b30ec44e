// What is drawn is balanced, resident, whole and watertight, whatever is in memory (docs/lod-and-paging.md).
#include <gtest/gtest.h>

#include "runtime/app/coverage.h"
#include "tests/runtime/lod/drawn_frame.h"
#include "tests/runtime/lod/selection_support.h"

namespace scree {
namespace {

using test::DrawnFrame;

// One drawn frame against every claim.
void expect_whole(const test::SyntheticTerrain& terrain, const test::FakeResidency& residency, const Camera& camera,
                  const DrawList& draws, const CpuArena& arena, const TilePatterns& patterns,
                  double half_curvature = 0) {
    for (const DrawItem& item : draws) {
        ASSERT_TRUE(residency.holds(item.tile));
        ASSERT_EQ(item.height_slot, terrain.index(item.tile));
    }
    const DrawnFrame frame(terrain, draws);
    ASSERT_EQ(frame.unbalanced(), "");
    ASSERT_EQ(frame.cells_drawn_twice(), 0);
    ASSERT_EQ(frame.visible_cells_missed(camera, half_curvature), 0);
    ASSERT_EQ(count_holes(terrain.dataset(), residency, camera, draws, half_curvature), 0);
    const DrawnMesh mesh = drawn_mesh(terrain.dataset(), patterns, draws, arena);
    ASSERT_EQ(frame.leak(mesh), "");
    const CrackReport cracks = count_cracks(terrain.dataset(), draws, mesh);
    ASSERT_EQ(cracks.open_edges, 0);
    ASSERT_EQ(cracks.t_junctions, 0);
}

TEST(Balance, RandomCutsOverRandomResidencyAreWatertightAndDrawEveryVisibleCellOnce) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    std::int64_t thinned = 0, mixed_levels = 0, refined = 0, morphed = 0, edges_apart = 0, coarse_leaves = 0;
    for (int world = 0; world < 60; ++world) {
        const auto terrain = test::random_terrain(random, world % 4 == 3 ? test::kDeepTextures : world % 4, 1,
                                                  test::depth_of_world(world / 4));
        const CpuArena arena = test::arena_of(terrain);
        const TilePatterns patterns(terrain.lattice().tile_cells_log2);
        Selector selector(terrain.dataset());
        for (int k = 0; k < 24; ++k) {
            SCOPED_TRACE("world " + std::to_string(world) + ", cut " + std::to_string(k));
            test::FakeResidency residency(terrain);
            residency.add_random(random, k % 4 == 0 ? 100 : test::uniform(random, 0, 100));
            const std::int64_t roots = terrain.lattice().root_rows * terrain.lattice().root_columns;
            SelectionSettings settings = test::with_tau(k == 1 ? 0 : std::exp(test::uniform_real(random, -4, 5)));
            settings.texture_tau_px = std::exp(test::uniform_real(random, -1, 3));
            if (k % 3 == 0) settings.height_slots = roots + test::uniform(random, 0, 80);
            if (k % 2 == 0) settings.half_curvature = test::random_half_curvature(random, terrain);
            if (k % 4 >= 2) test::arrive_at_random(random, terrain, residency, settings);
            settings.morph = k % 8 != 7;
            if (k % 3 == 1) settings.metric = ErrorMetric::deboer;
            if (k % 2 == 1) residency.keep_corrections();
            const Camera camera = test::random_camera(random, terrain);
            const Selection& s = selector.select({&camera, 1}, settings, residency);
            expect_whole(terrain, residency, camera, s.draws[0], arena, patterns, settings.half_curvature);
            if (HasFatalFailure()) return;
            for (const DrawItem& item : s.draws[0]) {
                morphed += item.morph > 0 ? 1 : 0;
                edges_apart += item.edge_morph[0] != item.morph ? 1 : 0;
                thinned += item.edge_mask != 0 ? 1 : 0;
                mixed_levels += item.tile.level != s.draws[0][0].tile.level ? 1 : 0;
                refined += item.tile.level == terrain.lattice().deepest_level ? 1 : 0;
                coarse_leaves += item.tile.level < terrain.lattice().deepest_level && terrain.is_leaf(item.tile);
            }
        }
    }
    // The claims above mean little unless cuts are uneven.
    EXPECT_GT(thinned, 500);
    EXPECT_GT(mixed_levels, 1000);
    EXPECT_GT(refined, 500);
    EXPECT_GT(morphed, 1000);
    EXPECT_GT(edges_apart, 200);
    EXPECT_GT(coarse_leaves, 500);
}

TEST(Balance, HoldsWhereOneLoneTileOfManyLevelsIsMissing) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int world = 0; world < 12; ++world) {
        const auto terrain = test::random_terrain(random, 0, 1, test::depth_of_world(world));
        const CpuArena arena = test::arena_of(terrain);
        const TilePatterns patterns(terrain.lattice().tile_cells_log2);
        Selector selector(terrain.dataset());
        for (int k = 0; k < 20; ++k) {
            test::FakeResidency residency(terrain);
            residency.add_all();
            const auto count = static_cast<int>(terrain.tiles().size());
            const TileId missing = terrain.tiles()[static_cast<std::size_t>(test::uniform(random, 0, count - 1))];
            if (missing.level == 0) continue;
            k % 2 == 0 ? residency.remove(missing) : residency.make_unavailable(missing);
            const Camera camera = test::random_camera(random, terrain);
            const Selection& s = selector.select({&camera, 1}, test::with_tau(0.01), residency);
            expect_whole(terrain, residency, camera, s.draws[0], arena, patterns);
            if (HasFatalFailure()) return;
        }
    }
}

TEST(Balance, SeveralRootsWithAnAbsentOneBetweenThemStayWatertight) {
    test::TerrainShape shape;
    shape.tile_cells_log2 = 2;
    shape.cells_x = 64;
    shape.cells_y = 16;
    const test::SyntheticTerrain terrain(shape, test::rough_heights(5, 400),
                                         [](std::int64_t i, std::int64_t) { return i < 16 || i >= 32; });
    ASSERT_EQ(terrain.lattice().root_columns, 4);
    ASSERT_EQ(terrain.tile({0, 1, 0}), nullptr);
    const CpuArena arena = test::arena_of(terrain);
    const TilePatterns patterns(2);
    test::FakeResidency residency(terrain);
    residency.add_all();
    Selector selector(terrain.dataset());
    test::Random random(test::seed());
    for (int k = 0; k < 40; ++k) {
        const Camera camera = test::random_camera(random, terrain);
        const Selection& s = selector.select({&camera, 1}, test::with_tau(k % 2 == 0 ? 0 : 4), residency);
        expect_whole(terrain, residency, camera, s.draws[0], arena, patterns);
        if (HasFatalFailure()) return;
    }
}

TEST(Balance, HoldsWherePagesAreSplitForTexturesBesideRoughGround) {
    // Flat ground under fine imagery has small pages of coarse meshes; rough ground beside it has large pages of fine
    // ones.
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    std::int64_t by_texture = 0;
    for (int world = 0; world < 6; ++world) {
        test::TerrainShape shape;
        shape.tile_cells_log2 = 4;
        shape.cells_x = shape.cells_y = 128;
        shape.texture_depth = 3;
        const auto rough = test::rough_heights(random(), 300);
        const int flat = test::uniform(random, 1, 7) * 16;
        const test::SyntheticTerrain terrain(
            shape, [=](std::int64_t i, std::int64_t j) { return i <= flat ? 0 : rough(i, j); });
        const CpuArena arena = test::arena_of(terrain);
        const TilePatterns patterns(4);
        test::FakeResidency residency(terrain);
        residency.add_all();
        Selector selector(terrain.dataset());
        for (int k = 0; k < 40; ++k) {
            const Camera camera = test::random_camera(random, terrain);
            SelectionSettings settings = test::with_tau(std::exp(test::uniform_real(random, 0, 6)));
            settings.texture_tau_px = std::exp(test::uniform_real(random, -2, 4));
            if (k % 4 == 0) settings.height_slots = test::uniform(random, 10, 60);
            const Selection& s = selector.select({&camera, 1}, settings, residency);
            expect_whole(terrain, residency, camera, s.draws[0], arena, patterns);
            if (HasFatalFailure()) return;
            for (const DrawItem& item : s.draws[0]) by_texture += item.tile.level > 0 && item.geomip >= 2 ? 1 : 0;
        }
    }
    EXPECT_GT(by_texture, 500);
}

TEST(Balance, WithRootsAloneResidentTheRootsAreDrawn) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    const auto terrain = test::random_terrain(random);
    test::FakeResidency residency(terrain);
    residency.add_roots();
    Selector selector(terrain.dataset());
    for (int k = 0; k < 50; ++k) {
        const Camera camera = test::random_camera(random, terrain);
        const Selection& s = selector.select({&camera, 1}, test::with_tau(0), residency);
        for (const DrawItem& item : s.draws[0]) EXPECT_EQ(item.tile.level, 0);
        EXPECT_EQ(DrawnFrame(terrain, s.draws[0]).visible_cells_missed(camera), 0);
    }
}

}  // namespace
}  // namespace scree
