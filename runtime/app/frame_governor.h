// FrameGovernor: the tolerance that keeps frames within a time (the future work of Ueng & Chuang). A frame costs a part
// that tau does not change and a part that grows as tau falls; the governor knows neither, and steers tau by the ratio
// of time taken to time allowed, in logarithms. No clock of its own.
#pragma once

namespace scree {

struct GovernorLimits {
    double frame_ms = 1000.0 / 30;
    double tau_least_px = 1;  ///< what the user asked for: never finer
    double tau_most_px = 16;  ///< never coarser, whatever the frame takes
};

class FrameGovernor {
public:
    explicit FrameGovernor(const GovernorLimits& limits);

    /// Takes the time of the frame drawn at tau_px(); returns the tau for the next.
    double next(double frame_ms);
    double tau_px() const { return tau_px_; }

private:
    GovernorLimits limits_;
    double tau_px_;
    double smoothed_ms_ = 0;  ///< 0: nothing measured
};

}  // namespace scree
