#include "runtime/view/frustum.h"

#include <algorithm>

namespace scree {

Frustum::Frustum(const Camera& camera) : eye_(camera.eye), near_m_(camera.near_m) {
    const glm::dvec3 forward = camera.forward, right = camera.right(), up = camera.up;
    const double tx = camera.tan_half_x(), ty = camera.tan_half_y();
    normals_ = {forward, forward * tx + right, forward * tx - right, forward * ty + up, forward * ty - up};
    for (std::size_t plane = 0; plane < normals_.size(); ++plane) reaches_[plane] = glm::abs(normals_[plane]);
}

bool Frustum::may_see(const Box& box) const {
    const glm::dvec3 low = box.low - eye_, high = box.high - eye_;
    for (int plane = 0; plane < kPlanes; ++plane) {
        const glm::dvec3& n = normal(plane);
        const double furthest =
            (n.x > 0 ? high.x : low.x) * n.x + (n.y > 0 ? high.y : low.y) * n.y + (n.z > 0 ? high.z : low.z) * n.z;
        if (!(furthest >= (plane == 0 ? near_m_ : 0))) return false;
    }
    return true;
}

Sight Frustum::sight(const Box& box) const {
    const glm::dvec3 middle = 0.5 * (box.low + box.high) - eye_, half = 0.5 * (box.high - box.low);
    // Nearest and furthest signed distance along a normal are the middle's, less and plus the box's reach.
    bool all = true;
    for (int plane = 0; plane < kPlanes; ++plane) {
        const double depth = glm::dot(normal(plane), middle) - (plane == 0 ? near_m_ : 0);
        const double span = glm::dot(reach(plane), half);
        if (!(depth + span >= 0)) return Sight::none;
        all = all && depth >= span;
    }
    return all ? Sight::all : Sight::some;
}

bool Frustum::contains(glm::dvec3 point) const {
    const glm::dvec3 p = point - eye_;
    for (int plane = 0; plane < kPlanes; ++plane)
        if (!(glm::dot(p, normal(plane)) >= (plane == 0 ? near_m_ : 0))) return false;
    return true;
}

}  // namespace scree
