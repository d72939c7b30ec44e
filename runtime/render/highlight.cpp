#include "runtime/render/highlight.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace scree {
namespace {

using Colour = std::array<std::uint8_t, 4>;

/// Hues that stay apart without one of the three cones (after Okabe and Ito, Color Universal Design, 2008), put so that
/// a light one always follows a dark one, round the end too.
constexpr std::array<Colour, 8> kSteps{{{86, 180, 233, 255},
                                        {196, 70, 0, 255},
                                        {240, 228, 66, 255},
                                        {0, 90, 170, 255},
                                        {244, 165, 30, 255},
                                        {0, 112, 84, 255},
                                        {226, 160, 200, 255},
                                        {62, 44, 120, 255}}};

/// Even steps of lightness from L* 14 to 90; blue to yellow is the axis that nearly everybody sees.
constexpr std::array<Colour, 6> kRamp{{{8, 30, 92, 255},
                                       {62, 66, 110, 255},
                                       {102, 104, 116, 255},
                                       {147, 143, 112, 255},
                                       {198, 184, 92, 255},
                                       {253, 228, 66, 255}}};

Colour mixed(const Colour& a, const Colour& b, double share) {
    Colour out;
    for (std::size_t k = 0; k < out.size(); ++k)
        out[k] = static_cast<std::uint8_t>(std::lround(a[k] + (b[k] - a[k]) * share));
    return out;
}

Colour of_ramp(double value) {
    // NaN, of 0 over 0, is no error.
    const double at = (value > 0 ? std::min(value, 1.0) : 0.0) * (kRamp.size() - 1);
    const auto low = std::min(static_cast<std::size_t>(at), kRamp.size() - 2);
    return mixed(kRamp[low], kRamp[low + 1], at - static_cast<double>(low));
}

}  // namespace

Colour highlight_colour(Highlight highlight, double value) {
    switch (highlight) {
        case Highlight::none:
            break;
        case Highlight::level:
        case Highlight::geomip:
            return kSteps[value > 0 ? static_cast<std::size_t>(std::min(value, 255.0)) % kSteps.size() : 0];
        case Highlight::error:
            return of_ramp(value);
    }
    return {0, 0, 0, 255};
}

std::optional<Highlight> highlight_from(std::string_view name) {
    if (name == "none") return Highlight::none;
    if (name == "level") return Highlight::level;
    if (name == "geomip") return Highlight::geomip;
    if (name == "error") return Highlight::error;
    return std::nullopt;
}

}  // namespace scree
