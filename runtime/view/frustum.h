// Frustum: the four side planes and the near plane of a camera, and the box test against them. A box is culled only
// when it lies wholly behind one plane (far-most corner per plane; Scree lod, C18: corner tests lose tiles, this loses
// none).
#pragma once

#include <array>

#include <glm/glm.hpp>

#include "runtime/view/camera.h"

namespace scree {

/// Axis-aligned box in the dataset's metres.
struct Box {
    glm::dvec3 low{0}, high{0};
};

/// Distance from a point to a box, 0 inside.
double distance_to_box(glm::dvec3 point, const Box& box);

enum class Sight { none, some, all };

class Frustum {
public:
    explicit Frustum(const Camera& camera);
    /// none only if no point of the box is in view; all only if every point is.
    Sight sight(const Box& box) const;
    /// False only if no point of the box is in view.
    bool may_see(const Box& box) const;
    bool contains(glm::dvec3 point) const;

private:
    glm::dvec3 eye_;
    glm::dvec3 forward_;
    double near_m_;
    std::array<glm::dvec3, 4> normals_;  ///< pointing inward, through the eye
};

}  // namespace scree
