// FlightRecorder: poses of a window's camera as a flight path that `fly --path` and a replay can fly again. Pure.
#pragma once

#include <optional>
#include <string>

#include "common/result.h"
#include "runtime/view/flight_path.h"

namespace scree {

/// Poses are taken kRecordedPerSecond times a second of the window's clock, whatever the frame rate: a path's pose k
/// belongs to second k / kRecordedPerSecond.
inline constexpr double kRecordedPerSecond = 30;

class FlightRecorder {
public:
    void start(double now_s, const FlightPose& pose);
    /// The pose at `now_s`; what lies between two calls is interpolated.
    void add(double now_s, const FlightPose& pose);
    bool recording() const;
    FlightPath stop();
};

/// Plays a path at the pace that it was recorded in.
class FlightReplay {
public:
    FlightReplay(FlightPath path, double now_s);
    /// None once it is over.
    std::optional<FlightPose> pose(double now_s) const;
};

/// Writes what read_flight_path() reads, whole or not at all. Errors: ErrorCode::io.
Result<void> write_flight_path(const std::string& csv, const FlightPath& path);

}  // namespace scree
