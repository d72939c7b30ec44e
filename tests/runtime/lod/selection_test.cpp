// Selection is a pure function of its arguments.
#include "runtime/lod/selection.h"

#include <gtest/gtest.h>

#include "tests/common/counted_new.h"
#include "tests/runtime/lod/selection_support.h"

namespace scree {
namespace {

SelectionSettings random_settings(test::Random& random, const test::SyntheticTerrain& terrain) {
    const std::int64_t roots = terrain.lattice().root_rows * terrain.lattice().root_columns;
    SelectionSettings settings = test::with_tau(std::exp(test::uniform_real(random, -4, 4)));
    settings.texture_tau_px = std::exp(test::uniform_real(random, -1, 3));
    settings.height_slots = roots + test::uniform(random, 0, 200);
    settings.texture_slots = roots + test::uniform(random, 0, 200);
    return settings;
}

TEST(Selection, IsTheSameTwiceAndAfterAnyOtherCallsBetween) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int world = 0; world < 30; ++world) {
        const auto terrain =
            test::random_terrain(random, world % 3 == 0 ? test::kDeepTextures : 3, 1, test::depth_of_world(world));
        Selector selector(terrain.dataset());
        for (int k = 0; k < 10; ++k) {
            test::FakeResidency residency(terrain);
            residency.add_random(random, test::uniform(random, 0, 110));
            const std::vector<Camera> views{test::random_camera(random, terrain), test::random_camera(random, terrain)};
            const SelectionSettings settings = random_settings(random, terrain);
            const Selection first = selector.select(views, settings, residency);
            ASSERT_TRUE(test::same_selection(first, selector.select(views, settings, residency)));
            for (int other = 0; other < 3; ++other) {
                test::FakeResidency another(terrain);
                another.add_random(random, 50);
                const Camera camera = test::random_camera(random, terrain);
                selector.select({&camera, 1}, random_settings(random, terrain), another);
            }
            ASSERT_TRUE(test::same_selection(first, selector.select(views, settings, residency)));
            ASSERT_TRUE(test::same_selection(first, Selector(terrain.dataset()).select(views, settings, residency)));
        }
    }
}

TEST(Selection, AllocatesNothingOnceItsBuffersHaveTheirSize) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int world = 0; world < 12; ++world) {
        const auto terrain =
            test::random_terrain(random, world % 3 == 0 ? test::kDeepTextures : 3, 1, test::depth_of_world(world));
        Selector selector(terrain.dataset());
        test::FakeResidency fake(terrain);
        fake.add_all();
        const Residency& residency = fake;
        const std::vector<Camera> views{test::random_camera(random, terrain), test::random_camera(random, terrain)};
        const SelectionSettings settings = random_settings(random, terrain);
        for (int k = 0; k < 2; ++k) selector.select(views, settings, residency);
        const std::int64_t before = test::allocations();
        for (int k = 0; k < 3; ++k) selector.select(views, settings, residency);
        EXPECT_EQ(test::allocations(), before);
    }
    EXPECT_GT(test::allocations(), 0);
}

TEST(Selection, OnceCompleteDoesNotDependOnWhatElseIsResident) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    int limited = 0;
    for (int world = 0; world < 50; ++world) {
        const auto terrain =
            test::random_terrain(random, world % 3 == 0 ? test::kDeepTextures : 3, 1, test::depth_of_world(world));
        Selector selector(terrain.dataset());
        for (int k = 0; k < 12; ++k) {
            const Camera camera = test::random_camera(random, terrain);
            const SelectionSettings settings = random_settings(random, terrain);
            // Full residency, and no more than what it plans.
            test::FakeResidency everything(terrain);
            everything.add_all();
            const Selection full = selector.select({&camera, 1}, settings, everything);
            ASSERT_TRUE(full.complete);
            limited += full.budget_limited ? 1 : 0;
            test::FakeResidency planned(terrain);
            planned.add_roots();
            for (const TileId id : test::planned_tiles(terrain, full, TileKind::height)) planned.add(id);
            for (const TileId id : test::planned_tiles(terrain, full, TileKind::texture)) planned.add_texture(id);
            for (const std::int32_t slot : full.standing_heights)
                planned.add(terrain.tiles()[static_cast<std::size_t>(slot)]);
            for (const std::int32_t slot : full.standing_textures)
                planned.add_texture(terrain.textures()[static_cast<std::size_t>(slot)]);
            ASSERT_TRUE(test::same_selection(full, selector.select({&camera, 1}, settings, planned)));
            test::FakeResidency more = planned;
            for (const TileId id : terrain.tiles())
                if (test::uniform(random, 0, 1) == 0) more.add(id);
            for (const TileId id : terrain.textures())
                if (test::uniform(random, 0, 1) == 0) more.add_texture(id);
            ASSERT_TRUE(test::same_selection(full, selector.select({&camera, 1}, settings, more)));
        }
    }
    EXPECT_GT(limited, 10);
}

