#include "common/mesh/geometric_error.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/mesh/drawn_surface.h"
#include "common/mesh/error_kernels.h"
#include "tests/common/test_support.h"

namespace scree {
namespace {

using Samples = std::vector<std::int32_t>;

std::size_t at(int n, int i, int j) { return static_cast<std::size_t>(j * ((1 << n) + 1) + i); }

// Whether vertex (i, j) belongs to a present cell.
bool is_present(const std::vector<std::uint8_t>& cells, int n, int i, int j) {
    if (cells.empty()) return true;
    const int m = 1 << n;
    for (int y = std::max(j - 1, 0); y <= std::min(j, m - 1); ++y)
        for (int x = std::max(i - 1, 0); x <= std::min(i, m - 1); ++x)
            if (cells[static_cast<std::size_t>(y * m + x)] != 0) return true;
    return false;
}

// Greatest |z - drawn| over all 16 masks, where finest vertex (i, j) stands at (origin + (i, j)) / unit of the drawn
// tile.
double brute_error(const Samples& drawn, int n, int geomip, std::int64_t origin_i, std::int64_t origin_j,
                   std::int64_t unit, const Samples& finest, const std::vector<std::uint8_t>& cells) {
    double worst = 0;
    for (unsigned mask = 0; mask < kEdgeMaskCount; ++mask)
        for (int j = 0; j <= 1 << n; ++j)
            for (int i = 0; i <= 1 << n; ++i) {
                if (!is_present(cells, n, i, j)) continue;
                const ExactHeight h = drawn_height(drawn, n, {geomip, mask}, origin_i + i, origin_j + j, unit);
                const std::int64_t d = std::abs(finest[at(n, i, j)] * h.denominator - h.numerator);
                worst = std::max(worst, static_cast<double>(d) / static_cast<double>(h.denominator));
            }
    return worst;
}

BlockVertices coarsest_block_of(const Samples& samples, int n) {
    BlockVertices block{};
    const int half = 1 << (n - 1);
    for (int k = 0; k < 9; ++k) block[static_cast<std::size_t>(k)] = samples[at(n, k % 3 * half, k / 3 * half)];
    return block;
}

FinestVertices finest_of(const Samples& samples, const std::vector<std::uint8_t>& present, int n) {
    return {samples.data(), present.empty() ? nullptr : present.data(), n};
}

TEST(LeafErrors, EqualTheBruteForceOverAllMasks) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int n = 2; n <= 4; ++n)
        for (int k = 0; k < 12; ++k) {
            const Samples samples = test::random_samples(random, n, k % 2 == 0 ? 500 : kMaxHeightUnits);
            const auto cells =
                k % 3 == 0 ? std::vector<std::uint8_t>{} : test::random_presence(random, n, k % 3 == 1 ? 60 : 8);
            const auto vertices = present_vertices(cells, n);
            const auto errors = leaf_errors(finest_of(samples, vertices, n));
            double running = 0;
            for (int g = 0; g < n; ++g) {
                running = std::max(running, brute_error(samples, n, g, 0, 0, 1, samples, cells));
                ASSERT_EQ(errors[static_cast<std::size_t>(g)], running)
                    << "n " << n << " case " << k << " geomip " << g;
            }
        }
}

TEST(CoarseBlockError, EqualsTheBruteForceAtEveryPlaceInAnAncestor) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int n = 2; n <= 4; ++n)
        for (int up = 1; up <= 3; ++up) {
            const Samples ancestor = test::random_samples(random, n, 3000);
            const int m = 1 << n, leaves = 1 << up;
            const std::int64_t stride = std::int64_t{1} << (up + n - 1);
            for (int place = 0; place < leaves * leaves; ++place) {
                const Samples leaf = test::random_samples(random, n, 3000);
                const auto cells = place % 2 == 0 ? std::vector<std::uint8_t>{} : test::random_presence(random, n, 20);
                const auto vertices = present_vertices(cells, n);
                const std::int64_t i = place % leaves * m, j = place / leaves * m;
                ASSERT_EQ(
                    coarse_block_error(coarsest_block_of(ancestor, n), stride, i, j, finest_of(leaf, vertices, n)),
                    brute_error(ancestor, n, n - 1, i, j, std::int64_t{1} << up, leaf, cells))
                    << "n " << n << " up " << up << " place " << place;
            }
        }
}

