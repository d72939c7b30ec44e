#include "tools/source/colour_rows.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <type_traits>

#include <fmt/format.h>

#include "tools/source/sample_memory.h"

namespace scree {
namespace {

Error usage(const std::string& path, const std::string& what) {
    return {ErrorCode::usage, fmt::format("{}: {}", path, what)};
}

bool is_signed(SampleType type) {
    return type == SampleType::i8 || type == SampleType::i16 || type == SampleType::i32 || type == SampleType::i64;
}

// The sample that stands for white or opaque where nothing else is said.
double full_sample(SampleType type, int significant_bits) {
    if (!is_integer(type)) return 1;
    if (significant_bits > 0) return std::exp2(significant_bits - (is_signed(type) ? 1 : 0)) - 1;
    double full = 0;
    with_memory_type(type,
                     [&](auto sample) { full = static_cast<double>(std::numeric_limits<decltype(sample)>::max()); });
    return full;
}

// To the nearest, halves up; NaN is 0.
std::uint8_t rounded_byte(double level) {
    const double clamped = level > 0 ? level : 0;
    return static_cast<std::uint8_t>((clamped < 255 ? clamped : 255) + 0.5);
}

// Linear from low..high to 0..255; low above high where 0 is white.
std::uint8_t linear_byte(double value, double low, double high) {
    return rounded_byte((value - low) * 255 / (high - low));
}

template <class T>
bool any_nan(const T (&shown)[3]) {
    return std::isnan(shown[0]) || std::isnan(shown[1]) || std::isnan(shown[2]);
}

Result<void> check_reading(const std::string& path, const ColourReading& reading, int bands) {
    if (!reading.bands.empty() && reading.bands.size() != 1 && reading.bands.size() != 3)
        return usage(path, fmt::format("--bands names {} bands; one is shown grey, three red, green and blue",
                                       reading.bands.size()));
    for (const int band : reading.bands)
        if (band < 1 || band > bands)
            return usage(path, fmt::format("--bands {}: the file has bands 1 to {}", band, bands));
    if (reading.stretch && !(std::isfinite(reading.stretch->low) && std::isfinite(reading.stretch->high) &&
                             reading.stretch->low < reading.stretch->high))
        return usage(path, fmt::format("--stretch {} {}: the first must be below the second, both finite",
                                       reading.stretch->low, reading.stretch->high));
    return {};
}

// Without bands named: the first three besides alpha, or the first one of fewer.
std::vector<int> default_bands(int channels, int alpha_channel) {
    std::vector<int> bands;
    for (int c = 0; c < channels && bands.size() < 3; ++c)
        if (c != alpha_channel) bands.push_back(c);
    if (bands.empty()) bands.push_back(0);
    if (bands.size() < 3) bands.resize(1);
    return bands;
}

// Four pixels of three words each way: what nearly all orthoimages are.
void rgb_to_rgba(const std::uint8_t* from, std::int64_t width, std::uint8_t* out) {
    std::int64_t column = 0;
    if constexpr (std::endian::native == std::endian::little) {
        constexpr std::uint32_t kOpaque = 0xFF000000u;
        for (; column + 4 <= width; column += 4, from += 12, out += 16) {
            std::uint32_t word[3];
            std::memcpy(word, from, sizeof word);
            const std::uint32_t pixel[4] = {word[0] | kOpaque, (word[0] >> 24 | word[1] << 8) | kOpaque,
                                            (word[1] >> 16 | word[2] << 16) | kOpaque, word[2] >> 8 | kOpaque};
            std::memcpy(out, pixel, sizeof pixel);
        }
    }
    for (; column < width; ++column, from += 3, out += 4) {
        out[0] = from[0];
        out[1] = from[1];
        out[2] = from[2];
        out[3] = 255;
    }
}

}  // namespace

Result<ColourRows> ColourRows::make(const std::string& path, const ImageInfo& info, const ImageHeader& header,
                                    const ColourReading& reading) {
    ColourRows rows;
    rows.width_ = info.width;
    rows.channels_ = info.channels;
    rows.alpha_channel_ = info.alpha_channel;
    rows.type_ = info.type;
    rows.model_ = header.model;
    rows.palette_ = header.palette;
    rows.associated_ = header.associated_alpha && info.alpha_channel >= 0;
    const bool made_rgb = header.model != ColourModel::grey_or_rgb;
    if (Result<void> checked = check_reading(path, reading, made_rgb ? 3 : info.channels); !checked)
        return checked.error();
    std::vector<int> bands = made_rgb ? std::vector<int>{0, 1, 2} : default_bands(info.channels, info.alpha_channel);
    if (!reading.bands.empty()) {
        bands = reading.bands;
        for (int& band : bands) --band;
    }
    rows.grey_ = bands.size() == 1;
    for (std::size_t c = 0; c < 3; ++c) rows.shown_[c] = bands[rows.grey_ ? 0 : c];

    rows.eight_bit_ = made_rgb || info.type == SampleType::u8;
    rows.alpha_max_ = full_sample(info.type, header.significant_bits);
    rows.high_ = made_rgb ? 255 : rows.alpha_max_;
    if (reading.stretch && !(reading.stretch->spares_8bit && rows.eight_bit_)) {
        rows.low_ = reading.stretch->low;
        rows.high_ = reading.stretch->high;
    }
    if (header.min_is_white) std::swap(rows.low_, rows.high_);
    const SampleType shown_type = made_rgb ? SampleType::u8 : info.type;
    if (reading.nodata)
        if (const std::optional<double> user = nodata_as(shown_type, *reading.nodata)) rows.nodata_.push_back(*user);
    if (made_rgb)
        rows.index_nodata_ = info.nodata;
    else if (info.nodata)
        rows.nodata_.push_back(*info.nodata);
    rows.fill_tables();
    return rows;
}

bool ColourRows::opaque() const {
    if (alpha_channel_ >= 0 || !nodata_.empty() || index_nodata_) return false;
    // Palettes have alpha of their own, and indices beyond their end are nothing.
    return model_ == ColourModel::cmyk || (model_ == ColourModel::grey_or_rgb && is_integer(type_));
}

void ColourRows::fill_tables() {
    const SampleType type = model_ == ColourModel::grey_or_rgb ? type_ : SampleType::u8;
    identity_ = type == SampleType::u8 && low_ == 0 && high_ == 255;
    with_memory_type(type, [&](auto sample) {
        using T = decltype(sample);
        if constexpr (std::is_integral_v<T> && sizeof(T) <= 2) {
            using Bits = std::make_unsigned_t<T>;
            levels_.resize(std::size_t{1} << (8 * sizeof(T)));
            for (std::size_t i = 0; i < levels_.size(); ++i)
                levels_[i] = linear_byte(static_cast<double>(static_cast<T>(static_cast<Bits>(i))), low_, high_);
        }
    });
}

template <class T>
bool ColourRows::hidden(const T* pixel) const {
    const T shown[3] = {pixel[shown_[0]], pixel[shown_[1]], pixel[shown_[2]]};
    if constexpr (std::is_floating_point_v<T>)
        if (any_nan(shown)) return true;
    for (const double nodata : nodata_) {
        const auto value = static_cast<T>(nodata);
        if (shown[0] == value && shown[1] == value && shown[2] == value) return true;
    }
    return false;
}

template <class T>
std::uint8_t ColourRows::alpha_of(const T* pixel) const {
    if (alpha_channel_ < 0) return 255;
    const T alpha = pixel[alpha_channel_];
    if constexpr (std::is_same_v<T, std::uint8_t>)
        if (alpha_max_ == 255) return alpha;
    return linear_byte(static_cast<double>(alpha), 0, alpha_max_);
}

bool ColourRows::masked(const MaskRow& mask, std::int64_t column) const {
    if (mask.samples == nullptr) return false;
    if (model_ != ColourModel::grey_or_rgb) return mask.hides(column, 0);
    return mask.hides(column, shown_[0]) && mask.hides(column, shown_[1]) && mask.hides(column, shown_[2]);
}

// Colours of a row, alpha 255, when nothing is multiplied by alpha. The table (of 8 and 16-bit types) or the line, and
// the channels, are copies: stores of bytes may alias any member.
template <bool kGrey, class T>
void ColourRows::convert_colours(const T* from, std::uint8_t* out) const {
    const std::uint8_t* table = levels_.data();
    const double low = low_;
    const double slope = 255 / (high_ - low_);  // a division a sample is what this would cost else
    const auto to_byte = [table, low, slope](T sample) {
        if constexpr (std::is_integral_v<T> && sizeof(T) <= 2)
            return table[static_cast<std::make_unsigned_t<T>>(sample)];
        else
            return rounded_byte((static_cast<double>(sample) - low) * slope);
    };
    const std::array<int, 3> shown = shown_;
    const int channels = channels_;
    for (const std::uint8_t* end = out + width_ * 4; out != end; from += channels, out += 4) {
        out[0] = to_byte(from[shown[0]]);
        out[1] = kGrey ? out[0] : to_byte(from[shown[1]]);
        out[2] = kGrey ? out[0] : to_byte(from[shown[2]]);
        out[3] = 255;
    }
}

template <class T>
void ColourRows::convert_associated(const T* from, std::uint8_t* out) const {
    for (std::int64_t column = 0; column < width_; ++column, from += channels_, out += 4) {
        const auto alpha = static_cast<double>(from[alpha_channel_]);
        for (std::size_t c = 0; c < 3; ++c) {
            const auto sample = static_cast<double>(from[shown_[c]]);
            out[c] = linear_byte(alpha > 0 ? sample * alpha_max_ / alpha : sample, low_, high_);
        }
    }
}

template <class T>
void ColourRows::convert(const T* from, const MaskRow& mask, std::uint8_t* out) const {
    if (associated_)
        convert_associated(from, out);
    else if (grey_)
        convert_colours<true>(from, out);
    else
        convert_colours<false>(from, out);
    if (alpha_channel_ < 0 && nodata_.empty() && mask.samples == nullptr) {
        if constexpr (std::is_floating_point_v<T>) {
            const std::array<int, 3> shown_bands = shown_;
            const int channels = channels_;
            for (const std::uint8_t* end = out + width_ * 4; out != end; from += channels, out += 4) {
                const T shown[3] = {from[shown_bands[0]], from[shown_bands[1]], from[shown_bands[2]]};
                if (any_nan(shown)) out[3] = 0;
            }
        }
        return;
    }
    for (std::int64_t column = 0; column < width_; ++column, from += channels_, out += 4)
        out[3] = hidden(from) || masked(mask, column) ? std::uint8_t{0} : alpha_of(from);
}

// `rgb` and the alpha that is in `pixel` already.
void ColourRows::finish_colour(std::array<std::uint8_t, 3> rgb, bool hidden, std::uint8_t* pixel) const {
    const std::uint8_t shown[3] = {rgb[static_cast<std::size_t>(shown_[0])], rgb[static_cast<std::size_t>(shown_[1])],
                                   rgb[static_cast<std::size_t>(shown_[2])]};
    for (const double nodata : nodata_)
        hidden = hidden || (shown[0] == nodata && shown[1] == nodata && shown[2] == nodata);
    for (int c = 0; c < 3; ++c) pixel[c] = levels_[shown[c]];
    if (hidden) pixel[3] = 0;
}

template <class T>
void ColourRows::convert_indexed(const T* from, const MaskRow& mask, std::uint8_t* out) const {
    for (std::int64_t column = 0; column < width_; ++column, from += channels_, out += 4) {
        const auto index = static_cast<std::size_t>(from[0]);  // a nodata that fills what was never written has any
        const std::array<std::uint8_t, 4> entry =
            index < palette_.size() ? palette_[index] : std::array<std::uint8_t, 4>{};
        out[3] = std::min(entry[3], alpha_of(from));
        const bool none = masked(mask, column) || (index_nodata_ && static_cast<double>(from[0]) == *index_nodata_);
        finish_colour({entry[0], entry[1], entry[2]}, none, out);
    }
}

template <class T>
void ColourRows::convert_cmyk(const T* from, const MaskRow& mask, std::uint8_t* out) const {
    for (std::int64_t column = 0; column < width_; ++column, from += channels_, out += 4) {
        std::array<unsigned, 4> ink{};
        bool none = index_nodata_.has_value();
        for (std::size_t c = 0; c < 4; ++c) {
            ink[c] = linear_byte(static_cast<double>(from[c]), 0, alpha_max_);
            none = none && static_cast<double>(from[c]) == *index_nodata_;
        }
        std::array<std::uint8_t, 3> rgb{};
        for (std::size_t c = 0; c < 3; ++c) rgb[c] = static_cast<std::uint8_t>((255 - ink[c]) * (255 - ink[3]) / 255);
        out[3] = alpha_of(from);
        finish_colour(rgb, none || masked(mask, column), out);
    }
}

void ColourRows::to_rgba8(const std::byte* samples, const MaskRow& mask, std::uint8_t* out) const {
    const bool plain = identity_ && model_ == ColourModel::grey_or_rgb && nodata_.empty() && !associated_ &&
                       mask.samples == nullptr && shown_ == std::array<int, 3>{0, 1, 2};
    if (plain && channels_ == 3 && alpha_channel_ < 0)
        return rgb_to_rgba(reinterpret_cast<const std::uint8_t*>(samples), width_, out);
    if (plain && channels_ == 4 && alpha_channel_ == 3) {
        std::memcpy(out, samples, static_cast<std::size_t>(width_) * 4);
        return;
    }
    with_memory_type(type_, [&](auto sample) {
        using T = decltype(sample);
        const T* from = reinterpret_cast<const T*>(samples);
        switch (model_) {
            case ColourModel::grey_or_rgb:
                return convert(from, mask, out);
            case ColourModel::palette:
                if constexpr (std::is_same_v<T, std::uint8_t> || std::is_same_v<T, std::uint16_t>)
                    return convert_indexed(from, mask, out);
                return;
            case ColourModel::cmyk:
                return convert_cmyk(from, mask, out);
        }
    });
}

void ColourRows::to_values(const std::byte* samples, const MaskRow& mask, float* out) const {
    with_memory_type(type_, [&](auto sample) {
        using T = decltype(sample);
        const T* from = reinterpret_cast<const T*>(samples);
        const int bands = shown_bands();
        for (std::int64_t column = 0; column < width_; ++column, from += channels_, out += bands) {
            const bool none =
                hidden(from) || masked(mask, column) || (alpha_channel_ >= 0 && !(from[alpha_channel_] > 0));
            for (int c = 0; c < bands; ++c) {
                double value = static_cast<double>(from[shown_[static_cast<std::size_t>(c)]]);
                if (associated_ && !none) value = value * alpha_max_ / static_cast<double>(from[alpha_channel_]);
                out[c] = none ? std::numeric_limits<float>::quiet_NaN() : static_cast<float>(value);
            }
        }
    });
}

}  // namespace scree
