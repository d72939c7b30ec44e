// TIFFs go straight through libtiff: OpenImageIO 2.4 returns uninitialised memory for tiled float64, takes damaged
// deflate strips for whole, inverts grey where 0 is white and spends minutes on some CMYK.
#include <algorithm>
#include <cstring>
#include <limits>
#include <span>
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
        case SampleType::f16:  // float in memory
        case SampleType::f32:
            return put<float>(value, out);
        case SampleType::f64:
            return put<double>(value, out);
    }
}

// Samples of other than whole bytes: a row is a string of bits, the first one highest (TIFF 6.0, FillOrder 1). So
// are 24-bit ones as GDAL writes and reads them, whatever the file's byte order.
class BitReader {
public:
    explicit BitReader(const std::byte* from) : from_(reinterpret_cast<const unsigned char*>(from)) {}
    std::uint32_t next(int bits) {
        while (held_ < bits) {
            window_ = window_ << 8 | *from_++;
            held_ += 8;
        }
        held_ -= bits;
        return static_cast<std::uint32_t>(window_ >> held_ & ((std::uint64_t{1} << bits) - 1));
    }

private:
    const unsigned char* from_;
    std::uint64_t window_ = 0;  ///< its low held_ bits are still to come
    int held_ = 0;
};

template <class T>
void unpack_bits(int bits, const std::byte* from, std::byte* to, std::size_t step, std::int64_t count) {
    BitReader reader(from);
    for (std::int64_t i = 0; i < count; ++i, to += step) {
        std::uint32_t value = reader.next(bits);
        if (std::numeric_limits<T>::is_signed && (value >> (bits - 1)) != 0) value |= ~0u << bits;
        const T sample = static_cast<T>(value);
        std::memcpy(to, &sample, sizeof(T));
    }
}

class TiffDecoder final : public PixelDecoder {
public:
    TiffDecoder(std::unique_ptr<TiffFile> file, const ImageHeader& header)
        : file_(std::move(file)), header_(header), plain_(*header.plain_tiff) {
        layout_ = {header.width,         header.height, plain_.channels,
                   header.alpha_channel, plain_.type,   plain_.tile_width > 0 ? header.rows_per_strip : 0};
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
        const int bits = plain_.rgba_by_libtiff ? 8 : plain_.bits;
        const auto unit_row_bytes = static_cast<std::size_t>((unit_columns * channels * bits + 7) / 8);
        if (!tiled && planes == 1 && stored_as_handed_out()) {
            // Uncompressed strips go from the file to where they belong without another copy.
            const Result<bool> written = read_unit({0, static_cast<std::uint32_t>(row), rows, 0},
                                                   {out, unit_row_bytes * static_cast<std::size_t>(rows)});
            if (!written) return written.error();
            if (!*written) fill_samples(out, rows * layout_.width * channels);
            return {};
        }
        unit_.resize(unit_row_bytes * static_cast<std::size_t>(unit_rows));
        for (int plane = 0; plane < planes; ++plane) {
            for (std::int64_t column = 0; column < layout_.width; column += unit_columns) {
                const Unit unit{static_cast<std::uint32_t>(column), static_cast<std::uint32_t>(row), unit_rows, plane};
                Result<bool> written = read_unit(unit, unit_);
                if (!written) return written.error();
                const std::int64_t columns = std::min(unit_columns, layout_.width - column);
                for (std::int64_t r = 0; r < rows; ++r) {
                    std::byte* to =
                        out +
                        static_cast<std::size_t>((r * layout_.width + column) * layout_.channels + plane) * out_bytes_;
                    if (*written)
                        copy_samples(unit_.data() + static_cast<std::size_t>(r) * unit_row_bytes, to,
                                     columns * channels);
                    else
                        fill_samples(to, columns * channels);
                }
            }
        }
        return {};
    }

    bool stored_as_handed_out() const {
        return !plain_.rgba_by_libtiff && plain_.type != SampleType::f16 &&
               static_cast<std::size_t>(plain_.bits) == out_bytes_ * 8;
    }

    struct Unit {
        std::uint32_t column, row;
        std::int64_t rows;  ///< of the tile; of a strip those that the image has
        int plane;
    };

    // False: the unit was never written, so it has neither place nor length.
    Result<bool> read_unit(const Unit& unit, std::span<std::byte> to) {
        TIFF* tiff = file_->get();
        const bool tiled = plain_.tile_width > 0;
        const auto plane = static_cast<std::uint16_t>(unit.plane);
        const std::uint32_t index =
            tiled ? TIFFComputeTile(tiff, unit.column, unit.row, 0, plane) : TIFFComputeStrip(tiff, unit.row, plane);
        if (TIFFGetStrileByteCount(tiff, index) == 0 && TIFFGetStrileOffset(tiff, index) == 0) return false;
        file_->clear_messages();
        const auto size = static_cast<tmsize_t>(to.size());
        const tmsize_t read = plain_.rgba_by_libtiff ? read_rgba(unit)
                              : tiled                ? TIFFReadEncodedTile(tiff, index, to.data(), size)
                                                     : TIFFReadEncodedStrip(tiff, index, to.data(), size);
        if (read != size || !file_->messages().empty()) {
            const std::string reason =
                file_->messages().empty() ? fmt::format("{} of {} bytes", read, size) : file_->messages();
            return Error{ErrorCode::input, fmt::format("{} {}: {}", tiled ? "tile" : "strip", index, reason)};
        }
        return true;
    }

