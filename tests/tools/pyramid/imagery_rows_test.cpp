#include "tools/pyramid/imagery_rows.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "tests/common/test_support.h"

namespace scree {
namespace {

// An image in memory that counts how often each row is read.
class MemoryImage final : public ImageSource {
public:
    MemoryImage(std::int64_t width, std::int64_t height, test::Random& random, int alpha_percent = 100) {
        info_.width = width;
        info_.height = height;
        info_.channels = 4;
        pixels_.resize(static_cast<std::size_t>(4 * width * height));
        for (std::size_t k = 0; k < pixels_.size(); ++k)
            pixels_[k] = k % 4 == 3 ? (test::uniform(random, 0, 99) < alpha_percent ? 255 : 0)
                                    : static_cast<std::uint8_t>(random());
        reads_.resize(static_cast<std::size_t>(height));
    }
    const ImageInfo& info() const override { return info_; }
    const std::optional<Georeference>& georeference() const override { return nowhere_; }
    Result<void> read_channel(std::int64_t, std::int64_t, std::span<float>) override { return Error{}; }
    Result<void> read_channel(std::int64_t, std::int64_t, std::span<double>) override { return Error{}; }
    Result<void> read_rgba8(std::int64_t begin, std::int64_t end, std::span<std::uint8_t> out) override {
        EXPECT_TRUE(begin >= 0 && begin < end && end <= info_.height) << begin << ".." << end;
        EXPECT_GE(begin, last_begin_) << "the image must be read forward";
        last_begin_ = begin;
        for (std::int64_t r = begin; r < end; ++r) ++reads_[static_cast<std::size_t>(r)];
        const auto row = static_cast<std::size_t>(4 * info_.width);
        EXPECT_GE(out.size(), row * static_cast<std::size_t>(end - begin));
        std::memcpy(out.data(), pixels_.data() + static_cast<std::size_t>(begin) * row,
                    row * static_cast<std::size_t>(end - begin));
        return {};
    }
    const std::uint8_t* pixel(std::int64_t x, std::int64_t y) const {
        return &pixels_[static_cast<std::size_t>(4 * (y * info_.width + x))];
    }
    int most_reads() const { return *std::max_element(reads_.begin(), reads_.end()); }

private:
    ImageInfo info_;
    std::optional<Georeference> nowhere_;
    std::vector<std::uint8_t> pixels_;
    std::vector<int> reads_;
    std::int64_t last_begin_ = 0;
};

Georeference at(double first_x, double first_y, double step) {
    Georeference where;
    where.first_x = first_x;
    where.first_y = first_y;
    where.column_x = step;
    where.row_y = -step;
    return where;
}

using Texels = std::vector<std::vector<std::uint8_t>>;
Texels sampled(MemoryImage& image, const Georeference& where, const TexelGrid& grid, std::int64_t rows) {
    ImageryRows imagery(image, where, grid);
    Texels out(static_cast<std::size_t>(rows), std::vector<std::uint8_t>(static_cast<std::size_t>(4 * grid.width), 99));
    for (std::int64_t r = 0; r < rows; ++r) {
        const auto ok = imagery.sample(r, out[static_cast<std::size_t>(r)]);
        EXPECT_TRUE(ok) << ok.error().message;
    }
    return out;
}

TEST(ImageryRows, CoincidingTexelsAreCopiedExactly) {
    test::Random random(test::seed());
    MemoryImage image(37, 50, random, 80);
    const Texels out = sampled(image, at(1000, 2000, 2.5), {1000, 2000, 2.5, 37}, 50);
    for (std::int64_t y = 0; y < 50; ++y)
        for (std::int64_t x = 0; x < 37; ++x)
            ASSERT_EQ(
                std::memcmp(&out[static_cast<std::size_t>(y)][static_cast<std::size_t>(4 * x)], image.pixel(x, y), 4),
                0);
    EXPECT_EQ(image.most_reads(), 1);
}

TEST(ImageryRows, WholePixelShiftsCopyAndTheOutsideIsTransparent) {
    test::Random random(test::seed());
    for (const int shift : {-60, -5, 3, 36, 60}) {
        MemoryImage image(37, 30, random);
        const Texels out = sampled(image, at(0, 0, 1), {static_cast<double>(shift), -2.0, 1, 50}, 40);
        for (std::int64_t y = 0; y < 40; ++y)
            for (std::int64_t x = 0; x < 50; ++x) {
                const std::int64_t u = x + shift, v = y + 2;
                const std::uint8_t* found = &out[static_cast<std::size_t>(y)][static_cast<std::size_t>(4 * x)];
                const bool outside = u < 0 || v < 0 || u >= 37 || v >= 30;
                ASSERT_TRUE(outside ? found[3] == 0 : std::memcmp(found, image.pixel(u, v), 4) == 0)
                    << "shift " << shift << " at " << x << ", " << y;
            }
    }
}

TEST(ImageryRows, AHalfPixelShiftIsTheMeanOfFour) {
    test::Random random(test::seed());
    MemoryImage image(20, 20, random);
    const Texels out = sampled(image, at(0, 0, 10), {5, -5, 10, 19}, 19);
    for (std::int64_t y = 0; y < 19; ++y)
        for (std::int64_t x = 0; x < 19; ++x)
            for (int c = 0; c < 3; ++c) {
                const int sum = image.pixel(x, y)[c] + image.pixel(x + 1, y)[c] + image.pixel(x, y + 1)[c] +
                                image.pixel(x + 1, y + 1)[c];
                ASSERT_EQ(out[static_cast<std::size_t>(y)][static_cast<std::size_t>(4 * x + c)], (sum + 2) / 4);
            }
    EXPECT_LE(image.most_reads(), 2);
}

TEST(ImageryRows, AnyScaleIsBilinearBetweenPixelCentres) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int round = 0; round < 30; ++round) {
        const std::int64_t width = test::uniform(random, 1, 40), height = test::uniform(random, 1, 60);
        MemoryImage image(width, height, random);
        const double pixel = 3, step = std::uniform_real_distribution<double>(0.7, 9)(random);
        const TexelGrid grid{std::uniform_real_distribution<double>(-30, 60)(random),
                             std::uniform_real_distribution<double>(-60, 30)(random), step, 30};
        const Texels out = sampled(image, at(0, 0, pixel), grid, 40);
        EXPECT_LE(image.most_reads(), 2);
        for (std::int64_t y = 0; y < 40; ++y)
            for (std::int64_t x = 0; x < 30; ++x) {
                const double u = (grid.first_x + static_cast<double>(x) * step) / pixel,
                             v = -(grid.first_y - static_cast<double>(y) * step) / pixel;
                const std::uint8_t* found = &out[static_cast<std::size_t>(y)][static_cast<std::size_t>(4 * x)];
                const double rim_u = std::max(-0.5 - u, u - (static_cast<double>(width) - 0.5));
                const double rim_v = std::max(-0.5 - v, v - (static_cast<double>(height) - 0.5));
                if (std::max(rim_u, rim_v) > 1e-5) {
                    ASSERT_EQ(found[3], 0);
                    continue;
                }
                if (std::max(rim_u, rim_v) > -1e-5) continue;
                ASSERT_EQ(found[3], 255);
                const double cu = std::clamp(u, 0.0, static_cast<double>(width - 1)),
                             cv = std::clamp(v, 0.0, static_cast<double>(height - 1));
                const auto x0 = static_cast<std::int64_t>(cu), y0 = static_cast<std::int64_t>(cv);
                const std::int64_t x1 = std::min(x0 + 1, width - 1), y1 = std::min(y0 + 1, height - 1);
                const double wu = cu - static_cast<double>(x0), wv = cv - static_cast<double>(y0);
                for (int c = 0; c < 3; ++c) {
                    const double want = (image.pixel(x0, y0)[c] * (1 - wu) + image.pixel(x1, y0)[c] * wu) * (1 - wv) +
                                        (image.pixel(x0, y1)[c] * (1 - wu) + image.pixel(x1, y1)[c] * wu) * wv;
                    ASSERT_NEAR(found[c], want, 1.6) << "weights have 8 bits";  // 255 / 512 a side and the rounding
                }
            }
    }
}

TEST(ImageryRows, TransparentNeighboursLendNoColour) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    MemoryImage image(30, 30, random, 50);
    const TexelGrid grid{0.3, -0.4, 1, 29};
    const Texels out = sampled(image, at(0, 0, 1), grid, 29);
    for (std::int64_t y = 0; y < 29; ++y)
        for (std::int64_t x = 0; x < 29; ++x) {
            const std::uint8_t* found = &out[static_cast<std::size_t>(y)][static_cast<std::size_t>(4 * x)];
            EXPECT_EQ(found[3], image.pixel(x, y)[3]) << "the nearest pixel decides";
            bool all = true;
            for (const int k : {0, 1, 2, 3}) all = all && image.pixel(x + k % 2, y + k / 2)[3] == 255;
            ASSERT_TRUE(all || found[3] != 255 || std::memcmp(found, image.pixel(x, y), 4) == 0) << x << ", " << y;
        }
}

}  // namespace
}  // namespace scree
