#include "common/tint/hypsometry.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace scree {
namespace {

double lightness(const TintColour& c) { return 0.2126 * c.r + 0.7152 * c.g + 0.0722 * c.b; }

TEST(Hypsometry, LowHillsAreNeitherGreyNorWhite) {
    for (const double top_m : {20.0, 300.0, 837.0, 1500.0}) {
        const Hypsometry tint(4, top_m);
        for (int k = 0; k <= 100; ++k) {
            const TintColour c = tint.at(4 + (top_m - 4) * k / 100);
            EXPECT_GT(std::max(c.r, c.g) - c.b, 20) << top_m << " m, " << k;
            EXPECT_LT(lightness(c), 210);
        }
    }
}

TEST(Hypsometry, ANarrowRangeShowsTheSlopeOfItsHills) {
    for (const double low_m : {0.0, 900.0, 2500.0}) {
        const Hypsometry tint(low_m, low_m + 200);
        const TintColour low = tint.at(low_m), high = tint.at(low_m + 200);
        EXPECT_GT(std::hypot(high.r - low.r, high.g - low.g, high.b - low.b), 25) << low_m;
    }
}

TEST(Hypsometry, WideRangesHaveTheSameColourAtTheSameHeight) {
    const Hypsometry alps(200, 4800), andes(0, 6900);
    for (const double height_m : {250.0, 800.0, 1700.0, 2600.0, 3900.0, 4700.0}) {
        const TintColour a = alps.at(height_m), b = andes.at(height_m);
        EXPECT_LT(std::hypot(a.r - b.r, a.g - b.g, a.b - b.b), 6) << height_m;
    }
    EXPECT_GT(lightness(andes.at(6000)), 240);
    EXPECT_LT(lightness(andes.at(3000)), 190) << "white is for what is really high";
}

TEST(Hypsometry, ColoursChangeByLittleFromHeightToHeight) {
    for (const auto& [low, high] :
         {std::pair{0.0, 837.0}, std::pair{-430.0, 1200.0}, std::pair{455.0, 2622.0}, std::pair{0.0, 8800.0}}) {
        const Hypsometry tint(low, high);
        for (int k = 0; k < 500; ++k) {
            const TintColour a = tint.at(low + (high - low) * k / 500), b = tint.at(low + (high - low) * (k + 1) / 500);
            EXPECT_LT(std::hypot(a.r - b.r, a.g - b.g, a.b - b.b), 6);
        }
    }
}

TEST(Hypsometry, DeepGroundIsSeaAndADryDepressionIsLand) {
    const Hypsometry ocean(-5000, 3000), dead_sea(-430, 1000);
    for (const double height_m : {-20.0, -400.0, -4000.0}) EXPECT_GT(ocean.at(height_m).b, ocean.at(height_m).r + 20);
    EXPECT_GT(ocean.at(30).g, ocean.at(30).b);
    EXPECT_GT(dead_sea.at(-400).g, dead_sea.at(-400).b);
    EXPECT_LT(lightness(ocean.at(-4000)), lightness(ocean.at(-20)));
}

TEST(Hypsometry, AnyRangeHasColours) {
    constexpr double kMost = std::numeric_limits<float>::max();
    for (const auto& [low, high] :
         {std::pair{0.0, 0.0}, std::pair{9000.0, 9000.0}, std::pair{-kMost, kMost}, std::pair{5.0, -5.0}})
        for (const double height_m : {low, high, 0.0, 1e30, -1e30}) {
            const TintColour c = Hypsometry(low, high).at(height_m);
            for (const double part : {c.r, c.g, c.b}) EXPECT_TRUE(part >= 0 && part <= 255) << low << ' ' << high;
        }
}

}  // namespace
}  // namespace scree
