// What is drawn moves continuously with the eye and with time: no vertex pops (docs/lod-and-paging.md, "Morphing").
#include <gtest/gtest.h>

#include <map>
#include <set>

#include "tests/runtime/lod/drawn_frame.h"
#include "tests/runtime/lod/probed_surface.h"
#include "tests/runtime/lod/selection_support.h"

namespace scree {
namespace {

/// Where two successive strides of a chain of pages have the same certified error, both are left at once, and any
/// height in which they differ pops: continuity needs errors that grow with the stride.
constexpr float kErrorGrowth = 1.25f;

std::vector<glm::dvec2> random_places(test::Random& random, const test::SyntheticTerrain& terrain, int count) {
    const Lattice& l = terrain.lattice();
    std::vector<glm::dvec2> places;
    for (int k = 0; k < count; ++k)
        places.push_back({test::uniform_real(random, 0, static_cast<double>(l.cells_x)),
                          test::uniform_real(random, 0, static_cast<double>(l.cells_y))});
    return places;
}

/// Greatest difference of two surfaces over all places, and where.
struct Jump {
    double height_m = 0;
    std::size_t place = 0;
};

Jump greatest_jump(const std::vector<double>& a, const std::vector<double>& b) {
    Jump jump;
    for (std::size_t k = 0; k < a.size(); ++k)
        if (std::abs(a[k] - b[k]) > jump.height_m) jump = {std::abs(a[k] - b[k]), k};
    return jump;
}

/// What stays of the greatest jump between parameters `from` and `to`, when the two come as near as `resolution`.
template <class Heights>
Jump pop_between(double from, double to, double resolution, double threshold_m, const Heights& heights) {
    std::vector<double> low = heights(from), high = heights(to);
    Jump jump = greatest_jump(low, high);
    while (to - from > resolution && jump.height_m > threshold_m) {
        const double middle = from + (to - from) / 2;
        std::vector<double> between = heights(middle);
        const Jump first = greatest_jump(low, between), second = greatest_jump(between, high);
        if (first.height_m > second.height_m) {
            to = middle;
            high = std::move(between);
            jump = first;
        } else {
            from = middle;
            low = std::move(between);
            jump = second;
        }
    }
    return jump.height_m > threshold_m ? jump : Jump{};
}

// A flight along a segment that sees all of the terrain all the time.
class Flight {
public:
    Flight(const test::SyntheticTerrain& terrain, const SelectionSettings& settings, glm::dvec3 from, glm::dvec3 to,
           std::vector<glm::dvec2> places)
        : terrain_(terrain),
          settings_(settings),
          from_(from),
          to_(to),
          places_(std::move(places)),
          arena_(test::arena_of(terrain)),
          surface_(terrain, arena_),
          residency_(terrain),
          selector_(terrain.dataset()) {
        residency_.add_all();
        // Of how many quanta a level is worth one step of its fixed point, and a little for the rest.
        threshold_m_ = 1e-3 + 2e-4 * (terrain.dataset().max_height_m - terrain.dataset().min_height_m);
    }
    double length_m() const { return glm::length(to_ - from_); }
    std::vector<double> heights(double metres) {
        const glm::dvec3 eye = from_ + (to_ - from_) * (metres / length_m());
        const Selection& s = selector_.select(test::views_all_round(eye), settings_, residency_);
        EXPECT_TRUE(s.complete);
        const DrawList draws = test::drawn_together(s);
        levels_.clear();
        for (const DrawItem& item : draws) {
            by_texture += item.tile.level > 0 && item.geomip >= 1 ? 1 : 0;
            levels_.insert(item.tile.level);
        }
        mixed += levels_.size() > 1 ? 1 : 0;
        return surface_.heights_m(draws, places_, eye, settings_.half_curvature);
    }
    /// Pops met in so many steps along the way; the drop of a curved world is taken off, as it moves anyway.
    int pops(int steps) {
        int found = 0;
        const double step = length_m() / steps;
        for (int k = 0; k < steps; ++k) {
            const Jump pop = pop_between(k * step, (k + 1) * step, 1e-7, threshold_m_,
                                         [&](double metres) { return heights(metres); });
            if (pop.height_m > 0) {
                ++found;
                worst_m = std::max(worst_m, pop.height_m);
                if (first_m < 0) first_m = k * step;
            }
        }
        return found;
    }
    std::int64_t by_texture = 0, mixed = 0;
    double worst_m = 0, first_m = -1;

private:
    const test::SyntheticTerrain& terrain_;
    SelectionSettings settings_;
    glm::dvec3 from_, to_;
    std::vector<glm::dvec2> places_;
    CpuArena arena_;
    test::ProbedSurface surface_;
    test::FakeResidency residency_;
    Selector selector_;
    std::set<int> levels_;
    double threshold_m_;
};

struct FlightKind {
    int texture_depth = 0;
    bool curved = false;
    bool morph = true;
    test::Depth depth = test::Depth::uniform;
};

struct FlightResult {
    int pops = 0, flights = 0;
    std::int64_t by_texture = 0, mixed = 0;
    double worst_m = 0;
};

FlightResult fly(test::Random& random, const FlightKind& kind, int worlds) {
    FlightResult result;
    for (int world = 0; world < worlds; ++world) {
        const auto terrain = test::random_terrain(random, kind.texture_depth, kErrorGrowth, kind.depth);
        const Lattice& l = terrain.lattice();
        const double top = terrain.dataset().max_height_m, extent_m = l.spacing_m * static_cast<double>(l.cells_x);
        for (int flight = 0; flight < 3; ++flight) {
            const auto point = [&] {
                return glm::dvec3(l.x_m(test::uniform_real(random, -0.2, 1.2) * static_cast<double>(l.cells_x)),
                                  l.y_m(test::uniform_real(random, -0.2, 1.2) * static_cast<double>(l.cells_y)),
                                  top + extent_m * std::exp(test::uniform_real(random, -5, 0.5)) - 30);
            };
            SelectionSettings settings = test::with_tau(std::exp(test::uniform_real(random, 0, 5)));
            settings.texture_tau_px = kind.texture_depth == 0 ? 1e9 : std::exp(test::uniform_real(random, -2, 2));
            settings.morph = kind.morph;
            if (kind.curved) settings.half_curvature = test::random_half_curvature(random, terrain);
            const glm::dvec3 from = point(), to = point();
            Flight f(terrain, settings, from, to, random_places(random, terrain, 80));
            const int pops = f.pops(60);
            result.pops += pops;
            if (std::getenv("SCREE_TRACE_POPS") != nullptr && pops > 0)
                std::printf("world %d flight %d: %d pops, worst %g m, first at %g m\n", world, flight, pops, f.worst_m,
                            f.first_m);
            result.by_texture += f.by_texture;
            result.mixed += f.mixed;
            result.worst_m = std::max(result.worst_m, f.worst_m);
            ++result.flights;
        }
    }
    return result;
}

TEST(ContinuityInSpace, NoVertexPopsWherePagesAreSplitForTheirShape) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    const FlightResult r = fly(random, {}, 25);
    EXPECT_EQ(r.pops, 0) << "the worst by " << r.worst_m << " m";
    EXPECT_GT(r.mixed, 500);
}

// Worlds in which a page beside an absent area is split and made whole again.
TEST(ContinuityInSpace, NoVertexPopsWhereAPageLacksAChild) {
    test::Random random(5);
    EXPECT_EQ(fly(random, {}, 11).pops, 0);
}

TEST(ContinuityInSpace, NoVertexPopsOverACurvedEarth) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    const FlightResult r = fly(random, {.curved = true}, 15);
    EXPECT_EQ(r.pops, 0) << "the worst by " << r.worst_m << " m";
    EXPECT_GT(r.mixed, 300);
}

