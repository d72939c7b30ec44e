// Rasters whose samples say where they stand, written in every format that places them, each by that format's own
// convention.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace scree::test {

/// Sample (column, row) stands at first + column * by_column + row * by_row of its CRS: a sample, not a corner,
/// whatever the format writes.
struct SampleGrid {
    std::string crs = "EPSG:32633";
    double first_x = 0, first_y = 0;
    double column_x = 1, column_y = 0, row_x = 0, row_y = -1;
    int width = 0, height = 0;
    bool area = false;  ///< samples stand for areas, so that values reach half a sample further out

    double x(double column, double row) const { return first_x + column * column_x + row * row_x; }
    double y(double column, double row) const { return first_y + column * column_y + row * row_y; }
    std::pair<double, double> sample_of(double x, double y) const;
    /// Samples [column, column + columns) x [row, row + rows) as a raster of their own.
    SampleGrid part(int column, int row, int columns, int rows) const;
    /// About its first sample, counter-clockwise.
    SampleGrid turned(double degrees) const;
};

/// North-up, the same step both ways unless `step_y` says otherwise.
SampleGrid north_up(const std::string& crs, double x, double y, double step, int width, int height, double step_y = 0);

using SampleValue = std::function<double(int column, int row)>;

enum class HeightFormat {
    striped,          ///< GeoTIFF, ModelPixelScale
    tiled,            ///< GeoTIFF in tiles of 32
    matrix,           ///< GeoTIFF, ModelTransformation: what is turned or south-up
    matrix_tiled,     ///< both
    world_file_tiff,  ///< TIFF without tags beside a world file
    ascii_corner,     ///< .asc, xllcorner
    ascii_center,     ///< .asc, xllcenter
    float_corner,     ///< .flt, xllcorner
    float_center,     ///< .flt, xllcenter
    bil,              ///< .bil of 16 bits, ULXMAP
    hgt,              ///< named by its corner
    dted,
    usgs_dem,  ///< UTM on WGS 84, heights in whole metres
    surfer,    ///< Surfer 6, float
    png        ///< 16 bits, world file
};

/// `name` without an extension; .hgt takes its name from the place. Returns the path. Sidecars name no CRS.
std::string write_placed_heights(const std::string& folder, const std::string& name, HeightFormat format,
                                 const SampleGrid& grid, const SampleValue& value);

/// One for each way in which a format says where it lies; between them every row of grid_formats() has one
/// (every_format_test.cpp).
struct PlacedExample {
    HeightFormat format = HeightFormat::striped;
    SampleGrid grid;
    std::vector<std::string> arguments;  ///< of a build: the CRS that the format cannot name
    int steps = 100;                     ///< metres from sample to sample that its heights have room for
};
std::vector<PlacedExample> placed_grid_examples();

/// GeoTIFF with areas for pixels (or points, as the grid says), 8 bits. `level`: of red; blue is 255 less that.
std::string write_placed_image(const std::string& folder, const std::string& name, const SampleGrid& grid, bool matrix,
                               const SampleValue& level);
std::string write_placed_png(const std::string& folder, const std::string& name, const SampleGrid& grid,
                             const SampleValue& level);

}  // namespace scree::test
