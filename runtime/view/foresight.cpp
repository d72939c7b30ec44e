#include "runtime/view/foresight.h"

#include <algorithm>
#include <cmath>

#include <glm/gtc/quaternion.hpp>

namespace scree {
namespace {

constexpr double kSmoothing_s = 0.2;
/// Further than the motion so far would have come in so many seconds is a leap.
constexpr double kLeap_s = 20;
constexpr double kWidening = 1.3;
constexpr double kMostTurn = 1.2;  ///< radians

}  // namespace

void Foresight::see(const Camera& camera, double now_s) {
    const double passed_s = now_s - when_s_;
    const glm::dvec3 moved = camera.eye - eye_;
    const bool leapt = glm::length(velocity_) > 0 && glm::length(moved) > kLeap_s * glm::length(velocity_);
    if (!seen_ || !(passed_s > 0) || leapt) {
        velocity_ = turn_ = glm::dvec3(0);
    } else {
        const double share = 1 - std::exp(-passed_s / kSmoothing_s);
        velocity_ += share * (moved / passed_s - velocity_);
        turn_ += share * (glm::cross(forward_, camera.forward) / passed_s - turn_);
    }
    seen_ = true;
    when_s_ = now_s;
    eye_ = camera.eye;
    forward_ = camera.forward;
}

Camera Foresight::ahead(const Camera& camera, double seconds) const {
    Camera out = camera;
    out.eye += seconds * velocity_;
    const double rate = glm::length(turn_);
    if (rate > 0) {
        const glm::dquat turn = glm::angleAxis(std::min(rate * seconds, kMostTurn), turn_ / rate);
        out.forward = glm::normalize(turn * camera.forward);
        out.up = glm::normalize(turn * camera.up);
    }
    out.fov_deg = std::min(kWidening * camera.fov_deg, std::max(camera.fov_deg, 150.0));
    return out;
}

}  // namespace scree
