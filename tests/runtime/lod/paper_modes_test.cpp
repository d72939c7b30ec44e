// The papers' own choices as reference modes: de Boer's metric, Ke et al.'s culling. What they choose, and that what
// they give up is what is written of them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "common/mesh/drawn_surface.h"
#include "runtime/app/audit.h"
#include "tests/runtime/lod/drawn_frame.h"
#include "tests/runtime/lod/memory_store.h"
#include "tests/runtime/lod/selection_support.h"

namespace scree {
namespace {

SelectionSettings deboer(double tau_px) {
    SelectionSettings settings = test::with_tau(tau_px);
    settings.metric = ErrorMetric::deboer;
    return settings;
}

/// Greatest distance of the vertices of stride 2^(geomip - 1) from the surface of stride 2^geomip, metres.
double level_to_level_m(const test::SyntheticTerrain& terrain, TileId id, int geomip) {
    const int n = terrain.lattice().tile_cells_log2, m = 1 << n, stride = 1 << (geomip - 1);
    const auto& samples = terrain.tile(id)->samples;
    double greatest = 0;
    for (int j = 0; j <= m; j += stride)
        for (int i = 0; i <= m; i += stride)
            greatest = std::max(greatest, std::abs(samples[static_cast<std::size_t>(j * (m + 1) + i)] -
                                                   drawn_height(samples, n, {geomip, 0}, i, j, 1).quanta()));
    return greatest * terrain.dataset().height_quantum_m;
}

double allowed_m(const test::SyntheticTerrain& terrain, TileId id, const Camera& camera, double tau_px) {
    const Box box = terrain.box_of(id);
    const double distance = glm::distance(camera.eye, 0.5 * (box.low + box.high));
    return tau_px * std::max(distance, camera.near_m) / camera.focal_px();
}

test::TerrainShape blocks_of_33(std::int64_t cells) {
    test::TerrainShape shape;
    shape.tile_cells_log2 = 5;
    shape.cells_x = shape.cells_y = cells;
    shape.spacing_m = 30;
    return shape;
}

TEST(DeBoer, ALoneTileHasTheLastLevelWhoseDistanceToTheCentreIsPassed) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    std::array<int, 5> drawn_at{};
    for (int world = 0; world < 8; ++world) {
        const test::SyntheticTerrain terrain(blocks_of_33(32), test::rough_heights(random(), 1 << (2 + world)));
        test::FakeResidency residency(terrain);
        residency.add_all();
        residency.keep_corrections();
        Selector selector(terrain.dataset());
        for (int k = 0; k < 100; ++k) {
            const Camera camera = test::random_camera(random, terrain);
            const double tau_px = std::exp(test::uniform_real(random, -3, 6));
            const Selection& s = selector.select({&camera, 1}, deboer(tau_px), residency);
            if (s.draws[0].empty()) continue;
            ASSERT_EQ(s.draws[0].size(), 1u);
            const double allowed = allowed_m(terrain, {0, 0, 0}, camera, tau_px);
            int expected = 4;
            while (expected > 0 && level_to_level_m(terrain, {0, 0, 0}, expected) > allowed) --expected;
            ASSERT_EQ(s.draws[0][0].geomip, expected);
            ++drawn_at[static_cast<std::size_t>(expected)];
        }
    }
    for (const int count : drawn_at) EXPECT_GT(count, 5);
}

TEST(DeBoer, MorphsLinearlyBetweenTheDistancesOfTwoLevels) {
    SCREE_TRACE_SEED();
    const test::SyntheticTerrain terrain(blocks_of_33(32), test::rough_heights(test::seed(), 200));
    test::FakeResidency residency(terrain);
    residency.add_all();
    residency.keep_corrections();
    Selector selector(terrain.dataset());
    const Lattice& l = terrain.lattice();
    const double first = level_to_level_m(terrain, {0, 0, 0}, 1), second = level_to_level_m(terrain, {0, 0, 0}, 2);
    ASSERT_GT(second, first);
    for (int geomip = 3; geomip < 5; ++geomip) ASSERT_GT(level_to_level_m(terrain, {0, 0, 0}, geomip), second);
    auto camera = look_at({l.x_m(16), l.y_m(16) - 3000, 500}, {l.x_m(16), l.y_m(16), 0}, 40, 800, 800);
    ASSERT_TRUE(camera.ok());
    for (const double share : {0.125, 0.5, 0.875}) {
        const double tau_px = (first + share * (second - first)) / allowed_m(terrain, {0, 0, 0}, *camera, 1);
        const Selection& s = selector.select({&*camera, 1}, deboer(tau_px), residency);
        ASSERT_EQ(s.draws[0].size(), 1u);
        EXPECT_EQ(s.draws[0][0].geomip, 1);
        EXPECT_NEAR(s.draws[0][0].morph, share, 1e-4);
    }
}

TEST(DeBoer, APageSplitsByWhatItsChildrensCertifiedErrorsGrow) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    int split = 0, whole = 0;
    for (int world = 0; world < 8; ++world) {
        // Of a leaf's own samples nothing is missed: its error before the first stride counts edges alone.
        const bool leaves = world % 2 == 1;
        const test::SyntheticTerrain terrain(blocks_of_33(leaves ? 64 : 128),
                                             test::rough_heights(random(), 8 << world));
        ASSERT_EQ(terrain.lattice().deepest_level, leaves ? 1 : 2);
        test::FakeResidency residency(terrain);
        residency.add_all();
        residency.keep_corrections();
        Selector selector(terrain.dataset());
        double growth_n = 0;
        for (const HeightBounds& child : terrain.tile({0, 0, 0})->header.children)
            growth_n = std::max(growth_n, static_cast<double>(child.error_n[1] - (leaves ? 0.0f : child.error_n[0])));
        for (int k = 0; k < 200; ++k) {
            const Camera camera = test::random_camera(random, terrain);
            const double tau_px = std::exp(test::uniform_real(random, -3, 6));
            const Selection& s = selector.select({&camera, 1}, deboer(tau_px), residency);
            if (s.draws[0].empty()) continue;
            const double allowed = allowed_m(terrain, {0, 0, 0}, camera, tau_px);
            bool expected = growth_n * terrain.dataset().height_quantum_m > allowed;
            // A coarser stride of its own may be good enough by the paper's measure, though that one is not.
            for (int geomip = 1; geomip < 5; ++geomip)
                expected = expected && level_to_level_m(terrain, {0, 0, 0}, geomip) > allowed;
            ASSERT_EQ(s.draws[0][0].tile.level > 0, expected);
            ++(expected ? split : whole);
        }
    }
    EXPECT_GT(split, 30);
    EXPECT_GT(whole, 30);
}

