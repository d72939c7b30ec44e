// FlightRecorder: poses of a window's camera as a flight path that `fly --path` and a replay can fly again. Pure; one
// thread.
#pragma once

#include <optional>
#include <string>

#include "common/result.h"
#include "runtime/view/flight_path.h"

namespace scree {

/// Poses are taken kRecordedPerSecond times a second of the window's clock, whatever the frame rate: a path's pose k
/// belongs to second k / kRecordedPerSecond.
inline constexpr double kRecordedPerSecond = 30;
/// Four hours, 21 MB: a recording that is forgotten takes no more.
inline constexpr std::size_t kMostRecorded = std::size_t{30} * 3600 * 4;

/// `w` of the way from one pose to another: the eye in a straight line, the view turning with it. 0 and 1 give the
/// poses themselves.
FlightPose between(const FlightPose& from, const FlightPose& to, double w);

class FlightRecorder {
public:
    /// Forgets what was recorded before.
    void start(double now_s, const FlightPose& pose);
    /// The pose at `now_s`; what lies between two calls is interpolated. A time before the last one, and a pose or time
    /// that is no number, are passed over.
    void add(double now_s, const FlightPose& pose);
    bool recording() const { return recording_; }
    /// kMostRecorded poses were taken: no more are. Still recording.
    bool full() const { return path_.size() >= kMostRecorded; }
    /// Of what is recorded so far.
    double seconds() const;
    /// Empty where nothing was being recorded.
    FlightPath stop();

private:
    bool recording_ = false;
    double start_s_ = 0, last_s_ = 0;
    FlightPose last_;
    FlightPath path_;
};

/// Plays a path at the pace that it was recorded in.
class FlightReplay {
public:
    FlightReplay(FlightPath path, double now_s);
    /// None once it is over: later than the last pose's time.
    std::optional<FlightPose> pose(double now_s) const;
    /// Of the whole path.
    double seconds() const;

private:
    FlightPath path_;
    double start_s_ = 0;
};

/// Writes what read_flight_path() reads, to the bit, whole or not at all. Errors: ErrorCode::io; ErrorCode::usage for a
/// path that could not be read again, because it is empty or holds what is no number.
Result<void> write_flight_path(const std::string& csv, const FlightPath& path);

}  // namespace scree
