#include "tools/source/height_source.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>

namespace scree {
namespace {

Error input_error(std::string message) { return {ErrorCode::input, std::move(message)}; }
Error usage_error(std::string message) { return {ErrorCode::usage, std::move(message)}; }

}  // namespace

Result<void> check_height_reading(const HeightReading& o) {
    if (o.height_scale && !(std::isfinite(*o.height_scale) && *o.height_scale > 0))
        return usage_error(fmt::format("--height-scale {} is not a positive number", *o.height_scale));
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

HeightUnits units_of(const ImageInfo& dem, const Georeference& where, const HeightReading& reading) {
    if (reading.height_scale) return {*reading.height_scale, reading.height_offset_m};
    const double unit = where.height_unit_m > 0 ? where.height_unit_m : 1;
    return {dem.value_scale * unit, dem.value_offset * unit + reading.height_offset_m};
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
