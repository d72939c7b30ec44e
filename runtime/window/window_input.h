// WindowInput: what a user does to a GLFW window, counted from events so that a tap shorter than a frame is not lost.
// One window at a time, on the thread that polls GLFW; made before whatever else wants the window's events and chains
// to the callbacks that it finds (Dear ImGui), gone after it.
#pragma once

#include <functional>
#include <optional>
#include <set>
#include <vector>

#include <glm/glm.hpp>

#include "runtime/window/camera_rig.h"
#include "runtime/window/key_table.h"

struct GLFWwindow;

namespace scree {

/// What was done since the last taking. Places are in pixels of the framebuffer, from the top left.
struct TakenInput {
    std::vector<Action> actions;          ///< in the order of their keys
    RigInput rig;                         ///< but for the seconds
    std::vector<glm::dvec2> clicks_px;    ///< of the left button, which went up where it had gone down
    std::optional<glm::dvec2> cursor_px;  ///< none: beyond the window, or over what takes the mouse for itself
    bool anything = false;                ///< an event of any kind came: also a mouse that only moves
    bool uncovered = false;               ///< the window's contents are lost
};

class WindowInput {
public:
    explicit WindowInput(GLFWwindow* window);
    ~WindowInput();
    WindowInput(const WindowInput&) = delete;
    WindowInput& operator=(const WindowInput&) = delete;

    /// Clicks, drags and wheel at a place that this says yes to are not ours. In the window's own coordinates.
    void leave_to(std::function<bool(const glm::dvec2&)> taken_at) { taken_at_ = std::move(taken_at); }
    TakenInput take();

private:
    struct Press {
        glm::dvec2 at{0};
        double when_s = 0;
        double travelled_px = 0;  ///< furthest from where it began
        int takings = 0;          ///< since it began
    };

    static WindowInput& of(GLFWwindow* window);
    void watch_keys();
    void watch_mouse();
    void press_key(int key, int modifiers);
    void press_button(int button);
    void release_button(int button);
    void move_cursor(const glm::dvec2& to);
    bool others_want(const glm::dvec2& at) const { return taken_at_ && taken_at_(at); }
    /// 1 if the key is down or was tapped since the last taking.
    double held(int key) const { return down_.contains(key) || tapped_.contains(key) ? 1 : 0; }
    double axis(int forth, int back) const { return held(forth) - held(back); }
    RigInput take_rig();
    glm::dvec2 to_framebuffer(const glm::dvec2& at) const;

    GLFWwindow* window_;
    std::function<bool(const glm::dvec2&)> taken_at_;
    std::set<int> down_, tapped_;  ///< keys
    std::optional<Press> left_, right_;
    glm::dvec2 cursor_{0};
    bool inside_ = false;
    glm::dvec2 dragged_{0}, panned_{0};
    double wheel_ = 0;
    TakenInput taken_;
};

}  // namespace scree
