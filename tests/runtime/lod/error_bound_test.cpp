// What selection promises in pixels, and how it keeps to its slots.
#include <gtest/gtest.h>

#include <set>

#include "tests/runtime/lod/selection_support.h"

namespace scree {
namespace {

/// Height slots that a plan takes: roots are pinned whether they are in view or not.
std::int64_t slots_taken(const test::SyntheticTerrain& terrain, const Selection& s) {
    std::set<TileId> tiles;
    for (const TileId id : test::planned_tiles(terrain, s, TileKind::height)) tiles.insert(id);
    for (const TileId id : terrain.tiles())
        if (id.level == 0) tiles.insert(id);
    return static_cast<std::int64_t>(tiles.size());
}

std::int64_t texture_slots_taken(const test::SyntheticTerrain& terrain, const Selection& s) {
    const auto ids = test::planned_tiles(terrain, s, TileKind::texture);
    return terrain.lattice().root_rows * terrain.lattice().root_columns +
           std::count_if(ids.begin(), ids.end(), [](TileId id) { return id.level > 0; });
}

TEST(ErrorBound, WithEverythingResidentEveryLeafMeetsTheToleranceAtItsBox) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    std::int64_t coarse = 0, leaves = 0;
    for (int world = 0; world < 40; ++world) {
        const auto terrain = test::random_terrain(random, world % 2, 1, test::depth_of_world(world / 2));
        test::FakeResidency residency(terrain);
        residency.add_all();
        Selector selector(terrain.dataset());
        for (int k = 0; k < 30; ++k) {
            const double tau = std::exp(test::uniform_real(random, -4, 6));
            const Camera camera = test::random_camera(random, terrain);
            SelectionSettings settings = test::with_tau(tau);
            if (k % 3 == 0) settings.half_curvature = test::random_half_curvature(random, terrain);
            settings.morph = k % 4 != 3;
            const Selection& s = selector.select({&camera, 1}, settings, residency);
            ASSERT_TRUE(s.complete);
            ASSERT_FALSE(s.budget_limited);
            double worst = 0, held = 0;
            for (const DrawItem& item : s.draws[0]) {
                const double px = test::bound_px(terrain, camera, item, settings.half_curvature);
                // Beside a coarser leaf a leaf's edge stays thinned, whatever that costs: it is stated.
                if (item.geomip == 0 && item.edge_mask != 0 && terrain.is_leaf(item.tile) &&
                    terrain.beside_coarser_leaf(item.tile))
                    held = std::max(held, px);
                else
                    ASSERT_LE(px, tau * (1 + 1e-12));
                ASSERT_NEAR(item.bound_px, px, 1e-6 * px);
                worst = std::max(worst, px);
                coarse += px > 0 ? 1 : 0;
                ++leaves;
            }
            ASSERT_LE(s.max_bound_px, std::max(tau, held) * (1 + 1e-12));
            ASSERT_NEAR(s.max_bound_px, worst, 1e-9 * worst);
        }
    }
    EXPECT_GT(coarse, leaves / 20);
    EXPECT_GT(leaves, 10000);  // a cut of finest tiles alone would prove nothing
}

// Tolerances are raised by whole steps of an eighth of an octave: textures first, then geometry.
TEST(ErrorBound, WhereSlotsBindTheCutIsTheUnlimitedOneAtTheLeastToleranceThatFits) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    constexpr double kStep = 1.0905077326652577;  // 2^(1/8)
    const double coarsest = std::exp2(50);
    int limited = 0, by_heights = 0, by_textures = 0;
    for (int world = 0; world < 40; ++world) {
        const auto terrain = test::random_terrain(random, world % 4 == 3 ? test::kDeepTextures : world % 4, 1,
                                                  test::depth_of_world(world / 4));
        const std::int64_t roots = terrain.lattice().root_rows * terrain.lattice().root_columns;
        Selector selector(terrain.dataset()), unlimited(terrain.dataset());
        for (int k = 0; k < 20; ++k) {
            test::FakeResidency residency(terrain);
            residency.add_random(random, k % 2 == 0 ? 100 : test::uniform(random, 0, 100));
            SelectionSettings settings = test::with_tau(k % 5 == 0 ? 0 : std::exp(test::uniform_real(random, -4, 3)));
            settings.texture_tau_px = std::exp(test::uniform_real(random, -1, 3));
            if (k % 3 != 1) settings.height_slots = roots + test::uniform(random, 0, 60);
            if (k % 3 != 0) settings.texture_slots = roots + test::uniform(random, 0, 60);
            const Camera camera = test::random_camera(random, terrain);
            const Selection s = selector.select({&camera, 1}, settings, residency);
            const auto at = [&](double tau, double texture_tau) {
                SelectionSettings free = test::with_tau(tau);
                free.texture_tau_px = texture_tau;
                return unlimited.select({&camera, 1}, free, residency);
            };
            // One in 32, but no root's, is left for the proof that nothing finer fits, unless all there is fits.
            const auto planned_with = [&](std::int64_t slots, std::size_t tiles) {
                if (slots >= static_cast<std::int64_t>(tiles)) return slots;
                return std::max(slots - slots / 32, std::min(slots, roots));
            };
            const auto fits = [&](const Selection& free) {
                return slots_taken(terrain, free) <= planned_with(settings.height_slots, terrain.tiles().size()) &&
                       texture_slots_taken(terrain, free) <=
                           planned_with(settings.texture_slots, terrain.textures().size());
            };
            ASSERT_TRUE(fits(s));
            ASSERT_EQ(s.budget_limited, !fits(at(settings.tau_px, settings.texture_tau_px)));
            Selection free = at(s.tau_effective_px, s.texture_tau_effective_px);
            ASSERT_FALSE(free.budget_limited);
            free.budget_limited = s.budget_limited;
            ASSERT_TRUE(test::same_selection(s, free));
            if (!s.budget_limited) {
                ASSERT_EQ(s.tau_effective_px, settings.tau_px);
                ASSERT_EQ(s.texture_tau_effective_px, settings.texture_tau_px);
                continue;
            }
            ++limited;
            const double least = std::max(settings.tau_px, 1.0 / 1024);
            const double steps = 8 * std::log2(s.tau_effective_px / least);
            if (s.tau_effective_px > settings.tau_px) {
                ASSERT_NEAR(steps, std::round(steps), 1e-6);
                const double finer = std::round(steps) == 0 ? settings.tau_px : s.tau_effective_px / kStep;
                ASSERT_FALSE(fits(at(finer, s.texture_tau_effective_px))) << "heights are needlessly coarse";
                ++by_heights;
            }
            if (s.texture_tau_effective_px > settings.texture_tau_px) {
                ASSERT_FALSE(fits(at(least * coarsest, s.texture_tau_effective_px / kStep)))
                    << "textures are needlessly coarse";
                ++by_textures;
            }
        }
    }
    EXPECT_GT(limited, 100);
    EXPECT_GT(by_heights, 50);
    EXPECT_GT(by_textures, 50);
}

