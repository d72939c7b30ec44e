#include "tools/source/height_source.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>

namespace scree {
namespace {

constexpr double kSquareTolerance = 1e-4;  // relative difference of pixel width and height

Error input_error(std::string message) { return {ErrorCode::input, std::move(message)}; }
Error usage_error(std::string message) { return {ErrorCode::usage, std::move(message)}; }

}  // namespace

Result<void> check_height_reading(const HeightReading& o) {
    if (!(std::isfinite(o.height_scale) && o.height_scale > 0))
        return usage_error(fmt::format("--height-scale {} is not a positive number", o.height_scale));
    if (!(std::abs(o.height_offset_m) <= 1e7))
        return usage_error(fmt::format("--height-offset {} m is not within 1e7 m", o.height_offset_m));
    if (o.spacing_m && !(*o.spacing_m >= 1e-6 && *o.spacing_m <= 1e6))
        return usage_error(fmt::format("--spacing {} m is outside 1e-6..1e6", *o.spacing_m));
    return {};
}

Result<std::unique_ptr<ImageSource>> open_heights(const std::string& path, const OpenOptions& options) {
    auto dem = ImageSource::open(path, options);
    if (dem && (*dem)->info().channels > 2)
        return input_error(fmt::format("{}: {} channels; heights are one channel: is this the imagery?", path,
                                       (*dem)->info().channels));
    return dem;
}

Result<HeightPlace> place_heights(const std::string& path, const ImageSource& dem, const HeightReading& reading) {
    const ImageInfo& info = dem.info();
    if (info.width < 2 || info.height < 2)
        return input_error(
            fmt::format("{}: {} x {} samples; a terrain needs at least 2 x 2", path, info.width, info.height));
    if (!dem.georeference()) {
        if (!reading.spacing_m)
            return input_error(
                fmt::format("{}: the file carries no georeference; give the distance of its samples in metres "
                            "with --spacing",
                            path));
        // Samples are points and the north-west one stands at (0, 0); y falls southward.
        return HeightPlace{0, 0, *reading.spacing_m, *reading.spacing_m};
    }
    const Georeference& where = *dem.georeference();
    if (reading.spacing_m)
        return usage_error(
            fmt::format("--spacing {}: {} carries its own georeference ({} m); the option is for files without",
                        *reading.spacing_m, path, where.column_x));
    if (auto ok = check_usable(path, where); !ok) return ok.error();
    return HeightPlace{where.first_x, where.first_y, where.column_x, -where.row_y};
}

Result<void> check_usable(const std::string& path, const Georeference& where) {
    if (where.geographic)
        return input_error(
            fmt::format("{}: coordinates are degrees ({}); heights in degrees cannot be built until warping "
                        "exists: reproject to a metric CRS such as UTM first",
                        path, where.crs.empty() ? "geographic CRS" : where.crs));
    if (!where.axis_aligned())
        return input_error(fmt::format(
            "{}: the raster is rotated against its CRS; this needs warping, which does not exist yet", path));
    if (where.row_y > 0 || where.column_x < 0)
        return input_error(
            fmt::format("{}: rows do not run from north to south (steps {}, {}); this needs warping, which does "
                        "not exist yet",
                        path, where.column_x, where.row_y));
    if (std::abs(where.linear_unit_m - 1) > 1e-9)
        return input_error(fmt::format("{}: CRS units of {} m; only metres can be built until warping exists", path,
                                       where.linear_unit_m));
    if (std::abs(where.column_x + where.row_y) > kSquareTolerance * where.column_x)
        return input_error(
            fmt::format("{}: cells of {} x {} m are not square; this needs warping, which does not exist yet", path,
                        where.column_x, -where.row_y));
    return {};
}

VoidRule::VoidRule(const ImageInfo& dem, const HeightReading& reading) : tag_(dem.nodata), user_(reading.nodata) {
    if (user_ && dem.type == SampleType::f32) user_ = static_cast<double>(static_cast<float>(*user_));
}

void VoidRule::apply(std::span<double> values) const {
    for (double& v : values)
        if (!std::isfinite(v) || (tag_ && v == *tag_) || (user_ && v == *user_))
            v = std::numeric_limits<double>::quiet_NaN();
}

}  // namespace scree
