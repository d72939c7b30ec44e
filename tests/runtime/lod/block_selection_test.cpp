// The restricted square grid of one block: its tables, the errors of dropped vertices, and what is selected.
#include "runtime/lod/block_selection.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "common/mesh/tile_patterns.h"
#include "runtime/lod/vertex_errors.h"
#include "runtime/lod/vertex_metric.h"
#include "tests/common/test_support.h"

namespace scree {
namespace {

std::vector<double> random_heights(test::Random& random, const Bisection& b, double amplitude) {
    std::vector<double> z(b.vertex_count());
    for (double& value : z) value = std::round(std::uniform_real_distribution<double>(-amplitude, amplitude)(random));
    return z;
}

using Corners = std::array<std::uint32_t, 3>;

std::multiset<Corners> triangles_of(std::span<const std::uint32_t> indices) {
    std::multiset<Corners> set;
    for (std::size_t k = 0; k + 2 < indices.size(); k += 3) {
        Corners t{indices[k], indices[k + 1], indices[k + 2]};
        std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());  // keeps the sense of rotation
        set.insert(t);
    }
    return set;
}

TEST(Bisection, EveryVertexButTheCornersHasItsLevelEndsAndParents) {
    for (int n = 1; n <= 8; ++n) {
        const Bisection b(n, n % 2 == 0);
        EXPECT_EQ(b.coarse_to_fine().size(), b.vertex_count() - 4);
        for (int level = 1; level <= b.levels(); ++level)
            for (const std::int32_t v : b.of_level(level)) {
                const BisectionVertex& vertex = b.vertex(v);
                ASSERT_EQ(vertex.level, level);
                ASSERT_EQ(vertex.ends[0] + vertex.ends[1], 2 * v);
                const int i = v % b.row(), j = v / b.row();
                const bool border = i == 0 || j == 0 || i == b.cells() || j == b.cells();
                ASSERT_EQ(vertex.parents[1] < 0, border);
                for (const std::int32_t parent : vertex.parents)
                    if (parent >= 0) {
                        ASSERT_LT(b.vertex(parent).level, level);
                        const auto& children = b.vertex(parent).children;
                        ASSERT_NE(std::find(children.begin(), children.end(), v), children.end());
                    }
            }
    }
}

TEST(Bisection, WholeItIsTheUnionJackThatTilesAreDrawnWith) {
    for (const int n : {1, 2, 5})
        for (int geomip = 0; geomip < n; ++geomip) {
            const Bisection b(n, false);
            const TilePatterns patterns(n);
            BlockSelection selection(b);
            const int stride = 1 << geomip;
            for (int j = 0; j <= b.cells(); j += stride)
                for (int i = 0; i <= b.cells(); i += stride) selection.add(b.index(i, j));
            std::vector<std::uint32_t> indices;
            selection.emit(indices);
            const PatternRange range = patterns.range(geomip, 0);
            EXPECT_EQ(triangles_of(indices),
                      triangles_of(std::span(patterns.indices()).subspan(range.first, range.count)));
            std::vector<std::uint32_t> parts;
            for (int y = 0; y < 1 << (n - geomip); ++y)
                for (int x = 0; x < 1 << (n - geomip); ++x) selection.emit(geomip, x, y, parts);
            EXPECT_EQ(triangles_of(parts), triangles_of(indices));
        }
}

// Height of the plane through three vertices at a fourth.
double plane_at(const Bisection& b, std::span<const double> z, const std::array<std::int32_t, 3>& t, std::int32_t v,
                bool& inside) {
    const auto x = [&](std::int32_t k) { return static_cast<double>(k % b.row()); };
    const auto y = [&](std::int32_t k) { return static_cast<double>(k / b.row()); };
    const auto cross = [&](std::int32_t p, std::int32_t q, std::int32_t r) {
        return (x(q) - x(p)) * (y(r) - y(p)) - (y(q) - y(p)) * (x(r) - x(p));
    };
    const double area = cross(t[0], t[1], t[2]);
    double sum = 0;
    inside = true;
    for (std::size_t k = 0; k < 3; ++k) {
        const double share = cross(v, t[(k + 1) % 3], t[(k + 2) % 3]) / area;
        inside = inside && share >= 0;
        sum += share * z[static_cast<std::size_t>(t[k])];
    }
    return sum;
}

TEST(VertexErrors, AreTheGreatestDistanceFromTheTrianglesThatTheVertexSplits) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (const bool odd : {false, true}) {
        const Bisection b(3, odd);
        const auto z = random_heights(random, b, 1000);
        std::vector<float> error(z.size());
        dropped_errors(b, z, error);
        for (const std::int32_t v : b.coarse_to_fine()) {
            const BisectionVertex& vertex = b.vertex(v);
            double greatest = 0;
            for (const std::int32_t apex : vertex.parents)
                for (std::int32_t p = 0; apex >= 0 && p < static_cast<std::int32_t>(z.size()); ++p) {
                    bool inside = false;
                    const double plane = plane_at(b, z, {apex, vertex.ends[0], vertex.ends[1]}, p, inside);
                    if (inside) greatest = std::max(greatest, std::abs(z[static_cast<std::size_t>(p)] - plane));
                }
            ASSERT_NEAR(error[static_cast<std::size_t>(v)], greatest, 1e-4 * greatest + 1e-9) << "vertex " << v;
            ASSERT_GE(static_cast<double>(error[static_cast<std::size_t>(v)]) * (1 + 1e-12), greatest - 1e-9);
        }
    }
}

