#include "runtime/scene/frame_governor.h"

#include <algorithm>
#include <cmath>

namespace scree {
namespace {

/// Weight of the newest frame: a jump is seen after three or four, noise of 5 % a frame becomes 2 %.
constexpr double kSmoothing = 0.3;
/// Aimed at is this share of the time allowed; within 7 % of it (0.90 to 1.04) nothing is done, so that noise does not
/// become motion.
constexpr double kAim = 0.967, kIdle = 0.07;
/// Taken for d log time / d log tau, which is between 0.3 (half of a frame does not depend on tau) and 1.5: what is
/// more steps twice as far as it should and still comes to rest, what is less is made up for by boldness.
constexpr double kElasticity = 1.15;
/// Share of the way to where tau should be that is made in one frame, and the most of it (a factor of 1.28).
constexpr double kShare = 0.75, kMostStep = 0.25;
/// Further off than so, and on the same side again: bolder. On the other side: it was too bold.
constexpr double kFar = 0.12, kBolder = 1.1, kCalmer = 0.55, kBoldest = 3, kCalmest = 0.35;
/// After so many frames of rest nothing that was learnt holds any more.
constexpr int kForget_frames = 60;
/// A single frame counts as e times the time allowed at most: a hitch is no load.
constexpr double kMostExcess = 1;
/// A tolerance of 0 has no logarithm: finer than this is stepped to and from at once.
constexpr double kFinest_px = 0.05;

}  // namespace

FrameGovernor::FrameGovernor(const GovernorLimits& limits) : limits_(limits), tau_px_(limits.tau_least_px) {
    recent_.fill(std::log(std::max(tau_px_, kFinest_px)));
}

void FrameGovernor::observe(double log_time, double log_tau) {
    log_time = std::clamp(log_time, -kMostExcess, kMostExcess);
    if (!seen_) {
        log_time_ = log_time;
        log_drawn_ = recent_[0];
        seen_ = true;
    }
    log_time_ += kSmoothing * (log_time - log_time_);
    log_drawn_ += kSmoothing * (recent_[0] - log_drawn_);
    std::shift_left(recent_.begin(), recent_.end(), 1);
    recent_.back() = log_tau;
}

void FrameGovernor::learn(int side, double excess) {
    if (side == 0) {
        boldness_ = std::min(boldness_, 1.0);
        if (++still_ > kForget_frames) {
            boldness_ = 1;
            side_ = 0;
        }
        return;
    }
    if (side == side_ && std::abs(excess) > kFar) boldness_ = std::min(boldness_ * kBolder, kBoldest);
    if (side == -side_) boldness_ = std::max(std::min(boldness_, 1.0) * kCalmer, kCalmest);
    side_ = side;
    still_ = 0;
}

double FrameGovernor::next(double frame_ms) {
    if (!(frame_ms > 0) || !std::isfinite(frame_ms)) return tau_px_;
    const double log_tau = std::log(std::max(tau_px_, kFinest_px));
    observe(std::log(frame_ms / limits_.frame_ms), log_tau);
    const double excess = log_time_ - std::log(kAim);
    const int side = excess > kIdle ? 1 : excess < -kIdle ? -1 : 0;
    learn(side, excess);
    if (side == 0) return tau_px_;
    // From the tau that the times belong to, not from that of steps whose effect is still to be seen.
    const double goal = log_drawn_ + boldness_ * excess / kElasticity;
    const double step = std::clamp(kShare * (goal - log_tau), -kMostStep, kMostStep);
    double tau_px = std::exp(log_tau + step);
    if (side < 0 && tau_px < kFinest_px) tau_px = 0;
    tau_px_ = std::clamp(tau_px, limits_.tau_least_px, std::max(limits_.tau_least_px, limits_.tau_most_px));
    return tau_px_;
}

}  // namespace scree
