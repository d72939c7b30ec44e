#include "tools/source/image_source.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <exception>
#include <limits>
#include <type_traits>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "tools/source/image_header.h"
#include "tools/source/isolated_decoder.h"
#include "tools/source/pixel_decoder.h"

namespace scree {
namespace {

constexpr int kMaxChannels = 1024;
// Units smaller than this are read several at a time: a call of the decoder costs about as much as decoding 64 KiB.
constexpr std::int64_t kBandTargetBytes = std::int64_t{1} << 20;
constexpr std::int64_t kMiB = std::int64_t{1} << 20;
// Measured: what decoders take for themselves, whatever the size of the image, is below 20 MiB.
constexpr std::int64_t kDecoderBytes = 64 * kMiB;

Error unusable(const std::string& path, const std::string& what) {
    return {ErrorCode::input, fmt::format("{}: {}", path, what)};
}

// Calls visit with a value of the type that decoded samples of `type` have in memory (half is widened to float).
template <class Visit>
void with_memory_type(SampleType type, Visit&& visit) {
    switch (type) {
        case SampleType::u8:
            return visit(std::uint8_t{});
        case SampleType::i8:
            return visit(std::int8_t{});
        case SampleType::u16:
            return visit(std::uint16_t{});
        case SampleType::i16:
            return visit(std::int16_t{});
        case SampleType::u32:
            return visit(std::uint32_t{});
        case SampleType::i32:
            return visit(std::int32_t{});
        case SampleType::u64:
            return visit(std::uint64_t{});
        case SampleType::i64:
            return visit(std::int64_t{});
        case SampleType::f16:
        case SampleType::f32:
            return visit(float{});
        case SampleType::f64:
            return visit(double{});
    }
}

std::int64_t saturating_product(std::int64_t a, std::int64_t b) {
    std::int64_t product = 0;
    return __builtin_mul_overflow(a, b, &product) ? std::numeric_limits<std::int64_t>::max() : product;
}

template <class T>
std::uint8_t to_byte(T value) {
    if constexpr (std::is_same_v<T, std::uint8_t>) {
        return value;
    } else if constexpr (std::is_floating_point_v<T>) {
        if (!(value > 0)) return 0;  // NaN too
        return static_cast<std::uint8_t>(std::min<T>(value, 1) * 255 + T(0.5));
    } else {
        if (value <= 0) return 0;
        return static_cast<std::uint8_t>(
            static_cast<double>(value) * 255 / static_cast<double>(std::numeric_limits<T>::max()) + 0.5);
    }
}

std::uint8_t divided_by_alpha(std::uint8_t colour, std::uint8_t alpha) {
    if (alpha == 0) return colour;
    return static_cast<std::uint8_t>(std::min(255, (colour * 255 + alpha / 2) / alpha));
}

class DecodedSource final : public ImageSource {
public:
    DecodedSource(std::string path, const ImageHeader& header, std::unique_ptr<IsolatedDecoder> decoder)
        : path_(std::move(path)), header_(header), decoder_(std::move(decoder)) {}

    Result<void> prepare(const OpenOptions& options) {
        const DecodedLayout& layout = decoder_->layout();
        if (layout.channels <= 0 || layout.channels > kMaxChannels)
            return unusable(
                path_, fmt::format("its header says {} channels; 1 to {} can be read", layout.channels, kMaxChannels));
        info_.width = layout.width;
        info_.height = layout.height;
        info_.channels = layout.channels;
        info_.type = layout.type;
        info_.tiled = layout.tile_rows > 0;
        info_.alpha_channel = layout.alpha_channel < layout.channels ? layout.alpha_channel : -1;
        if (header_.nodata) info_.nodata = nodata_as(layout.type, *header_.nodata);

        const std::size_t sample_bytes = memory_bytes(layout.type);
        row_bytes_ = info_.width * info_.channels * static_cast<std::int64_t>(sample_bytes);
        const std::int64_t unit_rows = std::min(info_.height, info_.tiled ? layout.tile_rows : header_.rows_per_strip);
        info_.unit_bytes = saturating_product(row_bytes_, unit_rows);
        if (info_.unit_bytes > options.max_unit_bytes) {
            const std::int64_t needed_mib = info_.unit_bytes / kMiB + 1;
            const char* unit = info_.tiled                 ? "a row of tiles"
                               : unit_rows == info_.height ? "the whole image"
                                                           : "a strip";
            return unusable(
                path_,
                fmt::format("{} must be decoded at once: {} rows of {} bytes, {} MiB, but {} MiB may be held; give "
                            "--memory at least {} MiB for it, or store the file in smaller strips or tiles",
                            unit, unit_rows, row_bytes_, needed_mib, options.max_unit_bytes / kMiB, needed_mib));
        }
        // A band starts at a unit's first row; small units are grouped.
        const std::int64_t target = std::min(kBandTargetBytes, options.max_unit_bytes);
        band_rows_ = unit_rows * std::max<std::int64_t>(1, target / std::max<std::int64_t>(info_.unit_bytes, 1));
        shift_ = header_.significant_bits > 0 ? static_cast<int>(sample_bytes) * 8 - header_.significant_bits : 0;
        return {};
    }

