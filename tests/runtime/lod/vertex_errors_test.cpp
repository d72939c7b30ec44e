// The errors of one block's vertices and what is selected by them, at the extremes. Numbers in comments: Scree lod,
// section 7 (docs/extremes.md).
#include "runtime/lod/vertex_errors.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include <glm/glm.hpp>

#include "runtime/lod/block_selection.h"
#include "runtime/lod/vertex_metric.h"
#include "tests/common/test_support.h"

namespace scree {
namespace {

constexpr double kFocal = 1098.99097;
constexpr double kTolerances[] = {0, 1e-9, 1e-3, 1, 1e3, 1e9};

using Heights = std::function<double(int i, int j)>;

// A block with all that its vertices cost.
struct Block {
    Block(int n, bool odd, double spacing, const Heights& height) : b(n, odd), spacing_m(spacing) {
        for (int j = 0; j <= b.cells(); ++j)
            for (int i = 0; i <= b.cells(); ++i) z.push_back(height(i, j));
        for (auto* list : {&delta, &local, &error, &radius}) list->resize(z.size());
        local_corrections(b, z, delta);
        dropped_errors(b, z, local);
        error = local;
        diamond_radii(b, z, spacing_m, 0, radius);
        saturate(b, z, spacing_m, error, radius);
    }
    VertexSight<double> sight(std::int32_t v, double ex, double ey, double ez) const {
        const double dx = spacing_m * (v % b.row()) - ex, dy = spacing_m * (v / b.row()) - ey, dz = at(z, v) - ez;
        return {dx * dx + dy * dy, dz * dz};
    }
    template <class List>
    static double at(const List& list, std::int32_t v) {
        return static_cast<double>(list[static_cast<std::size_t>(v)]);
    }
    BlockSelection by_uc(double tau, double ex, double ey, double ez) const {
        BlockSelection s(b);
        s.update([&](std::int32_t v) { return uc_selects(kFocal * at(delta, v), tau, sight(v, ex, ey, ez)); });
        return s;
    }
    BlockSelection guaranteed(double tau, double ex, double ey, double ez, double error_px = kFocal) const {
        BlockSelection s(b);
        s.refine([&](std::int32_t v) {
            return guaranteed_selects(error_px * at(error, v), at(radius, v), 0.3, tau, sight(v, ex, ey, ez));
        });
        return s;
    }
    std::int64_t full() const { return std::int64_t{2} * b.cells() * b.cells(); }

