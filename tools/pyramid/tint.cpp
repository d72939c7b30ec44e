#include "tools/pyramid/tint.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace scree {
namespace {

struct Stop {
    double at;
    double r, g, b;
};

// Lowland green over ochre and brown to grey and white; softened, as on printed physical maps.
constexpr std::array<Stop, 7> kRamp{{{0.00, 113, 158, 105},
                                     {0.12, 152, 184, 121},
                                     {0.28, 214, 206, 150},
                                     {0.48, 200, 166, 116},
                                     {0.68, 160, 124, 98},
                                     {0.85, 190, 182, 176},
                                     {1.00, 246, 246, 248}}};
constexpr Stop kSea{0, 120, 160, 190};

Stop ramp(double t) {
    t = std::clamp(t, 0.0, 1.0);
    std::size_t k = 1;
    while (k + 1 < kRamp.size() && t > kRamp[k].at) ++k;
    const Stop &a = kRamp[k - 1], &b = kRamp[k];
    const double w = (t - a.at) / (b.at - a.at);
    return {t, a.r + (b.r - a.r) * w, a.g + (b.g - a.g) * w, a.b + (b.b - a.b) * w};
}

}  // namespace

void tint_row(std::span<const double> upper, std::span<const double> lower, const TintOptions& o,
              std::span<std::uint8_t> out) {
    const double range = std::max(o.max_height_m - o.min_height_m, 1e-9);
    // Light from the north-west, 45 degrees up; flat ground stands at 0.71 of full light.
    const double lx = -0.5, ly = 0.5, lz = 0.70710678118654752;
    for (std::size_t i = 0; i + 1 < upper.size(); ++i) {
        const double nw = upper[i], ne = upper[i + 1], sw = lower[i], se = lower[i + 1];
        const double dx = (ne + se - nw - sw) / (2 * o.spacing_m), dy = (nw + ne - sw - se) / (2 * o.spacing_m);
        const double lambert = std::max(0.0, (-dx * lx - dy * ly + lz) / std::sqrt(dx * dx + dy * dy + 1));
        const double shade = 0.38 + 0.87 * lambert;  // 1.0 on flat ground
        const double z = (nw + ne + sw + se) / 4;
        const bool sea = nw <= 0 && ne <= 0 && sw <= 0 && se <= 0 && nw == ne && sw == se && nw == sw;
        const Stop c = sea ? kSea : ramp((z - o.min_height_m) / range);
        const auto byte = [&](double v) { return static_cast<std::uint8_t>(std::clamp(v * shade, 0.0, 255.0)); };
        out[4 * i] = byte(c.r);
        out[4 * i + 1] = byte(c.g);
        out[4 * i + 2] = byte(c.b);
        out[4 * i + 3] = 255;
    }
}

}  // namespace scree