/// Tiles drawn above or at an address that something is asked for.
std::int64_t drawn_over_missing(const Selection& s) {
    return std::count_if(s.draws[0].begin(), s.draws[0].end(), [&](const DrawItem& item) {
        return std::any_of(s.requests.begin(), s.requests.end(), [&](const TileRequest& r) {
            return r.id.level >= item.tile.level && ancestor_at(r.id, item.tile.level) == item.tile;
        });
    });
}

TEST(Selection, CountsTheTilesThatStandInForWhatIsMissing) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    int heights_alone = 0, textures_alone = 0;
    for (int world = 0; world < 40; ++world) {
        const auto terrain = test::random_terrain(random, 3, 1, test::depth_of_world(world));
        Selector selector(terrain.dataset());
        const Camera camera = test::random_camera(random, terrain);
        test::FakeResidency residency(terrain);
        residency.add_all();
        const Selection full = selector.select({&camera, 1}, test::kPlenty, residency);
        EXPECT_EQ(full.stand_ins, 0);
        // Heights that are missing: those drawn above them.
        test::FakeResidency low(terrain);
        low.add_roots();
        for (const TileId id : terrain.textures()) low.add_texture(id);
        for (const TileId id : terrain.tiles())
            if (id.level <= 1) low.add(id);
        const Selection coarse = selector.select({&camera, 1}, test::kPlenty, low);
        const bool only_heights = std::none_of(coarse.requests.begin(), coarse.requests.end(),
                                               [](const TileRequest& r) { return r.kind == TileKind::texture; });
        if (only_heights && !coarse.complete) {
            ++heights_alone;
            EXPECT_GT(coarse.stand_ins, 0);
            EXPECT_EQ(coarse.stand_ins, drawn_over_missing(coarse));
        }
        // Textures that are missing: all tiles that would be drawn with finer ones.
        test::FakeResidency blurred(terrain);
        for (const TileId id : terrain.tiles()) blurred.add(id);
        for (const TileId id : terrain.textures())
            if (id.level == 0) blurred.add_texture(id);
        const Selection coarse_textures = selector.select({&camera, 1}, test::kPlenty, blurred);
        std::int64_t finer = 0;
        for (const DrawItem& item : coarse_textures.draws[0])
            finer += std::any_of(full.draws[0].begin(), full.draws[0].end(), [&](const DrawItem& other) {
                return other.tile == item.tile && other.texture.scale > item.texture.scale;
            });
        if (finer > 0) ++textures_alone;
        EXPECT_GE(coarse_textures.stand_ins, finer);
        EXPECT_LE(coarse_textures.stand_ins, coarse_textures.nodes);
    }
    EXPECT_GT(heights_alone, 5);
    EXPECT_GT(textures_alone, 5);
}

TEST(Selection, FillingItsRequestsLeadsFromTheRootsToTheFullCutWithinTheSlots) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int world = 0; world < 50; ++world) {
        const auto terrain =
            test::random_terrain(random, world % 2 == 0 ? test::kDeepTextures : 2, 1, test::depth_of_world(world / 2));
        Selector selector(terrain.dataset());
        for (int k = 0; k < 6; ++k) {
            const Camera camera = test::random_camera(random, terrain);
            const SelectionSettings settings = random_settings(random, terrain);
            test::FakeResidency everything(terrain);
            everything.add_all();
            const Selection full = selector.select({&camera, 1}, settings, everything);
            test::FakeResidency residency(terrain);
            residency.add_roots();
            int rounds = 0;
            for (; rounds < 100; ++rounds) {
                const Selection s = selector.select({&camera, 1}, settings, residency);
                if (s.complete) break;
                // What is neither planned nor stands in is lost at once: the hardest pager there could be.
                test::FakeResidency kept(terrain);
                kept.add_roots();
                for (const TileId id : test::planned_tiles(terrain, s, TileKind::height))
                    if (residency.holds(id)) kept.add(id);
                for (const TileId id : test::planned_tiles(terrain, s, TileKind::texture))
                    if (residency.holds_texture(id)) kept.add_texture(id);
                for (const std::int32_t slot : s.standing_heights)
                    kept.add(terrain.tiles()[static_cast<std::size_t>(slot)]);
                for (const std::int32_t slot : s.standing_textures)
                    kept.add_texture(terrain.textures()[static_cast<std::size_t>(slot)]);
                residency = kept;
                for (const TileRequest& r : s.requests)
                    r.kind == TileKind::height ? residency.add(r.id) : residency.add_texture(r.id);
            }
            ASSERT_LT(rounds, 100);
            ASSERT_TRUE(test::same_selection(full, selector.select({&camera, 1}, settings, residency)));
        }
    }
}

