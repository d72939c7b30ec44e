#include "runtime/app/audit.h"

#include <gtest/gtest.h>

#include <limits>

#include "common/mesh/geometric_error.h"
#include "tests/runtime/lod/drawn_frame.h"
#include "tests/runtime/lod/grid_mesh.h"
#include "tests/runtime/lod/memory_store.h"
#include "tests/runtime/lod/selection_support.h"

namespace scree {
namespace {

TEST(ErrorHistogram, QuantilesAreWithinABinAndNeverTooSmall) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int round = 0; round < 50; ++round) {
        ErrorHistogram histogram;
        std::vector<double> values;
        for (int k = 0; k < 1000; ++k) {
            values.push_back(std::exp(test::uniform_real(random, -13, 10)));
            histogram.add(values.back());
        }
        std::sort(values.begin(), values.end());
        for (const double q : {0.001, 0.01, 0.5, 0.9, 0.99, 0.999, 1.0}) {
            const double exact = values[static_cast<std::size_t>(std::ceil(q * 1000)) - 1];
            ASSERT_GE(histogram.quantile(q), exact * (1 - 1e-9)) << q;
            ASSERT_LE(histogram.quantile(q), exact * 1.00401 + 1e-6) << q;
        }
        EXPECT_EQ(histogram.max(), values.back());
        EXPECT_EQ(histogram.quantile(1), values.back());
        EXPECT_EQ(histogram.count(), 1000);
    }
}

TEST(ErrorHistogram, CountsZerosAndIsEmptyAtFirst) {
    ErrorHistogram histogram;
    EXPECT_EQ(histogram.count(), 0);
    EXPECT_EQ(histogram.max(), 0);
    EXPECT_EQ(histogram.mean(), 0);
    EXPECT_EQ(histogram.quantile(0.99), 0);
    for (int k = 0; k < 99; ++k) histogram.add(0);
    histogram.add(2);
    EXPECT_EQ(histogram.quantile(0.99), 0);
    EXPECT_EQ(histogram.quantile(0.995), 2);
    EXPECT_DOUBLE_EQ(histogram.mean(), 0.02);
}

TEST(ErrorHistogram, MergedIsAsIfAllHadBeenAddedToOne) {
    test::Random random(test::seed());
    ErrorHistogram one, two, all;
    for (int k = 0; k < 2000; ++k) {
        const double px = std::exp(test::uniform_real(random, -10, 3));
        (k % 3 == 0 ? one : two).add(px);
        all.add(px);
    }
    one.merge(two);
    EXPECT_EQ(one.count(), all.count());
    EXPECT_EQ(one.max(), all.max());
    EXPECT_NEAR(one.mean(), all.mean(), 1e-12);
    for (const double q : {0.1, 0.5, 0.99}) EXPECT_EQ(one.quantile(q), all.quantile(q));
}

// 21: one NaN must not disable max().
TEST(ErrorHistogram, WhatIsNoNumberOrTooLargeIsNotHiddenByTheMaximum) {
    for (const double bad :
         {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 1e300}) {
        ErrorHistogram histogram;
        histogram.add(1);
        histogram.add(bad);
        histogram.add(2);
        EXPECT_FALSE(histogram.max() <= 1e299) << bad;
        EXPECT_FALSE(histogram.quantile(1) <= 1e299) << bad;
    }
}

/// Positions are floats, as on the GPU.
constexpr double kRoundingPx = 1e-3;

struct Audited {
    explicit Audited(const test::SyntheticTerrain& t)
        : terrain(t), store(t), residency(t), arena(test::arena_of(t)), selector(t.dataset()) {
        residency.add_all();
        reader = std::move(*store.open_reader());
    }
    ErrorHistogram audit(const Camera& camera, const DrawList& draws, double half_curvature = 0) {
        ErrorHistogram errors;
        EXPECT_TRUE(audit_frame(store, *reader, {camera, draws, arena, half_curvature}, errors).ok());
        return errors;
    }
    const test::SyntheticTerrain& terrain;
    test::MemoryStore store;
    test::FakeResidency residency;
    CpuArena arena;
    Selector selector;
    std::unique_ptr<TileReader> reader;
};

TEST(Audit, TheTruthNeverPassesThePromise) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    double closest = 0;
    std::int64_t samples = 0;
    for (int world = 0; world < 30; ++world) {
        const auto terrain = test::random_terrain(random, 0, 1, test::depth_of_world(world));
        Audited a(terrain);
        for (int k = 0; k < 12; ++k) {
            const Camera camera = test::random_camera(random, terrain);
            SelectionSettings settings = test::with_tau(std::exp(test::uniform_real(random, -2, 5)));
            if (k % 3 == 0) settings.height_slots = 12;
            if (k % 2 == 0) settings.half_curvature = test::random_half_curvature(random, terrain);
            settings.morph = k % 6 != 5;
            test::FakeResidency residency = a.residency;
            if (k % 4 == 3) test::arrive_at_random(random, terrain, residency, settings);
            const Selection& s = a.selector.select({&camera, 1}, settings, residency);
            const ErrorHistogram errors = a.audit(camera, s.draws[0], settings.half_curvature);
            ASSERT_LE(errors.max(), s.max_bound_px + kRoundingPx);
            if (s.max_bound_px > 0) closest = std::max(closest, errors.max() / s.max_bound_px);
            samples += errors.count();
        }
    }
    EXPECT_GT(closest, 0.5);  // a bound that nothing comes near would prove little
    EXPECT_GT(samples, 100000);
}

