#include "tools/pyramid/tint.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <vector>

#include "tests/common/test_support.h"

namespace scree {
namespace {

std::vector<std::uint8_t> tinted(const std::vector<double>& upper, const std::vector<double>& lower,
                                 const TintOptions& o) {
    std::vector<std::uint8_t> out((upper.size() - 1) * 4);
    Tint(o).row(upper, lower, out);
    return out;
}

TEST(Tint, IsOpaqueAndDefinedForAnyHeights) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int round = 0; round < 200; ++round) {
        const double span = round % 4 == 0 ? 0 : 1e7;
        std::vector<double> upper(9), lower(9);
        for (auto* row : {&upper, &lower})
            for (auto& z : *row) z = std::uniform_real_distribution<double>(-1e7, 1e7)(random) * (span > 0 ? 1 : 1e-9);
        const auto out = tinted(upper, lower, {-1e7, -1e7 + 2 * span, round % 2 == 0 ? 1e-6 : 1e6});
        for (std::size_t k = 3; k < out.size(); k += 4) ASSERT_EQ(out[k], 255);
    }
}

TEST(Tint, SlopesTowardsTheLightAreBrighter) {
    const TintOptions o{0, 1000, 10};
    // Falls to the north-west, flat, falls to the south-east; the same middle height.
    const auto lit = tinted({495, 500}, {500, 505}, o), flat = tinted({500, 500}, {500, 500}, o),
               dark = tinted({505, 500}, {500, 495}, o);
    for (std::size_t c = 0; c < 3; ++c) {
        EXPECT_GT(lit[c], flat[c]);
        EXPECT_GT(flat[c], dark[c]);
    }
}

// The mean of the four sides' light is that of flat ground, so that no ridge is lost whichever way it runs.
TEST(Tint, SlopesOfEveryAspectDifferFromFlatGroundOrFromTheirOpposite) {
    const TintOptions o{0, 1000, 10};
    const int flat = tinted({500, 500}, {500, 500}, o)[1];
    for (int aspect = 0; aspect < 16; ++aspect) {
        const double angle = aspect * 0.39269908169872414, dx = 3 * std::cos(angle), dy = 3 * std::sin(angle);
        const auto slope = [&](double sign) {
            return int{tinted({500 + sign * (dy - dx), 500 + sign * (dy + dx)},
                              {500 + sign * (-dy - dx), 500 + sign * (-dy + dx)}, o)[1]};
        };
        EXPECT_GT(std::abs(slope(1) - flat) + std::abs(slope(-1) - flat), 12) << aspect;
        EXPECT_GT(std::min(slope(1), slope(-1)), 40) << "no slope lies in the dark, " << aspect;
    }
}

TEST(Tint, LitSlopesAreWarmerThanShadedOnes) {
    const TintOptions o{0, 1000, 10};
    const auto lit = tinted({490, 500}, {500, 510}, o), dark = tinted({510, 500}, {500, 490}, o);
    EXPECT_GT(lit[0] * dark[2], dark[0] * lit[2]);
}

TEST(Tint, FlatSeaIsBlueAndFlatLandIsNot) {
    const TintOptions o{-5, 1000, 10};
    const auto sea = tinted({0, 0}, {0, 0}, o), land = tinted({10, 10}, {10, 10}, o);
    EXPECT_GT(sea[2], sea[0]);
    EXPECT_GT(land[1], land[2]);
    const auto salt_flat = tinted({-85, -85}, {-85, -85}, {-86, 1000, 10});
    EXPECT_GT(salt_flat[1], salt_flat[2]);
}

TEST(Tint, EqualHeightsEverywhereHaveAColour) {
    const auto out = tinted({5, 5, 5}, {5, 5, 5}, {5, 5, 10});
    EXPECT_EQ(std::vector<std::uint8_t>(out.begin(), out.begin() + 4),
              std::vector<std::uint8_t>(out.begin() + 4, out.end()));
    EXPECT_GT(int{out[0]} + out[1] + out[2], 100);
}

}  // namespace
}  // namespace scree
