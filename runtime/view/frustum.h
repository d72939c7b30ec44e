// Frustum: the four side planes and the near plane of a camera, and the box test against them. A box is culled only
// when it lies wholly behind one plane (far-most corner per plane; Scree lod, C18: corner tests lose tiles, this loses
// none).
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include <glm/glm.hpp>

#include "runtime/view/camera.h"

namespace scree {

/// Axis-aligned box in the dataset's metres.
struct Box {
    glm::dvec3 low{0}, high{0};
};

/// Distance from a point to a box, 0 inside.
inline double distance_to_box(const glm::dvec3& point, const Box& box) {
    const double x = std::max({box.low.x - point.x, 0.0, point.x - box.high.x});
    const double y = std::max({box.low.y - point.y, 0.0, point.y - box.high.y});
    const double z = std::max({box.low.z - point.z, 0.0, point.z - box.high.z});
    return std::sqrt(x * x + y * y + z * z);
}

enum class Sight { none, some, all };

class Frustum {
public:
    explicit Frustum(const Camera& camera);
    /// none only if no point of the box is in view; all only if every point is.
    Sight sight(const Box& box) const;
    /// False only if no point of the box is in view.
    bool may_see(const Box& box) const;
    bool contains(glm::dvec3 point) const;

    // Its planes: the first looks forward and lies near_m() before the eye; the others go through the eye.
    static constexpr int kPlanes = 5;
    glm::dvec3 eye() const { return eye_; }
    double near_m() const { return near_m_; }
    const glm::dvec3& normal(int plane) const { return normals_[static_cast<std::size_t>(plane)]; }
    /// |normal|: times half a box's sides, how far the box reaches along the normal.
    const glm::dvec3& reach(int plane) const { return reaches_[static_cast<std::size_t>(plane)]; }

private:
    glm::dvec3 eye_;
    double near_m_;
    std::array<glm::dvec3, kPlanes> normals_, reaches_;  ///< pointing inward
};

}  // namespace scree
