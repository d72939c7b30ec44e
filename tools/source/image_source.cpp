#include "tools/source/image_source.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <exception>
#include <filesystem>
#include <limits>
#include <type_traits>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "tools/source/colour_rows.h"
#include "tools/source/grid_file.h"
#include "tools/source/image_header.h"
#include "tools/source/isolated_decoder.h"
#include "tools/source/pam_file.h"
#include "tools/source/pixel_decoder.h"
#include "tools/source/projection_file.h"
#include "tools/source/sample_memory.h"

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

std::int64_t saturating_product(std::int64_t a, std::int64_t b) {
    std::int64_t product = 0;
    return __builtin_mul_overflow(a, b, &product) ? std::numeric_limits<std::int64_t>::max() : product;
}

// The rows of one decoder, a band at a time.
class BandRows {
public:
    explicit BandRows(std::unique_ptr<BandDecoder> decoder) : decoder_(std::move(decoder)) {}

    const DecodedLayout& layout() const { return decoder_->layout(); }
    std::int64_t unit_rows() const { return unit_rows_; }
    std::int64_t unit_bytes() const { return saturating_product(row_bytes_, unit_rows_); }

    Result<void> prepare(const std::string& path, std::int64_t rows_per_strip, std::int64_t max_unit_bytes) {
        const DecodedLayout& layout = decoder_->layout();
        if (layout.channels <= 0 || layout.channels > kMaxChannels)
            return unusable(
                path, fmt::format("its header says {} channels; 1 to {} can be read", layout.channels, kMaxChannels));
        const bool tiled = layout.tile_rows > 0;
        row_bytes_ = layout.width * layout.channels * static_cast<std::int64_t>(memory_bytes(layout.type));
        unit_rows_ = std::min(layout.height, tiled ? layout.tile_rows : rows_per_strip);
        if (unit_bytes() > max_unit_bytes) {
            const std::int64_t needed_mib = unit_bytes() / kMiB + 1;
            const char* unit = tiled ? "a row of tiles" : unit_rows_ == layout.height ? "the whole image" : "a strip";
            return unusable(
                path,
                fmt::format("{} must be decoded at once: {} rows of {} bytes, {} MiB, but {} MiB may be held; give "
                            "--memory at least {} MiB for it, or store the file in smaller strips or tiles",
                            unit, unit_rows_, row_bytes_, needed_mib, max_unit_bytes / kMiB, needed_mib));
        }
        // A band starts at a unit's first row; small units are grouped.
        const std::int64_t target = std::min(kBandTargetBytes, max_unit_bytes);
        band_rows_ = unit_rows_ * std::max<std::int64_t>(1, target / std::max<std::int64_t>(unit_bytes(), 1));
        return {};
    }

    /// The row's samples, until another row is asked for. The Error holds rows and reason.
    Result<const std::byte*> row(std::int64_t row) {
        if (row < band_begin_ || row >= band_end_) {
            if (Result<void> loaded = load_band(row - row % band_rows_); !loaded) return loaded.error();
        }
        return band_ + (row - band_begin_) * row_bytes_;
    }

private:
    Result<void> load_band(std::int64_t begin) {
        const std::int64_t end = std::min(begin + band_rows_, layout().height);
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
        return {ErrorCode::input,
                fmt::format("rows {} to {} of {} cannot be decoded ({}); the file is damaged or cut off", begin,
                            end - 1, layout().height, reason)};
    }

    std::unique_ptr<BandDecoder> decoder_;
    std::int64_t row_bytes_ = 0;
    std::int64_t unit_rows_ = 1;
    std::int64_t band_rows_ = 1;
    const std::byte* band_ = nullptr;  ///< the decoder's: rows [band_begin_, band_end_), all channels, as decoded
    std::int64_t band_begin_ = 0;
    std::int64_t band_end_ = 0;
};

class DecodedSource final : public ImageSource {
public:
    DecodedSource(std::string path, ImageHeader header, std::unique_ptr<BandDecoder> decoder)
        : path_(std::move(path)), header_(std::move(header)), image_(std::move(decoder)) {}

    Result<void> prepare(const OpenOptions& options) {
        if (Result<void> ready = image_.prepare(path_, header_.rows_per_strip, options.max_unit_bytes); !ready)
            return ready;
        const DecodedLayout& layout = image_.layout();
        info_.width = layout.width;
        info_.height = layout.height;
        info_.channels = layout.channels;
        info_.type = layout.type;
        info_.tiled = layout.tile_rows > 0;
        info_.alpha_channel = layout.alpha_channel < layout.channels ? layout.alpha_channel : -1;
        info_.value_scale = header_.value_scale;
        info_.value_offset = header_.value_offset;
        if (header_.nodata) info_.nodata = nodata_as(layout.type, *header_.nodata);
        info_.unit_bytes = image_.unit_bytes();
        info_.unit_rows = image_.unit_rows();
        info_.values_are_colours = header_.values_are_colours;
        if (options.height_band < 1 || options.height_band > info_.channels)
            return Error{ErrorCode::usage,
                         fmt::format("{}: band {} is asked for heights, but the file has bands 1 to {}", path_,
                                     options.height_band, info_.channels)};
        height_channel_ = options.height_band - 1;
        shift_ = header_.spread_bits > 0 ? static_cast<int>(memory_bytes(layout.type)) * 8 - header_.spread_bits : 0;
        Result<ColourRows> colours = ColourRows::make(path_, info_, header_, options.colours);
        if (!colours) return colours.error();
        colours_.emplace(std::move(*colours));
        info_.eight_bit = colours_->eight_bit();
        info_.shown_bands = colours_->shown_bands();
        info_.opaque = colours_->opaque();
        return {};
    }

