#include "tools/pyramid/tint.h"

#include <algorithm>
#include <cmath>

namespace scree {
namespace {

constexpr TintColour kWater{118, 152, 176};

// Altitude 45 degrees for the light from the north-west, 30 for the four.
constexpr double kSin45 = 0.70710678118654752;
constexpr double kSin30 = 0.5, kCos30 = 0.86602540378443865;

/// The light on a slope, 1 on flat ground. dx, dy: rise a metre to the east and to the north.
double relief_light(double dx, double dy) {
    const double steep = dx * dx + dy * dy;
    const double upright = 1 / std::sqrt(steep + 1);
    const double north_west = std::max(0.0, (dx - dy) * 0.5 + kSin45) * upright;
    if (steep < 1e-12) return north_west / kSin45;
    // Of each side its part towards the fall, of -1..1; its weight is what the slope does not face: sin^2 = 1 - cos^2.
    const double to_west = dx, to_north = -dy, to_north_west = (dx - dy) * kSin45, to_south_west = (dx + dy) * kSin45;
    double light = 0;
    for (const double towards : {to_west, to_north, to_north_west, to_south_west})
        light += (steep - towards * towards) * std::max(0.0, towards * kCos30 + kSin30);
    const double from_four = light / steep * upright / 2;
    return 0.5 * (north_west / kSin45) + 0.5 * (from_four / kSin30);
}

std::uint8_t byte_of(double v) { return static_cast<std::uint8_t>(std::clamp(v, 0.0, 255.0)); }

}  // namespace

Tint::Tint(const TintOptions& o) : colours_(o.min_height_m, o.max_height_m), per_2_spacings_(1 / (2 * o.spacing_m)) {}

void Tint::row(std::span<const double> upper, std::span<const double> lower, std::span<std::uint8_t> out) const {
    for (std::size_t i = 0; i + 1 < upper.size(); ++i) {
        const double nw = upper[i], ne = upper[i + 1], sw = lower[i], se = lower[i + 1];
        const double light = relief_light((ne + se - nw - sw) * per_2_spacings_, (nw + ne - sw - se) * per_2_spacings_);
        // Flat and at sea level; flats below it, as Death Valley's, are dry.
        const bool water = nw <= 0 && nw > -1 && ne == nw && sw == nw && se == nw;
        const TintColour c = water ? kWater : colours_.at((nw + ne + sw + se) / 4);
        // Sunlight is yellow, what falls into shade is the sky's blue.
        const double off = light - 1;
        out[4 * i] = byte_of(c.r * (1 + 0.86 * off));
        out[4 * i + 1] = byte_of(c.g * (1 + 0.80 * off));
        out[4 * i + 2] = byte_of(c.b * (1 + 0.66 * off));
        out[4 * i + 3] = 255;
    }
}

}  // namespace scree
