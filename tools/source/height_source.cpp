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

namespace {

// No branches, so that vectors can take it. A value that a sample type cannot hold is none of its values.
template <class T>
void apply_rule(std::span<T> values, const std::optional<double>& tag, const std::optional<double>& user) {
    constexpr T kVoid = std::numeric_limits<T>::quiet_NaN(), kGreatest = std::numeric_limits<T>::max();
    const auto as_sample = [](const std::optional<double>& value) {
        if (!value || !(std::abs(*value) <= static_cast<double>(kGreatest))) return kVoid;  // equals nothing
        const T sample = static_cast<T>(*value);
        return static_cast<double>(sample) == *value ? sample : kVoid;
    };
    const T of_tag = as_sample(tag), of_user = as_sample(user);
    for (T& v : values) {
        const bool height = (v >= -kGreatest) & (v <= kGreatest) & !(v == of_tag) & !(v == of_user);
        v = height ? v : kVoid;
    }
}

}  // namespace

void VoidRule::apply(std::span<double> values) const { apply_rule(values, tag_, user_); }
void VoidRule::apply(std::span<float> values) const { apply_rule(values, tag_, user_); }

}  // namespace scree
