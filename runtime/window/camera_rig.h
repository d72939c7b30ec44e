// CameraRig: how the camera of a window moves: free flight, circling round a point, walking. Knows no keys and no
// window: what is wished for comes as numbers. Pure; one thread.
#pragma once

#include <optional>

#include <glm/glm.hpp>

#include "runtime/view/flight_path.h"

namespace scree {

enum class RigMode {
    fly,    ///< goes where it looks
    orbit,  ///< looks at a point, and circles round it
    walk    ///< stands on the ground, as high as a person's eye
};

/// What is wished for in one frame.
struct RigInput {
    double seconds = 0;                   ///< since the last frame
    double ahead = 0, right = 0, up = 0;  ///< -1..1: keys held down
    double turn = 0, tilt = 0;            ///< -1..1: to the left, upwards
    glm::dvec2 drag_px{0};                ///< of the mouse with the left button: right, down; 800 px are half a turn
    glm::dvec2 pan_px{0};                 ///< with the right one: moves along the ground
    double wheel = 0;                     ///< notches away from the user: a faster flight, a nearer orbit
    bool fast = false;
};

class CameraRig {
public:
    /// `home`: where to start and to return to; `extent_m`: size of the world, sets speeds and limits.
    CameraRig(const FlightPose& home, double extent_m);

    RigMode mode() const;
    /// To orbit: round what was focused on last, or what the view's middle is said to show (`middle`), or a point
    /// ahead.
    void set_mode(RigMode mode, const std::optional<glm::dvec3>& middle = {});
    /// Glides to where the point is in the middle of the view and nearer by half, within a second; orbits it from then
    /// on where the mode is orbit. Any wish to move ends the glide.
    void focus(const glm::dvec3& point);
    void go_home();
    void set_pose(const FlightPose& pose);  ///< from outside: a replay

    /// `ground_m`: height of the ground under the eye, where it is known: never below it, by a clearance.
    void move(const RigInput& input, std::optional<double> ground_m);

    FlightPose pose() const;
    double speed_m_per_s() const;
    bool moved() const;    ///< in the last move()
    bool gliding() const;  ///< will move by itself in the next one
};

}  // namespace scree
