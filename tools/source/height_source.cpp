#include "tools/source/height_source.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>

namespace scree {
namespace {

Error input_error(std::string message) { return {ErrorCode::input, std::move(message)}; }
Error usage_error(std::string message) { return {ErrorCode::usage, std::move(message)}; }

// Three bands of eight bits as one of integers.
class EncodedHeights final : public ImageSource {
public:
    EncodedHeights(std::unique_ptr<ImageSource> colours, HeightEncoding encoding) : colours_(std::move(colours)) {
        info_ = colours_->info();
        info_.channels = 1;
        info_.alpha_channel = -1;
        info_.type = SampleType::u32;
        info_.nodata.reset();
        info_.values_are_colours = false;
        info_.shown_bands = 1;
        const bool terrarium = encoding == HeightEncoding::terrarium;
        info_.value_scale = terrarium ? 1.0 / 256 : 0.1;
        info_.value_offset = terrarium ? -32768 : -10000;
    }

    const ImageInfo& info() const override { return info_; }
    const std::optional<Georeference>& georeference() const override { return colours_->georeference(); }
    Result<void> read_channel(std::int64_t begin, std::int64_t end, std::span<float> out) override {
        return read(begin, end, out);
    }
    Result<void> read_channel(std::int64_t begin, std::int64_t end, std::span<double> out) override {
        return read(begin, end, out);
    }
    Result<void> read_rgba8(std::int64_t begin, std::int64_t end, std::span<std::uint8_t> out) override {
        return colours_->read_rgba8(begin, end, out);
    }

private:
    // Below 2^24: floats hold them. What is not wholly opaque is void.
    template <class T>
    Result<void> read(std::int64_t begin, std::int64_t end, std::span<T> out) {
        rgba_.resize(out.size() * 4);
        if (auto ok = colours_->read_rgba8(begin, end, rgba_); !ok) return ok;
        for (std::size_t k = 0; k < out.size(); ++k) {
            const std::uint8_t* p = rgba_.data() + 4 * k;
            out[k] = p[3] == 255 ? static_cast<T>(p[0] << 16 | p[1] << 8 | p[2]) : std::numeric_limits<T>::quiet_NaN();
        }
        return {};
    }

    std::unique_ptr<ImageSource> colours_;
    ImageInfo info_;
    std::vector<std::uint8_t> rgba_;
};

Result<std::unique_ptr<ImageSource>> open_encoded(const std::string& path, const OpenOptions& options,
                                                  HeightEncoding encoding) {
    auto colours = ImageSource::open(path, options);
    if (!colours) return colours.error();
    const ImageInfo& info = (*colours)->info();
    if (!info.eight_bit || info.shown_bands != 3 || info.channels > 4)
        return input_error(fmt::format("{}: {} channels{}; --height-encoding asks for red, green and blue of 8 bits",
                                       path, info.channels, info.eight_bit ? "" : " of more than 8 bits"));
    return std::unique_ptr<ImageSource>(std::make_unique<EncodedHeights>(std::move(*colours), encoding));
}

}  // namespace

Result<void> check_height_reading(const HeightReading& o) {
    if (o.height_scale && !(std::isfinite(*o.height_scale) && *o.height_scale > 0))
        return usage_error(fmt::format("--height-scale {} is not a positive number", *o.height_scale));
    if (!(std::abs(o.height_offset_m) <= 1e7))
        return usage_error(fmt::format("--height-offset {} m is not within 1e7 m", o.height_offset_m));
    if (o.spacing_m && !(*o.spacing_m >= 1e-6 && *o.spacing_m <= 1e6))
        return usage_error(fmt::format("--spacing {} m is outside 1e-6..1e6", *o.spacing_m));
    for (const std::string& word : o.source_vertical_crs)
        if (!parse_source_vertical_crs(word))
            return usage_error(fmt::format("--source-vertical-crs {} is not NAME=EPSG:n", word));
    return {};
}

std::optional<SourceVerticalCrs> parse_source_vertical_crs(const std::string& word) {
    const std::size_t equals = word.rfind('=');
    if (equals == std::string::npos || equals == 0 || equals + 1 == word.size()) return std::nullopt;
    return SourceVerticalCrs{word.substr(0, equals), word.substr(equals + 1)};
}

Result<std::unique_ptr<ImageSource>> open_heights(const std::string& path, const OpenOptions& options,
                                                  HeightEncoding encoding) {
    OpenOptions plain = options;
    plain.colours = {};  // bands, stretch and nodata of the imagery are not the heights'
    if (encoding != HeightEncoding::values) return open_encoded(path, plain, encoding);
    auto dem = ImageSource::open(path, plain);
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