TEST(BlockSelection, LocksMakeTheParentClosureWhateverWasActiveBefore) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    const Bisection b(4, false);
    BlockSelection selection(b);
    for (int round = 0; round < 200; ++round) {
        const int percent = test::uniform(random, 0, 30);
        std::vector<std::uint8_t> fails(b.vertex_count());
        for (auto& f : fails) f = test::uniform(random, 0, 99) < percent ? 1 : 0;
        selection.update([&](std::int32_t v) { return fails[static_cast<std::size_t>(v)] != 0; });
        BlockSelection closure(b);
        for (const std::int32_t v : b.coarse_to_fine())
            if (fails[static_cast<std::size_t>(v)] != 0) closure.add(v);
        ASSERT_TRUE(std::equal(selection.active().begin(), selection.active().end(), closure.active().begin()));
        std::vector<std::uint32_t> indices;
        selection.emit(indices);
        ASSERT_EQ(static_cast<std::int64_t>(indices.size() / 3), selection.triangles());
    }
}

TEST(BlockSelection, SaturatedErrorsSelectParentsWithTheirChildrenAndKeepTheTolerance) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    constexpr double kSpacing = 30, kErrorPx = 1400;
    for (int round = 0; round < 60; ++round) {
        const Bisection b(5, round % 2 != 0);
        const auto z = random_heights(random, b, round % 3 == 0 ? 3 : 300);
        std::vector<float> error(z.size()), radius(z.size());
        dropped_errors(b, z, error);
        diamond_radii(b, z, kSpacing, 0, radius);
        saturate(b, z, kSpacing, error, radius);
        const double ex = test::uniform(random, -3000, 3000), ey = test::uniform(random, -3000, 3000),
                     ez = test::uniform(random, -500, 3000), tau = 1;
        const auto sight = [&](std::int32_t v) {
            const double dx = kSpacing * (v % b.row()) - ex, dy = kSpacing * (v / b.row()) - ey,
                         dz = z[static_cast<std::size_t>(v)] - ez;
            return VertexSight<double>{dx * dx + dy * dy, dz * dz};
        };
        const auto selects = [&](std::int32_t v) {
            return guaranteed_selects(kErrorPx * static_cast<double>(error[static_cast<std::size_t>(v)]),
                                      static_cast<double>(radius[static_cast<std::size_t>(v)]), 0.3, tau, sight(v));
        };
        BlockSelection top_down(b), closure(b);
        top_down.refine(selects);
        closure.update(selects);
        ASSERT_TRUE(std::equal(top_down.active().begin(), top_down.active().end(), closure.active().begin()));
        std::vector<double> shown(z.size());
        surface_heights(b, top_down.active(), z, shown);
        for (std::int32_t v = 0; v < static_cast<std::int32_t>(z.size()); ++v) {
            const VertexSight<double> s = sight(v);
            const double off = std::abs(shown[static_cast<std::size_t>(v)] - z[static_cast<std::size_t>(v)]);
            ASSERT_LE(kErrorPx * off * std::sqrt(s.h2), tau * s.r2() * (1 + 1e-9) + 1e-9);
        }
    }
}

}  // namespace
}  // namespace scree
