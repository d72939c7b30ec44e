#include "tools/verify/geo_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "tools/source/crs.h"

namespace scree {
namespace {

constexpr int kPlaces = 10000;
// More than what is stated by so much may be found at other places than the builder's, or with another libm.
constexpr double kShareMore = 0.1, kMore_m = 0.001;

double fraction(double v) { return v - std::floor(v); }

// Spread evenly over the box, and never in step with its nodes: Roberts' R2 sequence, of the powers of the plastic
// number.
void spread(const std::array<double, 4>& box, std::vector<double>& x, std::vector<double>& y) {
    constexpr double kPlastic = 1.32471795724474602596;
    const auto [west, south, east, north] = box;
    for (int k = 1; k <= kPlaces; ++k) {
        x.push_back(west + fraction(k / kPlastic) * (east - west));
        y.push_back(south + fraction(k / (kPlastic * kPlastic)) * (north - south));
    }
}

GeoCheck compare(const GeoGrid& grid, const CrsTransform& to_degrees) {
    std::vector<double> x, y;
    spread(grid.box_m, x, y);
    std::vector<double> longitude = x, latitude = y;
    to_degrees.apply(longitude, latitude);
    double greatest_m = 0;
    for (std::size_t k = 0; k < x.size(); ++k) {
        const auto at = grid.lon_lat(x[k], y[k]);
        if (!at || !std::isfinite(longitude[k]) || !std::isfinite(latitude[k]))
            return {std::nullopt, "PROJ does not reach all of the grid", false};
        greatest_m = std::max(greatest_m, ground_distance_m(normal_of(*at), normal_of({longitude[k], latitude[k]})));
    }
    GeoCheck check{greatest_m, {}, false};
    const double accuracy_m = to_degrees.accuracy_m();
    if (accuracy_m < 0) check.reason = "PROJ does not say how sure its datum shift is";
    // Two machines may have different shifts, each as far from the truth.
    if (accuracy_m > 0) check.reason = fmt::format("the datum shift is known to {} m", accuracy_m);
    const double allowed_m = grid.error_m * (1 + kShareMore) + kMore_m + 2 * accuracy_m;
    check.broken = accuracy_m >= 0 && greatest_m > allowed_m;
    return check;
}

}  // namespace

GeoCheck check_geo_grid(const Dataset& d) {
    if (!d.geo_grid) return {std::nullopt, "the store has none", false};
    const auto crs = Crs::parse(d.crs), degrees = Crs::parse("EPSG:4326");
    if (!crs || !degrees) return {std::nullopt, "PROJ does not know the CRS", false};
    const auto to_degrees = CrsTransform::make(*crs, *degrees);
    if (!to_degrees) return {std::nullopt, "PROJ has no way from the CRS to WGS 84", false};
    return compare(*d.geo_grid, *to_degrees);
}

}  // namespace scree
