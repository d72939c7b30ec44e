// Where a raster lies. Coordinates are those of *sample centres* whatever the file's own convention was: PixelIsArea is
// shifted by half a pixel on reading, PixelIsPoint is not; `raster_is_point` keeps the fact.
#pragma once

#include <optional>
#include <string>

#include "common/result.h"

namespace scree {

struct Georeference {
    /// The centre of sample (column c, row r) stands at x = first_x + c * column_x + r * row_x,
    /// y = first_y + c * column_y + r * row_y, in units of the CRS.
    double first_x = 0, first_y = 0;
    double column_x = 1, column_y = 0;  ///< from one column to the next
    double row_x = 0, row_y = -1;       ///< from one row to the next; row_y is negative in a north-up file
    bool raster_is_point = false;       ///< samples are points (GTRasterTypeGeoKey PixelIsPoint, .hgt, DTED...)
    std::string crs;                    ///< what Crs::parse reads: "EPSG:n", WKT or a PROJ string; empty: not said
    std::string crs_name;               ///< citation text for people, may be empty
    std::string vertical_datum;         ///< "EPSG:n" of the vertical CRS/datum key when present, else empty
    bool geographic = false;            ///< as the keys say, in words of the file; placing goes by Crs
    double linear_unit_m = 1;           ///< the same
    double height_unit_m = 0;           ///< metres per unit of the heights where the file says so, else 0

    double x(double column, double row) const { return first_x + column * column_x + row * row_x; }
    double y(double column, double row) const { return first_y + column * column_y + row * row_y; }
    /// Rows run along x and columns along y, in either direction: no rotation or shear worth a thousandth of a sample
    /// over 2^20 of them.
    bool axis_aligned() const;
};

/// Numbers that place samples: none beyond 1e15, and samples not all on one line. Errors: ErrorCode::input; `where` is
/// what holds them.
Result<void> check_place(const Georeference& place, const std::string& path, const char* where);

/// Reads GeoTIFF tags of a TIFF file; nullopt when it has none. A place is given by ModelPixelScale and the first
/// ModelTiepoint, else by a ModelTransformation (or Intergraph's tag of the same content). Errors (ErrorCode::input)
/// only for absurd values (NaN, infinite, zero step) and for a file that only ground control points place.
Result<std::optional<Georeference>> read_geotiff(const std::string& path);

/// Reads PATH's world file (.tfw .pgw .jgw .wld, also .tifw-style double extension, either case) when there is one.
Result<std::optional<Georeference>> read_world_file(const std::string& image_path);

/// The world file that is read for PATH, where there is one.
std::optional<std::string> world_file_beside(const std::string& image_path);

/// What places an image: its GeoTIFF tags, else its .aux.xml (pam_file.h), else its world file. A TIFF with CRS keys
/// but no transformation takes the transformation from its world file and keeps the CRS of its keys. Where there are
/// none, the CRS is that of the .aux.xml, else of a .prj file (projection_file.h).
Result<std::optional<Georeference>> read_georeference(const std::string& image_path);

}  // namespace scree
