#include "runtime/app/fly_controls.h"

#include <GLFW/glfw3.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace scree {
namespace {
constexpr double kRadiansPerPixel = 0.004;  // 800 px turn by 183 degrees
constexpr double kSteepest = 1.55;          // just short of straight up
constexpr double kClearance = 1.7;          // metres: a person's eye
}  // namespace

FlyControls::FlyControls(GLFWwindow* window, const FlightPose& home, double extent_m)
    : window_(window), home_(home), speed_(extent_m / 20), least_speed_(extent_m / 1e5), greatest_speed_(extent_m) {
    glfwSetWindowUserPointer(window_, this);
    glfwSetScrollCallback(window_, on_scroll);
    glfwSetKeyCallback(window_, on_key);
    go_home();
}

FlyControls::~FlyControls() {
    glfwSetScrollCallback(window_, nullptr);
    glfwSetKeyCallback(window_, nullptr);
    glfwSetWindowUserPointer(window_, nullptr);
}

void FlyControls::on_scroll(GLFWwindow* window, double, double dy) {
    auto* self = static_cast<FlyControls*>(glfwGetWindowUserPointer(window));
    self->speed_ = std::clamp(self->speed_ * std::pow(1.25, dy), self->least_speed_, self->greatest_speed_);
}

void FlyControls::on_key(GLFWwindow* window, int key, int, int action, int) {
    if (action == GLFW_PRESS) ++static_cast<FlyControls*>(glfwGetWindowUserPointer(window))->presses_[key];
}

int FlyControls::take_presses(int key) {
    const auto it = presses_.find(key);
    return it == presses_.end() ? 0 : std::exchange(it->second, 0);
}

void FlyControls::go_home() {
    eye_ = home_.eye;
    const glm::dvec3 d = glm::normalize(home_.look - home_.eye);
    heading_ = std::atan2(d.y, d.x);
    pitch_ = std::asin(std::clamp(d.z, -1.0, 1.0));
    moved_ = true;
}

void FlyControls::move(double seconds, double ground_m) {
    moved_ = false;
    const auto down = [&](int key) { return glfwGetKey(window_, key) == GLFW_PRESS; };
    if (take_presses(GLFW_KEY_HOME) > 0) go_home();
    double x = 0, y = 0;
    glfwGetCursorPos(window_, &x, &y);
    const bool pressed = glfwGetMouseButton(window_, GLFW_MOUSE_BUTTON_LEFT) == GLFW_PRESS;
    if (pressed && dragging_ && (x != mouse_x_ || y != mouse_y_)) {
        heading_ -= (x - mouse_x_) * kRadiansPerPixel;
        pitch_ = std::clamp(pitch_ - (y - mouse_y_) * kRadiansPerPixel, -kSteepest, kSteepest);
        moved_ = true;
    }
    dragging_ = pressed;
    mouse_x_ = x;
    mouse_y_ = y;
    const double turn = seconds * 1.2;
    if (down(GLFW_KEY_LEFT)) heading_ += turn, moved_ = true;
    if (down(GLFW_KEY_RIGHT)) heading_ -= turn, moved_ = true;
    if (down(GLFW_KEY_UP)) pitch_ = std::min(kSteepest, pitch_ + turn), moved_ = true;
    if (down(GLFW_KEY_DOWN)) pitch_ = std::max(-kSteepest, pitch_ - turn), moved_ = true;
    const glm::dvec3 ahead{std::cos(heading_) * std::cos(pitch_), std::sin(heading_) * std::cos(pitch_),
                           std::sin(pitch_)};
    const glm::dvec3 right{std::sin(heading_), -std::cos(heading_), 0};
    glm::dvec3 step{0};
    if (down(GLFW_KEY_W)) step += ahead;
    if (down(GLFW_KEY_S)) step -= ahead;
    if (down(GLFW_KEY_D)) step += right;
    if (down(GLFW_KEY_A)) step -= right;
    if (down(GLFW_KEY_E)) step.z += 1;
    if (down(GLFW_KEY_Q)) step.z -= 1;
    if (step != glm::dvec3(0)) {
        const double fast = down(GLFW_KEY_LEFT_SHIFT) ? 4 : 1;
        eye_ += step * (speed_ * fast * seconds);
        moved_ = true;
    }
    if (eye_.z < ground_m + kClearance) {
        eye_.z = ground_m + kClearance;
        moved_ = true;
    }
}

FlightPose FlyControls::pose() const {
    return {eye_, eye_ + 1000.0 * glm::dvec3(std::cos(heading_) * std::cos(pitch_),
                                             std::sin(heading_) * std::cos(pitch_), std::sin(pitch_))};
}

}  // namespace scree