    Result<void> use_mask(const ImageHeader& header, std::unique_ptr<BandDecoder> decoder, const OpenOptions& options) {
        const DecodedLayout& layout = decoder->layout();
        if (layout.width != info_.width || layout.height != info_.height || layout.type != SampleType::u8 ||
            (layout.channels != 1 && layout.channels != info_.channels))
            return unusable(path_, "its mask is not of the image's size, so what is valid is unknown");
        mask_.emplace(std::move(decoder));
        info_.opaque = false;
        return mask_->prepare(path_, header.rows_per_strip, options.max_unit_bytes);
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
        return for_each_row(row_begin, row_end, [&](std::int64_t row, const std::byte* samples, const MaskRow& mask) {
            colours_->to_rgba8(samples, mask, out.data() + (row - row_begin) * info_.width * 4);
        });
    }

    Result<void> read_shown(std::int64_t row_begin, std::int64_t row_end, std::span<float> out) override {
        if (info_.eight_bit) return ImageSource::read_shown(row_begin, row_end, out);
        const std::int64_t row_values = info_.width * info_.shown_bands;
        assert(out.size() == static_cast<std::size_t>((row_end - row_begin) * row_values));
        return for_each_row(row_begin, row_end, [&](std::int64_t row, const std::byte* samples, const MaskRow& mask) {
            colours_->to_values(samples, mask, out.data() + (row - row_begin) * row_values);
        });
    }

private:
    template <class Out>
    Result<void> read_values(std::int64_t row_begin, std::int64_t row_end, std::span<Out> out) {
        assert(out.size() == static_cast<std::size_t>((row_end - row_begin) * info_.width));
        if (info_.values_are_colours)
            return unusable(path_, "its values are colours (a palette's indices, CMYK or YCbCr), not heights");
        return for_each_row(row_begin, row_end, [&](std::int64_t row, const std::byte* samples, const MaskRow& mask) {
            Out* to = out.data() + (row - row_begin) * info_.width;
            with_memory_type(info_.type, [&](auto sample) {
                using T = decltype(sample);
                const T* pixels = reinterpret_cast<const T*>(samples);
                const T* from = pixels + height_channel_;
                for (std::int64_t column = 0; column < info_.width; ++column, from += info_.channels) {
                    // Spread samples hold their own bits in the upper ones.
                    if constexpr (std::is_integral_v<T>)
                        to[column] = static_cast<Out>(shift_ == 0 ? *from : static_cast<T>(*from >> shift_));
                    else
                        to[column] = static_cast<Out>(*from);
                }
                void_hidden(pixels, mask, to);
            });
        });
    }

    template <class T, class Out>
    void void_hidden(const T* pixels, const MaskRow& mask, Out* values) const {
        constexpr Out kVoid = std::numeric_limits<Out>::quiet_NaN();
        if (info_.alpha_channel >= 0 && info_.alpha_channel != height_channel_) {
            const T* alpha = pixels + info_.alpha_channel;
            for (std::int64_t column = 0; column < info_.width; ++column, alpha += info_.channels)
                if (!(*alpha > 0)) values[column] = kVoid;
        }
        if (mask.samples == nullptr) return;
        for (std::int64_t column = 0; column < info_.width; ++column)
            if (mask.hides(column, height_channel_)) values[column] = kVoid;
    }

    template <class Use>
    Result<void> for_each_row(std::int64_t row_begin, std::int64_t row_end, Use&& use) {
        assert(0 <= row_begin && row_begin <= row_end && row_end <= info_.height);
        for (std::int64_t row = row_begin; row < row_end; ++row) {
            const Result<const std::byte*> samples = image_.row(row);
            if (!samples) return about_rows("", samples.error());
            MaskRow mask;
            if (mask_) {
                const Result<const std::byte*> mask_samples = mask_->row(row);
                if (!mask_samples) return about_rows("its mask's ", mask_samples.error());
                mask = {reinterpret_cast<const std::uint8_t*>(*mask_samples), mask_->layout().channels};
            }
            use(row, *samples, mask);
        }
        return {};
    }

    // What is not the file's fault (no memory, no decoder program) is said as it is.
    Error about_rows(const char* whose, const Error& error) const {
        return error.code == ErrorCode::input ? unusable(path_, whose + error.message) : error;
    }

