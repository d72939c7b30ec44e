#include "runtime/view/frustum.h"

#include <algorithm>

namespace scree {

Frustum::Frustum(const Camera& camera) : eye_(camera.eye), forward_(camera.forward), near_m_(camera.near_m) {
    const glm::dvec3 right = camera.right(), up = camera.up;
    const double tx = camera.tan_half_x(), ty = camera.tan_half_y();
    normals_ = {forward_ * tx + right, forward_ * tx - right, forward_ * ty + up, forward_ * ty - up};
}

bool Frustum::may_see(const Box& box) const {
    const glm::dvec3 low = box.low - eye_, high = box.high - eye_;
    const auto furthest = [&](glm::dvec3 n) {
        return (n.x > 0 ? high.x : low.x) * n.x + (n.y > 0 ? high.y : low.y) * n.y + (n.z > 0 ? high.z : low.z) * n.z;
    };
    if (!(furthest(forward_) >= near_m_)) return false;
    for (const glm::dvec3& n : normals_)
        if (!(furthest(n) >= 0)) return false;
    return true;
}

Sight Frustum::sight(const Box& box) const {
    const glm::dvec3 middle = 0.5 * (box.low + box.high) - eye_, half = 0.5 * (box.high - box.low);
    // Nearest and furthest signed distance along a normal are the middle's, less and plus this reach.
    const auto reach = [&](const glm::dvec3& n) { return glm::dot(glm::abs(n), half); };
    double depth = glm::dot(forward_, middle) - near_m_;
    double span = reach(forward_);
    if (!(depth + span >= 0)) return Sight::none;
    bool all = depth >= span;
    for (const glm::dvec3& n : normals_) {
        depth = glm::dot(n, middle);
        span = reach(n);
        if (!(depth + span >= 0)) return Sight::none;
        all = all && depth >= span;
    }
    return all ? Sight::all : Sight::some;
}

bool Frustum::contains(glm::dvec3 point) const {
    const glm::dvec3 p = point - eye_;
    if (!(glm::dot(p, forward_) >= near_m_)) return false;
    return std::all_of(normals_.begin(), normals_.end(), [&](glm::dvec3 n) { return glm::dot(p, n) >= 0; });
}

}  // namespace scree
