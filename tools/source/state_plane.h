// Zones of the State Plane Coordinate Systems of the United States by the number that federal files write (FIPS, NOAA
// Manual NOS NGS 5, appendix A). Those are listed of which the number, EPSG's CRS and EPSG's conversion of the same
// number (10000 + zone, of NAD83 30 more) agree.
#pragma once

#include <cstdint>

namespace scree {

/// EPSG code of the zone on NAD27, in US survey feet; 0: none is known.
int epsg_of_state_plane_nad27(std::int64_t zone);
/// On NAD83, in metres.
int epsg_of_state_plane_nad83(std::int64_t zone);

}  // namespace scree
