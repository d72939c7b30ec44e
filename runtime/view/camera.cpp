#include "runtime/view/camera.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace scree {
namespace {

bool finite(glm::dvec3 v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

}  // namespace

double Camera::tan_half_y() const { return std::tan(fov_deg * std::numbers::pi / 360.0); }
double Camera::tan_half_x() const { return tan_half_y() * width_px / height_px; }
double Camera::focal_px() const { return height_px / (2.0 * tan_half_y()); }
double Camera::off_axis_factor() const {
    const double tx = tan_half_x(), ty = tan_half_y();
    return 1.0 + tx * tx + ty * ty;
}

Result<Camera> look_at(glm::dvec3 eye, glm::dvec3 target, double fov_deg, int width_px, int height_px) {
    if (!finite(eye) || !finite(target))
        return Error{ErrorCode::usage, "the camera's eye and look must be finite numbers"};
    if (!(fov_deg >= 0.001 && fov_deg <= 179.0))
        return Error{ErrorCode::usage, fmt::format("fov {} degrees is outside 0.001..179", fov_deg)};
    if (width_px < 1 || height_px < 1 || width_px > 16384 || height_px > 16384)
        return Error{ErrorCode::usage, fmt::format("size {}x{} px is outside 1..16384", width_px, height_px)};
    glm::dvec3 direction = target - eye;
    // Divided by its largest part first: the squares of very long and very short directions leave the range of a
    // double.
    const double largest = std::max({std::abs(direction.x), std::abs(direction.y), std::abs(direction.z)});
    if (!(largest > 0))
        return Error{ErrorCode::usage, "the camera's eye and look are the same point, so it has no direction"};
    if (!std::isfinite(largest)) return Error{ErrorCode::usage, "the camera's eye and look are too far apart"};
    direction = glm::dvec3(direction.x / largest, direction.y / largest, direction.z / largest);
    Camera camera;
    camera.eye = eye;
    camera.fov_deg = fov_deg;
    camera.width_px = width_px;
    camera.height_px = height_px;
    camera.forward = glm::normalize(direction);
    glm::dvec3 right = glm::cross(camera.forward, glm::dvec3(0, 0, 1));
    if (glm::length(right) < 1e-9) right = {camera.forward.z < 0 ? 1 : -1, 0, 0};
    camera.up = glm::normalize(glm::cross(glm::normalize(right), camera.forward));
    return camera;
}

glm::mat4 clip_from_relative(const Camera& camera) {
    const glm::dvec3 r = camera.right(), u = camera.up, f = camera.forward;
    const double sx = 1.0 / camera.tan_half_x(), sy = 1.0 / camera.tan_half_y();
    // Columns: x, y, z of the world, then translation (none). w = distance along forward, z = near: depth = near / w.
    glm::dmat4 m(0.0);
    for (int k = 0; k < 3; ++k) {
        m[k][0] = sx * r[k];
        m[k][1] = sy * u[k];
        m[k][2] = 0.0;
        m[k][3] = f[k];
    }
    m[3][2] = camera.near_m;
    return glm::mat4(m);
}

}  // namespace scree
