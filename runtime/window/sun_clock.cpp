#include "runtime/window/sun_clock.h"

#include <cmath>

namespace scree {

glm::dvec3 sun_at(double hour) {
    const double azimuth = glm::radians(15 * hour);  // from the north over the east
    const double altitude = glm::radians(kNoonAltitude_deg) * -std::cos(glm::radians(15 * hour));
    return {std::sin(azimuth) * std::cos(altitude), std::cos(azimuth) * std::cos(altitude), std::sin(altitude)};
}

double sun_hour_of(const glm::dvec3& direction) {
    return later(glm::degrees(std::atan2(direction.x, direction.y)) / 15, 0);
}

double later(double hour, double by_hours) {
    const double there = std::fmod(hour + by_hours, 24);
    return there < 0 ? there + 24 : there;
}

}  // namespace scree