// Heights that make every sum as large as it can be, or any.
Samples extreme_samples(test::Random& random, int n, int kind) {
    Samples samples = test::random_samples(random, n, kind == 0 ? 300 : kMaxHeightUnits);
    if (kind == 2)
        for (auto& z : samples) z = z < 0 ? -kMaxHeightUnits : kMaxHeightUnits;
    if (kind == 3) std::fill(samples.begin(), samples.end(), samples.front());
    return samples;
}

// Presence of random tiles: all, many, few or no cells.
std::vector<std::uint8_t> some_presence(test::Random& random, int n) {
    const int kind = test::uniform(random, 0, 3);
    return kind == 0 ? std::vector<std::uint8_t>{}
                     : test::random_presence(random, n,
                                             kind == 1   ? 90
                                             : kind == 2 ? 5
                                                         : 0);
}

TEST(LeafErrors, OfSeveralTilesAreThoseOfEach) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int n = 1; n <= 7; ++n)
        for (int k = 0; k < (n < 6 ? 40 : 4); ++k) {
            const auto count = static_cast<std::size_t>(test::uniform(random, 1, 37));
            std::vector<Samples> samples(count);
            std::vector<std::vector<std::uint8_t>> present(count);
            std::vector<FinestVertices> tiles;
            for (std::size_t t = 0; t < count; ++t) {
                samples[t] = extreme_samples(random, n, test::uniform(random, 0, 3));
                if (k % 2 == 0) present[t] = present_vertices(some_presence(random, n), n);
                tiles.push_back(finest_of(samples[t], present[t], n));
            }
            std::vector<LeafErrors> errors(count);
            leaf_errors(tiles, errors);
            for (std::size_t t = 0; t < count; ++t)
                ASSERT_EQ(errors[t], leaf_errors(tiles[t])) << "n " << n << " case " << k << " tile " << t;
        }
}

std::vector<const ErrorKernels*> error_kernels() {
    std::vector<const ErrorKernels*> kernels{&kErrorKernelsSse2};
    if (__builtin_cpu_supports("avx2")) kernels.push_back(&kErrorKernelsAvx2);
    if (__builtin_cpu_supports("avx512f")) kernels.push_back(&kErrorKernelsAvx512);
    return kernels;
}

TEST(ErrorKernels, GiveTheSameLeafErrors) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    constexpr auto kTiles = static_cast<std::size_t>(kLeafErrorTiles);
    for (int n = 1; n <= kMaxLeafErrorLog2; ++n)
        for (int k = 0; k < 8; ++k) {
            std::vector<std::int32_t> samples(at(n, 1 << n, 1 << n) * kTiles + kTiles), present(samples.size());
            for (auto& z : samples)
                z = k < 4 ? test::uniform(random, -kMaxHeightUnits, kMaxHeightUnits)
                          : (test::uniform(random, 0, 1) != 0 ? kMaxHeightUnits : -kMaxHeightUnits);
            for (auto& p : present) p = -test::uniform(random, 0, 1);
            const std::size_t count = static_cast<std::size_t>(n) * kTiles;
            std::vector<std::int32_t> first(count), worst(count);
            for (const bool masked : {false, true}) {
                const std::int32_t* mask = masked ? present.data() : nullptr;
                kErrorKernelsSse2.leaf_errors(samples.data(), mask, n, first.data());
                for (const ErrorKernels* kernels : error_kernels()) {
                    std::fill(worst.begin(), worst.end(), -1);
                    kernels->leaf_errors(samples.data(), mask, n, worst.data());
                    ASSERT_EQ(worst, first) << "n " << n << " case " << k << " masked " << masked;
                }
            }
        }
}

TEST(ErrorKernels, GiveThePlainDistanceFromAPlane) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int k = 0; k < 3000; ++k) {
        const int n = test::uniform(random, kMinPlaneLog2, 6), m = 1 << n;
        const Samples samples = extreme_samples(random, n, test::uniform(random, 0, 2));
        const std::int64_t scale = std::int64_t{2} << test::uniform(random, 0, 28);
        const auto value = [&] { return scale * test::uniform(random, -kMaxHeightUnits, kMaxHeightUnits) / (2 * m); };
        const std::int64_t corner = value(), per_column = value() / m, per_row = value() / m;
        const auto part = static_cast<TilePlane::Part>(test::uniform(random, 0, 4));
        const auto inside = [&](int i, int j) {
            return part == TilePlane::whole || (part == TilePlane::south_west && i <= j) ||
                   (part == TilePlane::north_east && i >= j) || (part == TilePlane::north_west && i + j <= m) ||
                   (part == TilePlane::south_east && i + j >= m);
        };
        std::int64_t greatest = 0;
        for (int j = 0; j <= m; ++j)
            for (int i = 0; i <= m; ++i)
                if (inside(i, j))
                    greatest = std::max(
                        greatest, std::abs(scale * samples[at(n, i, j)] - (corner + i * per_column + j * per_row)));
        const TilePlane plane{static_cast<double>(corner), static_cast<double>(per_column),
                              static_cast<double>(per_row), part};
        for (const ErrorKernels* kernels : error_kernels())
            ASSERT_EQ(kernels->plane_distance(samples.data(), n, static_cast<double>(scale), plane),
                      static_cast<double>(greatest))
                << "n " << n << " part " << part << " scale " << scale;
    }
}

