#include "runtime/render/highlight.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include <glm/glm.hpp>

namespace scree {
namespace {

constexpr int kColours = 8;

glm::dvec3 light_of(std::array<std::uint8_t, 4> srgb) {
    glm::dvec3 out;
    for (int k = 0; k < 3; ++k) {
        const double c = srgb[static_cast<std::size_t>(k)] / 255.0;
        out[k] = c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4);
    }
    return out;
}

/// CIE L*.
double lightness(glm::dvec3 light) {
    const double y = glm::dot(light, glm::dvec3(0.2126, 0.7152, 0.0722));
    return y > 0.008856 ? 116 * std::cbrt(y) - 16 : 903.3 * y;
}

/// What is seen without one kind of cone: Machado, Oliveira and Fernandes, "A Physiologically-based Model for
/// Simulation of Color Vision Deficiency" (2009), severity 1. Rows.
const std::array<glm::dmat3, 3> kDichromats{
    {{0.152286, 1.052583, -0.204868, 0.114503, 0.786281, 0.099216, -0.003882, -0.048116, 1.051998},
     {0.367322, 0.860646, -0.227968, 0.280085, 0.672501, 0.047413, -0.011820, 0.042940, 0.968881},
     {1.255528, -0.076749, -0.178779, -0.078411, 0.930809, 0.147602, 0.004733, 0.691367, 0.303900}}};

TEST(Highlight, NeighbouringStepsDifferInLightnessToEveryColourVision) {
    for (int step = 0; step < kColours; ++step) {
        const auto a = light_of(highlight_colour(Highlight::level, step)),
                   b = light_of(highlight_colour(Highlight::level, step + 1));
        EXPECT_GT(std::abs(lightness(a) - lightness(b)), 20) << step;
        for (const glm::dmat3& seen : kDichromats)
            EXPECT_GT(std::abs(lightness(a * seen) - lightness(b * seen)), 15) << step;
    }
}

TEST(Highlight, StepsAreEightAndComeAgain) {
    for (int step = 0; step < 40; ++step)
        for (int other = 0; other < 40; ++other)
            EXPECT_EQ(highlight_colour(Highlight::geomip, step) == highlight_colour(Highlight::geomip, other),
                      step % kColours == other % kColours);
}

TEST(Highlight, ErrorsGrowLighterByEvenSteps) {
    const double dark = lightness(light_of(highlight_colour(Highlight::error, 0))),
                 bright = lightness(light_of(highlight_colour(Highlight::error, 1)));
    EXPECT_LT(dark, 20);
    EXPECT_GT(bright, 85);
    for (int k = 0; k < 50; ++k) {
        const double low = lightness(light_of(highlight_colour(Highlight::error, k / 50.0))),
                     high = lightness(light_of(highlight_colour(Highlight::error, (k + 1) / 50.0)));
        EXPECT_NEAR(high - low, (bright - dark) / 50, 1) << k;
    }
}

TEST(Highlight, ValuesThatAreNoneHaveAColourToo) {
    for (const double odd : {-1.0, -1e300, std::nan(""), -std::numeric_limits<double>::infinity()}) {
        EXPECT_EQ(highlight_colour(Highlight::error, odd), highlight_colour(Highlight::error, 0));
        EXPECT_EQ(highlight_colour(Highlight::level, odd), highlight_colour(Highlight::level, 0));
    }
    for (const double odd : {1.5, 1e300, std::numeric_limits<double>::infinity()})
        EXPECT_EQ(highlight_colour(Highlight::error, odd), highlight_colour(Highlight::error, 1));
    highlight_colour(Highlight::level, 1e300);
}

}  // namespace
}  // namespace scree
