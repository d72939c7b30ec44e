// Textures deeper than the heights are drawn on parts of a page (docs/decisions/0004-deep-textures.md).
#include <gtest/gtest.h>

#include <map>
#include <set>

#include "common/mesh/tile_patterns.h"
#include "tests/runtime/lod/selection_support.h"

namespace scree {
namespace {

// North-west cell and side of what an item draws.
struct Square {
    std::int64_t i, j, side;
};

Square square_of(const Lattice& l, const DrawItem& item) {
    const LatticePoint corner = l.corner(item.tile);
    const std::int64_t side = l.tile_extent(item.tile.level) >> item.part.level;
    return {corner.i + item.part.x * side, corner.j + item.part.y * side, side};
}

struct DeepWorld {
    DeepWorld(test::Random& random, int world)
        : terrain(test::random_terrain(random, test::kDeepTextures, 1, test::depth_of_world(world))),
          selector(terrain.dataset()) {}
    Camera near_camera(test::Random& random) const {
        const Lattice& l = terrain.lattice();
        const auto i = test::uniform(random, 0, static_cast<int>(l.cells_x)),
                   j = test::uniform(random, 0, static_cast<int>(l.cells_y));
        const glm::dvec3 ground{l.x_m(i), l.y_m(j), terrain.height_m(i, j)};
        auto camera =
            look_at(ground + glm::dvec3(test::uniform(random, -40, 40), -60, 30 + test::uniform(random, 0, 500)),
                    ground, 50, 800, 600);
        EXPECT_TRUE(camera.ok());
        return *camera;
    }
    test::SyntheticTerrain terrain;
    Selector selector;
};

TEST(DeepTextures, PartsDrawEveryPresentCellOfTheirTileOnceWithItsMesh) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    std::int64_t parts = 0;
    for (int world = 0; world < 12; ++world) {
        DeepWorld w(random, world);
        const Lattice& l = w.terrain.lattice();
        const TilePatterns patterns(l.tile_cells_log2);
        for (int k = 0; k < 10; ++k) {
            test::FakeResidency residency(w.terrain);
            residency.add_random(random, k % 2 == 0 ? 100 : 70);
            const Camera camera = w.near_camera(random);
            const Selection& s = w.selector.select({&camera, 1}, test::with_tau(2), residency);
            std::map<TileId, const DrawItem*> whole;
            for (const DrawItem& item : s.draws[0]) {
                ASSERT_EQ(item.part.level, 0);
                whole[item.tile] = &item;
            }
            std::set<std::pair<std::int64_t, std::int64_t>> cells;
            for (const DrawItem& item : s.to_render(0)) {
                const auto tile = whole.find(item.tile);
                ASSERT_NE(tile, whole.end());
                const DrawItem& page = *tile->second;
                ASSERT_EQ(std::tuple(item.height_slot, item.geomip, item.edge_mask, item.morph, item.edge_morph),
                          std::tuple(page.height_slot, page.geomip, page.edge_mask, page.morph, page.edge_morph));
                ASSERT_LE(item.part.level, patterns.finest_part_level(item.geomip));
                const Square q = square_of(l, item);
                for (std::int64_t j = q.j; j < q.j + q.side; ++j)
                    for (std::int64_t i = q.i; i < q.i + q.side; ++i) ASSERT_TRUE(cells.insert({i, j}).second);
                parts += item.part.level > 0 ? 1 : 0;
            }
            for (const auto& [tile, item] : whole) {
                const LatticePoint c = l.corner(tile);
                for (std::int64_t j = c.j; j < c.j + l.tile_extent(tile.level); ++j)
                    for (std::int64_t i = c.i; i < c.i + l.tile_extent(tile.level); ++i)
                        ASSERT_TRUE(cells.contains({i, j}) || !w.terrain.present(i, j));
            }
        }
    }
    EXPECT_GT(parts, 1000);
}

TEST(DeepTextures, EachPartLiesWhereItsScaleAndOffsetSayInItsTexture) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int world = 0; world < 10; ++world) {
        DeepWorld w(random, world);
        const Lattice& l = w.terrain.lattice();
        for (int k = 0; k < 10; ++k) {
            test::FakeResidency residency(w.terrain);
            residency.add_random(random, k % 2 == 0 ? 100 : 70);
            const Camera camera = w.near_camera(random);
            const Selection& s = w.selector.select({&camera, 1}, test::with_tau(2), residency);
            for (const DrawItem& item : s.to_render(0)) {
                ASSERT_GE(item.texture.slot, 0);
                const TileId texture = w.terrain.textures()[static_cast<std::size_t>(item.texture.slot)];
                const double extent =
                    std::ldexp(static_cast<double>(l.tile_extent(l.deepest_level)), l.deepest_level - texture.level);
                const Square q = square_of(l, item);
                const auto page = static_cast<double>(l.tile_extent(item.tile.level));
                const LatticePoint corner = l.corner(item.tile);
                for (const std::int64_t end : {std::int64_t{0}, q.side}) {
                    const double u =
                        item.texture.offset_u + item.texture.scale * static_cast<double>(q.i + end - corner.i) / page;
                    const double v =
                        item.texture.offset_v + item.texture.scale * static_cast<double>(q.j + end - corner.j) / page;
                    ASSERT_EQ(u * extent, static_cast<double>(q.i + end) - static_cast<double>(texture.x) * extent);
                    ASSERT_EQ(v * extent, static_cast<double>(q.j + end) - static_cast<double>(texture.y) * extent);
                    ASSERT_TRUE(u >= 0 && u <= 1 && v >= 0 && v <= 1) << "outside its texture";
                }
            }
        }
    }
}

