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

// Axis times radians.
glm::dvec3 turn_between(glm::dvec3 from, glm::dvec3 to) {
    const glm::dvec3 axis = glm::cross(from, to);
    const double sine = glm::length(axis);
    return sine > 0 ? axis * (std::atan2(sine, glm::dot(from, to)) / sine) : axis;
}

}  // namespace

void Foresight::see(const Camera& camera, double now_s) {
    const double passed_s = now_s - when_s_;
    const glm::dvec3 moved = camera.eye - eye_;
    glm::dvec3 measured(0);
    if (seen_ && passed_s > 0) measured = moved / passed_s;
    // From rest the first move may be a leap or a start: the next one tells.
    const double speed = std::max(glm::length(velocity_), glm::length(measured_));
    if (!seen_ || !(passed_s > 0) || glm::length(moved) > kLeap_s * speed) {
        velocity_ = turn_ = glm::dvec3(0);
    } else {
        const double share = 1 - std::exp(-passed_s / kSmoothing_s);
        velocity_ += share * (measured - velocity_);
        turn_ += share * (turn_between(forward_, camera.forward) / passed_s - turn_);
    }
    seen_ = true;
    when_s_ = now_s;
    eye_ = camera.eye;
    forward_ = camera.forward;
    measured_ = measured;
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