TEST(ErrorBound, WithSlotsForTheRootsAloneTheRootsAreDrawnAndTheirBoundStated) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    int limited = 0;
    for (int world = 0; world < 20; ++world) {
        const auto terrain = test::random_terrain(random, world % 3, 1, test::depth_of_world(world));
        const std::int64_t roots = terrain.lattice().root_rows * terrain.lattice().root_columns;
        test::FakeResidency residency(terrain);
        residency.add_all();
        Selector selector(terrain.dataset());
        for (int k = 0; k < 10; ++k) {
            const Camera camera = test::random_camera(random, terrain);
            SelectionSettings settings = test::with_tau(k % 2 == 0 ? 0 : 1);
            settings.height_slots = settings.texture_slots = roots;
            const Selection& s = selector.select({&camera, 1}, settings, residency);
            ASSERT_TRUE(s.complete);
            double worst = 0;
            for (const DrawItem& item : s.draws[0]) {
                ASSERT_EQ(item.tile.level, 0);
                worst = std::max(worst, test::bound_px(terrain, camera, item));
            }
            ASSERT_NEAR(s.max_bound_px, worst, 1e-9 * worst);
            limited += s.budget_limited ? 1 : 0;
        }
    }
    EXPECT_GT(limited, 50);
}

TEST(ErrorBound, ASplitThatCannotBeMadeCostsNoSlots) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int world = 0; world < 30; ++world) {
        const auto terrain = test::random_terrain(random, 0, 1, test::depth_of_world(world));
        test::FakeResidency residency(terrain);
        residency.add_all();
        for (const TileId id : terrain.tiles())
            if (id.level > 1 && test::uniform(random, 0, 19) == 0) residency.make_unavailable(id);
        Selector selector(terrain.dataset());
        for (int k = 0; k < 10; ++k) {
            const Camera camera = test::random_camera(random, terrain);
            SelectionSettings settings = test::with_tau(0);
            const Selection plenty = selector.select({&camera, 1}, settings, residency);
            const std::int64_t taken = slots_taken(terrain, plenty);
            settings.height_slots = taken + taken / 31;  // with what is reserved
            ASSERT_TRUE(test::same_selection(plenty, selector.select({&camera, 1}, settings, residency)));
        }
    }
}

