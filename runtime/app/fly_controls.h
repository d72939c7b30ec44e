// FlyControls: a free camera moved by keys, mouse and wheel of a GLFW window.
#pragma once

#include <map>

#include <glm/glm.hpp>

#include "runtime/view/camera.h"
#include "runtime/view/flight_path.h"

struct GLFWwindow;

namespace scree {

class FlyControls {
public:
    /// `home`: where to start and to return to; `extent_m`: size of the world, sets the speed.
    FlyControls(GLFWwindow* window, const FlightPose& home, double extent_m);
    ~FlyControls();
    FlyControls(const FlyControls&) = delete;
    FlyControls& operator=(const FlyControls&) = delete;

    /// Moves by what is held down for `seconds`; `ground_m` is the height under the eye, kept below it by a little.
    void move(double seconds, double ground_m);
    /// How often a key went down since the last call. Counted from events: a tap shorter than a frame is not lost.
    int take_presses(int key);
    FlightPose pose() const;
    double speed_m_per_s() const { return speed_; }
    bool moved() const { return moved_; }

private:
    static void on_scroll(GLFWwindow* window, double dx, double dy);
    static void on_key(GLFWwindow* window, int key, int scancode, int action, int modifiers);
    void go_home();

    GLFWwindow* window_;
    FlightPose home_;
    glm::dvec3 eye_{0};
    double heading_ = 0;  ///< radians from east to north
    double pitch_ = 0;
    double speed_ = 100;
    double least_speed_, greatest_speed_;
    double mouse_x_ = 0, mouse_y_ = 0;
    std::map<int, int> presses_;  ///< by key
    bool dragging_ = false;
    bool moved_ = true;
};

}  // namespace scree