    void place(std::optional<Georeference> georeference) { georeference_ = std::move(georeference); }

    const ImageInfo& info() const override { return info_; }
    const std::optional<Georeference>& georeference() const override { return georeference_; }

    Result<void> read_channel(std::int64_t row_begin, std::int64_t row_end, std::span<float> out) override {
        return read_values(row_begin, row_end, out);
    }
    Result<void> read_channel(std::int64_t row_begin, std::int64_t row_end, std::span<double> out) override {
        return read_values(row_begin, row_end, out);
    }

    Result<void> read_rgba8(std::int64_t row_begin, std::int64_t row_end, std::span<std::uint8_t> out) override {
        assert(out.size() == static_cast<std::size_t>((row_end - row_begin) * info_.width * 4));
        const int colours = info_.alpha_channel >= 0 ? info_.alpha_channel : info_.channels;
        const bool grey = colours < 3;
        return for_each_row(row_begin, row_end, [&](std::int64_t row, const std::byte* samples) {
            std::uint8_t* pixel = out.data() + (row - row_begin) * info_.width * 4;
            with_memory_type(info_.type, [&](auto sample) {
                using T = decltype(sample);
                const T* from = reinterpret_cast<const T*>(samples);
                for (std::int64_t column = 0; column < info_.width; ++column, from += info_.channels, pixel += 4) {
                    pixel[0] = to_byte(from[0]);
                    pixel[1] = grey ? pixel[0] : to_byte(from[1]);
                    pixel[2] = grey ? pixel[0] : to_byte(from[2]);
                    pixel[3] = info_.alpha_channel >= 0 ? to_byte(from[info_.alpha_channel]) : std::uint8_t{255};
                    if (info_.alpha_channel >= 0 && header_.associated_alpha) {
                        for (int c = 0; c < 3; ++c) pixel[c] = divided_by_alpha(pixel[c], pixel[3]);
                    }
                }
            });
        });
    }

private:
    template <class Out>
    Result<void> read_values(std::int64_t row_begin, std::int64_t row_end, std::span<Out> out) {
        assert(out.size() == static_cast<std::size_t>((row_end - row_begin) * info_.width));
        return for_each_row(row_begin, row_end, [&](std::int64_t row, const std::byte* samples) {
            Out* to = out.data() + (row - row_begin) * info_.width;
            with_memory_type(info_.type, [&](auto sample) {
                using T = decltype(sample);
                const T* from = reinterpret_cast<const T*>(samples);
                for (std::int64_t column = 0; column < info_.width; ++column, from += info_.channels) {
                    // Samples of odd widths arrive stretched over their type's range; their own bits are the upper
                    // ones.
                    if constexpr (std::is_same_v<T, std::uint8_t>)
                        to[column] = static_cast<Out>((header_.inverted_by_decoder ? 255 - *from : *from) >> shift_);
                    else if constexpr (std::is_integral_v<T>)
                        to[column] = static_cast<Out>(shift_ == 0 ? *from : static_cast<T>(*from >> shift_));
                    else
                        to[column] = static_cast<Out>(*from);
                }
            });
        });
    }