TEST(ContinuityInSpace, NoVertexPopsWherePagesAreSplitForTheirTextures) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    const FlightResult r = fly(random, {.texture_depth = 3}, 25);
    EXPECT_EQ(r.pops, 0) << "the worst by " << r.worst_m << " m";
    EXPECT_GT(r.by_texture, 500);
}

TEST(ContinuityInSpace, NoVertexPopsUnderTexturesDeeperThanTheHeights) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    const FlightResult r = fly(random, {.texture_depth = test::kDeepTextures}, 15);
    EXPECT_EQ(r.pops, 0) << "the worst by " << r.worst_m << " m";
    EXPECT_GT(r.by_texture, 500);
}

TEST(ContinuityInSpace, NoVertexPopsWhereLeavesLieAtVariousDepths) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    const FlightResult r = fly(random, {.depth = test::Depth::varying}, 25);
    EXPECT_EQ(r.pops, 0) << "the worst by " << r.worst_m << " m";
    EXPECT_GT(r.mixed, 500);
}

TEST(ContinuityInSpace, NoVertexPopsUnderTexturesWhoseDepthVariesAsWell) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (const int texture_depth : {3, test::kDeepTextures}) {
        const FlightResult r = fly(random, {.texture_depth = texture_depth, .depth = test::Depth::varying}, 15);
        EXPECT_EQ(r.pops, 0) << "the worst by " << r.worst_m << " m";
        EXPECT_GT(r.by_texture, 500);
    }
}

