#include "common/mesh/drawn_surface.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "tests/common/test_support.h"

namespace scree {
namespace {

// Height at (u, v) by barycentric coordinates in the pattern's own triangles: all in whole numbers.
ExactHeight by_triangles(const TilePatterns& patterns, const std::vector<std::int32_t>& z, DrawnPattern pattern,
                         std::int64_t u, std::int64_t v, std::int64_t unit) {
    const std::int64_t pitch = (1 << patterns.tile_cells_log2()) + 1;
    const PatternRange range = patterns.range(pattern.geomip, pattern.edge_mask);
    for (std::uint32_t k = range.first; k < range.first + range.count; k += 3) {
        std::array<std::int64_t, 3> x{}, y{}, h{}, w{};
        for (std::size_t c = 0; c < 3; ++c) {
            const std::uint32_t index = patterns.indices()[k + c];
            x[c] = index % pitch * unit;
            y[c] = index / pitch * unit;
            h[c] = z[index];
        }
        std::int64_t total = 0;
        bool inside = true;
        for (std::size_t c = 0; c < 3; ++c) {
            const std::size_t a = (c + 1) % 3, b = (c + 2) % 3;
            w[c] = (y[b] - y[a]) * (u - x[a]) - (x[b] - x[a]) * (v - y[a]);
            w[c] = -w[c];
            total += w[c];
        }
        for (const std::int64_t weight : w) inside = inside && (total > 0 ? weight >= 0 : weight <= 0);
        if (!inside || total == 0) continue;
        return {w[0] * h[0] + w[1] * h[1] + w[2] * h[2], total};
    }
    ADD_FAILURE() << "no triangle holds (" << u << ", " << v << ")";
    return {};
}

TEST(DrawnHeight, EqualsInterpolationOnThePatternsTrianglesExactly) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    constexpr std::int64_t kUnit = 8;
    for (int n = 1; n <= 5; ++n) {
        const TilePatterns patterns(n);
        const auto z = test::random_samples(random, n, kMaxHeightUnits);
        for (int g = 0; g < n; ++g)
            for (unsigned mask = 0; mask < kEdgeMaskCount; ++mask)
                for (int k = 0; k < 60; ++k) {
                    const int limit = static_cast<int>(kUnit << n);
                    std::int64_t u = test::uniform(random, 0, limit), v = test::uniform(random, 0, limit);
                    if (k % 4 == 0) u = k % 8 == 0 ? 0 : limit;  // borders, where thinning shows
                    if (k % 6 == 0) v = k % 12 == 0 ? 0 : limit;
                    const ExactHeight drawn = drawn_height(z, n, {g, mask}, u, v, kUnit);
                    const ExactHeight expected = by_triangles(patterns, z, {g, mask}, u, v, kUnit);
                    ASSERT_EQ(drawn.numerator * expected.denominator, expected.numerator * drawn.denominator)
                        << "n " << n << " g " << g << " mask " << mask << " at " << u << ", " << v;
                    const double real = drawn_height_at(z, n, {g, mask}, static_cast<double>(u) / kUnit,
                                                        static_cast<double>(v) / kUnit);
                    ASSERT_NEAR(real, drawn.quanta(), 1e-6);
                }
    }
}

TEST(DrawnHeight, PassesThroughEveryVertexThatIsDrawn) {
    test::Random random(5);
    const int n = 3, m = 8;
    const auto z = test::random_samples(random, n, 1000);
    for (int g = 0; g < n; ++g)
        for (int j = 0; j <= m; j += 1 << g)
            for (int i = 0; i <= m; i += 1 << g)
                EXPECT_EQ(drawn_height(z, n, {g, 0}, i, j, 1).quanta(), z[static_cast<std::size_t>(j * 9 + i)]);
}

TEST(DrawnHeight, AThinnedEdgeIsTheNextLevelsEdge) {
    test::Random random(6);
    const int n = 4, m = 16;
    const auto z = test::random_samples(random, n, 1000);
    for (int g = 0; g + 1 < n; ++g)
        for (std::int64_t k = 0; k <= 4 * m; ++k) {
            EXPECT_EQ(drawn_height(z, n, {g, kEdgeNorth}, k, 0, 4).quanta(),
                      drawn_height(z, n, {g + 1, 0}, k, 0, 4).quanta());
            EXPECT_EQ(drawn_height(z, n, {g, kEdgeSouth}, k, 4 * m, 4).quanta(),
                      drawn_height(z, n, {g + 1, 0}, k, 4 * m, 4).quanta());
            EXPECT_EQ(drawn_height(z, n, {g, kEdgeWest}, 0, k, 4).quanta(),
                      drawn_height(z, n, {g + 1, 0}, 0, k, 4).quanta());
            EXPECT_EQ(drawn_height(z, n, {g, kEdgeEast}, 4 * m, k, 4).quanta(),
                      drawn_height(z, n, {g + 1, 0}, 4 * m, k, 4).quanta());
        }
}

}  // namespace
}  // namespace scree
