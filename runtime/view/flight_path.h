// Flight paths: where the camera is and looks, frame by frame.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <glm/glm.hpp>

#include "common/store/tile_store.h"

namespace scree {

struct FlightPose {
    glm::dvec3 eye{0};
    glm::dvec3 look{0};
};

using FlightPath = std::vector<FlightPose>;

/// The default flight over a dataset of extent W (its longer side): the first third low (0.4 % of W, at least 3 cells,
/// above the ground) along a weaving diagonal, the second high (10 % of W) looking 15 degrees down across the middle,
/// the last steep (4 % of W) looking 60 degrees down. `frames` poses, linear between 301 key poses; the
/// clearance holds at the key poses, which are the path for frames <= 0. Deterministic. Errors: those of the store.
Result<FlightPath> default_flight(const TileStore& store, int frames);

/// Reads `eye_x,eye_y,eye_z,look_x,look_y,look_z` with that header. Errors: ErrorCode::input naming file and line.
Result<FlightPath> read_flight_path(const std::string& csv);

/// A restless flight for soaks: straight runs of random length, height, speed and direction over the dataset, with
/// leaps to elsewhere and turns on the spot between them. The same for the same seed.
Result<FlightPath> roaming_flight(const TileStore& store, int frames, std::uint64_t seed);

/// `frames` poses evenly spaced in index along a path, linearly interpolated; the path itself when frames <= 0.
FlightPath resample(const FlightPath& path, int frames);

/// Poses so many metres apart along a path, measured at the eye; runs back and forth where `frames` want more.
FlightPath paced(const FlightPath& path, double step_m, int frames);

/// Looks at the whole dataset from the south, 32 degrees down, as near as its corners allow.
FlightPose overview(const Dataset& dataset, double fov_deg, double aspect);

}  // namespace scree
