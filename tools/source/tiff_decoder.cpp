// Plain TIFFs (grey or RGB, whole-byte samples: what heights and orthoimages are) go straight through libtiff:
// OpenImageIO 2.4 returns uninitialised memory for tiled float64 and takes damaged deflate strips for whole.
#include <algorithm>
#include <cstring>
#include <utility>
#include <vector>

#include <Imath/half.h>
#include <fmt/format.h>
#include <tiffio.h>

#include "tools/source/pixel_decoder.h"
#include "tools/source/tiff_file.h"

namespace scree {
namespace {

template <class T, class Value>
void put(Value value, std::byte* out) {
    const T sample = static_cast<T>(value);
    std::memcpy(out, &sample, sizeof(T));
}

void put_value(SampleType type, double value, std::byte* out) {
    switch (type) {
        case SampleType::u8:
            return put<std::uint8_t>(value, out);
        case SampleType::i8:
            return put<std::int8_t>(value, out);
        case SampleType::u16:
            return put<std::uint16_t>(value, out);
        case SampleType::i16:
            return put<std::int16_t>(value, out);
        case SampleType::u32:
            return put<std::uint32_t>(value, out);
        case SampleType::i32:
            return put<std::int32_t>(value, out);
        case SampleType::u64:
            return put<std::uint64_t>(value, out);
        case SampleType::i64:
            return put<std::int64_t>(value, out);
        case SampleType::f16:
            return put<half>(static_cast<float>(value), out);
        case SampleType::f32:
            return put<float>(value, out);
        case SampleType::f64:
            return put<double>(value, out);
    }
}

class TiffDecoder final : public PixelDecoder {
public:
    TiffDecoder(std::unique_ptr<TiffFile> file, const ImageHeader& header)
        : file_(std::move(file)), header_(header), plain_(*header.plain_tiff) {
        layout_ = {header.width,         header.height, plain_.channels,
                   header.alpha_channel, plain_.type,   plain_.tile_width > 0 ? header.rows_per_strip : 0};
        stored_bytes_ = plain_.type == SampleType::f16 ? sizeof(half) : memory_bytes(plain_.type);
        out_bytes_ = memory_bytes(plain_.type);
    }

    const DecodedLayout& layout() const override { return layout_; }

    Result<void> decode(std::int64_t begin, std::int64_t end, std::byte* out) override {
        const std::int64_t row_bytes = layout_.width * layout_.channels * static_cast<std::int64_t>(out_bytes_);
        for (std::int64_t row = begin; row < end; row += header_.rows_per_strip) {
            const std::int64_t rows = std::min(header_.rows_per_strip, end - row);
            if (Result<void> read = decode_unit_row(row, rows, out + (row - begin) * row_bytes); !read) return read;
        }
        return {};
    }

private:
    // One strip, or one row of tiles, of every plane.
    Result<void> decode_unit_row(std::int64_t row, std::int64_t rows, std::byte* out) {
        const bool tiled = plain_.tile_width > 0;
        const std::int64_t unit_columns = tiled ? plain_.tile_width : layout_.width;
        const std::int64_t unit_rows = tiled ? header_.rows_per_strip : rows;
        const int planes = plain_.separate_planes ? plain_.channels : 1;
        const int channels = plain_.separate_planes ? 1 : plain_.channels;
        const std::size_t unit_bytes = static_cast<std::size_t>(unit_columns * unit_rows * channels) * stored_bytes_;
        unit_.resize(unit_bytes);
        for (int plane = 0; plane < planes; ++plane) {
            for (std::int64_t column = 0; column < layout_.width; column += unit_columns) {
                const auto x = static_cast<std::uint32_t>(column);
                const auto y = static_cast<std::uint32_t>(row);
                const auto sample = static_cast<std::uint16_t>(plane);
                TIFF* tiff = file_->get();
                const std::uint32_t index =
                    tiled ? TIFFComputeTile(tiff, x, y, 0, sample) : TIFFComputeStrip(tiff, y, sample);
                if (Result<void> read = read_unit(index, tiled, unit_bytes); !read) return read;
                const std::int64_t columns = std::min(unit_columns, layout_.width - column);
                for (std::int64_t r = 0; r < rows; ++r) {
                    const std::byte* from =
                        unit_.data() + static_cast<std::size_t>(r * unit_columns * channels) * stored_bytes_;
                    std::byte* to =
                        out +
                        static_cast<std::size_t>((r * layout_.width + column) * layout_.channels + plane) * out_bytes_;
                    copy_samples(from, to, columns * channels);
                }
            }
        }
        return {};
    }