TEST(DeepTextures, WithEverythingResidentATexelCoversNoMorePixelsThanAllowed) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    std::int64_t checked = 0;
    for (int world = 0; world < 10; ++world) {
        DeepWorld w(random, world);
        const Lattice& l = w.terrain.lattice();
        const Dataset& d = w.terrain.dataset();
        test::FakeResidency residency(w.terrain);
        residency.add_all();
        for (int k = 0; k < 10; ++k) {
            const Camera camera = w.near_camera(random);
            SelectionSettings settings = test::with_tau(1000);
            settings.texture_tau_px = std::exp(test::uniform_real(random, 0, 4));
            const Selection& s = w.selector.select({&camera, 1}, settings, residency);
            for (const DrawItem& item : s.to_render(0)) {
                const int level = w.terrain.textures()[static_cast<std::size_t>(item.texture.slot)].level;
                const Square q = square_of(l, item);
                // One block of cells is the smallest part; a deeper texture cannot be drawn.
                if (level == d.texture_deepest_level || q.side == 2 * l.step(item.tile.level) ||
                    !w.terrain.is_leaf(item.tile))
                    continue;
                if (level != item.tile.level + item.part.level) continue;
                const TileId own = w.terrain.textures()[static_cast<std::size_t>(item.texture.slot)];
                for (int quadrant = 0; quadrant < 4; ++quadrant) {
                    if (!w.terrain.has_texture(child_of(own, quadrant))) continue;
                    Box box = w.terrain.box_of(item.tile);
                    const std::int64_t half = q.side / 2, i = q.i + quadrant % 2 * half, j = q.j + quadrant / 2 * half;
                    box.low.x = std::max(box.low.x, l.x_m(static_cast<double>(i)));
                    box.high.x = std::min(box.high.x, l.x_m(static_cast<double>(i + half)));
                    box.low.y = std::max(box.low.y, l.y_m(static_cast<double>(j + half)));
                    box.high.y = std::min(box.high.y, l.y_m(static_cast<double>(j)));
                    if (!Frustum(camera).may_see(box)) continue;
                    const double distance = std::max(distance_to_box(camera.eye, box), camera.near_m);
                    ASSERT_LE(d.texel_m(level) * camera.focal_px() / distance, settings.texture_tau_px * (1 + 1e-9))
                        << "texture level " << level << " on a part of level " << item.part.level << ", geomip "
                        << item.geomip;
                    ++checked;
                }
            }
        }
    }
    EXPECT_GT(checked, 500);
}