TEST(ErrorBound, AStoreWhoseEveryTileHasASlotIsNeverLimited) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    int whole = 0;
    for (int world = 0; world < 30; ++world) {
        const auto terrain = test::random_terrain(random, 0, 1, test::depth_of_world(world));
        test::FakeResidency residency(terrain);
        residency.add_all();
        Selector selector(terrain.dataset());
        SelectionSettings settings = test::with_tau(0);
        settings.height_slots = static_cast<std::int64_t>(terrain.tiles().size());
        settings.texture_slots = std::max<std::int64_t>(static_cast<std::int64_t>(terrain.textures().size()),
                                                        terrain.lattice().root_rows * terrain.lattice().root_columns);
        for (const Camera& camera : test::views_all_round(test::random_camera(random, terrain).eye)) {
            const Selection s = selector.select({&camera, 1}, settings, residency);
            ASSERT_FALSE(s.budget_limited);
            ASSERT_EQ(s.tau_effective_px, 0);
        }
        const auto all_round = test::views_all_round(test::random_camera(random, terrain).eye);
        const Selection s = selector.select(all_round, settings, residency);
        ASSERT_FALSE(s.budget_limited);
        whole += slots_taken(terrain, s) > settings.height_slots - settings.height_slots / 32 ? 1 : 0;
    }
    EXPECT_GT(whole, 5) << "no view takes what used to be reserved";
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
        const auto terrain =
            test::random_terrain(random, world % 2 == 0 ? test::kDeepTextures : 3, 1, test::depth_of_world(world / 2));
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
                ASSERT_FALSE(residency.reaches(request.kind, request.id));
                ++(height ? heights : textures);
                ASSERT_TRUE(height ? terrain.tile(request.id) != nullptr : terrain.has_texture(request.id));
            }
            // Nothing that could not be kept: the whole plan fits, roots that are out of view included.
            ASSERT_LE(slots_taken(terrain, s), settings.height_slots);
            ASSERT_LE(texture_slots_taken(terrain, s), settings.texture_slots);
            // And it holds together: a planned tile's parent is planned, and listed before it.
            for (const TileKind kind : {TileKind::height, TileKind::texture}) {
                const auto tiles = test::planned_tiles(terrain, s, kind);
                const std::set<TileId> planned(tiles.begin(), tiles.end());
                for (const TileId id : planned)
                    if (id.level > 0) {
                        ASSERT_TRUE(planned.contains(parent_of(id))) << "tile of level " << id.level;
                    }
                std::set<TileId> before;
                const bool height = kind == TileKind::height;
                for (const std::int32_t slot : height ? s.planned_heights : s.planned_textures) {
                    ASSERT_GE(slot, 0);
                    const TileId id = (height ? terrain.tiles() : terrain.textures())[static_cast<std::size_t>(slot)];
                    ASSERT_TRUE(height ? residency.holds(id) : residency.holds_texture(id));
                    if (id.level > 0) {
                        ASSERT_TRUE(before.contains(parent_of(id)));
                    }
                    ASSERT_TRUE(before.insert(id).second);
                }
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
        const auto terrain = test::random_terrain(random, 0, 1, test::depth_of_world(world));
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
