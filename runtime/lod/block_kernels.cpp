#include "runtime/lod/block_kernels.h"

#include <cmath>

namespace scree {

void fails_uc(const VertexArrays& v, const float* delta, LocalEye eye, float focal_px, float tau_px,
              std::uint8_t* fails) {
    const float *x = v.x, *y = v.y, *z = v.z;
    for (std::size_t k = 0; k < v.count; ++k) {
        const float dx = x[k] - eye.x, dy = y[k] - eye.y, dz = z[k] - eye.z;
        const float h2 = dx * dx + dy * dy;
        const float fd = focal_px * delta[k], allowed = tau_px * (h2 + dz * dz);
        fails[k] = static_cast<std::uint8_t>(fd * fd * h2 > allowed * allowed);
    }
}

namespace {

// Whether N*'s test fails a vertex `dz` higher than the eye and sqrt(h2) away.
inline bool fails_one(float h2, float dz, float error, float rho, float scale, float floor, float tau_px) {
    const float r2 = h2 + dz * dz;
    const float h = std::sqrt(h2), r = std::sqrt(r2);
    const float level = h + rho, leaning = floor * (r + rho);
    const float reach = (level > leaning ? level : leaning) + kPad * r;
    const float within = r2 * (1 - kPad) - rho * rho * (1 + kPad);
    const float lhs = scale * error * reach, rhs = tau_px * within;
    // Both halves without a branch. A NaN is not <=.
    const bool passes = bool(within > 0) & bool(lhs <= rhs);
    return bool(error > 0) & !passes;
}

}  // namespace

void fails_ball(const VertexArrays& v, const float* error, const float* radius, LocalEye eye, float scale_px,
                float floor, float tau_px, std::uint8_t* fails) {
    const float *x = v.x, *y = v.y, *z = v.z;
    const float scale = scale_px * (1 + kPad);
    for (std::size_t k = 0; k < v.count; ++k) {
        const float dx = x[k] - eye.x, dy = y[k] - eye.y, dz = z[k] - eye.z;
        fails[k] =
            static_cast<std::uint8_t>(fails_one(dx * dx + dy * dy, dz, error[k], radius[k], scale, floor, tau_px));
    }
}

void fails_ball_curved(const VertexArrays& v, const float* error, const float* radius, LocalEye eye, float scale_px,
                       float floor, float tau_px, float half_curvature, std::uint8_t* fails) {
    const float *x = v.x, *y = v.y, *z = v.z;
    const float scale = scale_px * (1 + kPad);
    for (std::size_t k = 0; k < v.count; ++k) {
        const float dx = x[k] - eye.x, dy = y[k] - eye.y;
        const float h2 = dx * dx + dy * dy, dz = z[k] - eye.z - half_curvature * h2;
        const float rho = radius[k] * (1 + (2 * std::sqrt(h2) + radius[k]) * half_curvature);
        fails[k] = static_cast<std::uint8_t>(fails_one(h2, dz, error[k], rho, scale, floor, tau_px));
    }
}

void fails_threshold(const float* error, std::size_t count, float threshold_m, std::uint8_t* fails) {
    for (std::size_t k = 0; k < count; ++k)
        fails[k] = static_cast<std::uint8_t>(bool(error[k] > 0) & !bool(error[k] <= threshold_m));
}

}  // namespace scree