// Of a block's cells it takes those on its axes, on its diagonals, next to them, and any.
std::int64_t some_offset(test::Random& random, std::int64_t tiles, std::int64_t other) {
    switch (test::uniform(random, 0, 4)) {
        case 0:
            return other;
        case 1:
            return tiles - 1 - other;
        case 2:
            return std::clamp<std::int64_t>(other + test::uniform(random, -1, 1), 0, tiles - 1);
        case 3:
            return std::clamp<std::int64_t>(tiles / 2 + test::uniform(random, -1, 0), 0, tiles - 1);
        default:
            return std::uniform_int_distribution<std::int64_t>(0, tiles - 1)(random);
    }
}

TEST(GreatestBlockError, IsThePlainMaximumWhateverWasKnown) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int n = 1; n <= 6; ++n)
        for (int log2_stride = n; log2_stride <= 28; ++log2_stride)
            for (int k = 0; k < 12; ++k) {
                const std::int64_t stride = std::int64_t{1} << log2_stride, m = 1 << n, tiles = 2 * stride / m;
                const int kind = test::uniform(random, 0, 3);
                const Samples samples = extreme_samples(random, n, kind);
                const auto present = present_vertices(some_presence(random, n), n);
                const FinestVertices finest = finest_of(samples, present, n);
                BlockVertices block{};
                for (auto& z : block) {
                    z = test::uniform(random, -kMaxHeightUnits, kMaxHeightUnits);
                    if (kind == 0) z = test::uniform(random, -900, 900);
                    if (kind == 2) z = z < 0 ? -kMaxHeightUnits : kMaxHeightUnits;
                }
                const std::int64_t i = some_offset(random, tiles, 0), j = some_offset(random, tiles, i);
                const double plain = coarse_block_error(block, stride, i * m, j * m, finest);
                const LeafErrors own = leaf_errors(finest);
                const double unit = 0.5 / static_cast<double>(stride);
                for (const double known : {0.0, plain / 2, plain - unit, plain, plain + unit, plain * 2})
                    ASSERT_EQ(greatest_block_error(block, stride, i * m, j * m, finest, own, std::max(known, 0.0)),
                              std::max(known, plain))
                        << "n " << n << " stride 2^" << log2_stride << " case " << k;
            }
}

// What a descent from few vertices to all of them can miss: one vertex that stands out by the smallest unit.
TEST(GreatestBlockError, FindsTheOneVertexThatStandsOut) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    const int n = 5, m = 1 << n;
    for (int k = 0; k < 400; ++k) {
        const int up = test::uniform(random, 0, 6);
        const std::int64_t stride = std::int64_t{m} << up, tiles = 2 * stride / m;
        const std::int64_t i = some_offset(random, tiles, 0), j = some_offset(random, tiles, i);
        Samples samples(at(n, m, m) + 1, 7);
        const BlockVertices block{7, 7, 7, 7, 7, 7, 7, 7, 7};
        const int x = test::uniform(random, 0, m), y = test::uniform(random, 0, m);
        samples[at(n, x, y)] += k % 2 == 0 ? 1 : -1;
        const FinestVertices finest = finest_of(samples, {}, n);
        const LeafErrors own = leaf_errors(finest);
        ASSERT_EQ(greatest_block_error(block, stride, i * m, j * m, finest, own, 0), 1) << x << ", " << y;
        ASSERT_EQ(greatest_block_error(block, stride, i * m, j * m, finest, own, 0.99), 1) << x << ", " << y;
        ASSERT_EQ(greatest_block_error(block, stride, i * m, j * m, finest, own, 1.5), 1.5) << x << ", " << y;
    }
}