TEST(DeBoer, WhatIsChosenDoesNotDependOnWhatElseIsInMemory) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int world = 0; world < 10; ++world) {
        const auto terrain = test::random_terrain(random, 0, 1, test::depth_of_world(world));
        Selector selector(terrain.dataset()), another(terrain.dataset());
        for (int k = 0; k < 10; ++k) {
            test::FakeResidency all(terrain), needed(terrain);
            all.add_all();
            needed.add_roots();
            all.keep_corrections();
            needed.keep_corrections();
            const Camera camera = test::random_camera(random, terrain);
            const SelectionSettings settings = deboer(std::exp(test::uniform_real(random, -2, 5)));
            for (int arrivals = 0; arrivals < 100; ++arrivals) {
                const Selection& s = selector.select({&camera, 1}, settings, needed);
                if (s.complete) break;
                for (const TileRequest& request : s.requests)
                    request.kind == TileKind::height ? needed.add(request.id) : needed.add_texture(request.id);
            }
            const Selection& settled = selector.select({&camera, 1}, settings, needed);
            ASSERT_TRUE(settled.complete);
            ASSERT_TRUE(test::same_picture(settled, another.select({&camera, 1}, settings, all)));
        }
    }
}

/// Worst errors of drawn frames by the finest data, over the tolerance.
struct Truth {
    double guaranteed = 0, by_centre_and_steps = 0;
    int frames = 0, over = 0;
};

