// A pinhole camera by the contract's words, in doubles: arithmetic that shares nothing with either program.
#pragma once

#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <sstream>
#include <string>

namespace scree::test {

using Vec3 = std::array<double, 3>;
inline Vec3 operator-(const Vec3& a, const Vec3& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
inline double dot(const Vec3& a, const Vec3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
inline Vec3 cross(const Vec3& a, const Vec3& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
inline Vec3 unit(const Vec3& a) {
    const double length = std::sqrt(dot(a, a));
    return {a[0] / length, a[1] / length, a[2] / length};
}
/// "x,y,z", every digit of it: an argument of --eye and --look.
inline std::string words_of(const Vec3& p) {
    std::ostringstream out;
    out.precision(17);
    out << p[0] << ',' << p[1] << ',' << p[2];
    return out.str();
}

/// Vertical field of view in degrees, z up, square pixels, the eye in the picture's middle.
struct Pinhole {
    Vec3 eye, right, up, forward;
    double focal_px = 1, half_width_px = 1, half_height_px = 1;

    Pinhole(const Vec3& from, const Vec3& look, double fov_deg, int width_px, int height_px)
        : eye(from), forward(unit(look - from)), half_width_px(width_px / 2.0), half_height_px(height_px / 2.0) {
        right = unit(cross(forward, {0, 0, 1}));
        up = cross(right, forward);
        focal_px = half_height_px / std::tan(fov_deg * std::numbers::pi / 360);
    }
    /// Pixels from the picture's middle; nullopt behind the near plane.
    std::optional<std::array<double, 2>> project(const Vec3& p) const {
        const Vec3 v = p - eye;
        const double depth = dot(v, forward);
        if (depth <= 0.1) return std::nullopt;
        return std::array{focal_px * dot(v, right) / depth, focal_px * dot(v, up) / depth};
    }
    bool shows(const Vec3& p) const {
        const auto at = project(p);
        return at && std::abs((*at)[0]) <= half_width_px && std::abs((*at)[1]) <= half_height_px;
    }
    /// Between the projections of two points over one place; infinite where one of them has none.
    double distance_px(const Vec3& p, double other_z) const {
        const auto a = project(p), b = project({p[0], p[1], other_z});
        return a && b ? std::hypot((*a)[0] - (*b)[0], (*a)[1] - (*b)[1]) : std::numeric_limits<double>::infinity();
    }
};

}  // namespace scree::test