TEST(ContinuityInSpace, WithoutMorphingTheSameFlightsFindPops) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    EXPECT_GT(fly(random, {.morph = false}, 8).pops, 20);
}

// Not claimed: that nothing pops. What held its neighbours coarse while it was missing lets them go at once.
TEST(ContinuityInTime, WhatComesLateGrowsAndSettlesToThePictureWithoutGrowth) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    double moved_m = 0;
    int grown = 0, pops = 0, pops_at_once = 0;
    for (int world = 0; world < 40; ++world) {
        const auto terrain = test::random_terrain(random, world % 3 == 2 ? 3 : 0, kErrorGrowth);
        const Lattice& l = terrain.lattice();
        const CpuArena arena = test::arena_of(terrain);
        const test::ProbedSurface surface(terrain, arena);
        const auto places = random_places(random, terrain, 80);
        const double range_m = terrain.dataset().max_height_m - terrain.dataset().min_height_m;
        const double threshold_m = 1e-3 + 2e-4 * range_m;
        const glm::dvec3 eye(l.x_m(test::uniform_real(random, 0, static_cast<double>(l.cells_x))),
                             l.y_m(test::uniform_real(random, 0, static_cast<double>(l.cells_y))),
                             terrain.dataset().max_height_m + test::uniform_real(random, 0, 500));
        const auto views = test::views_all_round(eye);
        // The page of a path from a root down and all under it are late, each level sooner or later than the one above
        // has grown, or at once.
        const double delay_s = world % 2 == 0 ? 0 : test::uniform_real(random, 0, 0.8);
        const auto count = static_cast<int>(terrain.tiles().size());
        const TileId chosen = terrain.tiles()[static_cast<std::size_t>(test::uniform(random, count / 2, count - 1))];
        if (chosen.level == 0) continue;
        const int first_late = test::uniform(random, 1, chosen.level);
        std::map<TileId, double> late;
        for (const TileId id : terrain.tiles())
            if (id.level >= first_late && ancestor_at(id, first_late) == ancestor_at(chosen, first_late))
                late[id] = 0.3 + delay_s * (id.level - first_late);
        SelectionSettings settings = test::with_tau(std::exp(test::uniform_real(random, 0, 5)));
        settings.growth_s = 0.5;
        Selector selector(terrain.dataset());
        bool growing = false;
        const auto select = [&](double now_s) -> const Selection& {
            test::FakeResidency residency(terrain);
            residency.add_all();
            for (const auto& [id, at] : late) {
                if (at <= now_s)
                    residency.set_arrived(id, at);
                else
                    residency.remove(id);
            }
            residency.set_now(now_s);
            return selector.select(views, settings, residency);
        };
        const auto heights = [&](double now_s) {
            const Selection& s = select(now_s);
            growing = growing || s.growing;
            return surface.heights_m(test::drawn_together(s), places, eye, 0);
        };
        const auto first = heights(0);
        const double end_s = 4 + 0.5 * (l.deepest_level + 2);
        for (int k = 0; k < 60; ++k) {
            pops += pop_between(end_s * k / 60, end_s * (k + 1) / 60, 1e-9, threshold_m, heights).height_m > 0;
        }
        moved_m = std::max(moved_m, greatest_jump(first, heights(end_s)).height_m);
        grown += growing ? 1 : 0;
        const Selection settled = select(end_s);
        ASSERT_FALSE(settled.growing);
        settings.growth_s = 0;
        ASSERT_TRUE(test::same_selection(settled, select(end_s)));
        for (int k = 0; k < 60; ++k)
            pops_at_once += pop_between(end_s * k / 60, end_s * (k + 1) / 60, 1e-9, threshold_m, heights).height_m > 0;
    }
    EXPECT_GT(grown, 15);
    EXPECT_GT(moved_m, 1);
    EXPECT_GT(pops_at_once, 15);  // the same arrivals without growth
    EXPECT_LE(pops * 3, pops_at_once);
    RecordProperty("pops", pops);
    if (std::getenv("SCREE_TRACE_POPS") != nullptr) std::printf("%d pops, at once %d\n", pops, pops_at_once);
}

