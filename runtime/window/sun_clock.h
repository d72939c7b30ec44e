// The sun of a window, by an hour: a plain day, not an almanac: up at six in the east, highest at noon in the south,
// down at eighteen in the west, 15 degrees of azimuth an hour. Pure.
#pragma once

#include <glm/glm.hpp>

namespace scree {

inline constexpr double kNoonAltitude_deg = 60;  ///< a summer's noon of middle latitudes

/// Towards the sun, unit length, x east, y north, z up. `hour`: 0..24; below the horizon at night.
glm::dvec3 sun_at(double hour);
/// The hour at which the sun stands in the same direction of the compass.
double sun_hour_of(const glm::dvec3& direction);
double later(double hour, double by_hours);  ///< within 0..24

}  // namespace scree