TEST(Selection, StandInsAreNeverFinerThanTheFullCutWhenSlotsDoNotBind) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int world = 0; world < 40; ++world) {
        const auto terrain = test::random_terrain(random);
        Selector selector(terrain.dataset());
        for (int k = 0; k < 10; ++k) {
            test::FakeResidency everything(terrain), some(terrain);
            everything.add_all();
            some.add_random(random, 60);
            const Camera camera = test::random_camera(random, terrain);
            const SelectionSettings settings = test::with_tau(std::exp(test::uniform_real(random, -2, 3)));
            const Selection full = selector.select({&camera, 1}, settings, everything);
            const Selection& s = selector.select({&camera, 1}, settings, some);
            for (const DrawItem& item : s.draws[0])
                for (const DrawItem& wanted : full.draws[0]) {
                    const bool above =
                        wanted.tile.level < item.tile.level && ancestor_at(item.tile, wanted.tile.level) == wanted.tile;
                    ASSERT_FALSE(above) << "drawn finer than anybody asked for";
                    if (wanted.tile == item.tile) {
                        ASSERT_GE(item.geomip, wanted.geomip);
                    }
                }
        }
    }
}

TEST(Selection, DrawsEveryLeafWithTheNearestResidentTextureAboveItAtItsPlaceInIt) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    std::int64_t scaled = 0, own = 0;
    for (int world = 0; world < 40; ++world) {
        const auto terrain = test::random_terrain(random, 2);
        Selector selector(terrain.dataset());
        for (int k = 0; k < 12; ++k) {
            test::FakeResidency residency(terrain);
            residency.add_random(random, k % 3 == 0 ? 100 : 60);
            const Camera camera = test::random_camera(random, terrain);
            const Selection& s = selector.select({&camera, 1}, test::with_tau(1), residency);
            for (const DrawItem& item : s.draws[0]) {
                ASSERT_GE(item.texture.slot, 0);
                const TileId texture = terrain.textures()[static_cast<std::size_t>(item.texture.slot)];
                ASSERT_LE(texture.level, item.tile.level);
                ASSERT_EQ(ancestor_at(item.tile, texture.level), texture);
                // The corners of the tile, through scale and offset, where they lie in the texture's extent.
                const Lattice& l = terrain.lattice();
                const auto extent = static_cast<double>(l.tile_extent(texture.level));
                const LatticePoint inner = l.corner(item.tile), outer = l.corner(texture);
                ASSERT_EQ(static_cast<double>(item.texture.offset_u) * extent, static_cast<double>(inner.i - outer.i));
                ASSERT_EQ(static_cast<double>(item.texture.offset_v) * extent, static_cast<double>(inner.j - outer.j));
                ASSERT_EQ(static_cast<double>(item.texture.scale) * extent,
                          static_cast<double>(l.tile_extent(item.tile.level)));
                ++(texture.level < item.tile.level ? scaled : own);
            }
        }
    }
    EXPECT_GT(scaled, 100);
    EXPECT_GT(own, 100);
}

TEST(Selection, WithSlotsForRootTexturesAloneDrawsThemAndSaysThatSlotsBind) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    const auto terrain = test::random_terrain(random, 4);
    test::FakeResidency residency(terrain);
    residency.add_all();
    Selector selector(terrain.dataset());
    SelectionSettings settings = test::with_tau(1);
    settings.texture_slots = terrain.lattice().root_rows * terrain.lattice().root_columns;
    int limited = 0;
    for (int k = 0; k < 40; ++k) {
        const Camera camera = test::random_camera(random, terrain);
        const Selection& s = selector.select({&camera, 1}, settings, residency);
        EXPECT_TRUE(s.complete);
        for (const DrawItem& item : s.draws[0])
            EXPECT_EQ(item.texture.slot, terrain.texture_index(ancestor_at(item.tile, 0)));
        limited += s.budget_limited ? 1 : 0;
    }
    EXPECT_GT(limited, 0);
}

}  // namespace
}  // namespace scree
