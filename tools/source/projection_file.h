// The .prj file beside a raster: its CRS.
#pragma once

#include <optional>
#include <string>

#include "common/result.h"
#include "tools/source/georeference.h"

namespace scree {

/// Fills what `place` leaves open from PATH's .prj (either case), when there is one: `crs` where it is empty, with the
/// file's WKT as it is, or the EPSG code of what ArcInfo's older key-and-value text says (GEOGRAPHIC or UTM on WGS 84,
/// NAD83 or NAD27); `height_unit_m` where it is 0, from Zunits. Text that is neither leaves `crs` empty and becomes
/// `crs_name`. Errors: ErrorCode::input for a file that cannot be read or is longer than 64 KiB.
Result<void> take_projection_file(const std::string& path, Georeference& place);

/// PATH's .prj, where there is one.
std::optional<std::string> projection_file_beside(const std::string& path);

/// Metres per unit by the unit's name ("m", "metre", "ft", "US survey foot", "cm"...), 0 where it is unknown.
double length_unit_m(std::string_view name);

}  // namespace scree
