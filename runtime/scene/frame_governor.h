// FrameGovernor: the tolerance that keeps frames within a time (the future work of Ueng & Chuang). A frame costs a part
// that tau does not change and a part that grows as tau falls, and its time may be known frames after it was drawn. The
// governor knows neither cost nor delay: it compares times with the tolerances that they may belong to, and learns from
// which side it comes how boldly to step. Settles a doubled or halved load within a second at 30 frames a second.
// No clock of its own.
#pragma once

#include <array>

namespace scree {

struct GovernorLimits {
    double frame_ms = 1000.0 / 30;
    double tau_least_px = 1;  ///< what the user asked for: never finer
    double tau_most_px = 16;  ///< never coarser, whatever the frame takes
};

class FrameGovernor {
public:
    explicit FrameGovernor(const GovernorLimits& limits);

    /// Takes the time of the last frame, drawn at tau_px() or up to three frames earlier; returns the tau for the next.
    /// What is no time (not above 0, infinite, NaN) is passed over.
    double next(double frame_ms);
    double tau_px() const { return tau_px_; }

private:
    static constexpr int kDelay_frames = 3;

    void observe(double log_time, double log_tau);
    void learn(int side, double excess);

    GovernorLimits limits_;
    double tau_px_;
    bool seen_ = false;
    double log_time_ = 0;                       ///< smoothed: time taken to time allowed
    double log_drawn_ = 0;                      ///< smoothed alike: the tau it was drawn at
    std::array<double, kDelay_frames> recent_;  ///< log tau of the last frames, oldest first
    double boldness_ = 1;
    int side_ = 0;   ///< of the last frame outside the band: 1 too slow, -1 faster than need be
    int still_ = 0;  ///< frames within the band since
};

}  // namespace scree
