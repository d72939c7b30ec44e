// The inner loops of BlockWorld and TileVertices, in single precision over arrays, so that the compiler makes vectors
// of them. Places are relative to a point near the block: the numbers are small. Each writes 1 for a vertex whose test
// fails, else 0.
//
// Rounding. `fails_ball` never passes a vertex that the exact test selects (Scree lod, 1.4). Vertex and eye are each
// rounded once, by 2^-24 of their distance from the block's middle, which is less than R + r, R the block's own reach.
// The part with R is in the stored radius (kBallPad R); the part with r, and the roundings of the formula itself, a few
// 2^-24 each, are less than kPad of r^2, of rho^2 and of the left side.
#pragma once

#include <cstddef>
#include <cstdint>

namespace scree {

inline constexpr float kPad = 0x1p-19f;
inline constexpr double kBallPad = 0x1p-21;

struct VertexArrays {
    const float* x;
    const float* y;
    const float* z;
    std::size_t count;
};

struct LocalEye {
    float x, y, z;
};

/// Ueng & Chuang: f^2 delta^2 h^2 > tau^2 (h^2 + dz^2)^2.
void fails_uc(const VertexArrays& vertices, const float* delta, LocalEye eye, float focal_px, float tau_px,
              std::uint8_t* fails);

/// N*: E > 0 and scale E max(h + rho, c (r + rho)) > tau (r^2 - rho^2), or the eye within the ball. A NaN fails.
void fails_ball(const VertexArrays& vertices, const float* error, const float* radius, LocalEye eye, float scale_px,
                float floor, float tau_px, std::uint8_t* fails);

/// The same over a curved earth: what lies h away is lowered by h^2 / 2R = `half_curvature` h^2, which also widens the
/// ball, as its points are lowered by other amounts than its centre.
void fails_ball_curved(const VertexArrays& vertices, const float* error, const float* radius, LocalEye eye,
                       float scale_px, float floor, float tau_px, float half_curvature, std::uint8_t* fails);

/// BSK: E > 0 and E > threshold.
void fails_threshold(const float* error, std::size_t count, float threshold_m, std::uint8_t* fails);

}  // namespace scree
