// Camera: a pose and a perspective, in double precision and in the dataset's metres (x east, y north, z up).
#pragma once

#include <glm/glm.hpp>

#include "common/result.h"

namespace scree {

struct Camera {
    glm::dvec3 eye{0, 0, 0};
    glm::dvec3 forward{0, 1, 0};  ///< unit length
    glm::dvec3 up{0, 0, 1};       ///< unit length, orthogonal to forward
    double fov_deg = 40;          ///< vertical
    int width_px = 800;
    int height_px = 800;
    double near_m = 0.1;  ///< reversed-Z with an infinite far plane: near alone sets the depth resolution (lod.md 5.2)

    double tan_half_y() const;
    double tan_half_x() const;
    /// f: pixels of a unit segment at unit distance on the axis, height / (2 tan(fov/2)).
    double focal_px() const;
    /// K = 1 + tan^2(fovx/2) + tan^2(fovy/2): how far off-axis projection can enlarge an error (Scree lod, C1).
    double off_axis_factor() const;
    glm::dvec3 right() const { return glm::cross(forward, up); }
};

/// A camera at `eye` looking at `target`, z up; straight up or down takes north as the picture's up.
/// Errors (ErrorCode::usage): non-finite numbers, eye == target, fov outside 0.001..179, size outside 1..16384.
Result<Camera> look_at(glm::dvec3 eye, glm::dvec3 target, double fov_deg, int width_px, int height_px);

/// World direction (rotation only) to clip space: reversed-Z, infinite far plane, depth 1 at near, 0 at infinity, for
/// clip control (lower left, zero to one). Multiplies camera-relative positions (x east, y north, z up).
glm::mat4 clip_from_relative(const Camera& camera);

}  // namespace scree