    std::string path_;
    ImageHeader header_;
    BandRows image_;
    std::optional<BandRows> mask_;
    std::optional<ColourRows> colours_;  ///< from prepare on
    ImageInfo info_;
    std::optional<Georeference> georeference_;
    int height_channel_ = 0;
    int shift_ = 0;
};

// Whole frames take several times their size while they are decoded.
DecoderLimits limits_of(const OpenOptions& options) {
    DecoderLimits limits;
    if (options.max_unit_bytes < std::numeric_limits<std::int64_t>::max() / 8)
        limits.memory_bytes = kDecoderBytes + 4 * options.max_unit_bytes;
    return limits;
}

// FILE.msk, as GDAL writes it for formats without masks of their own: a TIFF of the image's size whose samples are 0
// where there is nothing. Source: GDAL RFC 15.
Result<void> open_mask_beside(const std::string& path, const OpenOptions& options, DecodedSource& source) {
    const std::string name = path + ".msk";
    std::error_code ignored;
    if (!std::filesystem::is_regular_file(name, ignored)) return {};
    const auto explained = [&](const Error& error) {
        return Error{error.code, fmt::format("{}; it is the mask of {}: without it take it away", error.message, path)};
    };
    const DecoderLimits limits = limits_of(options);
    if (Result<void> tried = try_headers(name, limits); !tried) return explained(tried.error());
    Result<ImageHeader> header = read_image_header(name);
    if (!header) return explained(header.error());
    if (!header->plain_tiff) return explained(unusable(name, "no TIFF"));
    Result<std::unique_ptr<BandDecoder>> decoder = open_isolated_decoder(name, *header, limits);
    if (!decoder) return explained(decoder.error());
    return source.use_mask(*header, std::move(*decoder), options);
}

// Where the file itself says nothing of it.
void take_scale(const PamFile& pam, ImageHeader& header) {
    if (header.value_scale != 1 || header.value_offset != 0) return;
    header.value_scale = pam.scale.value_or(1);
    header.value_offset = pam.offset.value_or(0);
}

Result<std::unique_ptr<ImageSource>> open_grid(const std::string& path, GridFile grid, const OpenOptions& options) {
    ImageHeader header;
    header.rows_per_strip = grid.rows_per_unit;
    header.nodata = std::move(grid.nodata);
    Result<PamFile> pam = read_pam(path);
    if (!pam) return pam.error();
    take_scale(*pam, header);
    if (grid.georeference && grid.georeference->height_unit_m == 0)
        grid.georeference->height_unit_m = length_unit_m(pam->unit);
    auto source = std::make_unique<DecodedSource>(path, header, decode_here(std::move(grid.decoder)));
    if (Result<void> prepared = source->prepare(options); !prepared) return prepared.error();
    if (Result<void> masked = open_mask_beside(path, options, *source); !masked) return masked.error();
    source->place(std::move(grid.georeference));
    return std::unique_ptr<ImageSource>(std::move(source));
}

Result<void> open_mask(const std::string& path, const ImageHeader& image, const OpenOptions& options,
                       DecodedSource& source) {
    Result<std::optional<ImageHeader>> header = read_mask_header(path, image);
    if (!header) return header.error();
    if (!*header) return open_mask_beside(path, options, source);
    Result<std::unique_ptr<BandDecoder>> decoder = open_isolated_decoder(path, **header, limits_of(options));
    if (!decoder) return decoder.error();
    return source.use_mask(**header, std::move(*decoder), options);
}

Result<std::unique_ptr<ImageSource>> open_image(const std::string& path, const OpenOptions& options) {
    Result<std::optional<GridFile>> grid = open_grid_file(path);
    if (!grid) return grid.error();
    if (grid->has_value()) return open_grid(path, std::move(**grid), options);
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
    Result<PamFile> pam = read_pam(path);
    if (!pam) return pam.error();
    if (!header->nodata) header->nodata = std::move(pam->nodata);
    take_scale(*pam, *header);
    Result<std::unique_ptr<BandDecoder>> decoder = open_isolated_decoder(path, *header, limits);
    if (!decoder) return decoder.error();
    auto source = std::make_unique<DecodedSource>(path, *header, std::move(*decoder));
    if (Result<void> prepared = source->prepare(options); !prepared) return prepared.error();
    if (Result<void> masked = open_mask(path, *header, options, *source); !masked) return masked.error();
    Result<std::optional<Georeference>> georeference = read_georeference(path);
    if (!georeference) return georeference.error();
    if (*georeference && (*georeference)->height_unit_m == 0) (*georeference)->height_unit_m = length_unit_m(pam->unit);
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

Result<void> ImageSource::read_shown(std::int64_t, std::int64_t, std::span<float>) {
    return Error{ErrorCode::input, "this image's samples cannot be read before they are stretched"};
}

Result<std::unique_ptr<ImageSource>> ImageSource::open(const std::string& path, const OpenOptions& options) {
    try {
        return open_image(path, options);
    } catch (const std::exception& problem) {
        return Error{ErrorCode::input, fmt::format("{}: cannot be opened ({})", path, problem.what())};
    }
}

}  // namespace scree
