#include "common/tint/hypsometry.h"

#include <algorithm>
#include <cstddef>
#include <span>

namespace scree {
namespace {

struct Rung {
    double height_m, at;
};

/// Layer heights of physical maps, which grow by more the higher they are, on a scale from 0 to 1.
constexpr std::array<Rung, 11> kLadder{{{0, 0},
                                        {100, 0.07},
                                        {300, 0.17},
                                        {600, 0.28},
                                        {1000, 0.38},
                                        {1500, 0.47},
                                        {2000, 0.55},
                                        {3000, 0.70},
                                        {4000, 0.88},
                                        {4500, 0.94},
                                        {5500, 1}}};

struct Stop {
    double at;
    TintColour colour;
};

constexpr std::array<Stop, 11> kLand{{{0.00, {122, 143, 116}},
                                      {0.08, {146, 161, 122}},
                                      {0.18, {176, 182, 134}},
                                      {0.30, {204, 197, 150}},
                                      {0.42, {211, 188, 145}},
                                      {0.54, {204, 172, 134}},
                                      {0.66, {188, 158, 131}},
                                      {0.76, {184, 168, 154}},
                                      {0.85, {206, 200, 195}},
                                      {0.93, {233, 232, 232}},
                                      {1.00, {247, 248, 250}}}};

/// By depth, of 6000 m.
constexpr std::array<Stop, 4> kSea{
    {{0, {148, 178, 192}}, {0.05, {120, 157, 180}}, {0.5, {74, 112, 148}}, {1, {46, 78, 118}}}};

/// Less of the scale than this says nothing of relief.
constexpr double kLeastSpan = 0.52;
/// Where a stretched range ends at most: below the greys.
constexpr double kStretchedEnd = 0.64;

double rung_of(double height_m) {
    if (!(height_m > 0)) return 0;
    std::size_t k = 1;
    while (k + 1 < kLadder.size() && height_m > kLadder[k].height_m) ++k;
    const Rung &a = kLadder[k - 1], &b = kLadder[k];
    return std::min(a.at + (b.at - a.at) * ((height_m - a.height_m) / (b.height_m - a.height_m)), 1.0);
}

TintColour mixed(std::span<const Stop> stops, double at) {
    std::size_t k = 1;
    while (k + 1 < stops.size() && at > stops[k].at) ++k;
    const Stop &a = stops[k - 1], &b = stops[k];
    const double w = std::clamp((at - a.at) / (b.at - a.at), 0.0, 1.0);
    const TintColour &p = a.colour, &q = b.colour;
    return {p.r + (q.r - p.r) * w, p.g + (q.g - p.g) * w, p.b + (q.b - p.b) * w};
}

}  // namespace

Hypsometry::Hypsometry(double min_height_m, double max_height_m)
    : min_m_(min_height_m),
      per_m_((kEntries - 1) / std::max(max_height_m - min_height_m, 1e-6)),
      has_sea_(min_height_m < -500) {
    // Land begins at 0 where there is sea below.
    const double low = rung_of(min_height_m), high = rung_of(max_height_m);
    if (high - low < kLeastSpan) {
        // What lies lowest of all keeps the lowland's colour, what lies high is not drawn down to it.
        const double end = std::max(high, std::min(low + kLeastSpan, kStretchedEnd)),
                     begin = std::min(low, std::max(end - kLeastSpan, 0.0));
        scale_ = (end - begin) / std::max(high - low, 1e-3);
        from_ = begin - low * scale_;
    }
    table_.reserve(kEntries);
    for (int k = 0; k < kEntries; ++k) table_.push_back(exact(min_m_ + k / per_m_));
}

TintColour Hypsometry::exact(double height_m) const {
    if (has_sea_ && height_m < 0) return mixed(kSea, -height_m / 6000);
    return mixed(kLand, from_ + scale_ * rung_of(height_m));
}

TintColour Hypsometry::at(double height_m) const {
    const double place = std::clamp((height_m - min_m_) * per_m_, 0.0, static_cast<double>(kEntries - 1));
    return table_[static_cast<std::size_t>(place + 0.5)];
}

}  // namespace scree
