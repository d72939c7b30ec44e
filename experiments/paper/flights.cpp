#include "experiments/paper/flights.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace scree::paper {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kRadiusShare = 0.16;
constexpr int kSize = 800;
constexpr double kFov = 40;
constexpr std::int64_t kNearBy = 4;  ///< samples
constexpr int kSmoothing = 40;       ///< frames to either side

struct Round {
    double x = 0, y = 0, heading = 0;
};

std::vector<Round> round_trip(const HeightRaster& r, double step_m, int frames) {
    const double radius = kRadiusShare * static_cast<double>(std::min(r.columns, r.rows) - 1) * r.spacing_m;
    const double x = r.x_m(static_cast<double>(r.columns - 1) / 2), y = r.y_m(static_cast<double>(r.rows - 1) / 2);
    std::vector<Round> places;
    for (int k = 0; k < frames; ++k) {
        const double angle = step_m * k / radius;
        places.push_back({x + radius * std::cos(angle), y + radius * std::sin(angle), angle + kPi / 2});
    }
    return places;
}

Camera towards(const glm::dvec3& eye, double heading, double pitch_deg) {
    const double pitch = pitch_deg * kPi / 180;
    const glm::dvec3 ahead{std::cos(heading) * std::cos(pitch), std::sin(heading) * std::cos(pitch), std::sin(pitch)};
    return *look_at(eye, eye + 1000.0 * ahead, kFov, kSize, kSize);
}

double peak(const HeightRaster& r) { return *std::max_element(r.z.begin(), r.z.end()); }

double highest_near(const HeightRaster& r, const Round& place) {
    const std::int64_t i = std::llround((place.x - r.west_m) / r.spacing_m),
                       j = std::llround((r.north_m - place.y) / r.spacing_m);
    double highest = 0;
    bool any = false;
    for (std::int64_t y = std::max<std::int64_t>(j - kNearBy, 0); y <= std::min(j + kNearBy, r.rows - 1); ++y)
        for (std::int64_t x = std::max<std::int64_t>(i - kNearBy, 0); x <= std::min(i + kNearBy, r.columns - 1); ++x) {
            highest = any ? std::max(highest, r.at(x, y)) : r.at(x, y);
            any = true;
        }
    return highest;
}

// The greatest within reach, then the mean of these: smooth, and never below what it began with.
std::vector<double> smooth_above(const std::vector<double>& floor) {
    const auto n = static_cast<int>(floor.size());
    const auto window = [&](int k) { return std::pair{std::max(k - kSmoothing, 0), std::min(k + kSmoothing, n - 1)}; };
    std::vector<double> greatest, mean;
    for (int k = 0; k < n; ++k) {
        const auto [a, b] = window(k);
        greatest.push_back(*std::max_element(floor.begin() + a, floor.begin() + b + 1));
    }
    for (int k = 0; k < n; ++k) {
        const auto [a, b] = window(k);
        double sum = 0;
        for (int i = a; i <= b; ++i) sum += greatest[static_cast<std::size_t>(i)];
        mean.push_back(sum / (b - a + 1));
    }
    return mean;
}

}  // namespace

std::vector<Camera> loop(const HeightRaster& raster, double step_m, int frames) {
    const double up = peak(raster) + 120;
    std::vector<Camera> cameras;
    for (const Round& p : round_trip(raster, step_m, frames)) {
        const double sway = 20 * kPi / 180 * std::sin(5 * p.heading);
        cameras.push_back(towards({p.x, p.y, up}, p.heading + sway, -8));
    }
    return cameras;
}

std::vector<Camera> steep(const HeightRaster& raster, double step_m, int frames) {
    const double up = peak(raster) + 120;
    std::vector<Camera> cameras;
    for (const Round& p : round_trip(raster, step_m, frames))
        cameras.push_back(towards({p.x, p.y, up}, p.heading, -60));
    return cameras;
}

std::vector<Camera> low(const HeightRaster& raster, double step_m, int frames) {
    const auto places = round_trip(raster, step_m, frames);
    std::vector<double> floor;
    floor.reserve(places.size());
    for (const Round& p : places) floor.push_back(highest_near(raster, p));
    const auto smooth = smooth_above(floor);
    std::vector<Camera> cameras;
    for (std::size_t k = 0; k < places.size(); ++k)
        cameras.push_back(towards({places[k].x, places[k].y, smooth[k] + 100}, places[k].heading, -2));
    return cameras;
}

}  // namespace scree::paper