    // libtiff's conversion gives a word a pixel, R in its lowest byte, and the last row first.
    tmsize_t read_rgba(const Unit& unit) {
        TIFF* tiff = file_->get();
        const bool tiled = plain_.tile_width > 0;
        const auto columns = static_cast<std::size_t>(tiled ? plain_.tile_width : layout_.width);
        const auto rows = static_cast<std::size_t>(unit.rows);
        words_.resize(columns * rows);
        const int read = tiled ? TIFFReadRGBATileExt(tiff, unit.column, unit.row, words_.data(), 1)
                               : TIFFReadRGBAStripExt(tiff, unit.row, words_.data(), 1);
        if (read != 1) return 0;
        std::byte* to = unit_.data();
        for (std::size_t r = rows; r-- > 0;) {
            for (const std::uint32_t *word = &words_[r * columns], *end = word + columns; word != end; ++word)
                for (int shift = 0; shift < 32; shift += 8) *to++ = static_cast<std::byte>(*word >> shift & 255);
        }
        return static_cast<tmsize_t>(unit_.size());
    }

    // With separate planes the samples of one plane lie `channels` apart in the output.
    std::size_t out_step() const {
        return plain_.separate_planes ? out_bytes_ * static_cast<std::size_t>(plain_.channels) : out_bytes_;
    }

    // What was never written means nodata, or zero where there is none.
    void fill_samples(std::byte* to, std::int64_t count) const {
        const std::optional<double> nodata = header_.nodata ? nodata_as(plain_.type, *header_.nodata) : std::nullopt;
        for (std::int64_t i = 0; i < count; ++i, to += out_step()) put_value(plain_.type, nodata.value_or(0), to);
    }

    void copy_samples(const std::byte* from, std::byte* to, std::int64_t count) const {
        const std::size_t step = out_step();
        if (plain_.rgba_by_libtiff) {
            std::memcpy(to, from, static_cast<std::size_t>(count));
        } else if (plain_.type == SampleType::f16) {
            for (std::int64_t i = 0; i < count; ++i, from += sizeof(half), to += step) {
                half stored;
                std::memcpy(&stored, from, sizeof stored);
                const float wide = stored;
                std::memcpy(to, &wide, sizeof wide);
            }
        } else if (!stored_as_handed_out()) {
            unpack(from, to, count);
        } else if (step == out_bytes_) {
            std::memcpy(to, from, static_cast<std::size_t>(count) * out_bytes_);
        } else {
            for (std::int64_t i = 0; i < count; ++i, from += out_bytes_, to += step) std::memcpy(to, from, out_bytes_);
        }
    }

    void unpack(const std::byte* from, std::byte* to, std::int64_t count) const {
        const std::size_t step = out_step();
        const int bits = plain_.bits;
        switch (plain_.type) {
            case SampleType::u8:
                return unpack_bits<std::uint8_t>(bits, from, to, step, count);
            case SampleType::i8:
                return unpack_bits<std::int8_t>(bits, from, to, step, count);
            case SampleType::u16:
                return unpack_bits<std::uint16_t>(bits, from, to, step, count);
            case SampleType::i16:
                return unpack_bits<std::int16_t>(bits, from, to, step, count);
            case SampleType::i32:
                return unpack_bits<std::int32_t>(bits, from, to, step, count);
            default:
                return unpack_bits<std::uint32_t>(bits, from, to, step, count);
        }
    }

    std::unique_ptr<TiffFile> file_;
    ImageHeader header_;
    PlainTiff plain_;
    DecodedLayout layout_;
    std::size_t out_bytes_ = 1;
    std::vector<std::byte> unit_;
    std::vector<std::uint32_t> words_;
};

}  // namespace

Result<std::unique_ptr<PixelDecoder>> make_tiff_decoder(const std::string& path, const ImageHeader& header) {
    auto file = std::make_unique<TiffFile>(path, "rm");
    if (!file->valid())
        return Error{ErrorCode::input, fmt::format("{}: not a readable TIFF ({})", path, file->messages())};
    const PlainTiff& plain = *header.plain_tiff;
    if (plain.directory != 0 && TIFFSetSubDirectory(file->get(), plain.directory) != 1)
        return Error{ErrorCode::input, fmt::format("{}: its mask cannot be read ({})", path, file->messages())};
    if (plain.ycbcr_jpeg) TIFFSetField(file->get(), TIFFTAG_JPEGCOLORMODE, JPEGCOLORMODE_RGB);
    return std::unique_ptr<PixelDecoder>(std::make_unique<TiffDecoder>(std::move(file), header));
}

}  // namespace scree