TEST(DeepTextures, APartReachesNoFurtherThanTheDataDoesSoThatNoPartIsMoreUrgentThanItsPage) {
    // The last column of pages holds one column of cells; the eye stands over the padding beyond it.
    test::TerrainShape shape;
    shape.tile_cells_log2 = 4;
    shape.cells_x = 33;
    shape.cells_y = 64;
    shape.texture_depth = test::kDeepTextures;
    const test::SyntheticTerrain terrain(shape, test::rough_heights(2, 100));
    const Lattice& l = terrain.lattice();
    test::FakeResidency residency(terrain);
    residency.add_all();
    Selector selector(terrain.dataset());
    auto camera = look_at({l.x_m(37), l.y_m(20), 45}, {l.x_m(20), l.y_m(20), 40}, 60, 800, 800);
    ASSERT_TRUE(camera.ok());
    for (int slots = 1; slots < 200; ++slots) {
        SelectionSettings settings = test::with_tau(1000);
        settings.texture_slots = slots;
        const Selection& s = selector.select({&*camera, 1}, settings, residency);
        const std::vector<TileId> ids = test::planned_tiles(terrain, s, TileKind::texture);
        const std::set<TileId> planned(ids.begin(), ids.end());
        for (const TileId id : planned)
            if (id.level > 0) {
                ASSERT_TRUE(planned.contains(parent_of(id)))
                    << "with " << slots << " slots, texture of level " << id.level;
            }
    }
}

// Fine imagery of one corner over coarse imagery of the rest, on flat ground: pages are split for it there alone, and
// no texture is asked for that is not stored.
TEST(DeepTextures, FineImageryOfOnePlaceSplitsNoPagesElsewhere) {
    test::TerrainShape shape;
    shape.tile_cells_log2 = 3;
    shape.cells_x = shape.cells_y = 128;
    shape.texture_depth = 4;
    const Lattice l = *make_lattice(0, 0, 1, 128, 128, 3);
    ASSERT_EQ(l.deepest_level, 4);
    shape.texture_depth_map = test::DepthMap::path_to({4, 15, 15});
    const test::SyntheticTerrain terrain(shape, [](std::int64_t, std::int64_t) { return 0; });
    ASSERT_EQ(terrain.textures().size(), 17u);
    Selector selector(terrain.dataset());
    for (const bool with_textures : {true, false}) {
        test::FakeResidency residency(terrain);
        for (const TileId id : terrain.tiles()) residency.add(id);
        residency.add_texture({0, 0, 0});
        if (with_textures) residency.add_all();
        const auto look_down = [&](double i, double j) -> const Selection& {
            const Lattice& at = terrain.lattice();
            auto camera = look_at({at.x_m(i), at.y_m(j), 60}, {at.x_m(i), at.y_m(j) + 0.1, 50}, 40, 800, 800);
            EXPECT_TRUE(camera.ok());
            SelectionSettings settings = test::with_tau(1);
            settings.texture_tau_px = 0.01;
            return selector.select({&*camera, 1}, settings, residency);
        };
        for (const DrawItem& item : look_down(20, 20).draws[0]) EXPECT_EQ(item.tile.level, 1);
        int finest = 0;
        const Selection& s = look_down(124, 124);
        for (const DrawItem& item : s.draws[0]) finest = std::max(finest, item.tile.level);
        EXPECT_EQ(finest, 4);
        for (const TileRequest& request : s.requests) EXPECT_TRUE(terrain.has_texture(request.id));
        EXPECT_EQ(s.complete, with_textures);
    }
}

}  // namespace
}  // namespace scree
