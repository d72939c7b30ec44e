#include "tools/pyramid/texture_filter.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "tests/common/test_support.h"
#include "tools/pyramid/texture_filter_kernel.h"

namespace scree {
namespace {

double linear(int v) {
    const double s = v / 255.0;
    return s <= 0.04045 ? s / 12.92 : std::pow((s + 0.055) / 1.055, 2.4);
}
double srgb(double l) { return 255 * (l <= 0.0031308 ? 12.92 * l : 1.055 * std::pow(l, 1 / 2.4) - 0.055); }

std::array<std::uint8_t, 4> mean_of(const std::array<std::array<std::uint8_t, 4>, 4>& t) {
    std::uint8_t upper[8], lower[8];
    for (std::size_t k = 0; k < 4; ++k) {
        upper[k] = t[0][k], upper[4 + k] = t[1][k];
        lower[k] = t[2][k], lower[4 + k] = t[3][k];
    }
    std::array<std::uint8_t, 4> out{};
    downsample_rgba_row(upper, lower, 1, out.data());
    return out;
}

TEST(TextureFilter, MeanIsTakenInLinearLight) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int round = 0; round < 200000; ++round) {
        std::array<std::array<std::uint8_t, 4>, 4> t{};
        const int dark = round % 3 == 0 ? 20 : 255;  // the dark end is where tables lose most
        for (auto& texel : t) {
            for (auto& v : texel) v = static_cast<std::uint8_t>(test::uniform(random, 0, dark));
            texel[3] = 255;
        }
        const auto out = mean_of(t);
        ASSERT_EQ(out[3], 255);
        for (std::size_t c = 0; c < 3; ++c) {
            const double want = srgb((linear(t[0][c]) + linear(t[1][c]) + linear(t[2][c]) + linear(t[3][c])) / 4);
            ASSERT_NEAR(out[c], want, 1.0)
                << int{t[0][c]} << ' ' << int{t[1][c]} << ' ' << int{t[2][c]} << ' ' << int{t[3][c]};
        }
    }
}

TEST(TextureFilter, EqualTexelsKeepTheirValue) {
    for (int v = 0; v < 256; ++v)
        for (const int alpha : {1, 2, 128, 255}) {
            const auto b = static_cast<std::uint8_t>(v);
            const std::array<std::uint8_t, 4> texel{b, b, b, static_cast<std::uint8_t>(alpha)};
            ASSERT_EQ(mean_of({texel, texel, texel, texel}), texel);
        }
}

TEST(TextureFilter, AlphaIsThePlainRoundedMean) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int round = 0; round < 20000; ++round) {
        std::array<std::array<std::uint8_t, 4>, 4> t{};
        int sum = 0;
        for (auto& texel : t) {
            texel[3] = static_cast<std::uint8_t>(round < 16 ? (round >> (&texel - t.data()) & 1) * 255
                                                            : test::uniform(random, 0, 255));
            sum += texel[3];
        }
        ASSERT_EQ(mean_of(t)[3], (sum + 2) / 4);
    }
}

TEST(TextureFilter, TransparentSourcesHaveNoWeightInTheColour) {
    const std::array<std::uint8_t, 4> red{200, 10, 30, 255}, ghost{255, 255, 255, 0}, blue{0, 0, 250, 255};
    EXPECT_EQ(mean_of({red, ghost, ghost, ghost}), (std::array<std::uint8_t, 4>{200, 10, 30, 64}));
    EXPECT_EQ(mean_of({ghost, ghost, ghost, ghost}), (std::array<std::uint8_t, 4>{0, 0, 0, 0}));
    const auto mixed = mean_of({red, ghost, blue, ghost}), alone = mean_of({red, red, blue, blue});
    for (std::size_t c = 0; c < 3; ++c) EXPECT_EQ(mixed[c], alone[c]);
    EXPECT_EQ(mixed[3], 128);
}

TEST(TextureFilter, ARowIsFilteredTexelByTexel) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    std::vector<std::uint8_t> upper(8 * 33), lower(8 * 33), out(4 * 33 + 4, 77);
    for (auto* row : {&upper, &lower})
        for (auto& v : *row) v = static_cast<std::uint8_t>(random());
    downsample_rgba_row(upper.data(), lower.data(), 33, out.data());
    for (std::size_t k = 0; k < 33; ++k) {
        std::array<std::array<std::uint8_t, 4>, 4> t{};
        for (std::size_t c = 0; c < 4; ++c)
            t[0][c] = upper[8 * k + c], t[1][c] = upper[8 * k + 4 + c], t[2][c] = lower[8 * k + c],
            t[3][c] = lower[8 * k + 4 + c];
        const auto want = mean_of(t);
        for (std::size_t c = 0; c < 4; ++c) ASSERT_EQ(out[4 * k + c], want[c]);
    }
    for (std::size_t c = 0; c < 4; ++c) EXPECT_EQ(out[4 * 33 + c], 77) << "wrote past its end";
}

struct VectorRow {
    const char* name;
    FilterRow* row;
    bool runs_here;
};
class VectorRows : public testing::TestWithParam<VectorRow> {
protected:
    void SetUp() override {
        if (!GetParam().runs_here) GTEST_SKIP() << "this processor has no " << GetParam().name;
    }
};
INSTANTIATE_TEST_SUITE_P(TextureFilter, VectorRows,
                         testing::Values(VectorRow{"AVX2", filter_row_avx2, filter_row_avx2_runs_here()},
                                         VectorRow{"AVX-512 VBMI", filter_row_avx512, filter_row_avx512_runs_here()}),
                         [](const auto& tested) { return tested.index == 0 ? "Avx2" : "Avx512"; });

TEST_P(VectorRows, GiveTheBytesOfTheScalarOne) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (std::size_t count = 0; count <= 140; ++count) {
        for (int kind = 0; kind < 5; ++kind) {
            std::vector<std::uint8_t> upper(8 * count), lower(8 * count), want(4 * count + 4, 77),
                got(4 * count + 4, 77);
            for (auto* row : {&upper, &lower})
                for (std::size_t i = 0; i < row->size(); ++i) {
                    (*row)[i] = static_cast<std::uint8_t>(kind == 3 ? random() % 16 : random());
                    const bool rim = random() % 40 == 0;
                    if (i % 4 == 3 && kind < 4) (*row)[i] = kind == 1 ? 0 : kind == 2 && rim ? 254 : 255;
                }
            filter_row_scalar(filter_tables(), upper.data(), lower.data(), static_cast<std::int64_t>(count),
                              want.data());
            GetParam().row(filter_tables(), upper.data(), lower.data(), static_cast<std::int64_t>(count), got.data());
            ASSERT_EQ(got, want) << count << " texels, kind " << kind;
        }
    }
}

TEST_P(VectorRows, GiveEveryMeanAsTheScalarOne) {
    // All pairs of levels: every entry of the way there and thousands of the way back.
    std::vector<std::uint8_t> upper(8 * 256), want(4 * 256), got(4 * 256);
    for (int a = 0; a < 256; ++a) {
        for (std::size_t i = 0; i < upper.size(); ++i)
            upper[i] = static_cast<std::uint8_t>(i % 4 == 3 ? 255 : i % 8 < 4 ? a : static_cast<int>(i / 8));
        filter_row_scalar(filter_tables(), upper.data(), upper.data(), 256, want.data());
        GetParam().row(filter_tables(), upper.data(), upper.data(), 256, got.data());
        ASSERT_EQ(got, want) << a;
    }
}

}  // namespace
}  // namespace scree
