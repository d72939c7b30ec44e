#include "runtime/window/camera_rig.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace scree {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kRadiansPerPixel = kPi / 800;
constexpr double kTurn_per_s = 1.2;
constexpr double kSteepest = kPi / 2 - 1e-3;  // a heading can still be told from the view
constexpr double kLongestFrame_s = 0.1;
constexpr double kFast = 4;
constexpr double kNotch = 1.25;  // of the wheel
/// Of the distance looked over: at 40 degrees and 800 rows a pixel is 0.0009 of it.
constexpr double kPanPerPixel = 0.001;
constexpr double kOrbitSpeed_per_s = 0.5;  // of the distance
constexpr double kNearest_m = 2;
constexpr double kReach = 20;  // extents
constexpr double kStrolling_m_per_s = 1.4;
constexpr double kSlowest_m_per_s = 0.5, kRunning_m_per_s = 14;
constexpr double kLook_m = 1000;
constexpr double kFocus_s = 0.8, kTurnToCentre_s = 0.4, kDescent_s = 1.5;
constexpr double kFollow_s = 0.1;  // in which walking downhill makes up 63 % of the height
constexpr double kSettled_m = 1e-3;
constexpr double kInView = 0.94;  // cosine of 20 degrees
constexpr double kPlumb = 1e-9;   // a direction has no heading
constexpr double kFarthest_m = 1e10;

bool usable(const glm::dvec3& v) {
    return std::abs(v.x) <= kFarthest_m && std::abs(v.y) <= kFarthest_m && std::abs(v.z) <= kFarthest_m;
}

double part(double value, double limit) { return std::isfinite(value) ? std::clamp(value, -limit, limit) : 0; }
glm::dvec2 pixels(const glm::dvec2& v) { return {part(v.x, 1e5), part(v.y, 1e5)}; }

RigInput checked(const RigInput& in) {
    RigInput out;
    out.seconds = std::max(0.0, part(in.seconds, kLongestFrame_s));
    out.ahead = part(in.ahead, 1);
    out.right = part(in.right, 1);
    out.up = part(in.up, 1);
    out.turn = part(in.turn, 1);
    out.tilt = part(in.tilt, 1);
    out.drag_px = pixels(in.drag_px);
    out.pan_px = pixels(in.pan_px);
    out.wheel = part(in.wheel, 100);
    out.fast = in.fast;
    return out;
}

/// From 0 to 1, at rest at both ends.
double eased(double t) {
    const double s = std::clamp(t, 0.0, 1.0);
    return s * s * (3 - 2 * s);
}

double wrapped(double radians) { return std::remainder(radians, 2 * kPi); }

double pace(const RigInput& in) { return (in.fast ? kFast : 1) * in.seconds; }

}  // namespace

CameraRig::CameraRig(const FlightPose& home, double extent_m)
    : home_(home),
      extent_m_(std::isfinite(extent_m) ? std::clamp(extent_m, 1.0, 1e9) : 1000),
      fly_speed_(extent_m_ / 20),
      walk_speed_(kStrolling_m_per_s) {
    if (!take(home_)) home_ = pose();
}

glm::dvec3 CameraRig::forward() const {
    return {std::cos(heading_) * std::cos(pitch_), std::sin(heading_) * std::cos(pitch_), std::sin(pitch_)};
}

glm::dvec3 CameraRig::right() const { return {std::sin(heading_), -std::cos(heading_), 0}; }

// Keeps the heading of a plumb line where it has one already.
void CameraRig::aim(const glm::dvec3& direction) {
    const double level = std::hypot(direction.x, direction.y);
    if (!(level > 0) && direction.z == 0) return;
    if (level > kPlumb * std::abs(direction.z)) heading_ = std::atan2(direction.y, direction.x);
    pitch_ = std::atan2(direction.z, level);
}

bool CameraRig::take(const FlightPose& pose) {
    const glm::dvec3 direction = pose.look - pose.eye;
    if (!usable(pose.eye) || !usable(pose.look) || direction == glm::dvec3(0)) return false;
    glide_.reset();
    descent_.reset();
    focus_.reset();
    settling_ = false;
    eye_ = pose.eye;
    // A camera that looks straight down or up has north at the picture's top (look_at).
    if (std::hypot(direction.x, direction.y) <= kPlumb * std::abs(direction.z))
        heading_ = direction.z < 0 ? kPi / 2 : -kPi / 2;
    aim(direction);
    return true;
}

void CameraRig::set_pose(const FlightPose& pose) {
    if (!take(pose)) return;
    target_ = eye_ + distance_m_ * forward();
    if (mode_ == RigMode::walk) descent_ = Descent{eye_.z, 0, {}};
}

void CameraRig::go_home() {
    if (mode_ == RigMode::walk) mode_ = RigMode::fly;
    if (!take(home_)) return;
    distance_m_ = std::max(kNearest_m, glm::length(home_.look - home_.eye));
    target_ = eye_ + distance_m_ * forward();
}

