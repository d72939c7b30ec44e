#include "runtime/window/flight_recorder.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "common/report.h"

namespace scree {
namespace {

bool finite(const glm::dvec3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }
bool finite(const FlightPose& p) { return finite(p.eye) && finite(p.look); }

/// Hardly any direction: two views back to back have no middle.
constexpr double kOpposite = 1e-6;

}  // namespace

FlightPose between(const FlightPose& from, const FlightPose& to, double w) {
    if (!(w > 0)) return from;
    if (w >= 1) return to;
    const glm::dvec3 a = from.look - from.eye, b = to.look - to.eye;
    const double near = glm::length(a), far = glm::length(b);
    if (!(near > 0) || !(far > 0)) return w < 0.5 ? from : to;
    const glm::dvec3 direction = (1 - w) * (a / near) + w * (b / far);
    const double length = glm::length(direction);
    const glm::dvec3 eye = from.eye + (to.eye - from.eye) * w;
    const glm::dvec3 ahead = length > kOpposite ? direction / length : b / far;
    return {eye, eye + ahead * (near + (far - near) * w)};
}

void FlightRecorder::start(double now_s, const FlightPose& pose) {
    path_.clear();
    recording_ = std::isfinite(now_s) && finite(pose);
    if (!recording_) return;
    start_s_ = last_s_ = now_s;
    last_ = pose;
    path_.push_back(pose);
}

void FlightRecorder::add(double now_s, const FlightPose& pose) {
    if (!recording_ || !std::isfinite(now_s) || now_s < last_s_ || !finite(pose)) return;
    while (!full()) {
        const double due_s = start_s_ + static_cast<double>(path_.size()) / kRecordedPerSecond;
        if (due_s > now_s) break;
        const double run_s = now_s - last_s_;
        path_.push_back(between(last_, pose, run_s > 0 ? (due_s - last_s_) / run_s : 1));
    }
    last_s_ = now_s;
    last_ = pose;
}

double FlightRecorder::seconds() const {
    return path_.empty() ? 0 : static_cast<double>(path_.size() - 1) / kRecordedPerSecond;
}

FlightPath FlightRecorder::stop() {
    recording_ = false;
    return std::exchange(path_, {});
}

FlightReplay::FlightReplay(FlightPath path, double now_s) : path_(std::move(path)), start_s_(now_s) {}

std::optional<FlightPose> FlightReplay::pose(double now_s) const {
    const double at = (now_s - start_s_) * kRecordedPerSecond;
    if (path_.empty() || !(at <= static_cast<double>(path_.size() - 1))) return std::nullopt;
    if (at <= 0) return path_.front();
    const auto k = static_cast<std::size_t>(at);
    return between(path_[k], path_[std::min(k + 1, path_.size() - 1)], at - static_cast<double>(k));
}

double FlightReplay::seconds() const {
    return path_.empty() ? 0 : static_cast<double>(path_.size() - 1) / kRecordedPerSecond;
}

Result<void> write_flight_path(const std::string& csv, const FlightPath& path) {
    if (path.empty()) return Error{ErrorCode::usage, fmt::format("{}: a path without poses is not written", csv)};
    fmt::memory_buffer text;
    fmt::format_to(std::back_inserter(text), "eye_x,eye_y,eye_z,look_x,look_y,look_z\n");
    for (const FlightPose& p : path) {
        if (!finite(p)) return Error{ErrorCode::usage, fmt::format("{}: a pose that is no number is not written", csv)};
        // The shortest digits that give the same double.
        fmt::format_to(std::back_inserter(text), "{},{},{},{},{},{}\n", p.eye.x, p.eye.y, p.eye.z, p.look.x, p.look.y,
                       p.look.z);
    }
    return write_text(csv, fmt::to_string(text));
}

}  // namespace scree