TEST(Audit, AFinestMeshHasNoErrorAndEveryPresentVertexInViewIsLookedAt) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    const test::TerrainShape shape;
    const test::SyntheticTerrain terrain(shape, test::rough_heights(9, 800), test::with_absent_discs(random, shape, 2));
    Audited a(terrain);
    DrawList finest;
    const Lattice& l = terrain.lattice();
    for (const TileId id : terrain.tiles())
        if (id.level == l.deepest_level) {
            DrawItem item;
            item.tile = id;
            item.height_slot = terrain.index(id);
            finest.push_back(item);
        }
    auto camera = look_at({l.x_m(32), l.y_m(32), 5000}, {l.x_m(32), l.y_m(32), 0}, 40, 800, 800);
    ASSERT_TRUE(camera.ok());
    const ErrorHistogram errors = a.audit(*camera, finest);
    EXPECT_EQ(errors.max(), 0);
    std::int64_t vertices = 0;  // counted once for each tile they belong to
    for (const DrawItem& item : finest) {
        const LatticePoint c = l.corner(item.tile);
        for (std::int64_t j = c.j; j <= c.j + 8; ++j)
            for (std::int64_t i = c.i; i <= c.i + 8; ++i) {
                bool present = false;
                for (int q = 0; q < 4; ++q) {
                    const std::int64_t ci = i - q % 2, cj = j - q / 2;
                    present |= ci >= c.i && cj >= c.j && ci < c.i + 8 && cj < c.j + 8 && terrain.present(ci, cj);
                }
                vertices += present ? 1 : 0;
            }
    }
    EXPECT_EQ(errors.count(), vertices);
}

TEST(Audit, LeavesDrawnWholeHaveNoErrorWhateverTheirDepth) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int world = 0; world < 10; ++world) {
        const auto terrain = test::random_terrain(random, 0, 1, test::Depth::varying);
        Audited a(terrain);
        DrawList leaves;
        std::int64_t vertices = 0;
        const std::int64_t m = terrain.lattice().tile_cells();
        for (const TileId id : terrain.tiles()) {
            if (!terrain.is_leaf(id)) continue;
            DrawItem item;
            item.tile = id;
            item.height_slot = terrain.index(id);
            leaves.push_back(item);
            const auto present = present_vertices(terrain.tile(id)->presence, terrain.lattice().tile_cells_log2);
            vertices += present.empty() ? (m + 1) * (m + 1) : std::count(present.begin(), present.end(), 1);
        }
        const Lattice& l = terrain.lattice();
        const double i = static_cast<double>(l.cells_x) / 2, j = static_cast<double>(l.cells_y) / 2;
        auto camera = look_at({l.x_m(i), l.y_m(j), 20000}, {l.x_m(i), l.y_m(j), 0}, 40, 800, 800);
        ASSERT_TRUE(camera.ok());
        const ErrorHistogram errors = a.audit(*camera, leaves);
        EXPECT_EQ(errors.max(), 0);
        EXPECT_EQ(errors.count(), vertices);
    }
}

TEST(Audit, MeasuresADroppedSpikeInPixels) {
    const test::TerrainShape shape;
    const test::SyntheticTerrain terrain(shape,
                                         [](std::int64_t i, std::int64_t j) { return i == 21 && j == 43 ? 40 : 0; });
    Audited a(terrain);
    const Lattice& l = terrain.lattice();
    // Level view from 1000 m: 10 m stand upright, f * 10 / 1000 px.
    auto camera = look_at({l.x_m(21), l.y_m(43) - 1000, 50}, {l.x_m(21), l.y_m(43), 50}, 40, 800, 800);
    ASSERT_TRUE(camera.ok());
    DrawItem root;
    root.height_slot = terrain.index({0, 0, 0});
    root.geomip = 2;
    const ErrorHistogram errors = a.audit(*camera, {root});
    EXPECT_NEAR(errors.max(), camera->focal_px() * 10 / 1000, 1e-9);
    // Every other vertex in view is where it should be.
    EXPECT_EQ(errors.quantile(1 - 1.5 / static_cast<double>(errors.count())), errors.count() > 4 ? 0 : errors.max());
}

