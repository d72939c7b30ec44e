// GeoGrid: longitude and latitude of any place of a dataset without PROJ: unit vectors (normals of the ellipsoid) at
// the nodes of a coarse grid over the lattice, interpolated. Made by the builder, which measures and states the
// greatest error; at poles and at the antimeridian as good as anywhere, for vectors know no seams. Pure; any thread.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "common/result.h"

namespace scree {

struct LonLat {
    double longitude_deg = 0;  ///< -180..180, east positive
    double latitude_deg = 0;   ///< geodetic, WGS 84
};

/// The unit vector that stands upright there: x to longitude 0 on the equator, z to the north pole.
std::array<double, 3> normal_of(const LonLat& at);
/// Metres along the ground between two normals, close together: at most so many (the ellipsoid is flattest, and so its
/// radius of curvature greatest, at the poles).
double ground_distance_m(const std::array<double, 3>& a, const std::array<double, 3>& b);

struct GeoGrid {
    /// Nodes a side: 2 to this many.
    static constexpr int kMostNodes = 65;

    /// Nodes stand evenly from the north-west corner of the box to its south-east corner, row by row.
    int columns = 0, rows = 0;
    /// West, south, east, north: of the outermost nodes, in the dataset's CRS. The lattice with a margin of a tenth on
    /// all sides, or the lattice alone where the CRS does not reach farther.
    std::array<double, 4> box_m{};
    std::vector<std::array<double, 3>> normals;
    double error_m = 0;  ///< greatest distance on the ground that lon_lat() was found to be off, measured between nodes

    /// None beyond the box.
    std::optional<LonLat> lon_lat(double x_m, double y_m) const;
    /// The place of a longitude and latitude; none where it is beyond the box. As exact as lon_lat(). Of several places
    /// (a map goes round the world more than once) the one nearest to the box's middle.
    std::optional<std::array<double, 2>> place(const LonLat& at) const;

    Result<void> check() const;  ///< finite, unit length, sizes that fit
};

/// Normals as text (docs/store-format.md, "Longitude and latitude"): rounded to multiples of 2^-32, differences of
/// third order, base64. Of a grid that check() accepts.
std::string normals_to_text(const GeoGrid& grid);
/// Inverse. Errors: ErrorCode::store, for a text that is not of columns * rows normals.
Result<std::vector<std::array<double, 3>>> normals_from_text(const std::string& text, int columns, int rows);

}  // namespace scree
