// What selection promises in pixels, and how it keeps to its slots.
#include <gtest/gtest.h>

#include <set>

#include "tests/runtime/lod/selection_support.h"

namespace scree {
namespace {

std::int64_t roots_out_of_view(const test::SyntheticTerrain& terrain, const Selection& s) {
    std::int64_t out = 0;
    for (const TileId id : terrain.tiles())
        out += id.level == 0 &&
                       std::find(s.planned_heights.begin(), s.planned_heights.end(), id) == s.planned_heights.end()
                   ? 1
                   : 0;
    return out;
}

TEST(ErrorBound, WithEverythingResidentEveryLeafMeetsTheToleranceAtItsBox) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    std::int64_t coarse = 0, leaves = 0;
    for (int world = 0; world < 40; ++world) {
        const auto terrain = test::random_terrain(random, world % 2);
        test::FakeResidency residency(terrain);
        residency.add_all();
        Selector selector(terrain.dataset());
        for (int k = 0; k < 30; ++k) {
            const double tau = std::exp(test::uniform_real(random, -4, 6));
            const Camera camera = test::random_camera(random, terrain);
            const Selection& s = selector.select({&camera, 1}, test::with_tau(tau), residency);
            ASSERT_TRUE(s.complete);
            ASSERT_FALSE(s.budget_limited);
            double worst = 0;
            for (const DrawItem& item : s.draws[0]) {
                const double px = test::bound_px(terrain, camera, item);
                ASSERT_LE(px, tau * (1 + 1e-12));
                worst = std::max(worst, px);
                coarse += px > 0 ? 1 : 0;
                ++leaves;
            }
            ASSERT_LE(s.max_bound_px, tau * (1 + 1e-12));
            ASSERT_NEAR(s.max_bound_px, worst, 1e-9 * worst);
        }
    }
    EXPECT_GT(coarse, leaves / 20);
    EXPECT_GT(leaves, 10000);  // a cut of finest tiles alone would prove nothing
}

TEST(ErrorBound, StopsAtTheFirstStrideThatMeetsTheTolerance) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int k = 0; k < 40; ++k) {
        const auto terrain = test::random_terrain(random);
        test::FakeResidency residency(terrain);
        residency.add_all();
        Selector selector(terrain.dataset());
        const Camera camera = test::random_camera(random, terrain);
        const double tau = std::exp(test::uniform_real(random, -2, 5));
        const Selection& s = selector.select({&camera, 1}, test::with_tau(tau), residency);
        int finest = 99;
        for (const DrawItem& item : s.draws[0])
            finest = std::min(finest, terrain.lattice().deepest_level - item.tile.level + item.geomip);
        const int coarsest = terrain.lattice().deepest_level + terrain.lattice().tile_cells_log2 - 1;
        if (finest >= coarsest) continue;
        // One at least of the densest leaves failed at the doubled stride, or a page above it failed at either stride
        // (then its children took the stride over), or an edge of it would fail thinned.
        bool needed = false;
        for (const DrawItem& item : s.draws[0]) {
            if (terrain.lattice().deepest_level - item.tile.level + item.geomip != finest) continue;
            for (int level = item.tile.level; level >= 0; --level)
                for (int exponent = finest; exponent <= finest + 1; ++exponent) {
                    DrawItem page;
                    page.tile = ancestor_at(item.tile, level);
                    page.geomip = exponent - (terrain.lattice().deepest_level - level);
                    page.edge_mask = 15;
                    if (page.geomip < 0 || page.geomip >= terrain.lattice().tile_cells_log2) continue;
                    if (level == item.tile.level && exponent == finest && finest > 0) continue;
                    needed |= test::bound_px(terrain, camera, page) > tau;
                }
        }
        EXPECT_TRUE(needed) << "stride 2^" << finest << " at tau " << tau;
    }
}

TEST(ErrorBound, FewerSlotsGiveACoarserCutThatSaysSoAndNeverPlansMoreThanTheSlots) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    int limited = 0;
    for (int world = 0; world < 50; ++world) {
        const auto terrain = test::random_terrain(random, world % 3);
        const std::int64_t roots = terrain.lattice().root_rows * terrain.lattice().root_columns;
        Selector selector(terrain.dataset());
        for (int k = 0; k < 30; ++k) {
            test::FakeResidency residency(terrain);
            residency.add_random(random, k % 2 == 0 ? 100 : test::uniform(random, 0, 100));
            SelectionSettings settings = test::with_tau(std::exp(test::uniform_real(random, -4, 3)));
            settings.height_slots = roots + test::uniform(random, 0, 40);
            const Camera camera = test::random_camera(random, terrain);
            const Selection& s = selector.select({&camera, 1}, settings, residency);
            const auto planned = static_cast<std::int64_t>(s.planned_heights.size());
            ASSERT_LE(planned + roots_out_of_view(terrain, s), settings.height_slots);
            if (k % 2 != 0) continue;
            ASSERT_TRUE(s.complete);
            if (s.max_bound_px > settings.tau_px * (1 + 1e-12)) {
                ASSERT_TRUE(s.budget_limited);
            }
            if (s.budget_limited) {
                ASSERT_GT(planned + roots_out_of_view(terrain, s) + 4, settings.height_slots);
                ++limited;
            }
            double worst = 0;
            for (const DrawItem& item : s.draws[0]) worst = std::max(worst, test::bound_px(terrain, camera, item));
            ASSERT_NEAR(s.max_bound_px, worst, 1e-9 * worst);  // coarser, and stated
        }
    }
    EXPECT_GT(limited, 20);
}

