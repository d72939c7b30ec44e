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
    std::optional<double> spacing_m;     ///< for files without georeference; else the lattice's
    std::optional<double> height_scale;  ///< z = value * scale + offset; none: as the file says
    double height_offset_m = 0;
    std::optional<double> nodata;             ///< besides the file's own tag
    std::optional<std::string> vertical_crs;  ///< what heights stand above; files of another are converted
};

/// Errors: ErrorCode::usage, naming the option.
Result<void> check_height_reading(const HeightReading& reading);

/// Opens a DEM. Errors: ImageSource::open's, and ErrorCode::input for what has too many channels to be heights.
Result<std::unique_ptr<ImageSource>> open_heights(const std::string& path, const OpenOptions& options);

/// Metres from values: z = value * scale + offset.
struct HeightUnits {
    double scale = 1, offset_m = 0;
    friend bool operator==(const HeightUnits&, const HeightUnits&) = default;
};
/// The user's scale, else the file's own unit (metres where it names none).
HeightUnits units_of(const ImageInfo& dem, const Georeference& where, const HeightReading& reading);

/// Turns voids into NaN: the file's nodata value, the user's, and whatever is not finite.
class VoidRule {
public:
    VoidRule(const ImageInfo& dem, const HeightReading& reading);
    void apply(std::span<double> values) const;
    /// Of a type that fits float32.
    void apply(std::span<float> values) const;

private:
    std::optional<double> tag_, user_;
};

}  // namespace scree
