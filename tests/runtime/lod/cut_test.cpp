// The levels of a cut are the greatest that its rules allow: nothing is drawn needlessly fine.
#include "runtime/lod/cut.h"

#include <gtest/gtest.h>

#include <limits>
#include <tuple>

#include "runtime/view/four_boxes.h"
#include "tests/runtime/lod/selection_support.h"

namespace scree {
namespace {

/// More than the rounding of one share of a level.
constexpr Level kRaise = 2;

class Rules {
public:
    Rules(const test::SyntheticTerrain& terrain, const Cut& cut, double tau_px)
        : terrain_(terrain), cut_(cut), tau_px_(tau_px) {}

    /// Whether a leaf may be drawn at that level beside all the others as they are.
    bool allow(const CutNode& leaf, Level level) const {
        if (level > level_of(cut_.maximum_exponent(leaf)) || error_m(leaf, level) > allowed_m(leaf)) return false;
        for (const CutNode& other : cut_.nodes()) {
            const bool above = other.id.level < leaf.id.level && ancestor_at(leaf.id, other.id.level) == other.id;
            if (above && level > other.level) return false;
            if (share_an_edge(leaf.id, other.id) && level > limit_beside(leaf, other)) return false;
        }
        return true;
    }

private:
    double allowed_m(const CutNode& node) const { return tau_px_ * node.metres_per_px; }
    double error_m(const CutNode& node, Level level) const {
        const HeightBounds& own = terrain_.tile(node.id)->header.own;
        const auto geomip = static_cast<std::size_t>(exponent_of(level) - cut_.minimum_exponent(node));
        const double weight = static_cast<double>(morph_of(level));
        const double next = weight > 0 ? own.error_n[geomip + 1] : 0;
        return ((1 - weight) * own.error_n[geomip] + weight * next) * terrain_.dataset().height_quantum_m;
    }
    // Split pages stand for what they would be drawn at as leaves: towards smaller pages, and where they lack a child.
    Level limit_beside(const CutNode& leaf, const CutNode& other) const {
        if (other.id.level < leaf.id.level) return other.level;
        if (other.split && other.id.level > leaf.id.level && !lacks_towards(other, leaf))
            return std::numeric_limits<Level>::max();
        const Level limit = other.level + kOneLevel;
        const double finest_m = error_m(other, level_of(cut_.minimum_exponent(other)));
        if (other.split || !terrain_.is_leaf(other.id) || allowed_m(other) >= finest_m) return limit;
        return std::min(limit, level_of(cut_.minimum_exponent(other)) +
                                   static_cast<Level>(allowed_m(other) / finest_m * kOneLevel));
    }
    bool lacks_towards(const CutNode& split, const CutNode& leaf) const {
        for (int q = 0; q < 4; ++q)
            if (split.children[static_cast<std::size_t>(q)] < 0 && share_an_edge(child_of(split.id, q), leaf.id))
                return true;
        return false;
    }
    bool share_an_edge(TileId a, TileId b) const {
        const Lattice& l = terrain_.lattice();
        const LatticePoint p = l.corner(a), q = l.corner(b);
        const std::int64_t u = l.tile_extent(a.level), v = l.tile_extent(b.level);
        const std::int64_t wide = std::min(p.i + u, q.i + v) - std::max(p.i, q.i);
        const std::int64_t high = std::min(p.j + u, q.j + v) - std::max(p.j, q.j);
        return (wide == 0 && high > 0) || (high == 0 && wide > 0);
    }

