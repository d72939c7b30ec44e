#include "runtime/lod/reuse.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace scree {
namespace {

// g = h + dz^2 / h: the correction allowed a pixel, over 1/f.
double allowed(const glm::dvec3& eye, const glm::dvec3& vertex) {
    const double dx = vertex.x - eye.x, dy = vertex.y - eye.y, dz = vertex.z - eye.z;
    const double h = std::sqrt(dx * dx + dy * dy);
    return h + dz * dz / h;  // infinite at h = 0
}

bool is_over(const glm::dvec3& eye, const Box& box) {
    return eye.x >= box.low.x && eye.x <= box.high.x && eye.y >= box.low.y && eye.y <= box.high.y;
}

double floored(const EyeToBox& e, double c) { return std::max(e.level_m, c * e.distance_m); }

}  // namespace

EyeToBox eye_to_box(const glm::dvec3& eye, const Box& box) {
    const auto outside = [](double at, double low, double high) { return std::max({low - at, 0.0, at - high}); };
    const double dx = outside(eye.x, box.low.x, box.high.x), dy = outside(eye.y, box.low.y, box.high.y),
                 dz = outside(eye.z, box.low.z, box.high.z);
    const double level2 = dx * dx + dy * dy;
    // max() drops a NaN: put it back.
    const double broken = 0 * (eye.x + eye.y + eye.z);
    return {std::sqrt(level2) + broken, std::sqrt(level2 + dz * dz) + broken};
}

bool reuse_t1(const EyeToBox& then, const EyeToBox& now, double moved_m, const ReuseAllowance& a) {
    if (moved_m == 0) return true;
    if (!(then.level_m > 0 && now.level_m > 0 && a.s_px > 0 && std::isfinite(moved_m))) return false;
    // moved^2 tau (tau + s) <= h0 h1 s^2, in roots: the products may overflow. tau = 0 allows any motion.
    return moved_m * std::sqrt(a.tau_px) * std::sqrt(a.tau_px + a.s_px) <=
           std::sqrt(then.level_m) * std::sqrt(now.level_m) * a.s_px;
}

bool reuse_t2(const EyeToBox& now, double moved_m, const ReuseAllowance& a) {
    if (moved_m == 0) return true;
    if (!(now.distance_m > 0 && a.s_px > 0 && std::isfinite(moved_m))) return false;
    return moved_m * a.tau_px <= a.s_px * now.distance_m;
}

bool reuse_t3(const EyeToBox& then, const EyeToBox& now, double moved_m, double c, const ReuseAllowance& a) {
    if (moved_m == 0) return true;
    const double before = floored(then, c), after = floored(now, c);
    if (!(before > 0 && after > 0 && a.s_px > 0 && std::isfinite(moved_m))) return false;
    const double mean = std::sqrt(before) * std::sqrt(after) / std::sqrt(a.q());  // 0 where q is infinite
    return moved_m <= before + after - 2 * mean;
}

bool reuse_exact(const EyeToBox& then, const EyeToBox& now, double moved_m, double c, const ReuseAllowance& a) {
    return reuse_t1(then, now, moved_m, a) || (c > 0 && reuse_t3(then, now, moved_m, c, a));
}

bool reuse_p1(const glm::dvec3& then, const glm::dvec3& now, const std::array<glm::dvec3, 4>& corners, const Box& box,
              double focal_px, double s_px, double tau_px) {
    if (is_over(then, box) || is_over(now, box)) return false;
    double change = 0, allowance = std::numeric_limits<double>::infinity();
    for (const glm::dvec3& corner : corners) {
        const double g0 = allowed(then, corner), g1 = allowed(now, corner);
        const double d = tau_px / focal_px * std::abs(g1 - g0);
        if (!(d >= 0)) return false;
        change = std::max(change, d);
        allowance = std::min(allowance, s_px / focal_px * g0);
    }
    return change < allowance || (change == 0 && then == now);
}

bool reuse_p2(const glm::dvec3& then, const glm::dvec3& now, const std::array<glm::dvec3, 4>& corners, const Box& box,
              double focal_px, double s_px, double tau_px) {
    if (is_over(then, box) || is_over(now, box)) return false;
    return std::all_of(corners.begin(), corners.end(), [&](const glm::dvec3& corner) {
        const double g0 = allowed(then, corner), g1 = allowed(now, corner);
        const double change = tau_px / focal_px * std::abs(g1 - g0);
        return change < s_px / focal_px * g0 || (change == 0 && then == now);
    });
}

}  // namespace scree
