// Where a raster lies. Coordinates are those of *sample centres* whatever the file's own convention was: PixelIsArea is
// shifted by half a pixel on reading, PixelIsPoint is not; `raster_is_point` keeps the fact.
#pragma once

#include <optional>
#include <string>

#include "common/result.h"

namespace scree {

struct Georeference {
    double first_x = 0;    ///< x of the centre of sample (column 0, row 0), CRS units
    double first_y = 0;    ///< y of the same
    double step_x = 1;     ///< x from one column to the next
    double step_y = -1;    ///< y from one row to the next; negative in a north-up file
    bool rotated = false;  ///< ModelTransformation or world file with rotation terms: steps are meaningless then
    bool raster_is_point = false;  ///< GTRasterTypeGeoKey was PixelIsPoint
    bool geographic = false;       ///< degrees, not metres
    std::string crs;               ///< "EPSG:n", or empty when the file names none (a world file)
    std::string crs_name;          ///< citation text for people, may be empty
    std::string vertical_datum;    ///< "EPSG:n" of the vertical CRS/datum key when present, else empty
    double linear_unit_m = 1;      ///< metres per CRS unit (projected)
};

/// Reads GeoTIFF tags of a TIFF file; nullopt when it has none. Errors (ErrorCode::input) only for absurd values
/// (NaN, infinite, zero step).
Result<std::optional<Georeference>> read_geotiff(const std::string& path);

/// Reads PATH's world file (.tfw .pgw .jgw .wld, also .tifw-style double extension, either case) when there is one.
Result<std::optional<Georeference>> read_world_file(const std::string& image_path);

/// What places an image: its GeoTIFF tags, else its world file. A TIFF with CRS keys but no transformation takes the
/// transformation from its world file and keeps the CRS of its keys.
Result<std::optional<Georeference>> read_georeference(const std::string& image_path);

}  // namespace scree