    Bisection b;
    double spacing_m;
    std::vector<double> z;
    std::vector<float> delta, local, error, radius;
};

double alternating(int i, int j) { return (i + j) % 2 == 0 ? 1e6 : -1e6; }

// 14: every slope of whole numbers is exact, in any tile, at any tolerance.
TEST(VertexErrors, ARampHasNoneAndStaysTwoTriangles) {
    for (int n = 1; n <= 8; ++n)
        for (const auto& slope : {glm::ivec2(0, 0), glm::ivec2(3, -2), glm::ivec2(-7000, 1000)}) {
            const Block block(n, n % 2 == 0, 10, [&](int i, int j) { return slope.x * i + slope.y * j - 5; });
            for (const auto* list : {&block.delta, &block.local, &block.error})
                for (const float e : *list) ASSERT_EQ(e, 0);
            for (const double tau : kTolerances) {
                EXPECT_EQ(block.by_uc(tau, 3, 4, 5).triangles(), 2);
                EXPECT_EQ(block.guaranteed(tau, 3, 4, 5).triangles(), 2);
            }
        }
}

// 14: slopes that no double holds leave no more than rounding, and a tolerance of a millionth of a pixel drops it.
TEST(VertexErrors, ARampOfAnySlopeHasNoMoreThanRounding) {
    const Block block(8, false, 10, [](int i, int j) { return 0.1 * i - 1e3 / 7 * j; });
    for (const float e : block.error) ASSERT_LT(e, 1e-10f);
    EXPECT_EQ(block.guaranteed(1e-6, 500, -3, 1e6).triangles(), 2);
}

// 14: E = H at every ancestor, and its block is refined exactly where f K H M passes the tolerance.
TEST(VertexErrors, ASpikeCountsInFullAtEveryAncestorAndNowhereElse) {
    constexpr double kSpike = 1234;
    for (int n = 1; n <= 8; ++n) {
        const int m = 1 << n, si = m / 2 + (n > 2 ? 3 : 0), sj = m / 2 + (n > 2 ? 1 : 0);
        const Block block(n, false, 10, [&](int i, int j) { return i == si && j == sj ? kSpike : 0; });
        std::vector<std::uint8_t> ancestors(block.z.size(), 0);
        const std::int32_t spike = block.b.index(si, sj);
        add_closed(block.b, spike, ancestors.data());
        for (const std::int32_t v : block.b.coarse_to_fine()) {
            const double e = Block::at(block.error, v);
            if (ancestors[static_cast<std::size_t>(v)] != 0)
                ASSERT_GE(e, kSpike);
            else
                ASSERT_LE(e, kSpike * 1.0001);  // a spike at the corner of a triangle is a slope on it
        }
        const std::int32_t first = block.b.of_level(1)[0];
        const double half = 5.0 * m, away = 2e4;  // outside its ball
        const double magnified =
            greatest_magnification(block.sight(first, half, half, away), Block::at(block.radius, first), 0.3);
        const double px = kFocal * Block::at(block.error, first) * magnified;
        EXPECT_GT(block.guaranteed(px * (1 - 1e-9), half, half, away).triangles(), 2);
        EXPECT_EQ(block.guaranteed(px * (1 + 1e-9), half, half, away).triangles(), 2);
    }
}

// 15 for vertices: each level's own correction is one, the sum of three is what is missing.
TEST(VertexErrors, CorrectionsOfSeveralLevelsAddUpAndAreCountedTogether) {
    const auto tent = [](int at, int period) { return 1.0 - std::abs(at % period - period / 2) * 2.0 / period; };
    const Block block(4, false, 10, [&](int i, int) { return tent(i, 16) + tent(i, 8) + tent(i, 4); });
    double greatest_local = 0;
    for (const float d : block.delta) greatest_local = std::max(greatest_local, static_cast<double>(d));
    double relief = 0;
    for (const double z : block.z) relief = std::max(relief, z);
    EXPECT_GT(relief, 1.5 * greatest_local);
    EXPECT_GE(Block::at(block.error, block.b.of_level(1)[0]), relief);
}

// 5
TEST(VertexErrors, AtAToleranceOfZeroUcSelectsWhatHasACorrectionAndIsNotUnderTheEye) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    const Block block(4, false, 10, [&](int, int) { return test::uniform(random, 0, 2); });
    const double ex = 70, ey = 30;  // over the vertex (7, 3)
    BlockSelection expected(block.b);
    int under = 0;
    for (const std::int32_t v : block.b.coarse_to_fine()) {
        const bool is_under = v == block.b.index(7, 3);
        under += is_under && Block::at(block.delta, v) > 0 ? 1 : 0;
        if (Block::at(block.delta, v) > 0 && !is_under) expected.add(v);
    }
    const BlockSelection s = block.by_uc(0, ex, ey, 500);
    EXPECT_TRUE(std::equal(s.active().begin(), s.active().end(), expected.active().begin()));
    BlockSelection exact(block.b);
    for (const std::int32_t v : block.b.coarse_to_fine())
        if (Block::at(block.error, v) > 0) exact.add(v);
    const BlockSelection g = block.guaranteed(0, ex, ey, 500);
    EXPECT_TRUE(std::equal(g.active().begin(), g.active().end(), exact.active().begin()));
    EXPECT_LE(under, 1);
}

// 5
TEST(VertexErrors, AThousandthOfAPixelMakesTheFullMeshOfRoughGround) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    const Block block(5, true, 30, [&](int, int) { return std::uniform_real_distribution<double>(0, 50)(random); });
    EXPECT_GT(block.guaranteed(1e-3, -500, 300, 200).triangles(), block.full() * 99 / 100);
    EXPECT_GT(block.by_uc(1e-3, -500, 300, 200).triangles(), block.full() * 99 / 100);
    EXPECT_EQ(block.guaranteed(1e3, -5000, 300, 200).triangles(), 2);
}