TEST(ErrorBound, ASplitThatCannotBeMadeCostsNoSlots) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int world = 0; world < 30; ++world) {
        const auto terrain = test::random_terrain(random);
        test::FakeResidency residency(terrain);
        residency.add_all();
        for (const TileId id : terrain.tiles())
            if (id.level > 1 && test::uniform(random, 0, 19) == 0) residency.make_unavailable(id);
        Selector selector(terrain.dataset());
        for (int k = 0; k < 10; ++k) {
            const Camera camera = test::random_camera(random, terrain);
            SelectionSettings settings = test::with_tau(0);
            const Selection plenty = selector.select({&camera, 1}, settings, residency);
            settings.height_slots =
                static_cast<std::int64_t>(plenty.planned_heights.size()) + roots_out_of_view(terrain, plenty);
            ASSERT_TRUE(test::same_selection(plenty, selector.select({&camera, 1}, settings, residency)));
        }
    }
}

TEST(ErrorBound, MoreSlotsNeverDrawFewerTiles) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    const auto terrain = test::random_terrain(random);
    test::FakeResidency residency(terrain);
    residency.add_all();
    Selector selector(terrain.dataset());
    for (int k = 0; k < 20; ++k) {
        const Camera camera = test::random_camera(random, terrain);
        std::int64_t before = 0;
        for (int slots = 8; slots < 400; slots += 7) {
            SelectionSettings settings = test::with_tau(0.1);
            settings.height_slots = slots;
            const auto planned =
                static_cast<std::int64_t>(selector.select({&camera, 1}, settings, residency).planned_heights.size());
            ASSERT_GE(planned, before);
            before = planned;
        }
    }
}

TEST(Requests, AreSortedMissingExistingPlannedAndOnce) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    std::int64_t heights = 0, textures = 0;
    for (int world = 0; world < 60; ++world) {
        const auto terrain = test::random_terrain(random, world % 2 == 0 ? test::kDeepTextures : 3);
        const std::int64_t roots = terrain.lattice().root_rows * terrain.lattice().root_columns;
        Selector selector(terrain.dataset());
        for (int k = 0; k < 30; ++k) {
            test::FakeResidency residency(terrain);
            residency.add_random(random, test::uniform(random, 0, 90));
            SelectionSettings settings = test::with_tau(std::exp(test::uniform_real(random, -3, 3)));
            settings.height_slots = roots + test::uniform(random, 0, 60);
            settings.texture_slots = roots + test::uniform(random, 0, 60);
            const Camera camera = test::random_camera(random, terrain);
            const Selection& s = selector.select({&camera, 1}, settings, residency);
            ASSERT_EQ(s.complete, s.requests.empty());
            std::set<std::pair<TileKind, TileId>> seen;
            for (std::size_t r = 0; r < s.requests.size(); ++r) {
                const TileRequest& request = s.requests[r];
                ASSERT_TRUE(seen.insert({request.kind, request.id}).second);
                if (r > 0) {
                    ASSERT_GE(s.requests[r - 1].priority, request.priority);
                }
                const bool height = request.kind == TileKind::height;
                ASSERT_FALSE(height ? residency.holds(request.id) : residency.holds_texture(request.id));
                const auto& planned = height ? s.planned_heights : s.planned_textures;
                ASSERT_NE(std::find(planned.begin(), planned.end(), request.id), planned.end());
                ++(height ? heights : textures);
                ASSERT_TRUE(height ? terrain.tile(request.id) != nullptr : terrain.has_texture(request.id));
            }
            // Nothing that could not be kept: the whole plan fits, roots that are out of view included.
            ASSERT_LE(static_cast<std::int64_t>(s.planned_heights.size()) + roots_out_of_view(terrain, s),
                      settings.height_slots);
            const auto fine = std::count_if(s.planned_textures.begin(), s.planned_textures.end(),
                                            [](TileId id) { return id.level > 0; });
            ASSERT_LE(fine + roots, settings.texture_slots);
            // And it holds together: a planned tile's parent is planned.
            const std::set<TileId> planned(s.planned_heights.begin(), s.planned_heights.end());
            for (const TileId id : planned)
                if (id.level > 0) {
                    ASSERT_TRUE(planned.contains(parent_of(id)));
                }
            const std::set<TileId> textures_planned(s.planned_textures.begin(), s.planned_textures.end());
            for (const TileId id : textures_planned)
                if (id.level > 0) {
                    ASSERT_TRUE(textures_planned.contains(parent_of(id))) << "texture of level " << id.level;
                }
        }
    }
    EXPECT_GT(heights, 500);
    EXPECT_GT(textures, 500);
}

TEST(Requests, ATileThatCannotBeReadIsNotAskedForAndItsParentStandsIn) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    int stood_in = 0;
    for (int world = 0; world < 12; ++world) {
        const auto terrain = test::random_terrain(random);
        Selector selector(terrain.dataset());
        for (int k = 0; k < 20; ++k) {
            test::FakeResidency residency(terrain);
            residency.add_all();
            const auto count = static_cast<int>(terrain.tiles().size());
            const TileId lost = terrain.tiles()[static_cast<std::size_t>(test::uniform(random, 0, count - 1))];
            if (lost.level == 0) continue;
            residency.make_unavailable(lost);
            const Camera camera = test::random_camera(random, terrain);
            const Selection& s = selector.select({&camera, 1}, test::with_tau(0), residency);
            EXPECT_TRUE(s.complete);
            EXPECT_TRUE(s.requests.empty());
            if (!Frustum(camera).may_see(terrain.box_of(lost))) continue;
            int covering = 0;
            for (const DrawItem& item : s.draws[0])
                covering += item.tile.level < lost.level && ancestor_at(lost, item.tile.level) == item.tile ? 1 : 0;
            EXPECT_EQ(covering, 1);
            ++stood_in;
        }
    }
    EXPECT_GT(stood_in, 10);
}

}  // namespace
}  // namespace scree
