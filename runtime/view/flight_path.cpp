#include "runtime/view/flight_path.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <numbers>
#include <random>
#include <vector>

#include "common/query/ground.h"

namespace scree {
namespace {

constexpr const char* kHeader = "eye_x,eye_y,eye_z,look_x,look_y,look_z";

double radians(double degrees) { return degrees * std::numbers::pi / 180; }

// Ground height under a point, or the dataset's lowest where there is none.
Result<double> ground_or_floor(Ground& ground, const Dataset& d, glm::dvec3 p) {
    auto height = ground.height(p.x, p.y);
    if (!height) return height.error();
    return *height ? (*height)->height_m : d.min_height_m;
}

constexpr int kKeyPoses = 301;  // a hundred a part: the path does not depend on how many frames are flown along it

Result<FlightPath> key_poses(const TileStore& store) {
    const Dataset& d = store.dataset();
    const Lattice& l = d.lattice;
    auto ground = Ground::open(store);
    if (!ground) return ground.error();
    const double width = static_cast<double>(l.cells_x) * l.spacing_m,
                 depth = static_cast<double>(l.cells_y) * l.spacing_m;
    const double extent = std::max(width, depth);
    const glm::dvec3 west_south{l.x_m(0), l.y_m(static_cast<double>(l.cells_y)), 0};
    const auto at = [&](double u, double v) { return west_south + glm::dvec3(u * width, v * depth, 0); };

    FlightPath path;
    for (int k = 0; k < kKeyPoses; ++k) {
        const double t = 3.0 * k / (kKeyPoses - 1);
        const double u = std::clamp(t - std::floor(std::min(t, 2.0)), 0.0, 1.0);
        FlightPose pose;
        double heading = 0, pitch = 0, above = 0;  // heading from east towards north
        if (t < 1) {
            pose.eye = at(0.2 + 0.5 * u, 0.25 + 0.4 * u + 0.05 * std::sin(4 * std::numbers::pi * u));
            heading =
                std::atan2((0.4 + 0.2 * std::numbers::pi * std::cos(4 * std::numbers::pi * u)) * depth, 0.5 * width);
            pitch = -4;
            above = std::max(0.004 * extent, 3 * l.spacing_m);
        } else if (t < 2) {
            pose.eye = at(0.7 - 0.45 * u, 0.65 - 0.1 * u);
            heading = std::numbers::pi + 0.8 * u;
            pitch = -15;
            above = 0.1 * extent;
        } else {
            pose.eye = at(0.25 + 0.4 * u, 0.55 - 0.15 * std::sin(std::numbers::pi * u));
            heading = 1.2 * u;
            pitch = -60;
            above = 0.04 * extent;
        }
        // Over the highest ground within reach, so that the low part clears ridges.
        double floor = d.min_height_m;
        for (int s = 0; s <= 8; ++s) {
            const double reach = s * 0.25 * above * 4;
            auto height =
                ground_or_floor(**ground, d, pose.eye + glm::dvec3(std::cos(heading), std::sin(heading), 0) * reach);
            if (!height) return height.error();
            floor = std::max(floor, *height);
        }
        pose.eye.z = floor + above;
        pose.look = pose.eye + extent * 0.1 *
                                   glm::dvec3(std::cos(heading) * std::cos(radians(pitch)),
                                              std::sin(heading) * std::cos(radians(pitch)), std::sin(radians(pitch)));
        path.push_back(pose);
    }
    // The floor jumps from ridge to ridge: smooth the low part, never below it by more than the clearance allows.
    for (int pass = 0; pass < 8; ++pass)
        for (std::size_t k = 1; k + 1 < path.size(); ++k) {
            const double mean = 0.5 * (path[k - 1].eye.z + path[k + 1].eye.z);
            const double lift = std::max(0.0, mean - path[k].eye.z);
            path[k].eye.z += lift;
            path[k].look.z += lift;
        }
    return path;
}

}  // namespace

Result<FlightPath> default_flight(const TileStore& store, int frames) {
    auto path = key_poses(store);
    if (!path) return path;
    return resample(*path, frames);
}

Result<FlightPath> read_flight_path(const std::string& csv) {
    std::ifstream in(csv);
    if (!in) return Error{ErrorCode::input, fmt::format("{}: cannot be read", csv)};
    std::string line;
    if (!std::getline(in, line) || line.substr(0, line.find('\r')) != kHeader)
        return Error{ErrorCode::input, fmt::format("{}: the first line is not '{}'", csv, kHeader)};
    FlightPath path;
    for (int number = 2; std::getline(in, line); ++number) {
        if (line.find_first_not_of(" \t\r") == std::string::npos) continue;
        double values[6] = {};
        const char *p = line.data(), *end = p + line.size();
        for (int k = 0; k < 6; ++k) {
            while (p != end && (*p == ' ' || *p == '\t')) ++p;
            const auto [next, error] = std::from_chars(p, end, values[k]);
            if (error != std::errc{} || !std::isfinite(values[k]) || (k < 5 && (next == end || *next != ',')))
                return Error{ErrorCode::input, fmt::format("{}: line {}: '{}' is not six numbers", csv, number, line)};
            p = next + (k < 5 ? 1 : 0);
        }
        if (line.find_first_not_of(" \t\r", static_cast<std::size_t>(p - line.data())) != std::string::npos)
            return Error{ErrorCode::input,
                         fmt::format("{}: line {}: '{}' is more than six numbers", csv, number, line)};
        path.push_back({{values[0], values[1], values[2]}, {values[3], values[4], values[5]}});
    }
    if (path.empty()) return Error{ErrorCode::input, fmt::format("{}: holds no pose", csv)};
    return path;
}

FlightPath resample(const FlightPath& path, int frames) {
    if (frames <= 0 || path.empty()) return path;
    FlightPath out;
    for (int k = 0; k < frames; ++k) {
        const double t = frames == 1 ? 0 : static_cast<double>(k) * static_cast<double>(path.size() - 1) / (frames - 1);
        const auto i = std::min(static_cast<std::size_t>(t), path.size() - 1);
        const std::size_t next = std::min(i + 1, path.size() - 1);
        const double w = t - static_cast<double>(i);
        out.push_back(
            {path[i].eye + (path[next].eye - path[i].eye) * w, path[i].look + (path[next].look - path[i].look) * w});
    }
    return out;
}

FlightPath paced(const FlightPath& path, double step_m, int frames) {
    if (path.size() < 2 || !(step_m > 0)) return resample(path, frames);
    std::vector<double> along{0};
    for (std::size_t k = 1; k < path.size(); ++k)
        along.push_back(along.back() + glm::length(path[k].eye - path[k - 1].eye));
    if (!(along.back() > 0)) return resample(path, frames);
    FlightPath out;
    for (int k = 0; k < frames; ++k) {
        // There and back again.
        const double lap = std::fmod(k * step_m, 2 * along.back());
        const double at = lap <= along.back() ? lap : 2 * along.back() - lap;
        const auto end = std::upper_bound(along.begin() + 1, along.end() - 1, at) - along.begin();
        const auto j = static_cast<std::size_t>(end);
        const double run = along[j] - along[j - 1];
        const double w = run > 0 ? (at - along[j - 1]) / run : 0;
        out.push_back({path[j - 1].eye + (path[j].eye - path[j - 1].eye) * w,
                       path[j - 1].look + (path[j].look - path[j - 1].look) * w});
    }
    return out;
}

Result<FlightPath> roaming_flight(const TileStore& store, int frames, std::uint64_t seed) {
    const Dataset& d = store.dataset();
    const Lattice& l = d.lattice;
    auto ground = Ground::open(store);
    if (!ground) return ground.error();
    // The standard fixes this generator's numbers, not those of its distributions.
    std::mt19937_64 random(seed);
    const auto uniform = [&](double low, double high) {
        return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53;
    };
    const double width = static_cast<double>(l.cells_x) * l.spacing_m,
                 depth = static_cast<double>(l.cells_y) * l.spacing_m, extent = std::max(width, depth);
    FlightPath path;
    glm::dvec2 at{0};
    double heading = 0, pitch = 0, above = 0, speed = 0, turn = 0;
    int left = 0;
    while (static_cast<int>(path.size()) < frames) {
        if (left-- <= 0) {
            left = static_cast<int>(uniform(10, 120));
            if (path.empty() || uniform(0, 1) < 0.4) {
                at = {l.x_m(0) + uniform(0, width), l.y_m(0) - uniform(0, depth)};
                heading = uniform(0, 2 * std::numbers::pi);
            }
            above = extent * 0.1 * std::pow(uniform(0, 1), 4) + 2 * l.spacing_m;
            speed = extent * 0.02 * std::pow(uniform(0, 1), 3);
            turn = uniform(0, 1) < 0.3 ? uniform(-0.2, 0.2) : 0;
            pitch = uniform(-1.3, 0.1);
        }
        heading += turn;
        at += speed * glm::dvec2(std::cos(heading), std::sin(heading));
        auto height = ground_or_floor(**ground, d, {at.x, at.y, 0});
        if (!height) return height.error();
        FlightPose pose;
        pose.eye = {at.x, at.y, *height + above};
        pose.look = pose.eye + 1000.0 * glm::dvec3(std::cos(heading) * std::cos(pitch),
                                                   std::sin(heading) * std::cos(pitch), std::sin(pitch));
        path.push_back(pose);
    }
    return path;
}

FlightPose overview(const Dataset& d, double fov_deg, double aspect) {
    const Lattice& l = d.lattice;
    const double width = static_cast<double>(l.cells_x) * l.spacing_m,
                 depth = static_cast<double>(l.cells_y) * l.spacing_m;
    const glm::dvec3 middle{l.origin_x_m + width / 2, l.origin_y_m - depth / 2,
                            0.5 * (d.min_height_m + d.max_height_m)};
    const double heading = radians(-65), pitch = radians(32);
    const glm::dvec3 back{std::cos(heading) * std::cos(pitch), std::sin(heading) * std::cos(pitch), std::sin(pitch)};
    const glm::dvec3 right = glm::normalize(glm::cross(-back, glm::dvec3(0, 0, 1))), up = glm::cross(right, -back);
    // Near enough that the eight corners of the terrain just fit.
    const double ty = 0.94 * std::tan(radians(fov_deg) / 2), tx = ty * aspect;
    double distance = 0;
    for (int corner = 0; corner < 8; ++corner) {
        const glm::dvec3 c{(corner & 1 ? 0.5 : -0.5) * width, (corner & 2 ? 0.5 : -0.5) * depth,
                           (corner & 4 ? 0.5 : -0.5) * (d.max_height_m - d.min_height_m)};
        const double reach = std::max(std::abs(glm::dot(c, right)) / tx, std::abs(glm::dot(c, up)) / ty);
        distance = std::max(distance, reach + glm::dot(c, back));
    }
    return {middle + distance * back, middle};
}

}  // namespace scree
