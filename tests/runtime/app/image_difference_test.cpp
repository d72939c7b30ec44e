// PSNR and SSIM against values worked out by hand, and SSIM against its formula written out window by window.
#include "runtime/app/image_difference.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "tests/common/test_support.h"

namespace scree::test {
namespace {

using Picture = std::vector<std::uint8_t>;

Picture grey(int width, int height, std::uint8_t value) {
    return Picture(3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height), value);
}

Picture noise(int width, int height, std::mt19937& random) {
    Picture p = grey(width, height, 0);
    for (auto& byte : p) byte = static_cast<std::uint8_t>(random() >> 24);
    return p;
}

// Wang et al., equation 13 with the weights of section III-B, straight from its definition.
double ssim_by_definition(int width, int height, const Picture& a, const Picture& b) {
    const auto luma = [&](const Picture& p, int x, int y) {
        const std::size_t k =
            3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x));
        return 0.299 * p[k] + 0.587 * p[k + 1] + 0.114 * p[k + 2];
    };
    const auto weight = [](int dx, int dy) { return std::exp(-(dx * dx + dy * dy) / (2 * 1.5 * 1.5)); };
    double weights = 0, total = 0;
    for (int dy = -5; dy <= 5; ++dy)
        for (int dx = -5; dx <= 5; ++dx) weights += weight(dx, dy);
    int windows = 0;
    for (int y = 5; y + 5 < height; ++y)
        for (int x = 5; x + 5 < width; ++x, ++windows) {
            const auto mean = [&](const auto& value) {
                double sum = 0;
                for (int dy = -5; dy <= 5; ++dy)
                    for (int dx = -5; dx <= 5; ++dx) sum += weight(dx, dy) / weights * value(x + dx, y + dy);
                return sum;
            };
            const double ma = mean([&](int i, int j) { return luma(a, i, j); }),
                         mb = mean([&](int i, int j) { return luma(b, i, j); });
            const double va = mean([&](int i, int j) { return std::pow(luma(a, i, j) - ma, 2); }),
                         vb = mean([&](int i, int j) { return std::pow(luma(b, i, j) - mb, 2); }),
                         both = mean([&](int i, int j) { return (luma(a, i, j) - ma) * (luma(b, i, j) - mb); });
            const double c1 = 2.55 * 2.55, c2 = 7.65 * 7.65;
            total += (2 * ma * mb + c1) * (2 * both + c2) / ((ma * ma + mb * mb + c1) * (va + vb + c2));
        }
    return total / windows;
}

TEST(ImageDifferences, PsnrIsThatOfTheMeanSquare) {
    EXPECT_EQ(psnr_db(mean_squared_difference(grey(7, 5, 9), grey(7, 5, 9))), kSamePsnr_db);
    EXPECT_NEAR(psnr_db(mean_squared_difference(grey(7, 5, 9), grey(7, 5, 10))), 48.1308, 1e-4);
    EXPECT_NEAR(psnr_db(mean_squared_difference(grey(7, 5, 0), grey(7, 5, 255))), 0, 1e-12);
    Picture one = grey(10, 10, 100);
    one[17] = 130;  // 900 / 300 = 3
    EXPECT_DOUBLE_EQ(mean_squared_difference(one, grey(10, 10, 100)), 3);
    EXPECT_NEAR(psnr_db(3), 43.3596, 1e-4);
    EXPECT_LE(psnr_db(1e-12), kSamePsnr_db) << "what differs is not more alike than what does not";
}

TEST(ImageDifferences, SsimOfEvenPicturesIsThatOfTheirLuminance) {
    EXPECT_NEAR(ssim(20, 15, grey(20, 15, 100), grey(20, 15, 100)), 1, 1e-9);
    EXPECT_NEAR(ssim(20, 15, grey(20, 15, 100), grey(20, 15, 120)), (24000 + 6.5025) / (24400 + 6.5025), 1e-9);
    EXPECT_NEAR(ssim(20, 15, grey(20, 15, 0), grey(20, 15, 255)), 6.5025 / (65025 + 6.5025), 1e-9);
    // Smaller than a window: one window.
    EXPECT_NEAR(ssim(3, 2, grey(3, 2, 100), grey(3, 2, 120)), (24000 + 6.5025) / (24400 + 6.5025), 1e-9);
    EXPECT_NEAR(ssim(1, 1, grey(1, 1, 100), grey(1, 1, 100)), 1, 1e-9);
}

TEST(ImageDifferences, SsimIsThatOfItsDefinition) {
    SCREE_TRACE_SEED();
    std::mt19937 random(static_cast<std::mt19937::result_type>(seed()));
    for (const auto& [width, height] : {std::pair{11, 11}, std::pair{26, 17}, std::pair{12, 40}}) {
        const Picture a = noise(width, height, random);
        Picture b = a, turned = a;
        for (auto& byte : b) byte = static_cast<std::uint8_t>(std::min(255, byte + static_cast<int>(random() % 60)));
        for (auto& byte : turned) byte = static_cast<std::uint8_t>(255 - byte);
        EXPECT_NEAR(ssim(width, height, a, a), 1, 1e-9);
        EXPECT_NEAR(ssim(width, height, a, b), ssim_by_definition(width, height, a, b), 1e-9);
        EXPECT_NEAR(ssim(width, height, b, a), ssim(width, height, a, b), 1e-9);
        EXPECT_NEAR(ssim(width, height, a, turned), ssim_by_definition(width, height, a, turned), 1e-9);
        EXPECT_LT(ssim(width, height, a, turned), -0.5);
    }
}

// Sums of squares must not make noise of what is even and bright.
TEST(ImageDifferences, EvenBrightPicturesAreTheSame) {
    Picture a = grey(64, 64, 254);
    Picture b = a;
    b[3 * 40 * 64] = 255;
    EXPECT_NEAR(ssim(64, 64, a, b), ssim_by_definition(64, 64, a, b), 1e-9);
}

}  // namespace
}  // namespace scree::test
