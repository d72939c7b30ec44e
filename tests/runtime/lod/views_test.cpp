// Several views share one cut.
#include <gtest/gtest.h>

#include <map>

#include "common/mesh/tile_patterns.h"
#include "tests/runtime/lod/drawn_frame.h"
#include "tests/runtime/lod/selection_support.h"

namespace scree {
namespace {

TEST(Views, EachListIsWhatTheViewMaySeeOfOneCommonBalancedCut) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    std::int64_t shared = 0, only_one = 0;
    for (int world = 0; world < 40; ++world) {
        const auto terrain = test::random_terrain(random, world % 2, 1, test::depth_of_world(world / 2));
        Selector selector(terrain.dataset());
        for (int k = 0; k < 12; ++k) {
            test::FakeResidency residency(terrain);
            residency.add_random(random, k % 2 == 0 ? 100 : 70);
            std::vector<Camera> views;
            for (int v = 0; v <= 1 + k % 3; ++v) views.push_back(test::random_camera(random, terrain));
            const Selection& s =
                selector.select(views, test::with_tau(std::exp(test::uniform_real(random, -3, 4))), residency);
            ASSERT_EQ(s.draws.size(), views.size());
            std::map<TileId, DrawItem> common;
            std::map<TileId, std::size_t> seen_by;
            for (const DrawList& list : s.draws)
                for (const DrawItem& item : list) {
                    const auto [it, inserted] = common.try_emplace(item.tile, item);
                    ASSERT_EQ(test::fields(it->second), test::fields(item));
                    ++seen_by[item.tile];
                }
            std::int64_t triangles = 0;
            for (std::size_t v = 0; v < views.size(); ++v) {
                const Frustum frustum(views[v]);
                std::size_t expected = 0;
                for (const auto& [tile, item] : common) expected += frustum.may_see(terrain.box_of(tile)) ? 1 : 0;
                ASSERT_EQ(s.draws[v].size(), expected);
                for (const DrawItem& item : s.draws[v]) {
                    ASSERT_TRUE(frustum.may_see(terrain.box_of(item.tile)));
                    triangles += pattern_triangles(terrain.lattice().tile_cells_log2, item.geomip, item.edge_mask);
                }
            }
            EXPECT_EQ(s.triangles, triangles);
            EXPECT_EQ(s.nodes, static_cast<std::int64_t>(common.size()));
            DrawList all;
            for (const auto& [tile, item] : common) all.push_back(item);
            const test::DrawnFrame frame(terrain, all);
            ASSERT_EQ(frame.unbalanced(), "");
            ASSERT_EQ(frame.cells_drawn_twice(), 0);
            for (const Camera& view : views) ASSERT_EQ(frame.visible_cells_missed(view), 0);
            for (const auto& [tile, count] : seen_by) ++(count > 1 ? shared : only_one);
        }
    }
    EXPECT_GT(shared, 100);
    EXPECT_GT(only_one, 100);
}

TEST(Views, EachViewMeetsTheTolerance) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int world = 0; world < 40; ++world) {
        const auto terrain = test::random_terrain(random);
        test::FakeResidency residency(terrain);
        residency.add_all();
        Selector selector(terrain.dataset());
        for (int k = 0; k < 12; ++k) {
            const std::vector<Camera> views{test::random_camera(random, terrain), test::random_camera(random, terrain)};
            const double tau = std::exp(test::uniform_real(random, -3, 4));
            const Selection& s = selector.select(views, test::with_tau(tau), residency);
            for (std::size_t v = 0; v < views.size(); ++v)
                for (const DrawItem& item : s.draws[v])
                    ASSERT_LE(test::bound_px(terrain, views[v], item), tau * (1 + 1e-12));
        }
    }
}

TEST(Views, ASecondIdenticalViewChangesNothing) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int world = 0; world < 40; ++world) {
        const auto terrain = test::random_terrain(random, 2);
        Selector selector(terrain.dataset());
        for (int k = 0; k < 12; ++k) {
            test::FakeResidency residency(terrain);
            residency.add_random(random, 80);
            const Camera camera = test::random_camera(random, terrain);
            SelectionSettings settings = test::with_tau(0.5);
            settings.height_slots = 64 + test::uniform(random, 0, 100);
            const Selection one = selector.select({&camera, 1}, settings, residency);
            const std::vector<Camera> twice{camera, camera};
            Selection two = selector.select(twice, settings, residency);
            ASSERT_TRUE(test::same_draws(two.draws[0], two.draws[1]));
            ASSERT_EQ(two.triangles, 2 * one.triangles);
            two.draws.pop_back();
            if (!two.parts.empty()) two.parts.pop_back();
            two.triangles = one.triangles;
            ASSERT_TRUE(test::same_selection(one, two));
        }
    }
}

TEST(Views, WithoutAnyNothingIsDrawnOrAskedFor) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    const auto terrain = test::random_terrain(random);
    test::FakeResidency residency(terrain);
    residency.add_roots();
    Selector selector(terrain.dataset());
    const Camera camera = test::random_camera(random, terrain);
    selector.select({&camera, 1}, test::with_tau(0), residency);
    const Selection& s = selector.select({}, test::with_tau(0), residency);
    EXPECT_TRUE(s.draws.empty());
    EXPECT_TRUE(s.requests.empty());
    EXPECT_TRUE(s.complete);
    EXPECT_EQ(s.triangles, 0);
}

}  // namespace
}  // namespace scree