TEST(ContinuityInTime, ATextureThatComesLateIsBlendedInOverItsAncestors) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    std::int64_t fading = 0;
    for (int world = 0; world < 8; ++world) {
        const auto terrain = test::random_terrain(random, 3);
        const Lattice& l = terrain.lattice();
        const glm::dvec3 middle(l.x_m(static_cast<double>(l.cells_x) / 2), l.y_m(static_cast<double>(l.cells_y) / 2),
                                terrain.dataset().max_height_m + 20);
        const auto views = test::views_all_round(middle);
        SelectionSettings settings = test::with_tau(1);
        settings.texture_tau_px = 0.1;
        settings.growth_s = 2;
        test::FakeResidency residency(terrain);
        residency.add_all();
        for (const TileId id : terrain.textures())
            if (id.level > 0) residency.set_texture_arrived(id, 10);
        Selector selector(terrain.dataset());
        for (const double age_s : {0.0, 0.5, 1.0, 1.75, 2.0, 3.0}) {
            residency.set_now(10 + age_s);
            const Selection& s = selector.select(views, settings, residency);
            const std::int64_t before = fading;
            for (const DrawItem& item : test::drawn_together(s)) {
                const TileId texture = terrain.textures()[static_cast<std::size_t>(item.texture.slot)];
                if (texture.level == 0 || age_s >= 2) {
                    ASSERT_EQ(item.texture_share, 1);
                    continue;
                }
                ASSERT_EQ(item.texture_share, static_cast<float>(age_s / 2));
                const TileId coarse = terrain.textures()[static_cast<std::size_t>(item.coarse_texture.slot)];
                ASSERT_EQ(coarse, parent_of(texture));
                // Both lie at the same place: scale and offset differ by the quadrant.
                const double extent = std::ldexp(static_cast<double>(l.tile_extent(0)), -coarse.level);
                const double cell = static_cast<double>(l.tile_extent(item.tile.level));
                ASSERT_EQ(static_cast<double>(item.coarse_texture.scale) * extent, cell);
                ASSERT_EQ(static_cast<double>(item.coarse_texture.offset_u) * extent,
                          static_cast<double>(item.tile.x) * cell - static_cast<double>(coarse.x) * extent);
                ASSERT_EQ(static_cast<double>(item.coarse_texture.offset_v) * extent,
                          static_cast<double>(item.tile.y) * cell - static_cast<double>(coarse.y) * extent);
                ++fading;
            }
            ASSERT_EQ(s.growing, fading > before);
        }
    }
    EXPECT_GT(fading, 10);
}

}  // namespace
}  // namespace scree
