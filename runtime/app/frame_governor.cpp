#include "runtime/app/frame_governor.h"

#include <algorithm>
#include <cmath>

namespace scree {
namespace {

/// Weight of the newest frame: noise of single frames is taken out, a jump is seen after three or four.
constexpr double kSmoothing = 0.3;
/// Between this share of the time allowed and all of it nothing is done: the band keeps noise from becoming motion.
constexpr double kIdleFrom = 0.8;
/// Share of the wanted change that is made in one frame, and the most of it: less than a fifth of a level.
constexpr double kCoarserGain = 0.25, kFinerGain = 0.08, kMostChange = 1.12;

}  // namespace

FrameGovernor::FrameGovernor(const GovernorLimits& limits) : limits_(limits), tau_px_(limits.tau_least_px) {}

double FrameGovernor::next(double frame_ms) {
    if (!(frame_ms > 0) || !std::isfinite(frame_ms)) return tau_px_;
    smoothed_ms_ = smoothed_ms_ > 0 ? smoothed_ms_ + kSmoothing * (frame_ms - smoothed_ms_) : frame_ms;
    const double share = smoothed_ms_ / limits_.frame_ms;
    double change = 1;
    if (share > 1)
        change = std::pow(share, kCoarserGain);
    else if (share < kIdleFrom)
        change = std::pow(share / kIdleFrom, kFinerGain);
    change = std::clamp(change, 1 / kMostChange, kMostChange);
    // A tolerance of 0 would stay 0.
    const double from = share > 1 ? std::max(tau_px_, 0.05) : tau_px_;
    tau_px_ = std::clamp(from * change, limits_.tau_least_px, std::max(limits_.tau_least_px, limits_.tau_most_px));
    return tau_px_;
}

}  // namespace scree