TEST(Audit, MeasuresTheMeshThatATileIsDrawnByInPlaceOfItsPattern) {
    const test::TerrainShape shape;
    const test::SyntheticTerrain terrain(shape,
                                         [](std::int64_t i, std::int64_t j) { return i == 24 && j == 40 ? 40 : 0; });
    Audited a(terrain);
    const Lattice& l = terrain.lattice();
    auto camera = look_at({l.x_m(24), l.y_m(40) - 1000, 50}, {l.x_m(24), l.y_m(40), 50}, 40, 800, 800);
    ASSERT_TRUE(camera.ok());
    MeshPool pool(1000, 3 * 128);
    const auto worst_px = [&](bool with_spike) {
        test::GridMesh mesh(3);
        mesh.set(3, 5, with_spike);
        DrawItem root;
        root.height_slot = terrain.index({0, 0, 0});
        root.mesh = pool.put(mesh.indices());
        ErrorHistogram errors;
        EXPECT_TRUE(audit_frame(a.store, *a.reader, {*camera, {root}, a.arena, 0, &pool}, errors).ok());
        return errors.max();
    };
    EXPECT_NEAR(worst_px(false), camera->focal_px() * 10 / 1000, 1e-9);
    // The spike is there, and so is its slope where the ground is flat.
    EXPECT_GT(worst_px(true), 1);
    EXPECT_LT(worst_px(true), camera->focal_px() * 10 / 1000);
}

TEST(Audit, OfMeshesWithThePatternsTrianglesIsThatOfThePatterns) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int world = 0; world < 8; ++world) {
        const auto terrain = test::random_terrain(random, 0, 1, test::depth_of_world(world));
        const int n = terrain.lattice().tile_cells_log2;
        const TilePatterns patterns(n);
        Audited a(terrain);
        for (int k = 0; k < 6; ++k) {
            const Camera camera = test::random_camera(random, terrain);
            SelectionSettings settings = test::with_tau(std::exp(test::uniform_real(random, -2, 5)));
            settings.half_curvature = test::random_half_curvature(random, terrain);
            settings.morph = false;
            const Selection& s = a.selector.select({&camera, 1}, settings, a.residency);
            const ErrorHistogram by_patterns = a.audit(camera, s.draws[0], settings.half_curvature);
            DrawList draws = s.draws[0];
            const std::size_t largest = patterns.range(0, 0).count;
            MeshPool pool(largest * (draws.size() + 1), largest);
            for (DrawItem& item : draws) {
                const PatternRange range = patterns.range(item.geomip, item.edge_mask);
                item.mesh = pool.put(std::span(patterns.indices()).subspan(range.first, range.count));
            }
            ErrorHistogram errors;
            ASSERT_TRUE(
                audit_frame(a.store, *a.reader, {camera, draws, a.arena, settings.half_curvature, &pool}, errors).ok());
            ASSERT_EQ(errors.count(), by_patterns.count());
            ASSERT_NEAR(errors.max(), by_patterns.max(), 1e-6 * (1 + by_patterns.max()));
            ASSERT_NEAR(errors.mean(), by_patterns.mean(), 1e-6 * (1 + by_patterns.mean()));
        }
    }
}

TEST(Audit, FailsAtAMeshWithAHole) {
    const test::SyntheticTerrain terrain({}, test::rough_heights(1, 100));
    Audited a(terrain);
    auto camera = look_at({terrain.lattice().x_m(32), terrain.lattice().y_m(32), 5000},
                          {terrain.lattice().x_m(32), terrain.lattice().y_m(30), 0}, 40, 800, 800);
    std::vector<std::uint32_t> indices = test::GridMesh(3).indices();
    indices.resize(indices.size() - 3);
    MeshPool pool(100, 100);
    DrawItem root;
    root.height_slot = terrain.index({0, 0, 0});
    root.mesh = pool.put(indices);
    ErrorHistogram errors;
    const auto audited = audit_frame(a.store, *a.reader, {*camera, {root}, a.arena, 0, &pool}, errors);
    ASSERT_FALSE(audited.ok());
    EXPECT_EQ(audited.error().code, ErrorCode::check_failed);
}

TEST(Audit, HandsOnTheErrorOfADamagedStore) {
    const test::TerrainShape shape;
    const test::SyntheticTerrain terrain(shape, test::rough_heights(1, 100));
    test::MemoryStore store(terrain);
    store.damage(TileKind::height, {3, 2, 2}, test::Damage::checksum);
    const CpuArena arena = test::arena_of(terrain);
    auto reader = store.open_reader();
    ASSERT_TRUE(reader.ok());
    auto camera = look_at({terrain.lattice().x_m(32), terrain.lattice().y_m(32), 5000},
                          {terrain.lattice().x_m(32), terrain.lattice().y_m(30), 0}, 40, 800, 800);
    ErrorHistogram errors;
    DrawItem root;
    root.height_slot = 0;
    EXPECT_FALSE(audit_frame(store, **reader, {*camera, {root}, arena}, errors).ok());
}

}  // namespace
}  // namespace scree
