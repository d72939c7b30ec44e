// Foresight: where a camera will be if it goes on as it does. Plain dead reckoning over a smoothed motion.
#pragma once

#include <glm/glm.hpp>

#include "runtime/view/camera.h"

namespace scree {

class Foresight {
public:
    /// The camera as of `now_s`. A leap, a clock that stands still or goes back: the motion is forgotten.
    void see(const Camera& camera, double now_s);
    /// The camera in `seconds`, moved and turned on, with a wider view than `camera`'s: a head may turn.
    Camera ahead(const Camera& camera, double seconds) const;

    glm::dvec3 velocity_m_per_s() const { return velocity_; }
    glm::dvec3 turn_per_s() const { return turn_; }  ///< axis times radians

private:
    bool seen_ = false;
    double when_s_ = 0;
    glm::dvec3 eye_{0}, forward_{0, 1, 0};
    glm::dvec3 velocity_{0}, turn_{0};
    glm::dvec3 measured_{0};  ///< velocity of the last step alone
};

}  // namespace scree
