// FlyControls: a free camera moved by keys, mouse and wheel of a GLFW window.
#pragma once

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
    FlightPose pose() const;
    double speed_m_per_s() const { return speed_; }
    bool moved() const { return moved_; }

private:
    static void on_scroll(GLFWwindow* window, double dx, double dy);
    void go_home();

    GLFWwindow* window_;
    FlightPose home_;
    glm::dvec3 eye_{0};
    double heading_ = 0;  ///< radians from east to north
    double pitch_ = 0;
    double speed_ = 100;
    double least_speed_, greatest_speed_;
    double mouse_x_ = 0, mouse_y_ = 0;
    bool dragging_ = false;
    bool moved_ = true;
};

}  // namespace scree