TEST(DeBoer, PassesTheToleranceAndSaysSo) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    Truth truth;
    for (int world = 0; world < 6; ++world) {
        const test::SyntheticTerrain terrain(blocks_of_33(256), test::rough_heights(random(), 1 << (7 + world % 3)));
        test::MemoryStore store(terrain);
        test::FakeResidency residency(terrain);
        residency.add_all();
        residency.keep_corrections();
        const CpuArena arena = test::arena_of(terrain);
        Selector selector(terrain.dataset());
        auto reader = store.open_reader();
        ASSERT_TRUE(reader.ok());
        for (int k = 0; k < 12; ++k) {
            const Camera camera = test::random_camera(random, terrain);
            const double tau_px = k % 2 == 0 ? 1 : 4;
            for (const bool guaranteed : {true, false}) {
                SelectionSettings settings = guaranteed ? test::with_tau(tau_px) : deboer(tau_px);
                settings.morph = k % 4 != 3;
                const Selection& s = selector.select({&camera, 1}, settings, residency);
                ErrorHistogram errors;
                ASSERT_TRUE(audit_frame(store, **reader, {camera, s.draws[0], arena, 0}, errors).ok());
                ASSERT_LE(errors.max(), s.max_bound_px + 1e-3);  // positions are floats
                double& worst = guaranteed ? truth.guaranteed : truth.by_centre_and_steps;
                worst = std::max(worst, errors.max() / tau_px);
                if (guaranteed) continue;
                ++truth.frames;
                truth.over += errors.max() > tau_px ? 1 : 0;
            }
        }
    }
    RecordProperty("guaranteed_over_tau", std::to_string(truth.guaranteed));
    RecordProperty("deboer_over_tau", std::to_string(truth.by_centre_and_steps));
    RecordProperty("deboer_frames_over", truth.over);
    EXPECT_LE(truth.guaranteed, 1 + 1e-3);
    EXPECT_GT(truth.by_centre_and_steps, 1.5);
    EXPECT_GT(truth.over, truth.frames / 4);
}

bool corner_in_view(const test::SyntheticTerrain& terrain, const Camera& camera, TileId id, double half_curvature) {
    const Box box = terrain.box_of(id);
    const Frustum frustum(camera);
    for (const double x : {box.low.x, box.high.x})
        for (const double y : {box.low.y, box.high.y}) {
            const double dx = x - camera.eye.x, dy = y - camera.eye.y;
            const double z = (box.low.z + box.high.z) / 2 - (dx * dx + dy * dy) * half_curvature;
            if (frustum.contains({x, y, z})) return true;
        }
    return false;
}

