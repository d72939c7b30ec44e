// The CRS that GeoTIFF keys describe, as text that Crs::parse reads. Source: OGC 19-008r4, chapter 7 and annex B.
#pragma once

#include <string>

struct gtiff;

namespace scree {

struct GeotiffCrs {
    bool said = false;         ///< any key of a CRS is there
    std::string crs;           ///< "EPSG:n", or WKT of a CRS that has no code; empty where the keys do not tell
    std::string name;          ///< citation
    std::string vertical;      ///< "EPSG:n" or empty
    double height_unit_m = 0;  ///< of VerticalUnitsGeoKey or of a vertical CRS in feet, else 0
    bool geographic = false;   ///< degrees
    double linear_unit_m = 1;  ///< of a projected CRS
    bool raster_is_point = false;
};

/// A user-defined CRS becomes the WKT of its citation where that holds one ("ESRI PE String = ..."), else WKT 1
/// assembled from its keys, with datum, ellipsoid, prime meridian and units; so does a code whose own unit of length
/// another key overrides.
GeotiffCrs read_geotiff_crs(gtiff* keys);

}  // namespace scree
