// The tests that select a vertex. Squared or multiplied out: no division, no root of a difference, no NaN at h = 0 or
// r = 0 (Scree lod, 1.1, 1.2, 1.4). `Real` is float or double. Pure functions.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

namespace scree {

/// A vertex as the eye sees it: horizontal distance h, height difference dz, both in metres.
template <class Real>
struct VertexSight {
    Real h2 = 0;   ///< h^2
    Real dz2 = 0;  ///< dz^2
    Real r2() const { return h2 + dz2; }
};

/// Ueng & Chuang, eq. of section 1.1: f^2 delta^2 h^2 > tau^2 (h^2 + dz^2)^2. `f_delta` = f delta. A vertex straight
/// under the eye (h = 0) is never selected; an overflow of (tau r^2)^2 passes: in float from tau r^2 = 1.8e19 px m^2
/// on, where no terrain has a correction to show (4 million km at a pixel).
template <class Real>
bool uc_selects(Real f_delta, Real tau, VertexSight<Real> s) {
    const Real r2 = s.r2();
    return f_delta * f_delta * s.h2 > tau * tau * r2 * r2;
}

/// sup over the ball of radius rho round the vertex of max(h, c r) / r^2, 0 <= c <= 1 (c = 0: of h / r^2, exact): how
/// large a unit of vertical error may look. Infinite where the eye may be in the ball.
template <class Real>
Real greatest_magnification(VertexSight<Real> s, Real rho, Real c) {
    const Real r2 = s.r2(), within = r2 - rho * rho;
    if (!(within > 0)) return std::numeric_limits<Real>::infinity();
    return std::max(std::sqrt(s.h2) + rho, c * (std::sqrt(r2) + rho)) / within;
}

/// sup over a box of h / r^2, 1/m: no more than 1 / its distance, and far less straight under the eye or far below it.
/// Infinite with the eye in the box. `Box`: low and high corners. A NaN stays one.
template <class Point, class Box>
double greatest_box_magnification(const Point& eye, const Box& box) {
    const auto outside = [](double at, double low, double high) {
        return at < low ? low - at : at > high ? at - high : 0 * at;
    };
    const double dx = outside(eye.x, box.low.x, box.high.x), dy = outside(eye.y, box.low.y, box.high.y),
                 dz = outside(eye.z, box.low.z, box.high.z);
    // h / (h^2 + dz^2) is greatest at h = |dz|.
    double h = std::sqrt(dx * dx + dy * dy);
    if (h < dz) {
        const double far_x = std::max(std::abs(box.low.x - eye.x), std::abs(box.high.x - eye.x)),
                     far_y = std::max(std::abs(box.low.y - eye.y), std::abs(box.high.y - eye.y));
        h = std::min(std::sqrt(far_x * far_x + far_y * far_y), dz);
    }
    if (h == 0 && dz == 0) return std::numeric_limits<double>::infinity();
    const double r = std::sqrt(h * h + dz * dz);
    return std::isinf(r) ? 0 : h / r / r;
}

/// N*K: E > 0 and f K E sup(magnification) > tau. `error_px` = f K E.
template <class Real>
bool guaranteed_selects(Real error_px, Real rho, Real c, Real tau, VertexSight<Real> s) {
    if (!(error_px > 0)) return false;
    const Real r2 = s.r2(), within = r2 - rho * rho;
    if (!(within > 0)) return true;
    const Real reach = c > 0 ? std::max(std::sqrt(s.h2) + rho, c * (std::sqrt(r2) + rho)) : std::sqrt(s.h2) + rho;
    return error_px * reach > tau * within;
}

}  // namespace scree
