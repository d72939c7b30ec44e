// The heights of one DEM file: what its values mean and where its samples stand. One rule for every command that reads
// heights, so that what judges a store reads its sources as the build did.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>

#include "common/result.h"
#include "tools/source/image_source.h"

namespace scree {

struct HeightReading {
    std::optional<double> spacing_m;  ///< for files without georeference
    double height_scale = 1;          ///< z = value * scale + offset
    double height_offset_m = 0;
    std::optional<double> nodata;  ///< besides the file's own tag
};

/// Errors: ErrorCode::usage, naming the option.
Result<void> check_height_reading(const HeightReading& reading);

/// Opens a DEM. Errors: ImageSource::open's, and ErrorCode::input for what has too many channels to be heights.
Result<std::unique_ptr<ImageSource>> open_heights(const std::string& path, const OpenOptions& options);

/// Rows run southward, columns eastward: sample (column, row) stands at (x_m + column * step, y_m - row * step).
struct HeightPlace {
    double x_m = 0, y_m = 0;  ///< of sample (0, 0)
    double step_x_m = 1, step_y_m = 1;
};

/// Where the samples stand: by the file's georeference, else `spacing_m` apart from (0, 0). Errors: ErrorCode::input
/// for a raster of less than 2 x 2 samples or that cannot be used as it stands (neither georeference nor spacing,
/// degrees, rotated, not square); ErrorCode::usage for a spacing where the file has its own.
Result<HeightPlace> place_heights(const std::string& path, const ImageSource& dem, const HeightReading& reading);

/// Square cells, in metres, from north to south and west to east: what images must be, too. Errors: ErrorCode::input.
Result<void> check_usable(const std::string& path, const Georeference& where);

/// Turns voids into NaN: the file's nodata value, the user's, and whatever is not finite.
class VoidRule {
public:
    VoidRule(const ImageInfo& dem, const HeightReading& reading);
    void apply(std::span<double> values) const;

private:
    std::optional<double> tag_, user_;
};

}  // namespace scree