void CameraRig::set_mode(RigMode mode, const std::optional<glm::dvec3>& middle) {
    if (mode == mode_) return;
    if (mode == RigMode::walk || mode_ == RigMode::walk) end_glide();
    mode_ = mode;
    descent_.reset();
    settling_ = false;
    if (mode == RigMode::walk) descent_ = Descent{eye_.z, 0, pitch_ < 0 ? std::optional(pitch_) : std::nullopt};
    if (mode != RigMode::orbit || glide_) return;
    const glm::dvec3 centre = centre_of_orbit(middle);
    glide_ = Glide{eye_, eye_, centre, heading_, pitch_, 0, kTurnToCentre_s};
    distance_m_ = glm::length(centre - eye_);
}

void CameraRig::focus(const glm::dvec3& point) {
    if (!usable(point)) return;
    const double distance = glm::length(point - eye_);
    if (!(distance > kNearest_m)) return;
    if (descent_) descent_->pitch.reset();
    focus_ = point;
    distance_m_ = distance;
    const double nearer = std::max(distance / 2, kNearest_m);
    const glm::dvec3 to = mode_ == RigMode::walk ? eye_ : point + (eye_ - point) * (nearer / distance);
    glide_ = Glide{eye_, to, point, heading_, pitch_, 0, kFocus_s};
}

void CameraRig::move(const RigInput& wished, std::optional<double> ground_m) {
    const RigInput input = checked(wished);
    ground_m_ = ground_m && std::abs(*ground_m) < kFarthest_m ? ground_m : std::nullopt;
    if (wishes(input)) end_glide();
    const glm::dvec3 before = target_;
    if (mode_ != RigMode::orbit) change_pace(input.wheel);
    if (glide_)
        glide(input.seconds);
    else if (mode_ == RigMode::fly)
        fly(input);
    else if (mode_ == RigMode::walk)
        walk(input);
    else if (wishes(input))
        orbit(input);
    keep_clear(input.seconds, before != target_);
    if (glide_) look_along_glide();
    const Place now{eye_, heading_, pitch_};
    moved_ = shown_ != now;
    shown_ = now;
}

// In flight and on foot the wheel sets a speed, and moves nothing.
bool CameraRig::wishes(const RigInput& in) const {
    const bool keys = in.seconds > 0 && (in.ahead != 0 || in.right != 0 || in.up != 0 || in.turn != 0 || in.tilt != 0);
    const bool mouse = in.drag_px != glm::dvec2(0) || in.pan_px != glm::dvec2(0);
    return keys || mouse || (mode_ == RigMode::orbit && in.wheel != 0);
}

void CameraRig::change_pace(double wheel) {
    if (wheel == 0) return;
    double& speed = mode_ == RigMode::walk ? walk_speed_ : fly_speed_;
    const double least = mode_ == RigMode::walk ? kSlowest_m_per_s : extent_m_ / 1e5,
                 most = mode_ == RigMode::walk ? kRunning_m_per_s : extent_m_;
    speed = std::clamp(speed * std::pow(kNotch, wheel), least, most);
}

void CameraRig::turn(const RigInput& in) {
    heading_ = wrapped(heading_ + in.turn * kTurn_per_s * in.seconds - in.drag_px.x * kRadiansPerPixel);
    const double tilt = in.tilt * kTurn_per_s * in.seconds - in.drag_px.y * kRadiansPerPixel;
    // A pose from outside may be steeper: it stays so until it is tilted back.
    const double steepest = std::max(kSteepest, std::abs(pitch_));
    if (tilt != 0) pitch_ = std::clamp(pitch_ + tilt, -steepest, steepest);
}

// The ground goes with the mouse, so the eye goes against it.
glm::dvec3 CameraRig::pan(const RigInput& in) const {
    const double metres = kPanPerPixel * (mode_ == RigMode::orbit ? distance_m_ : distance_ahead());
    const glm::dvec3 ahead{std::cos(heading_), std::sin(heading_), 0};
    return metres * (in.pan_px.y * ahead - in.pan_px.x * right());
}

// `to`, unless it is farther from home than one may go and farther than before.
glm::dvec3 CameraRig::within_reach(const glm::dvec3& from, const glm::dvec3& to) const {
    const double reach = glm::length(to - home_.eye);
    return reach > kReach * extent_m_ && reach > glm::length(from - home_.eye) ? from : to;
}

void CameraRig::fly(const RigInput& in) {
    turn(in);
    const glm::dvec3 step = in.ahead * forward() + in.right * right() + glm::dvec3(0, 0, in.up);
    eye_ = within_reach(eye_, eye_ + step * (fly_speed_ * pace(in)) + pan(in));
}