TEST(CornerCulling, DrawsWhatTheBoxTestDrawsButTilesWithoutACornerInView) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    std::int64_t culled = 0, kept = 0;
    for (int world = 0; world < 20; ++world) {
        const auto terrain =
            test::random_terrain(random, world % 2 == 0 ? test::kDeepTextures : 2, 1, test::depth_of_world(world / 2));
        test::FakeResidency residency(terrain);
        residency.add_all();
        Selector by_box(terrain.dataset()), by_corners(terrain.dataset());
        for (int k = 0; k < 20; ++k) {
            const std::vector<Camera> cameras{test::random_camera(random, terrain),
                                              test::random_camera(random, terrain)};
            SelectionSettings settings = test::with_tau(std::exp(test::uniform_real(random, -2, 5)));
            if (k % 3 == 0) settings.half_curvature = test::random_half_curvature(random, terrain);
            const Selection& all = by_box.select(cameras, settings, residency);
            settings.culling = Culling::corners;
            const Selection& some = by_corners.select(cameras, settings, residency);
            std::int64_t lost = 0;
            for (std::size_t v = 0; v < cameras.size(); ++v) {
                DrawList expected;
                for (const DrawItem& item : all.draws[v])
                    if (corner_in_view(terrain, cameras[v], item.tile, settings.half_curvature))
                        expected.push_back(item);
                ASSERT_TRUE(test::same_draws(some.draws[v], expected));
                lost += static_cast<std::int64_t>(all.draws[v].size() - expected.size());
                kept += static_cast<std::int64_t>(expected.size());
                // Parts of a tile go with it.
                for (const DrawItem& part : some.to_render(v))
                    ASSERT_TRUE(corner_in_view(terrain, cameras[v], part.tile, settings.half_curvature));
            }
            ASSERT_EQ(some.culled, lost);
            ASSERT_EQ(some.nodes, static_cast<std::int64_t>(test::drawn_together(some).size()));
            ASSERT_EQ(all.culled, 0);
            ASSERT_LE(some.max_bound_px, all.max_bound_px);
            ASSERT_EQ(some.planned_heights, all.planned_heights);
            culled += lost;
        }
    }
    EXPECT_GT(culled, 100);
    EXPECT_GT(kept, 1000);
}

/// Of the tiles with ground in view, the share in percent that culling by corners leaves out.
double lost_percent(test::Random& random, double spacing_m) {
    test::TerrainShape shape = blocks_of_33(256);
    shape.spacing_m = spacing_m;
    const test::SyntheticTerrain terrain(shape, test::rough_heights(random(), 160));  // 40 m either way
    test::FakeResidency residency(terrain);
    residency.add_all();
    Selector selector(terrain.dataset());
    const Lattice& l = terrain.lattice();
    SelectionSettings settings = test::with_tau(0);  // every tile of the deepest level
    std::int64_t lost = 0, visible = 0;
    for (int k = 0; k < 200; ++k) {
        const double i = test::uniform_real(random, 64, 192), j = test::uniform_real(random, 64, 192);
        const double turn = test::uniform_real(random, 0, 6.28), eye_m = test::uniform_real(random, 400, 1000);
        const glm::dvec3 eye{l.x_m(i), l.y_m(j), eye_m};
        auto camera = look_at(eye, eye + glm::dvec3(std::cos(turn), std::sin(turn), -0.3), 40, 800, 800);
        EXPECT_TRUE(camera.ok());
        const Frustum frustum(*camera);
        const Selection& s = selector.select({&*camera, 1}, settings, residency);
        for (const DrawItem& item : s.draws[0]) {
            const LatticePoint c = l.corner(item.tile);
            bool seen = false;
            for (std::int64_t v = c.j; v <= c.j + 32 && !seen; ++v)
                for (std::int64_t u = c.i; u <= c.i + 32 && !seen; ++u)
                    seen = frustum.contains(
                        {l.x_m(static_cast<double>(u)), l.y_m(static_cast<double>(v)), terrain.height_m(u, v)});
            visible += seen ? 1 : 0;
            lost += seen && !corner_in_view(terrain, *camera, item.tile, 0) ? 1 : 0;
        }
    }
    EXPECT_GT(visible, 300);
    return 100.0 * static_cast<double>(lost) / static_cast<double>(visible);
}

TEST(CornerCulling, LosesMoreOfWhatIsInViewTheLargerTilesAre) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    std::vector<double> lost;
    for (const double spacing_m : {20.0, 100.0, 500.0}) {
        lost.push_back(lost_percent(random, spacing_m));
        RecordProperty("lost_percent_at_" + std::to_string(static_cast<int>(32 * spacing_m)) + "_m",
                       std::to_string(lost.back()));
        EXPECT_GT(lost.back(), 0.3);
    }
    EXPECT_GT(lost.back(), 1.3 * lost.front());
}

}  // namespace
}  // namespace scree
