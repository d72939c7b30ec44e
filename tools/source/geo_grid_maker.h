// Makes a dataset's GeoGrid with PROJ.
#pragma once

#include <optional>
#include <string>

#include "common/geo_grid.h"
#include "common/lattice.h"

namespace scree {

/// The most characters of normals in a store.
inline constexpr std::size_t kMostNormalsText = 20000;

/// What lon_lat() may be off: 0.01 m or a thousandth of the spacing, whichever is larger.
double geo_grid_tolerance_m(const Lattice& lattice);

/// The grid with the fewest nodes that keeps within the tolerance, else the best of those within
/// GeoGrid::kMostNodes a side and kMostNormalsText. Its normals are as a store gives them back, and its error is
/// measured at 25 places a cell or more, with a twentieth added and rounded up to 0.1 mm. None where PROJ does not know
/// the CRS, or has no longitude and latitude for some place of the lattice. Takes a tenth of a second; seconds where a
/// CRS tears within the lattice.
std::optional<GeoGrid> make_geo_grid(const Lattice& lattice, const std::string& crs);

}  // namespace scree
