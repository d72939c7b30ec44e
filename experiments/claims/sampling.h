// What the experiments draw at random and how they look at it. Deterministic from the seed on any machine: the
// distributions of the standard library are not.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>
#include <vector>

#include <glm/glm.hpp>

#include "experiments/claims/terrain.h"
#include "runtime/view/camera.h"
#include "runtime/view/frustum.h"

namespace scree {

class Sampler {
public:
    explicit Sampler(std::uint64_t seed) : engine_(seed) {}
    /// low <= value < high
    double uniform(double low, double high) {
        return low + (high - low) * static_cast<double>(engine_() >> 11) * 0x1p-53;
    }
    double log_uniform(double low, double high) { return std::exp(uniform(std::log(low), std::log(high))); }
    /// low <= value <= high
    int whole(int low, int high) {
        return low + static_cast<int>(engine_() % static_cast<std::uint64_t>(high - low + 1));
    }
    glm::dvec3 direction() {
        const double z = uniform(-1, 1), turn = uniform(0, 2 * std::numbers::pi), r = std::sqrt(1 - z * z);
        return {r * std::cos(turn), r * std::sin(turn), z};
    }

private:
    std::mt19937_64 engine_;
};

/// `yaw` from east to north, `pitch` up, in radians; z up.
inline Camera camera_at(glm::dvec3 eye, double yaw, double pitch, double fov_deg = 40, int width_px = 800,
                        int height_px = 800) {
    Camera camera;
    camera.eye = eye;
    camera.forward = {std::cos(pitch) * std::cos(yaw), std::cos(pitch) * std::sin(yaw), std::sin(pitch)};
    const glm::dvec3 right{std::sin(yaw), -std::cos(yaw), 0};
    camera.up = glm::cross(right, camera.forward);
    camera.fov_deg = fov_deg;
    camera.width_px = width_px;
    camera.height_px = height_px;
    return camera;
}

/// Pixels between the projections of two points in front of the camera.
inline double screen_distance_px(const Camera& camera, const glm::dvec3& a, const glm::dvec3& b) {
    const auto project = [&](const glm::dvec3& point) {
        const glm::dvec3 p = point - camera.eye;
        return camera.focal_px() / glm::dot(p, camera.forward) *
               glm::dvec2(glm::dot(p, camera.right()), glm::dot(p, camera.up));
    };
    return glm::length(project(a) - project(b));
}

/// A closed loop over the terrain that sways, 8 degrees down (Scree lod, section 6), `eye_m` high but `clear_m` above
/// the highest ground at least where `over_peaks`, else above the ground under the eye.
struct Loop {
    double eye_m = 1000;
    double clear_m = 120;
    bool over_peaks = true;
    double pitch_deg = -8;
};
inline std::vector<Camera> loop_cameras(const Terrain& terrain, const Loop& loop, int frames) {
    std::vector<Camera> cameras;
    const double peak_m = terrain.highest_m();
    for (int k = 0; k < frames; ++k) {
        const double turn = 2 * std::numbers::pi * k / frames;
        const double x = terrain.width_m() * (0.5 + 0.3 * std::cos(turn));
        const double y = -terrain.depth_m() * (0.5 - 0.3 * std::sin(turn));
        const double floor_m = (loop.over_peaks ? peak_m : terrain.ground_m(x, y)) + loop.clear_m;
        const double z = loop.over_peaks ? std::max(loop.eye_m, floor_m) : floor_m;
        const double sway = 0.35 * std::sin(7 * turn);
        cameras.push_back(
            camera_at({x, y, z}, turn + std::numbers::pi / 2 + sway, loop.pitch_deg * std::numbers::pi / 180));
    }
    return cameras;
}

/// Errors of many points.
class PixelErrors {
public:
    void add(double px) { values_.push_back(px); }
    std::size_t count() const { return values_.size(); }
    double max() const { return values_.empty() ? 0 : *std::max_element(values_.begin(), values_.end()); }
    double mean() const {
        double sum = 0;
        for (const double v : values_) sum += v;
        return values_.empty() ? 0 : sum / static_cast<double>(values_.size());
    }
    /// The value that a share q of them does not pass.
    double quantile(double q) {
        if (values_.empty()) return 0;
        const auto at = static_cast<std::size_t>(std::ceil(q * static_cast<double>(values_.size())));
        const auto nth = values_.begin() + static_cast<std::ptrdiff_t>(std::max<std::size_t>(at, 1) - 1);
        std::nth_element(values_.begin(), nth, values_.end());
        return *nth;
    }

private:
    std::vector<double> values_;
};

}  // namespace scree