    template <class Use>
    Result<void> for_each_row(std::int64_t row_begin, std::int64_t row_end, Use&& use) {
        assert(0 <= row_begin && row_begin <= row_end && row_end <= info_.height);
        for (std::int64_t row = row_begin; row < row_end; ++row) {
            if (row < band_begin_ || row >= band_end_) {
                if (Result<void> loaded = load_band(row - row % band_rows_); !loaded) return loaded;
            }
            use(row, band_ + (row - band_begin_) * row_bytes_);
        }
        return {};
    }

    Result<void> load_band(std::int64_t begin) {
        const std::int64_t end = std::min(begin + band_rows_, info_.height);
        band_begin_ = band_end_ = 0;  // a failure leaves nothing that could be taken for pixels
        const Result<const std::byte*> decoded = decoder_->decode(begin, end);
        if (!decoded) {
            if (decoded.error().code != ErrorCode::input) return decoded.error();
            return unreadable(begin, end, decoded.error().message);
        }
        band_ = *decoded;
        band_begin_ = begin;
        band_end_ = end;
        return {};
    }

    Error unreadable(std::int64_t begin, std::int64_t end, const std::string& reason) const {
        return unusable(path_, fmt::format("rows {} to {} of {} cannot be decoded ({}); the file is damaged or cut off",
                                           begin, end - 1, info_.height, reason));
    }

    std::string path_;
    ImageHeader header_;
    std::unique_ptr<IsolatedDecoder> decoder_;
    ImageInfo info_;
    std::optional<Georeference> georeference_;
    std::int64_t row_bytes_ = 0;
    std::int64_t band_rows_ = 1;
    int shift_ = 0;
    const std::byte* band_ = nullptr;  ///< the decoder's: rows [band_begin_, band_end_), all channels, as decoded
    std::int64_t band_begin_ = 0;
    std::int64_t band_end_ = 0;
};

// Whole frames take several times their size while they are decoded.
DecoderLimits limits_of(const OpenOptions& options) {
    DecoderLimits limits;
    if (options.max_unit_bytes < std::numeric_limits<std::int64_t>::max() / 8)
        limits.memory_bytes = kDecoderBytes + 4 * options.max_unit_bytes;
    return limits;
}

Result<std::unique_ptr<ImageSource>> open_image(const std::string& path, const OpenOptions& options) {
    const DecoderLimits limits = limits_of(options);
    if (Result<void> tried = try_headers(path, limits); !tried) return tried.error();
    Result<ImageHeader> header = read_image_header(path);
    if (!header) return header.error();
    if (header->rows_per_strip == header->height && header->height > 0) {
        // Some decoders take the whole frame on opening: the least it can be is one byte a sample.
        const std::int64_t least = saturating_product(header->width, header->height);
        if (least > options.max_unit_bytes)
            return unusable(
                path,
                fmt::format(
                    "the whole image, {} x {} samples, must be decoded at once, but {} MiB may be held; give --memory "
                    "at least {} MiB for it, or store the file in tiles",
                    header->width, header->height, options.max_unit_bytes / kMiB, least / kMiB + 1));
    }
    Result<std::unique_ptr<IsolatedDecoder>> decoder = open_isolated_decoder(path, *header, limits);
    if (!decoder) return decoder.error();
    auto source = std::make_unique<DecodedSource>(path, *header, std::move(*decoder));
    if (Result<void> prepared = source->prepare(options); !prepared) return prepared.error();
    Result<std::optional<Georeference>> georeference = read_georeference(path);
    if (!georeference) return georeference.error();
    source->place(std::move(*georeference));
    return std::unique_ptr<ImageSource>(std::move(source));
}

}  // namespace

bool is_integer(SampleType type) {
    return type != SampleType::f16 && type != SampleType::f32 && type != SampleType::f64;
}

bool fits_float32(SampleType type) {
    switch (type) {
        case SampleType::u8:
        case SampleType::i8:
        case SampleType::u16:
        case SampleType::i16:
        case SampleType::f16:
        case SampleType::f32:
            return true;
        default:
            return false;
    }
}

Result<std::unique_ptr<ImageSource>> ImageSource::open(const std::string& path, const OpenOptions& options) {
    try {
        return open_image(path, options);
    } catch (const std::exception& problem) {
        return Error{ErrorCode::input, fmt::format("{}: cannot be opened ({})", path, problem.what())};
    }
}

}  // namespace scree
