// CameraRig: how the camera of a window moves: free flight, circling round a point, walking. Knows no keys and no
// window: what is wished for comes as numbers. Pure; one thread.
//
// Whatever numbers come in, finite ones come out: what is no number is no wish, and a frame that took longer than 0.1 s
// moves as far as one of 0.1 s.
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
    glm::dvec2 pan_px{0};                 ///< with the right one: moves along the ground, which follows the mouse
    double wheel = 0;                     ///< notches away from the user: a faster flight or walk, a nearer orbit
    bool fast = false;                    ///< four times as fast
};

/// Metres between the eye and the ground under it, at least: a person's eye.
inline constexpr double kClearance_m = 1.7;

class CameraRig {
public:
    /// `home`: where to start and to return to; `extent_m`: size of the world, sets speeds and limits: nobody leaves 20
    /// extents round home.
    CameraRig(const FlightPose& home, double extent_m);

    RigMode mode() const { return mode_; }
    /// The picture stays as it is at first. To orbit: round what was focused on last, or what the view's middle is said
    /// to show (`middle`), whichever is first in view, or a point ahead; the view turns to it within half a second. To
    /// walk: the eye comes down (or up) to the ground within 1.5 s, as soon as its height is known, and a view that
    /// goes down is levelled meanwhile, unless it is tilted by hand.
    void set_mode(RigMode mode, const std::optional<glm::dvec3>& middle = {});
    /// Glides to where the point is in the middle of the view and nearer by half, within a second; orbits it from then
    /// on where the mode is orbit; turns to it where it stands in walk. Any wish to move ends the glide. What is no
    /// place, or closer than 2 m, is passed over.
    void focus(const glm::dvec3& point);
    /// At once. From walk to fly.
    void go_home();
    /// From outside: a replay. At once; the mode stays, an orbit is round what is ahead. Steeper than a tilt goes, if
    /// need be. A pose that is no place or no direction is passed over.
    void set_pose(const FlightPose& pose);

    /// `ground_m`: height of the ground under the eye, where it is known: never below it, by kClearance_m.
    void move(const RigInput& input, std::optional<double> ground_m);

    /// It looks at the point that is circled, in orbit; else at one 1000 m ahead.
    FlightPose pose() const;
    /// Of flight, of walking, or of the point that is circled; without `fast`.
    double speed_m_per_s() const;
    /// From eye to the point that is circled; none but in orbit.
    std::optional<double> orbit_distance_m() const;
    /// In the last move(), or between it and the one before.
    bool moved() const { return moved_; }
    /// Will move by itself in the next one.
    bool gliding() const { return glide_.has_value() || settling_; }

private:
    struct Glide {
        glm::dvec3 from{0}, to{0};  ///< the eye
        glm::dvec3 point{0};        ///< looked at in the end
        double heading = 0, pitch = 0;
        double seconds = 0, lasts_s = 0;
    };
    struct Descent {
        double from_m = 0, seconds = 0;
        std::optional<double> pitch{};  ///< that it began with, to be levelled; none: not below level, or tilted since
    };
    struct Place {
        glm::dvec3 eye{0};
        double heading = 0, pitch = 0;
        bool operator==(const Place&) const = default;
    };

    glm::dvec3 forward() const;
    glm::dvec3 right() const;
    void aim(const glm::dvec3& direction);
    bool take(const FlightPose& pose);
    void turn(const RigInput& input);
    bool wishes(const RigInput& input) const;
    void fly(const RigInput& input);
    void walk(const RigInput& input);
    void orbit(const RigInput& input);
    void change_pace(double wheel);
    glm::dvec3 pan(const RigInput& input) const;
    glm::dvec3 within_reach(const glm::dvec3& from, const glm::dvec3& to) const;
    void keep_clear(double seconds, bool pushed);
    void follow_ground(double seconds, double least_m);
    double distance_ahead() const;
    glm::dvec3 centre_of_orbit(const std::optional<glm::dvec3>& middle) const;
    bool in_view(const glm::dvec3& point) const;
    void glide(double seconds);
    void look_along_glide();
    void end_glide();

    FlightPose home_;
    double extent_m_;
    RigMode mode_ = RigMode::fly;
    glm::dvec3 eye_{0};
    double heading_ = 0;  ///< radians from east to north
    double pitch_ = 0;    ///< radians upwards
    double fly_speed_, walk_speed_;
    glm::dvec3 target_{0};  ///< of an orbit that does not glide: eye + distance * forward
    double distance_m_ = 1;
    std::optional<glm::dvec3> focus_;
    std::optional<double> ground_m_;
    std::optional<Glide> glide_;
    std::optional<Descent> descent_;
    bool settling_ = false;  ///< walking, and not yet as low as the ground allows
    std::optional<Place> shown_;
    bool moved_ = true;
};

}  // namespace scree
