// The heights of one DEM file: what its values mean and where its samples stand. One rule for every command that reads
// heights, so that what judges a store reads its sources as the build did.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/result.h"
#include "tools/source/image_source.h"

namespace scree {

/// What three 8-bit bands of colours stand for as heights: n = red * 65536 + green * 256 + blue.
/// terrarium: n / 256 - 32768 m; mapbox ("Terrain-RGB"): n / 10 - 10000 m. Sources: the formats' documents, "Terrain
/// Tiles on AWS" and "Mapbox Terrain-RGB v1".
enum class HeightEncoding { values, terrarium, mapbox };

struct HeightReading {
    std::optional<double> spacing_m;     ///< for files without georeference; else the lattice's
    std::optional<double> height_scale;  ///< z = value * scale + offset; none: as the file says
    double height_offset_m = 0;
    std::optional<double> nodata;                             ///< besides the file's own tag
    HeightEncoding height_encoding = HeightEncoding::values;  ///< of every file
    /// NAME=CRS: what the heights of the file of that name stand above, whatever it says itself.
    std::vector<std::string> source_vertical_crs{};
    std::optional<std::string> vertical_crs;  ///< what heights stand above; files of another are converted
};

/// Errors: ErrorCode::usage, naming the option.
Result<void> check_height_reading(const HeightReading& reading);

/// Opens a DEM; where heights are encoded in colours, as integers with a scale and an offset. Errors:
/// ImageSource::open's, and ErrorCode::input for what has too many channels to be heights, or too few for their
/// encoding.
Result<std::unique_ptr<ImageSource>> open_heights(const std::string& path, const OpenOptions& options,
                                                  HeightEncoding encoding = HeightEncoding::values);

/// NAME and CRS of a word of source_vertical_crs; nullopt for one without both.
struct SourceVerticalCrs {
    std::string name, crs;
};
std::optional<SourceVerticalCrs> parse_source_vertical_crs(const std::string& word);

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