    Result<void> read_unit(std::uint32_t index, bool tiled, std::size_t bytes) {
        TIFF* tiff = file_->get();
        // A unit that was never written has neither place nor length; it means nodata, or zero where there is none.
        if (TIFFGetStrileByteCount(tiff, index) == 0 && TIFFGetStrileOffset(tiff, index) == 0) {
            const std::optional<double> nodata =
                header_.nodata ? nodata_as(plain_.type, *header_.nodata) : std::nullopt;
            for (std::size_t at = 0; at < bytes; at += stored_bytes_)
                put_value(plain_.type, nodata.value_or(0), unit_.data() + at);
            return {};
        }
        file_->clear_messages();
        const auto size = static_cast<tmsize_t>(bytes);
        const tmsize_t read = tiled ? TIFFReadEncodedTile(tiff, index, unit_.data(), size)
                                    : TIFFReadEncodedStrip(tiff, index, unit_.data(), size);
        if (read != size || !file_->messages().empty()) {
            const std::string reason =
                file_->messages().empty() ? fmt::format("{} of {} bytes", read, size) : file_->messages();
            return Error{ErrorCode::input, fmt::format("{} {}: {}", tiled ? "tile" : "strip", index, reason)};
        }
        return {};
    }

    // With separate planes the samples of one plane lie `channels` apart in the output.
    void copy_samples(const std::byte* from, std::byte* to, std::int64_t count) const {
        const std::size_t step =
            plain_.separate_planes ? out_bytes_ * static_cast<std::size_t>(plain_.channels) : out_bytes_;
        if (plain_.type == SampleType::f16) {
            for (std::int64_t i = 0; i < count; ++i, from += stored_bytes_, to += step) {
                half stored;
                std::memcpy(&stored, from, sizeof stored);
                const float wide = stored;
                std::memcpy(to, &wide, sizeof wide);
            }
        } else if (step == out_bytes_) {
            std::memcpy(to, from, static_cast<std::size_t>(count) * out_bytes_);
        } else {
            for (std::int64_t i = 0; i < count; ++i, from += stored_bytes_, to += step)
                std::memcpy(to, from, stored_bytes_);
        }
    }

    std::unique_ptr<TiffFile> file_;
    ImageHeader header_;
    PlainTiff plain_;
    DecodedLayout layout_;
    std::size_t stored_bytes_ = 1;
    std::size_t out_bytes_ = 1;
    std::vector<std::byte> unit_;
};

}  // namespace

std::size_t memory_bytes(SampleType type) {
    switch (type) {
        case SampleType::u8:
        case SampleType::i8:
            return 1;
        case SampleType::u16:
        case SampleType::i16:
            return 2;
        case SampleType::u32:
        case SampleType::i32:
        case SampleType::f16:  // widened
        case SampleType::f32:
            return 4;
        case SampleType::u64:
        case SampleType::i64:
        case SampleType::f64:
            return 8;
    }
    return 0;
}

Result<std::unique_ptr<PixelDecoder>> make_tiff_decoder(const std::string& path, const ImageHeader& header) {
    auto file = std::make_unique<TiffFile>(path, "rm");
    if (!file->valid())
        return Error{ErrorCode::input, fmt::format("{}: not a readable TIFF ({})", path, file->messages())};
    return std::unique_ptr<PixelDecoder>(std::make_unique<TiffDecoder>(std::move(file), header));
}

}  // namespace scree
