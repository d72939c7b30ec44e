#include "common/mesh/tile_patterns.h"

#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <map>
#include <set>

namespace scree {
namespace {

constexpr int kSizes[] = {1, 2, 3, 4, 5, 6};

struct Point {
    std::int64_t i, j;
};

class Pattern {
public:
    Pattern(const TilePatterns& patterns, int geomip, unsigned mask)
        : pitch_((1 << patterns.tile_cells_log2()) + 1),
          range_(patterns.range(geomip, mask)),
          indices_(patterns.indices()) {}
    std::uint32_t triangles() const { return range_.count / 3; }
    std::uint32_t vertex(std::uint32_t triangle, std::uint32_t corner) const {
        return indices_[range_.first + 3 * triangle + corner];
    }
    Point point(std::uint32_t index) const { return {index % pitch_, index / pitch_}; }
    // Positive for counter-clockwise seen from above: j points south.
    std::int64_t twice_area(std::uint32_t t) const {
        const Point a = point(vertex(t, 0)), b = point(vertex(t, 1)), c = point(vertex(t, 2));
        return (b.j - a.j) * (c.i - a.i) - (b.i - a.i) * (c.j - a.j);
    }

private:
    std::uint32_t pitch_;
    PatternRange range_;
    const std::vector<std::uint32_t>& indices_;
};

template <class Visit>
void for_each_pattern(Visit visit) {
    for (const int n : kSizes) {
        const TilePatterns patterns(n);
        ASSERT_EQ(patterns.geomip_levels(), n);
        for (int g = 0; g < n; ++g)
            for (unsigned mask = 0; mask < kEdgeMaskCount; ++mask) {
                SCOPED_TRACE("n = " + std::to_string(n) + ", geomip " + std::to_string(g) + ", mask " +
                             std::to_string(mask));
                visit(n, g, mask, Pattern(patterns, g, mask));
                if (testing::Test::HasFatalFailure()) return;
            }
    }
}

TEST(TilePatterns, TrianglesCoverTheTileOnceAndFaceUp) {
    for_each_pattern([](int n, int, unsigned, const Pattern& p) {
        std::int64_t area = 0;
        for (std::uint32_t t = 0; t < p.triangles(); ++t) {
            ASSERT_GT(p.twice_area(t), 0);
            area += p.twice_area(t);
        }
        EXPECT_EQ(area, std::int64_t{2} << (2 * n));
    });
}

TEST(TilePatterns, InnerEdgesAreUsedOnceEachWayAndOuterEdgesOnce) {
    for_each_pattern([](int n, int g, unsigned mask, const Pattern& p) {
        const std::int64_t m = std::int64_t{1} << n;
        std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
        for (std::uint32_t t = 0; t < p.triangles(); ++t)
            for (std::uint32_t k = 0; k < 3; ++k) ++edges[{p.vertex(t, k), p.vertex(t, (k + 1) % 3)}];
        std::map<unsigned, std::int64_t> border_edges;
        for (const auto& [edge, uses] : edges) {
            ASSERT_EQ(uses, 1);
            if (edges.count({edge.second, edge.first}) != 0) continue;
            const Point a = p.point(edge.first), b = p.point(edge.second);
            const unsigned side = a.j == 0 && b.j == 0   ? kEdgeNorth
                                  : a.j == m && b.j == m ? kEdgeSouth
                                  : a.i == 0 && b.i == 0 ? kEdgeWest
                                  : a.i == m && b.i == m ? kEdgeEast
                                                         : 0u;
            ASSERT_NE(side, 0u) << "a hole inside";
            const std::int64_t length = std::abs(a.i - b.i) + std::abs(a.j - b.j);
            EXPECT_EQ(length, (std::int64_t{1} << g) * ((mask & side) != 0 ? 2 : 1));
            border_edges[side] += length;
        }
        for (const unsigned side : {kEdgeNorth, kEdgeEast, kEdgeSouth, kEdgeWest}) EXPECT_EQ(border_edges[side], m);
    });
}

TEST(TilePatterns, TriangleCountsAreTwoACellLessOneARemovedVertex) {
    for_each_pattern([](int n, int g, unsigned mask, const Pattern& p) {
        const std::uint32_t cells = 1u << (n - g);
        const std::uint32_t removed = static_cast<std::uint32_t>(std::popcount(mask)) * cells / 2;
        EXPECT_EQ(p.triangles(), 2 * cells * cells - removed);
        EXPECT_EQ(pattern_triangles(n, g, mask), p.triangles());
    });
}

TEST(TilePatterns, ThinnedEdgesKeepEverySecondVertexAndInnerVerticesStay) {
    for_each_pattern([](int n, int g, unsigned mask, const Pattern& p) {
        const std::int64_t m = std::int64_t{1} << n, s = std::int64_t{1} << g;
        std::set<std::uint32_t> used;
        for (std::uint32_t t = 0; t < p.triangles(); ++t)
            for (std::uint32_t k = 0; k < 3; ++k) used.insert(p.vertex(t, k));
        std::set<std::uint32_t> expected;
        for (std::int64_t j = 0; j <= m; j += s)
            for (std::int64_t i = 0; i <= m; i += s) {
                const bool removed = (j == 0 && (mask & kEdgeNorth) != 0 && i % (2 * s) != 0) ||
                                     (j == m && (mask & kEdgeSouth) != 0 && i % (2 * s) != 0) ||
                                     (i == 0 && (mask & kEdgeWest) != 0 && j % (2 * s) != 0) ||
                                     (i == m && (mask & kEdgeEast) != 0 && j % (2 * s) != 0);
                if (!removed) expected.insert(static_cast<std::uint32_t>(j * (m + 1) + i));
            }
        EXPECT_EQ(used, expected);
    });
}

TEST(TilePatterns, DiagonalsFollowTheUnionJack) {
    for_each_pattern([](int, int g, unsigned mask, const Pattern& p) {
        if (mask != 0) return;
        const std::int64_t s = std::int64_t{1} << g;
        for (std::uint32_t t = 0; t < p.triangles(); ++t)
            for (std::uint32_t k = 0; k < 3; ++k) {
                const Point a = p.point(p.vertex(t, k)), b = p.point(p.vertex(t, (k + 1) % 3));
                if (a.i == b.i || a.j == b.j) continue;
                const std::int64_t i = std::min(a.i, b.i) / s, j = std::min(a.j, b.j) / s;
                const bool falling = (a.i - b.i) == (a.j - b.j);  // (i, j) to (i + 1, j + 1)
                EXPECT_EQ(falling, (i + j) % 2 == 0);
            }
    });
}

TEST(TilePatterns, TheSmallestTileWithAllEdgesThinnedIsFourTriangles) {
    const TilePatterns patterns(1);
    const PatternRange range = patterns.range(0, 15);
    ASSERT_EQ(range.count, 12u);
    std::set<std::uint32_t> used(patterns.indices().begin() + range.first,
                                 patterns.indices().begin() + range.first + 12);
    EXPECT_EQ(used, (std::set<std::uint32_t>{0, 2, 4, 6, 8}));
}

TEST(TilePatterns, ThinningCoarsensOnlyTheTrianglesAtTheEdge) {
    // A thinned edge has the very edges of the next geomip level: what a coarser neighbour draws.
    const TilePatterns patterns(4);
    for (int g = 0; g + 1 < 4; ++g) {
        const Pattern fine(patterns, g, kEdgeNorth), coarse(patterns, g + 1, 0);
        const auto north = [](const Pattern& p) {
            std::set<std::pair<std::int64_t, std::int64_t>> edges;
            for (std::uint32_t t = 0; t < p.triangles(); ++t)
                for (std::uint32_t k = 0; k < 3; ++k) {
                    const Point a = p.point(p.vertex(t, k)), b = p.point(p.vertex(t, (k + 1) % 3));
                    if (a.j == 0 && b.j == 0) edges.insert({std::min(a.i, b.i), std::max(a.i, b.i)});
                }
            return edges;
        };
        EXPECT_EQ(north(fine), north(coarse));
    }
}

TEST(TilePatterns, PartsCoverTheirSquareAndTogetherAreTheWhole) {
    for (const int n : kSizes) {
        const TilePatterns patterns(n);
        const std::int64_t pitch = (1 << n) + 1;
        for (int g = 0; g < n; ++g)
            for (unsigned mask = 0; mask < kEdgeMaskCount; ++mask)
                for (int level = 0; level <= patterns.finest_part_level(g); ++level) {
                    std::uint32_t total = 0;
                    const std::int64_t side = std::int64_t{1} << (n - level);
                    for (int y = 0; y < 1 << level; ++y)
                        for (int x = 0; x < 1 << level; ++x) {
                            const PatternRange part = patterns.range(g, mask, {level, x, y});
                            total += part.count;
                            std::int64_t area = 0;
                            for (std::uint32_t k = part.first; k < part.first + part.count; k += 3) {
                                std::array<Point, 3> p{};
                                for (std::uint32_t c = 0; c < 3; ++c) {
                                    const std::uint32_t index = patterns.indices()[k + c];
                                    p[c] = {index % pitch, index / pitch};
                                    ASSERT_GE(p[c].i, x * side);
                                    ASSERT_LE(p[c].i, (x + 1) * side);
                                    ASSERT_GE(p[c].j, y * side);
                                    ASSERT_LE(p[c].j, (y + 1) * side);
                                }
                                area += (p[1].j - p[0].j) * (p[2].i - p[0].i) - (p[1].i - p[0].i) * (p[2].j - p[0].j);
                            }
                            ASSERT_EQ(area, 2 * side * side);
                        }
                    ASSERT_EQ(total, patterns.range(g, mask).count);
                }
    }
}

}  // namespace
}  // namespace scree