TEST(GeometricError, ARampHasNone) {
    const int n = 4, m = 16;
    Samples samples(17 * 17);
    for (int j = 0; j <= m; ++j)
        for (int i = 0; i <= m; ++i) samples[at(n, i, j)] = 700 * i - 311 * j + 5;
    for (const double error : leaf_errors(finest_of(samples, {}, n))) EXPECT_EQ(error, 0);
    BlockVertices block{};  // the same plane two levels up, the leaf in its south-east
    for (int k = 0; k < 9; ++k)
        block[static_cast<std::size_t>(k)] = 700 * (k % 3 * 32 - 48) - 311 * (k / 3 * 32 - 48) + 5;
    EXPECT_EQ(coarse_block_error(block, 32, 48, 48, finest_of(samples, {}, n)), 0);
}

TEST(GeometricError, ASpikeCountsInFullAtEveryLevelThatDropsIt) {
    const int n = 4;
    constexpr std::int32_t kHeight = 12345;
    Samples samples(17 * 17, 0);
    samples[at(n, 5, 7)] = kHeight;
    const auto errors = leaf_errors(finest_of(samples, {}, n));
    EXPECT_EQ(errors[0], 0);
    for (std::size_t g = 1; g < 4; ++g) EXPECT_EQ(errors[g], kHeight);
    for (int up = 1; up < 20; ++up)
        EXPECT_EQ(coarse_block_error({}, std::int64_t{1} << (up + n - 1), 0, 0, finest_of(samples, {}, n)), kHeight);
}

TEST(GeometricError, ASpikeOnTheBorderCountsAtOnceBecauseThinningRemovesIt) {
    Samples samples(17 * 17, 0);
    samples[at(4, 5, 0)] = 99;
    EXPECT_EQ(leaf_errors(finest_of(samples, {}, 4))[0], 99);
}

TEST(GeometricError, AbsentCellsDoNotCount) {
    const int n = 2;
    Samples samples(25, 0);
    samples[at(n, 1, 1)] = 1000;
    std::vector<std::uint8_t> cells(16, 0);
    cells[15] = 1;
    const auto vertices = present_vertices(cells, n);
    for (const double error : leaf_errors(finest_of(samples, vertices, n))) EXPECT_EQ(error, 0);
    cells[0] = 1;
    EXPECT_EQ(leaf_errors(finest_of(samples, present_vertices(cells, n), n))[1], 1000);
}

TEST(GeometricError, AlternatingExtremesAreExact) {
    constexpr double kWorst = 2.0 * kMaxHeightUnits;
    for (int n = 2; n <= 5; ++n) {
        Samples samples(at(n, 1 << n, 1 << n) + 1);
        for (int j = 0; j <= 1 << n; ++j)
            for (int i = 0; i <= 1 << n; ++i)
                samples[at(n, i, j)] = (i + j) % 2 == 0 ? kMaxHeightUnits : -kMaxHeightUnits;
        const auto errors = leaf_errors(finest_of(samples, {}, n));
        for (int g = 0; g < n; ++g) EXPECT_EQ(errors[static_cast<std::size_t>(g)], kWorst);
        BlockVertices high{};
        high.fill(kMaxHeightUnits);
        for (int log2 = n; log2 <= 28; ++log2)
            EXPECT_EQ(coarse_block_error(high, std::int64_t{1} << log2, 0, 0, finest_of(samples, {}, n)), kWorst);
    }
}

TEST(PresentVertices, AreTheCornersOfPresentCells) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int n = 1; n <= 4; ++n) {
        const auto cells = test::random_presence(random, n, 15);
        const auto vertices = present_vertices(cells, n);
        for (int j = 0; j <= 1 << n; ++j)
            for (int i = 0; i <= 1 << n; ++i) EXPECT_EQ(vertices[at(n, i, j)] != 0, is_present(cells, n, i, j));
    }
    EXPECT_TRUE(present_vertices({}, 3).empty());
}

TEST(RoundUpToFloat, IsTheSmallestFloatNotBelow) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int k = 0; k < 100000; ++k) {
        const double value = std::ldexp(static_cast<double>(random() >> 11), test::uniform(random, -80, 0));
        const float rounded = round_up_to_float(value);
        ASSERT_GE(static_cast<double>(rounded), value);
        if (rounded > 0) {
            ASSERT_LT(static_cast<double>(std::nextafter(rounded, -1.0f)), value);
        }
    }
    EXPECT_EQ(round_up_to_float(0), 0.0f);
    EXPECT_EQ(round_up_to_float(16777217.0), 16777218.0f);
    EXPECT_EQ(round_up_to_float(16777216.0), 16777216.0f);
    EXPECT_GT(round_up_to_float(1e-300), 0.0f);
}

}  // namespace
}  // namespace scree
