#include "runtime/window/window_input.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

#include <algorithm>
#include <utility>

namespace scree {
namespace {

// A hand that means to click moves the mouse by a few pixels, and not for long.
constexpr double kClickTravel_px = 4;
constexpr double kClick_s = 0.4;

}  // namespace

WindowInput::WindowInput(GLFWwindow* window) : window_(window) {
    glfwSetWindowUserPointer(window_, this);
    glfwGetCursorPos(window_, &cursor_.x, &cursor_.y);
    inside_ = glfwGetWindowAttrib(window_, GLFW_HOVERED) == GLFW_TRUE;
    watch_keys();
    watch_mouse();
    glfwSetWindowRefreshCallback(window_, [](GLFWwindow* w) { of(w).taken_.uncovered = of(w).taken_.anything = true; });
}

WindowInput::~WindowInput() {
    glfwSetKeyCallback(window_, nullptr);
    glfwSetMouseButtonCallback(window_, nullptr);
    glfwSetCursorPosCallback(window_, nullptr);
    glfwSetCursorEnterCallback(window_, nullptr);
    glfwSetScrollCallback(window_, nullptr);
    glfwSetWindowRefreshCallback(window_, nullptr);
    glfwSetWindowUserPointer(window_, nullptr);
}

WindowInput& WindowInput::of(GLFWwindow* window) {
    return *static_cast<WindowInput*>(glfwGetWindowUserPointer(window));
}

void WindowInput::watch_keys() {
    glfwSetKeyCallback(window_, [](GLFWwindow* w, int key, int, int action, int modifiers) {
        if (action == GLFW_PRESS) of(w).press_key(key, modifiers);
        if (action == GLFW_RELEASE) of(w).down_.erase(key);
        of(w).taken_.anything = true;
    });
}

void WindowInput::watch_mouse() {
    glfwSetMouseButtonCallback(window_, [](GLFWwindow* w, int button, int action, int) {
        if (action == GLFW_PRESS) of(w).press_button(button);
        if (action == GLFW_RELEASE) of(w).release_button(button);
        of(w).taken_.anything = true;
    });
    glfwSetCursorPosCallback(window_, [](GLFWwindow* w, double x, double y) { of(w).move_cursor({x, y}); });
    glfwSetCursorEnterCallback(window_, [](GLFWwindow* w, int entered) {
        of(w).inside_ = entered == GLFW_TRUE;
        of(w).taken_.anything = true;
    });
    glfwSetScrollCallback(window_, [](GLFWwindow* w, double, double up) {
        if (!of(w).others_want(of(w).cursor_)) of(w).wheel_ += up;
        of(w).taken_.anything = true;
    });
}

void WindowInput::press_key(int key, int modifiers) {
    down_.insert(key);
    tapped_.insert(key);
    if (const KeyBinding* binding = binding_of(key, (modifiers & GLFW_MOD_SHIFT) != 0))
        taken_.actions.push_back(binding->action);
}

void WindowInput::press_button(int button) {
    if (others_want(cursor_)) return;
    const Press press{cursor_, glfwGetTime()};
    if (button == GLFW_MOUSE_BUTTON_LEFT) left_ = press;
    if (button == GLFW_MOUSE_BUTTON_RIGHT) right_ = press;
}

void WindowInput::release_button(int button) {
    if (button == GLFW_MOUSE_BUTTON_RIGHT) right_.reset();
    if (button != GLFW_MOUSE_BUTTON_LEFT || !left_) return;
    // Events come when they are polled: within a slow frame nobody can tell how long a press was.
    const bool was_short = glfwGetTime() - left_->when_s < kClick_s || left_->takings <= 1;
    if (left_->travelled_px <= kClickTravel_px && was_short) taken_.clicks_px.push_back(to_framebuffer(left_->at));
    left_.reset();
}

void WindowInput::move_cursor(const glm::dvec2& to) {
    const glm::dvec2 step = to - cursor_;
    cursor_ = to;
    inside_ = true;
    taken_.anything = true;
    for (const auto& [press, sum] : {std::pair(&left_, &dragged_), std::pair(&right_, &panned_)}) {
        if (!*press) continue;
        (*press)->travelled_px = std::max((*press)->travelled_px, glm::length(to - (*press)->at));
        *sum += step;
    }
}

// A mouse that may still mean a click turns nothing; once it is a drag, all of its way counts.
RigInput WindowInput::take_rig() {
    RigInput rig;
    rig.ahead = axis(GLFW_KEY_W, GLFW_KEY_S);
    rig.right = axis(GLFW_KEY_D, GLFW_KEY_A);
    rig.up = axis(GLFW_KEY_E, GLFW_KEY_Q);
    rig.turn = axis(GLFW_KEY_LEFT, GLFW_KEY_RIGHT);
    rig.tilt = axis(GLFW_KEY_UP, GLFW_KEY_DOWN);
    rig.fast = down_.contains(GLFW_KEY_LEFT_SHIFT) || down_.contains(GLFW_KEY_RIGHT_SHIFT);
    const bool perhaps_click = left_ && left_->travelled_px <= kClickTravel_px;
    if (!perhaps_click) rig.drag_px = std::exchange(dragged_, glm::dvec2(0));
    rig.pan_px = std::exchange(panned_, glm::dvec2(0));
    rig.wheel = std::exchange(wheel_, 0.0);
    tapped_.clear();
    return rig;
}

glm::dvec2 WindowInput::to_framebuffer(const glm::dvec2& at) const {
    int window_width = 0, window_height = 0, width = 0, height = 0;
    glfwGetWindowSize(window_, &window_width, &window_height);
    glfwGetFramebufferSize(window_, &width, &height);
    if (window_width <= 0 || window_height <= 0) return at;
    return at * glm::dvec2(static_cast<double>(width) / window_width, static_cast<double>(height) / window_height);
}

TakenInput WindowInput::take() {
    if (!taken_.clicks_px.empty()) dragged_ = {};  // the few pixels of a click
    TakenInput taken = std::exchange(taken_, {});
    taken.rig = take_rig();
    if (left_) ++left_->takings;
    if (inside_ && !left_ && !right_ && !others_want(cursor_)) taken.cursor_px = to_framebuffer(cursor_);
    return taken;
}

}  // namespace scree