    const test::SyntheticTerrain& terrain_;
    const Cut& cut_;
    const double tau_px_;
};

TEST(Cut, NoLeafCanBeRaisedWithoutBreakingItsToleranceOrARule) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    std::int64_t leaves = 0, between = 0, raised_to_the_top = 0;
    for (int world = 0; world < 60; ++world) {
        const auto terrain = test::random_terrain(random, 0, kErrorGrowth, test::depth_of_world(world));
        test::FakeResidency residency(terrain);
        residency.add_all();
        Cut cut(terrain.dataset());
        for (int k = 0; k < 4; ++k) {
            const glm::dvec3 eye = test::random_camera(random, terrain).eye;
            std::vector<LodView> views;
            for (const Camera& camera : test::views_all_round(eye)) views.emplace_back(camera);
            CutSettings settings;
            settings.tau_px = std::exp(test::uniform_real(random, 0, 6));
            settings.texture_tau_px = 1e9;
            settings.max_pages = 1 << 20;
            ASSERT_TRUE(cut.refine(views, settings, residency));
            const Rules rules(terrain, cut, settings.tau_px);
            for (const CutNode& node : cut.nodes()) {
                if (node.split) continue;
                ASSERT_FALSE(rules.allow(node, node.level + kRaise))
                    << "level " << node.id.level << " page " << node.id.x << ", " << node.id.y << " at " << node.level;
                ++leaves;
                between += morph_of(node.level) > 0 ? 1 : 0;
                raised_to_the_top += node.level == level_of(cut.maximum_exponent(node)) ? 1 : 0;
            }
        }
    }
    EXPECT_GT(leaves, 3000);
    EXPECT_GT(between, 500);
    EXPECT_LT(raised_to_the_top, leaves);
}

auto numbers(const CutNode& n) {
    return std::tuple(n.id, n.split, n.level, n.floor, n.seen_by, n.slot, n.texture_slot, n.leaf, n.children, n.parent,
                      n.metres_per_px, n.texel_per_px, n.finest_error_m, n.texture_need, n.priority, n.approach);
}

TEST(Cut, BesideAPlanItMeasuresNothingAgainAndIsTheSame) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    std::int64_t from_the_plan = 0, own = 0;
    for (int world = 0; world < 60; ++world) {
        const auto terrain = test::random_terrain(random, world % 4, kErrorGrowth, test::depth_of_world(world));
        test::FakeResidency residency(terrain);
        residency.add_roots();
        residency.add_random(random, test::uniform(random, 20, 100));
        SelectionSettings timing;
        test::arrive_at_random(random, terrain, residency, timing);
        Cut plan(terrain.dataset()), beside(terrain.dataset()), alone(terrain.dataset());
        for (int k = 0; k < 4; ++k) {
            std::vector<LodView> views;
            for (int v = 0; v <= k % 3; ++v) views.emplace_back(test::random_camera(random, terrain));
            CutSettings settings;
            settings.tau_px = std::exp(test::uniform_real(random, 0, 6));
            settings.texture_tau_px = std::exp(test::uniform_real(random, -2, 4));
            settings.max_pages = 1 << 20;
            if (k % 2 != 0) settings.half_curvature = test::random_half_curvature(random, terrain);
            ASSERT_TRUE(plan.refine(views, settings, residency));
            settings.only_resident = true;
            settings.growth_s = timing.growth_s;
            ASSERT_TRUE(beside.refine(views, settings, residency, &plan));
            ASSERT_TRUE(alone.refine(views, settings, residency));
            ASSERT_EQ(beside.nodes().size(), alone.nodes().size());
            for (std::size_t n = 0; n < alone.nodes().size(); ++n) {
                ASSERT_EQ(numbers(beside.nodes()[n]), numbers(alone.nodes()[n]));
                ++(beside.nodes()[n].twin >= 0 ? from_the_plan : own);
            }
        }
    }
    EXPECT_GT(from_the_plan, 300);
    EXPECT_LT(own, from_the_plan);
}

TEST(FourBoxes, AreSeenInTheSameBitsAsOneByOne) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    std::array<int, 3> met{};
    for (int k = 0; k < 20000; ++k) {
        const double size = std::exp(test::uniform_real(random, 0, 8));
        const auto anywhere = [&] { return test::uniform_real(random, -size, size); };
        const auto camera = look_at({anywhere(), anywhere(), anywhere()}, {anywhere(), anywhere(), anywhere()},
                                    test::uniform_real(random, 5, 120), test::uniform(random, 1, 900), 600);
        if (!camera) continue;
        const Frustum frustum(*camera);
        const double half_curvature = k % 2 == 0 ? 0 : std::exp(test::uniform_real(random, -14, -2));
        const bool inside = k % 5 == 0;
        std::array<Box, 4> boxes;
        FourBoxes four;
        for (std::size_t b = 0; b < 4; ++b) {
            Box& box = boxes[b];
            for (int axis = 0; axis < 3; ++axis) {
                box.low[axis] = anywhere();
                box.high[axis] = box.low[axis] + (k % 7 == 0 ? 0 : test::uniform_real(random, 0, size));
            }
            four.west[b] = box.low.x, four.south[b] = box.low.y, four.low[b] = box.low.z;
            four.east[b] = box.high.x, four.north[b] = box.high.y, four.high[b] = box.high.z;
        }
        const FourSeen seen = see_four(frustum, four, half_curvature, camera->near_m, inside);
        for (std::size_t b = 0; b < 4; ++b) {
            const Box box = lowered_by_curvature(boxes[b], camera->eye, half_curvature);
            const Sight sight = inside ? Sight::all : frustum.sight(box);
            ++met[static_cast<std::size_t>(sight)];
            ASSERT_EQ((seen.none >> b & 1) != 0, sight == Sight::none);
            ASSERT_EQ((seen.all >> b & 1) != 0, sight == Sight::all);
            ASSERT_EQ(seen.distance_m[b], std::max(distance_to_box(camera->eye, box), camera->near_m));
        }
    }
    for (const int count : met) EXPECT_GT(count, 1000);
}

}  // namespace
}  // namespace scree
