// Whether a mesh that was chosen for one eye may be drawn for another: the paper's test and the exact ones (Scree lod,
// 1.1 and 1.2). Metres and pixels. A NaN anywhere, or a motion that is no number, regenerates. Pure functions.
#pragma once

#include <array>

#include <glm/glm.hpp>

#include "runtime/view/frustum.h"

namespace scree {

/// What an eye has to do with a block's box.
struct EyeToBox {
    double level_m = 0;     ///< horizontal distance to the box's rectangle; 0 over it
    double distance_m = 0;  ///< to the box
};
EyeToBox eye_to_box(const glm::dvec3& eye, const Box& box);

/// The tolerances of a mesh: it was chosen for an error of tau, and may come to tau + s.
struct ReuseAllowance {
    double tau_px = 1;
    double s_px = 0;
    double q() const { return (tau_px + s_px) / tau_px; }  ///< infinite for tau = 0 and s > 0
};

/// T1, hyperbolic: |e1 - e0|^2 <= h0 h1 s^2 / (tau (tau + s)). Never over the block.
bool reuse_t1(const EyeToBox& then, const EyeToBox& now, double moved_m, const ReuseAllowance& allowance);
/// T2, isotropic: |e1 - e0| <= (q - 1) dist. For metrics that go by 1/r (BSK, geomip).
bool reuse_t2(const EyeToBox& now, double moved_m, const ReuseAllowance& allowance);
/// T3, floored metric max(h, c r) / r^2: |e1 - e0| <= H0 + H1 - 2 sqrt(H0 H1 / q), H = max(level, c distance).
bool reuse_t3(const EyeToBox& then, const EyeToBox& now, double moved_m, double c, const ReuseAllowance& allowance);
/// T1, or T3 where the metric has a floor c > 0: what passed the floored test passed the other as well.
bool reuse_exact(const EyeToBox& then, const EyeToBox& now, double moved_m, double c, const ReuseAllowance& allowance);

/// P1 of Ueng & Chuang: the greatest change of the allowed correction over the block's four corner vertices is less
/// than the least allowance s over them, at the old eye; both eyes outside the block. Bounds nothing (C3 to C5).
bool reuse_p1(const glm::dvec3& then, const glm::dvec3& now, const std::array<glm::dvec3, 4>& corners, const Box& box,
              double focal_px, double s_px, double tau_px);
/// P2: each corner against its own allowance.
bool reuse_p2(const glm::dvec3& then, const glm::dvec3& now, const std::array<glm::dvec3, 4>& corners, const Box& box,
              double focal_px, double s_px, double tau_px);

}  // namespace scree
