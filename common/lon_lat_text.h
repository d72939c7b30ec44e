// Longitude and latitude for people: 121.5654 E 25.0330 N.
#pragma once

#include <string>

#include "common/geo_grid.h"

namespace scree {

/// Degrees with a letter for the side, longitude first. As many digits as `certain_m` metres on the ground deserve (the
/// error of what is shown, or what a pixel covers, whichever is greater): the last digit is a tenth of it to all of it,
/// 0 to 7 digits. Longitudes get the same digits, though a degree of them is shorter away from the equator. What rounds
/// to 180 is 180 without a letter, what rounds to 0 is 0 without one. Not by locale.
std::string lon_lat_text(const LonLat& at, double certain_m);

}  // namespace scree