// The surface keeps the tolerance, from an eye a millimetre over a vertex to one a million kilometres away.
TEST(VertexErrors, TheSurfaceKeepsTheToleranceAtEverySpacingReliefEyeAndField) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    const auto real = [&](double low, double high) {
        return std::uniform_real_distribution<double>(low, high)(random);
    };
    std::int64_t dropped = 0, kept = 0;
    for (const int n : {1, 2, 5, 8})
        for (const double spacing : {1e-3, 30.0, 1e5})
            for (const double relief : {0.0, 1e-3, 1e3, 1e6}) {
                if (n == 8 && spacing != 30) continue;
                const bool alternates = relief > 1e5;
                const Block block(n, n == 5, spacing, [&](int i, int j) {
                    return alternates ? alternating(i, j) : std::round(real(-relief, relief) * 4096) / 4096;
                });
                for (const auto* list : {&block.error, &block.radius})
                    for (const float value : *list) ASSERT_TRUE(std::isfinite(value) && value >= 0);
                const double side = spacing * block.b.cells();
                for (const double error_px : {1e-3, 1390.0, 1e8})  // fov 179 degrees .. 0.01 degrees
                    for (int eye = 0; eye < 6; ++eye) {
                        const std::int32_t v = test::uniform(random, 0, static_cast<int>(block.z.size()) - 1);
                        double ex = spacing * (v % block.b.row()), ey = spacing * (v / block.b.row()),
                               ez = Block::at(block.z, v);
                        const double away[] = {0, 1e-3, side, 1e4, 1e6, 1e9};
                        ez += away[eye] * (eye % 2 == 0 ? 1 : 0.3);
                        ex += away[eye] * (eye % 2 == 0 ? 0 : -0.9);
                        for (const double tau : {0.0, 1e-3, 1.0, 1e3}) {
                            const BlockSelection s = block.guaranteed(tau, ex, ey, ez, error_px);
                            std::vector<double> shown(block.z.size());
                            surface_heights(block.b, s.active(), block.z, shown);
                            for (std::int32_t w = 0; w < static_cast<std::int32_t>(shown.size()); ++w) {
                                ++(s.is_active(w) ? kept : dropped);
                                const double off = std::abs(Block::at(shown, w) - Block::at(block.z, w));
                                if (off == 0) continue;
                                const double h2 = block.sight(w, ex, ey, ez).h2;
                                const double p = std::sqrt(h2 + std::pow(Block::at(block.z, w) - ez, 2)),
                                             q = std::sqrt(h2 + std::pow(Block::at(shown, w) - ez, 2));
                                ASSERT_LE(error_px * off * std::sqrt(h2), tau * p * q * (1 + 1e-9))
                                    << "n " << n << " spacing " << spacing << " relief " << relief << " eye " << eye
                                    << " tau " << tau;
                            }
                        }
                    }
            }
    EXPECT_GT(dropped, 10000);
    EXPECT_GT(kept, 10000);
}

TEST(VertexErrors, AlternatingExtremesAreExactInTheSmallestBlockAndTheLargest) {
    for (const int n : {1, 2, 8}) {
        const Block block(n, false, 1e-3, alternating);
        const std::int32_t centre = block.b.of_level(1)[0];
        // The finest stand between two of the other sign, and every vertex has such a one under it.
        for (const std::int32_t v : block.b.coarse_to_fine()) ASSERT_EQ(Block::at(block.error, v), 2e6) << v;
        EXPECT_EQ(block.guaranteed(1e3, 0, 0, 0).triangles(), block.full());
        EXPECT_GE(Block::at(block.radius, centre), 2e6);
        EXPECT_LT(Block::at(block.radius, centre), 1e8);
    }
}

// 3^2 vertices: one level of centres, one of sides.
TEST(Bisection, TheSmallestBlockHasFiveVerticesToDrop) {
    for (const bool odd : {false, true}) {
        const Bisection b(1, odd);
        EXPECT_EQ(b.levels(), 2);
        EXPECT_EQ(b.of_level(1).size(), 1u);
        EXPECT_EQ(b.of_level(2).size(), 4u);
        BlockSelection s(b);
        EXPECT_EQ(s.triangles(), 2);
        for (const std::int32_t v : b.of_level(2)) s.add(v);
        EXPECT_EQ(s.triangles(), 8);
    }
}

// 21: one height that is no number must not hide the errors of others. Heights of stores are integers; a caller that
// has another source must refuse it before (z finite).
TEST(VertexErrors, OfSamplesOfAStoreAreFiniteWhateverTheSamples) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int k = 0; k < 30; ++k) {
        constexpr int kMost = (1 << 23) - 1;
        const double quantum = std::exp2(test::uniform(random, -10, 10));
        const Block block(test::uniform(random, 1, 6), k % 2 == 0, std::exp(test::uniform(random, -13, 13)),
                          [&](int, int) { return quantum * (test::uniform(random, 0, 1) == 0 ? kMost : -kMost); });
        for (const auto* list : {&block.delta, &block.local, &block.error, &block.radius})
            for (const float value : *list) ASSERT_TRUE(std::isfinite(value) && value >= 0);
    }
}

}  // namespace
}  // namespace scree
