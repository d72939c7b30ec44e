// How numbers are written in a window. Pure.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include <glm/glm.hpp>

#include "common/dataset.h"
#include "runtime/window/hud_model.h"

namespace scree {

std::string grouped(std::int64_t count);      ///< "1 234 567"
std::string length_text(double metres);       ///< "850 m", "12.3 km"
std::string speed_text(double metres_per_s);  ///< "25 m/s", "1.2 km/s"
std::string megabytes(std::int64_t bytes);    ///< "96.2"
/// Easting and northing, and the height as the ground has it. `place` as drawn.
std::string place_text(const glm::dvec3& place, const Dataset& dataset);
/// "25.03300° N, 121.56540° E"; none where the dataset does not say.
std::optional<std::string> lon_lat_text(const glm::dvec3& place, const Dataset& dataset);
/// "45° NE, 12° down": clockwise from the grid's north; no heading where it looks straight down or up. As drawn.
std::string direction_text(const glm::dvec3& direction);
/// "14:00"
std::string hour_text(double hour);
/// Slots in use against those that there are; `of` is what they hold.
HudModel::Bar slots_bar(std::string of, std::int64_t used, std::int64_t slots, std::int64_t bytes_each);

}  // namespace scree