void CameraRig::walk(const RigInput& in) {
    const double tilted = pitch_;
    turn(in);
    if (descent_ && pitch_ != tilted) descent_->pitch.reset();
    glm::dvec3 step = in.ahead * glm::dvec3(std::cos(heading_), std::sin(heading_), 0) + in.right * right();
    if (const double length = glm::length(step); length > 1) step /= length;
    eye_ = within_reach(eye_, eye_ + step * (walk_speed_ * pace(in)));
}

void CameraRig::orbit(const RigInput& in) {
    turn(in);
    const double farthest = std::max(kReach * extent_m_, distance_m_), nearest = std::min(kNearest_m, distance_m_);
    distance_m_ = std::clamp(distance_m_ * std::pow(kNotch, -in.wheel), nearest, farthest);
    const glm::dvec3 ahead{std::cos(heading_), std::sin(heading_), 0};
    const glm::dvec3 step = in.ahead * ahead + in.right * right() + glm::dvec3(0, 0, in.up);
    target_ = within_reach(target_, target_ + step * (speed_m_per_s() * pace(in)) + pan(in));
    eye_ = target_ - distance_m_ * forward();
}

// `pushed`: the point that is circled was moved, and is lifted with the eye. Else the eye alone is, and looks at it
// from there.
void CameraRig::keep_clear(double seconds, bool pushed) {
    settling_ = false;
    if (!ground_m_) return;
    const double least = *ground_m_ + kClearance_m;
    if (mode_ == RigMode::walk) return follow_ground(seconds, least);
    if (eye_.z >= least) return;
    const double lift = least - eye_.z;
    eye_.z = least;
    if (mode_ != RigMode::orbit || glide_) return;
    if (pushed) {
        target_.z += lift;
    } else {
        aim(target_ - eye_);
        distance_m_ = glm::length(target_ - eye_);
    }
}

void CameraRig::follow_ground(double seconds, double least_m) {
    if (descent_) {
        descent_->seconds += seconds;
        const double s = eased(descent_->seconds / kDescent_s);
        eye_.z = std::max(least_m, descent_->from_m + (least_m - descent_->from_m) * s);
        if (descent_->pitch) pitch_ = *descent_->pitch * (1 - s);
        if (descent_->seconds >= kDescent_s) {
            descent_.reset();
            eye_.z = least_m;
        }
    } else {
        const double above = (eye_.z - least_m) * std::exp(-seconds / kFollow_s);
        eye_.z = above > kSettled_m ? least_m + above : least_m;
    }
    settling_ = eye_.z > least_m;
}

double CameraRig::distance_ahead() const {
    const double down = -forward().z;
    if (!ground_m_ || down < 1e-3) return extent_m_ / 4;
    return std::clamp((eye_.z - *ground_m_) / down, 2 * kNearest_m, extent_m_);
}

bool CameraRig::in_view(const glm::dvec3& point) const {
    if (!usable(point)) return false;
    const glm::dvec3 to = point - eye_;
    const double distance = glm::length(to);
    return distance > kNearest_m && glm::dot(to, forward()) > kInView * distance;
}

glm::dvec3 CameraRig::centre_of_orbit(const std::optional<glm::dvec3>& middle) const {
    if (focus_ && in_view(*focus_)) return *focus_;
    if (middle && in_view(*middle)) return *middle;
    return eye_ + distance_ahead() * forward();
}

// Moves the eye; where it looks follows when it is clear of the ground.
void CameraRig::glide(double seconds) {
    glide_->seconds += seconds;
    if (mode_ == RigMode::walk) return;
    eye_ = glide_->from + (glide_->to - glide_->from) * eased(glide_->seconds / glide_->lasts_s);
}

void CameraRig::look_along_glide() {
    const Glide g = *glide_;
    aim(g.point - eye_);
    const double s = eased(g.seconds / g.lasts_s);
    heading_ = wrapped(g.heading + wrapped(heading_ - g.heading) * s);
    pitch_ = g.pitch + (pitch_ - g.pitch) * s;
    distance_m_ = std::max(kNearest_m, glm::length(g.point - eye_));
    if (g.seconds >= g.lasts_s) end_glide();
}

void CameraRig::end_glide() {
    if (!glide_) return;
    glide_.reset();
    target_ = eye_ + distance_m_ * forward();
}

FlightPose CameraRig::pose() const {
    return {eye_, eye_ + (mode_ == RigMode::orbit ? distance_m_ : kLook_m) * forward()};
}

double CameraRig::speed_m_per_s() const {
    if (mode_ == RigMode::walk) return walk_speed_;
    return mode_ == RigMode::orbit ? std::max(1.0, kOrbitSpeed_per_s * distance_m_) : fly_speed_;
}

std::optional<double> CameraRig::orbit_distance_m() const {
    return mode_ == RigMode::orbit ? std::optional(distance_m_) : std::nullopt;
}

}  // namespace scree
