// GeoGrid: longitude and latitude of any place of a dataset without PROJ: unit vectors (normals of the ellipsoid) at
// the nodes of a coarse grid over the lattice, interpolated. Made by the builder, which measures and states the
// greatest error; at poles and at the antimeridian as good as anywhere, for vectors know no seams. Pure; any thread.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "common/result.h"

namespace scree {

struct LonLat {
    double longitude_deg = 0;  ///< -180..180, east positive
    double latitude_deg = 0;   ///< geodetic, WGS 84
};

struct GeoGrid {
    /// Nodes stand evenly from the north-west corner of the lattice to its south-east corner, row by row.
    int columns = 0, rows = 0;
    std::array<double, 4> box_m{};  ///< west, south, east, north: of the outermost nodes, in the dataset's CRS
    std::vector<std::array<double, 3>> normals;
    double error_m = 0;  ///< greatest distance on the ground that lon_lat() was found to be off, measured between nodes

    /// Within the box, a margin of a tenth included. None beyond it.
    std::optional<LonLat> lon_lat(double x_m, double y_m) const;
    /// The place of a longitude and latitude; none where it is beyond the box. As exact as lon_lat().
    std::optional<std::array<double, 2>> place(const LonLat& at) const;

    Result<void> check() const;  ///< finite, unit length, sizes that fit
};

}  // namespace scree
