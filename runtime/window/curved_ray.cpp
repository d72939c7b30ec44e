#include "runtime/window/curved_ray.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace scree {
namespace {

constexpr double kBend_rad = 5e-6;
/// Straighter up or down than this a ray does not bend: it meets the ground before it is anywhere else.
constexpr double kPlumb = 1e-9;
/// Chords overlap by so much, so that none of them begins beyond a surface that the one before just missed.
constexpr double kOverlap_m = 1e-3;
constexpr double kFarthest_m = 1e14;  // cast_ray takes ten times that

Result<std::optional<glm::dvec3>> cast_chord(Ground& ground, const glm::dvec3& from, const glm::dvec3& along,
                                             double length_m) {
    auto hit = ground.cast_ray({from.x, from.y, from.z}, {along.x, along.y, along.z}, length_m);
    if (!hit) return hit.error();
    if (!*hit) return std::optional<glm::dvec3>{};
    const Vector3& p = (*hit)->position;
    return std::optional(glm::dvec3(p.x, p.y, p.z));
}

/// Of any finite vector, however long or short. Zero and what is not finite come back as they are.
glm::dvec3 unit(const glm::dvec3& v) {
    const double largest = std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
    if (!(largest > 0) || !std::isfinite(largest)) return v;
    return glm::normalize(glm::dvec3(v.x / largest, v.y / largest, v.z / largest));
}

/// On the map, from a place to the furthest corner of the data.
double reach_m(const Lattice& l, const glm::dvec3& eye) {
    const auto reach = [](double from, double a, double b) { return std::max(std::abs(a - from), std::abs(b - from)); };
    return std::hypot(reach(eye.x, l.x_m(0), l.x_m(static_cast<double>(l.cells_x))),
                      reach(eye.y, l.y_m(0), l.y_m(static_cast<double>(l.cells_y))));
}

}  // namespace

Result<std::optional<glm::dvec3>> cast_curved_ray(Ground& ground, const glm::dvec3& eye, const glm::dvec3& direction,
                                                  double half_curvature) {
    const glm::dvec3 ray = unit(direction);
    const double level = glm::length(glm::dvec2(ray));
    if (!(half_curvature > 0) || !(level > kPlumb))
        return cast_chord(ground, eye, direction, std::numeric_limits<double>::infinity());
    const Dataset& d = ground.dataset();
    const double reach = reach_m(d.lattice, eye);
    const auto at = [&](double distance) {
        return eye + ray * (distance / level) + glm::dvec3(0, 0, distance * distance * half_curvature);
    };
    // Between distances a and b a chord leaves the parabola by (sqrt b - sqrt a)^2 / 2R radians at most: with ends at
    // s, 4 s, 9 s ... all of them bend by the same.
    const double first_m = kBend_rad / half_curvature;
    glm::dvec3 from = eye;
    for (double k = 1;; ++k) {
        const double distance = std::min(first_m * k * k, reach);
        const glm::dvec3 to = at(distance);
        if (!(std::abs(to.z) < kFarthest_m)) return cast_chord(ground, from, ray, kFarthest_m);
        auto hit = cast_chord(ground, from, to - from, glm::length(to - from) + kOverlap_m);
        if (!hit || *hit || distance >= reach) return hit;
        const bool rises = to.z > from.z;
        // A parabola that rises goes on rising. One that sank below all ground has passed it by: what it would meet
        // from below, far away, is on no picture.
        if (rises ? to.z > d.max_height_m + 1 : to.z < d.min_height_m - 1) return std::optional<glm::dvec3>{};
        from = to;
    }
}

}  // namespace scree
