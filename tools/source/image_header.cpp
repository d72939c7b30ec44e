// Sources: TIFF 6.0; PNG (W3C) 11.2.2; JPEG ITU-T T.81 annex B; JPEG 2000 ITU-T T.800 annexes A and I.
#include "tools/source/image_header.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string_view>
#include <vector>

#include <Imath/half.h>
#include <fmt/format.h>
#include <tiffio.h>

#include "tools/source/gdal_metadata.h"
#include "tools/source/number_text.h"
#include "tools/source/raster_formats.h"
#include "tools/source/tiff_file.h"

namespace scree {
namespace {

constexpr std::int64_t kMaxSide = std::int64_t{1} << 30;  // the lattice has no more cells a side
constexpr int kMaxChannels = 1024;
constexpr std::uint32_t kGdalMetadataTag = 42112;
constexpr std::uint32_t kGdalNodataTag = 42113;
constexpr int kMaxDirectories = 256;  // of a TIFF, searched for a mask; more are pages of something else

Error unusable(const std::string& path, const std::string& what) {
    return {ErrorCode::input, fmt::format("{}: {}", path, what)};
}

std::uint32_t big_endian(const unsigned char* bytes, int count) {
    std::uint32_t value = 0;
    for (int i = 0; i < count; ++i) value = value << 8 | bytes[i];
    return value;
}

Result<void> check_sides(const std::string& path, std::int64_t width, std::int64_t height) {
    if (width <= 0 || height <= 0)
        return unusable(path,
                        fmt::format("the header says {} x {} samples, so there is nothing to read", width, height));
    if (width > kMaxSide || height > kMaxSide)
        return unusable(path, fmt::format("the header says {} x {} samples; more than {} a side cannot be used", width,
                                          height, kMaxSide));
    return {};
}

std::optional<SampleType> whole_byte_type(int bits, int format) {
    switch (bits) {
        case 8:
            return format == SAMPLEFORMAT_INT ? SampleType::i8 : SampleType::u8;
        case 16:
            return format == SAMPLEFORMAT_IEEEFP ? SampleType::f16
                   : format == SAMPLEFORMAT_INT  ? SampleType::i16
                                                 : SampleType::u16;
        case 32:
            return format == SAMPLEFORMAT_IEEEFP ? SampleType::f32
                   : format == SAMPLEFORMAT_INT  ? SampleType::i32
                                                 : SampleType::u32;
        case 64:
            return format == SAMPLEFORMAT_IEEEFP ? SampleType::f64
                   : format == SAMPLEFORMAT_INT  ? SampleType::i64
                                                 : SampleType::u64;
        default:
            return std::nullopt;
    }
}

// The smallest type that holds integers of odd widths.
SampleType type_holding(int bits, bool is_signed) {
    if (bits <= 8) return is_signed ? SampleType::i8 : SampleType::u8;
    if (bits <= 16) return is_signed ? SampleType::i16 : SampleType::u16;
    return is_signed ? SampleType::i32 : SampleType::u32;
}

struct TiffLayout {
    std::uint16_t bits = 1;
    std::uint16_t samples = 1;
    std::uint16_t format = SAMPLEFORMAT_UINT;
    std::uint16_t photometric = PHOTOMETRIC_MINISBLACK;
    std::uint16_t compression = COMPRESSION_NONE;
    std::uint16_t planes = PLANARCONFIG_CONTIG;
    std::uint16_t ink_set = INKSET_CMYK;
    std::uint32_t depth = 1;
    std::uint32_t tile_width = 0;
};

TiffLayout tiff_layout(TIFF* file) {
    TiffLayout layout;
    TIFFGetFieldDefaulted(file, TIFFTAG_BITSPERSAMPLE, &layout.bits);
    TIFFGetFieldDefaulted(file, TIFFTAG_SAMPLESPERPIXEL, &layout.samples);
    TIFFGetFieldDefaulted(file, TIFFTAG_SAMPLEFORMAT, &layout.format);
    TIFFGetField(file, TIFFTAG_PHOTOMETRIC, &layout.photometric);
    TIFFGetFieldDefaulted(file, TIFFTAG_COMPRESSION, &layout.compression);
    TIFFGetFieldDefaulted(file, TIFFTAG_PLANARCONFIG, &layout.planes);
    TIFFGetFieldDefaulted(file, TIFFTAG_INKSET, &layout.ink_set);
    TIFFGetFieldDefaulted(file, TIFFTAG_IMAGEDEPTH, &layout.depth);
    if (TIFFIsTiled(file) != 0) TIFFGetField(file, TIFFTAG_TILEWIDTH, &layout.tile_width);
    return layout;
}

Result<void> check_tiff_samples(const std::string& path, const TiffLayout& layout) {
    if (layout.depth > 1)
        return unusable(path, fmt::format("it is a volume of {} slices; only flat images are read", layout.depth));
    if (layout.format == SAMPLEFORMAT_COMPLEXIEEEFP || layout.format == SAMPLEFORMAT_COMPLEXINT)
        return unusable(path, "its samples are complex numbers, which are neither heights nor colours");
    const int bits = layout.bits;
    const bool is_float = layout.format == SAMPLEFORMAT_IEEEFP;
    if (is_float ? bits != 16 && bits != 32 && bits != 64 : bits == 0 || (bits > 32 && bits != 64))
        return unusable(
            path,
            fmt::format(
                "its samples are {}-bit {}; integers of 1 to 32 and 64 bits and floats of 16, 32 and 64 bits are read",
                bits, is_float ? "floats" : "integers"));
    if (layout.samples == 0 || layout.samples > kMaxChannels)
        return unusable(path,
                        fmt::format("its header says {} channels; 1 to {} can be read", layout.samples, kMaxChannels));
    return {};
}

Result<void> read_tiff_palette(const std::string& path, TIFF* file, const TiffLayout& layout, ImageHeader& header) {
    std::uint16_t* channels[3] = {};
    if (layout.bits > 16 || layout.format == SAMPLEFORMAT_INT || layout.format == SAMPLEFORMAT_IEEEFP)
        return unusable(path, fmt::format("its samples of {} bits cannot be indices of a palette", layout.bits));
    if (TIFFGetField(file, TIFFTAG_COLORMAP, &channels[0], &channels[1], &channels[2]) != 1)
        return unusable(path, "it needs a palette but has none, so its colours are unknown");
    const std::size_t count = std::size_t{1} << layout.bits;
    // Some writers stored 8-bit entries where the format means 16-bit ones.
    bool narrow = true;
    for (const std::uint16_t* channel : channels)
        narrow = narrow && std::all_of(channel, channel + count, [](std::uint16_t v) { return v < 256; });
    header.model = ColourModel::palette;
    header.palette.assign(count, {0, 0, 0, 255});
    for (std::size_t i = 0; i < count; ++i)
        for (std::size_t c = 0; c < 3; ++c)
            header.palette[i][c] = static_cast<std::uint8_t>(narrow ? channels[c][i] : channels[c][i] >> 8);
    header.values_are_colours = true;
    return {};
}

// Sets what the channels mean; false in rgba_by_libtiff means that the samples are taken as they are stored.
Result<void> read_tiff_colours(const std::string& path, TIFF* file, const TiffLayout& layout, ImageHeader& header) {
    PlainTiff& plain = *header.plain_tiff;
    switch (layout.photometric) {
        case PHOTOMETRIC_MINISWHITE:
            header.min_is_white = true;
            return {};
        case PHOTOMETRIC_MINISBLACK:
        case PHOTOMETRIC_RGB:
        case PHOTOMETRIC_MASK:
            return {};
        case PHOTOMETRIC_PALETTE:
            return read_tiff_palette(path, file, layout, header);
        case PHOTOMETRIC_SEPARATED:
            if (layout.ink_set != INKSET_CMYK || layout.samples < 4)
                return unusable(path, fmt::format("its colours are {} inks other than CMYK; convert it to RGB first",
                                                  layout.samples));
            header.model = ColourModel::cmyk;
            header.values_are_colours = true;
            return {};
        case PHOTOMETRIC_YCBCR:
        case PHOTOMETRIC_CIELAB: {
            header.values_are_colours = true;
            if (layout.photometric == PHOTOMETRIC_YCBCR && layout.compression == COMPRESSION_JPEG && layout.bits == 8 &&
                layout.samples == 3 && layout.planes == PLANARCONFIG_CONTIG) {
                plain.ycbcr_jpeg = true;
                return {};
            }
            char reason[1024] = {};
            if (layout.bits != 8 || TIFFRGBAImageOK(file, reason) == 0)
                return unusable(path, fmt::format("its colours of photometric {} and {} bits cannot be made RGB ({}); "
                                                  "convert it to RGB or grey first",
                                                  layout.photometric, layout.bits,
                                                  reason[0] != 0 ? reason : "only 8-bit ones can"));
            plain.rgba_by_libtiff = true;
            plain.separate_planes = false;
            plain.type = SampleType::u8;
            plain.channels = 4;
            return {};
        }
        default:
            return unusable(path, fmt::format("its colours are of photometric {}, which is not read (grey, RGB, "
                                              "palette, CMYK, YCbCr and CIE Lab are); convert it to RGB or grey first",
                                              layout.photometric));
    }
}

void read_tiff_alpha(TIFF* file, int samples, ImageHeader& header) {
    std::uint16_t count = 0;
    std::uint16_t* extra = nullptr;
    if (TIFFGetField(file, TIFFTAG_EXTRASAMPLES, &count, &extra) == 1) {
        for (int i = std::max(0, count - samples); i < count && header.alpha_channel < 0; ++i) {
            if (extra[i] != EXTRASAMPLE_ASSOCALPHA && extra[i] != EXTRASAMPLE_UNASSALPHA) continue;
            header.alpha_channel = samples - count + i;
            header.associated_alpha = extra[i] == EXTRASAMPLE_ASSOCALPHA;
        }
    }
    if (header.plain_tiff->rgba_by_libtiff) {
        header.associated_alpha = header.alpha_channel >= 0;  // libtiff multiplies by either kind
        header.alpha_channel = 3;
    }
}

Result<void> read_tiff_layout(const std::string& path, TIFF* file, ImageHeader& header) {
    const TiffLayout layout = tiff_layout(file);
    if (Result<void> checked = check_tiff_samples(path, layout); !checked) return checked;
    const std::optional<SampleType> whole = whole_byte_type(layout.bits, layout.format);
    PlainTiff plain;
    plain.type = whole ? *whole : type_holding(layout.bits, layout.format == SAMPLEFORMAT_INT);
    plain.bits = layout.bits;
    plain.channels = layout.samples;
    plain.separate_planes = layout.planes == PLANARCONFIG_SEPARATE && layout.samples > 1;
    plain.tile_width = layout.tile_width;
    header.plain_tiff = plain;
    if (!whole) header.significant_bits = layout.bits;
    if (Result<void> colours = read_tiff_colours(path, file, layout, header); !colours) return colours;
    read_tiff_alpha(file, layout.samples, header);
    return {};
}

Result<void> read_tiff_directory(const std::string& path, TIFF* file, ImageHeader& header) {
    std::uint32_t width = 0;
    std::uint32_t height = 0;
    TIFFGetField(file, TIFFTAG_IMAGEWIDTH, &width);
    TIFFGetField(file, TIFFTAG_IMAGELENGTH, &height);
    header.width = width;
    header.height = height;
    if (Result<void> checked = check_sides(path, width, height); !checked) return checked;

    if (TIFFIsTiled(file) != 0) {
        std::uint32_t tile_width = 0;
        std::uint32_t tile_height = 0;
        TIFFGetField(file, TIFFTAG_TILEWIDTH, &tile_width);
        TIFFGetField(file, TIFFTAG_TILELENGTH, &tile_height);
        if (tile_width == 0 || tile_height == 0 || tile_width > kMaxSide || tile_height > kMaxSide)
            return unusable(path, fmt::format("the header says tiles of {} x {} samples, which cannot be read",
                                              tile_width, tile_height));
        header.rows_per_strip = tile_height;
    } else {
        std::uint32_t rows = 0;
        TIFFGetFieldDefaulted(file, TIFFTAG_ROWSPERSTRIP, &rows);
        if (rows == 0) return unusable(path, "the header says strips of 0 rows, which cannot be read");
        header.rows_per_strip = std::min<std::int64_t>(rows, height);
    }
    return read_tiff_layout(path, file, header);
}

void read_gdal_tags(TIFF* file, ImageHeader& header) {
    if (const std::string nodata = text_tag(file, kGdalNodataTag); !nodata.empty()) header.nodata = nodata;
    const GdalBandMetadata band = parse_gdal_metadata(text_tag(file, kGdalMetadataTag));
    header.value_scale = band.scale;
    header.value_offset = band.offset;
}

Result<void> read_tiff_header(const std::string& path, ImageHeader& header) {
    TiffFile tiff(path, "rm");
    if (!tiff.valid()) return unusable(path, fmt::format("not a readable TIFF ({})", tiff.messages()));
    read_gdal_tags(tiff.get(), header);
    return read_tiff_directory(path, tiff.get(), header);
}

bool is_mask_of(TIFF* file, const ImageHeader& image) {
    std::uint32_t kind = 0;
    std::uint32_t width = 0;
    std::uint32_t height = 0;
    std::uint16_t samples = 1;
    std::uint16_t bits = 1;
    TIFFGetField(file, TIFFTAG_SUBFILETYPE, &kind);
    TIFFGetField(file, TIFFTAG_IMAGEWIDTH, &width);
    TIFFGetField(file, TIFFTAG_IMAGELENGTH, &height);
    TIFFGetFieldDefaulted(file, TIFFTAG_SAMPLESPERPIXEL, &samples);
    TIFFGetFieldDefaulted(file, TIFFTAG_BITSPERSAMPLE, &bits);
    // With the bit of reduced images it masks an overview.
    return (kind & FILETYPE_MASK) != 0 && (kind & FILETYPE_REDUCEDIMAGE) == 0 && width == image.width &&
           height == image.height && (bits == 1 || bits == 8) &&
           (samples == 1 || samples == image.plain_tiff->channels);
}

Result<void> read_png_header(const std::string& path, std::string_view start, ImageHeader& header) {
    // Signature 8, chunk length 4, "IHDR" 4, width 4, height 4, depth, colour, compression, filter, interlace.
    if (start.size() < 29 || start.substr(12, 4) != "IHDR") return unusable(path, "the PNG ends within its header");
    const auto* bytes = reinterpret_cast<const unsigned char*>(start.data());
    header.width = big_endian(bytes + 16, 4);
    header.height = big_endian(bytes + 20, 4);
    header.rows_per_strip = bytes[28] != 0 ? header.height : 1;
    const int depth = bytes[24];
    const int colour_type = bytes[25];
    header.values_are_colours = colour_type == 3;
    if (colour_type == 0 && depth < 8) header.spread_bits = depth;
    return check_sides(path, header.width, header.height);
}

// After the start-of-scan marker entropy-coded bytes hold 0xFF only as FF 00 or a marker, so FF D9 is the true end.
bool jpeg_has_end(std::istream& file) {
    std::vector<char> block(1 << 16);
    bool after_ff = false;
    while (file) {
        file.read(block.data(), static_cast<std::streamsize>(block.size()));
        const char* at = block.data();
        const char* end = at + file.gcount();
        while (at != end) {
            if (after_ff && static_cast<unsigned char>(*at) == 0xD9) return true;
            at = std::find(at, end, '\xFF');
            after_ff = at != end;
            if (at != end) ++at;
        }
    }
    return false;
}

Result<void> read_jpeg_header(const std::string& path, ImageHeader& header) {
    std::ifstream file(path, std::ios::binary);
    file.seekg(2);
    std::array<unsigned char, 8> bytes{};
    const auto read = [&](std::size_t count) {
        return static_cast<bool>(file.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(count)));
    };
    bool adobe = false;
    int components = 0;
    while (read(2)) {
        if (bytes[0] != 0xFF)
            return unusable(path, fmt::format("found byte {:#04x} where the JPEG needs a marker", bytes[0]));
        while (bytes[1] == 0xFF && file.read(reinterpret_cast<char*>(&bytes[1]), 1)) {
        }
        const unsigned marker = bytes[1];
        if (marker == 0x01 || (marker >= 0xD0 && marker <= 0xD8)) continue;
        if (!read(2)) break;
        const std::uint32_t length = big_endian(bytes.data(), 2);
        if (length < 2) return unusable(path, fmt::format("JPEG marker {:#04x} claims a length of {}", marker, length));
        if (marker == 0xDA) {
            if (header.width == 0) break;
            if (components == 4 && !adobe)
                return unusable(path,
                                "it has four components but no Adobe marker that says what they mean; convert it "
                                "to RGB or grey first");
            file.seekg(length - 2, std::ios::cur);
            if (!jpeg_has_end(file))
                return unusable(path, "the JPEG is cut off: its end marker is missing, so rows are lost");
            return check_sides(path, header.width, header.height);
        }
        const bool frame = marker >= 0xC0 && marker <= 0xCF && marker != 0xC4 && marker != 0xC8 && marker != 0xCC;
        std::uint32_t skip = length - 2;
        if (frame) {
            if (length < 8 || !read(6)) break;
            skip -= 6;
            header.height = big_endian(bytes.data() + 1, 2);
            header.width = big_endian(bytes.data() + 3, 2);
            components = bytes[5];
            header.values_are_colours = components != 1;
            header.rows_per_strip = marker == 0xC0 || marker == 0xC1 ? 1 : header.height;
        }
        if (marker == 0xEE && skip >= 5) {
            if (!read(5)) break;
            skip -= 5;
            // The marker stands for inks stored inverted, which is how the decoder takes them.
            adobe = adobe || std::memcmp(bytes.data(), "Adobe", 5) == 0;
        }
        file.seekg(skip, std::ios::cur);
    }
    return unusable(path, "the JPEG ends within its header");
}

Result<void> read_jpeg2000_header(const std::string& path, ImageHeader& header) {
    // Both the ihdr box of a .jp2 and the SIZ segment of a bare codestream stand near the start.
    std::vector<char> start(1 << 16);
    std::ifstream file(path, std::ios::binary);
    file.read(start.data(), static_cast<std::streamsize>(start.size()));
    const std::string_view text(start.data(), static_cast<std::size_t>(file.gcount()));
    const std::size_t siz = text.find(std::string_view("\xFF\x4F\xFF\x51", 4));
    if (siz == std::string_view::npos || text.size() - siz < 45)
        return unusable(path, "the JPEG 2000 file has no codestream header in its first 64 KiB");
    const auto* bytes = reinterpret_cast<const unsigned char*>(text.data()) + siz;
    header.width = std::int64_t{big_endian(bytes + 8, 4)} - big_endian(bytes + 16, 4);
    header.height = std::int64_t{big_endian(bytes + 12, 4)} - big_endian(bytes + 20, 4);
    header.rows_per_strip = header.height;
    // Ssiz of every component: its sign in the highest bit, its depth less 1 in the others.
    const std::uint32_t components = big_endian(bytes + 40, 2);
    for (std::size_t c = 0; c < components && siz + 42 + 3 * c < text.size(); ++c) {
        const unsigned depth = bytes[42 + 3 * c];
        if ((depth & 0x80) != 0)
            return unusable(path, "its samples are signed, which its decoder misreads; store it as a GeoTIFF");
        if (depth != bytes[42])
            return unusable(path, "its bands differ in depth, which its decoder mixes up; store it as a GeoTIFF");
    }
    const int bits = (bytes[42] & 0x7F) + 1;
    if (bits > 16)
        return unusable(path,
                        fmt::format("its samples are {}-bit integers; of JPEG 2000 up to 16 bits are read", bits));
    header.spread_bits = bits % 8 == 0 ? 0 : bits;
    return check_sides(path, header.width, header.height);
}

Result<void> read_bmp_header(const std::string& path, std::string_view start, ImageHeader& header) {
    const auto* bytes = reinterpret_cast<const unsigned char*>(start.data());
    if (start.size() < 34) return unusable(path, "the BMP ends within its header");
    const bool has_compression = bytes[14] >= 40;  // the first field of the second header is its size
    const unsigned compression = has_compression ? bytes[30] : 0u;
    if (compression == 1 || compression == 2)
        return unusable(path, "its pixels are run-length encoded, which its decoder misreads; store it uncompressed");
    header.values_are_colours = bytes[has_compression ? 28 : 24] <= 8;  // bits a pixel: indices of a palette
    return {};
}

template <class T>
std::optional<double> as_integer(double value) {
    // Both limits are exact or rounded up in double; the strict comparison with max + 1 keeps the cast defined.
    if (!(value >= static_cast<double>(std::numeric_limits<T>::min()))) return std::nullopt;
    if (!(value < static_cast<double>(std::numeric_limits<T>::max() / 2 + 1) * 2)) return std::nullopt;
    if (value != std::floor(value)) return std::nullopt;
    return value;
}

double as_float(double value) {
    if (!std::isfinite(value)) return value;
    // Writers put the lowest double for "the lowest value": in a float32 image its pixels are the lowest float.
    constexpr double kMax = std::numeric_limits<float>::max();
    return static_cast<float>(std::clamp(value, -kMax, kMax));
}

}  // namespace

const char* reader_name(ImageKind kind) { return image_format(kind).reader; }

Result<ImageHeader> read_image_header(const std::string& path) {
    std::error_code problem;
    const std::filesystem::file_type type = std::filesystem::status(path, problem).type();
    if (type == std::filesystem::file_type::not_found)
        return unusable(path, "no such file, so there is nothing to read");
    if (type == std::filesystem::file_type::none)
        return unusable(path, fmt::format("cannot be reached ({})", problem.message()));
    if (type == std::filesystem::file_type::directory) return unusable(path, "a folder, not an image");
    if (type != std::filesystem::file_type::regular)
        return unusable(path, "not a regular file, so it cannot be read as an image");
    std::ifstream file(path, std::ios::binary);
    if (!file) return unusable(path, "cannot be opened for reading");
    std::string start(kSniffBytes, '\0');
    file.read(start.data(), static_cast<std::streamsize>(start.size()));
    start.resize(static_cast<std::size_t>(file.gcount()));
    if (start.empty()) return unusable(path, "the file is empty, so there is nothing to read");

    const ImageFormat* format = image_format_of(path, start);
    if (format == nullptr)
        return unusable(path, fmt::format("not an image of a known kind ({}) nor a DEM of one ({})",
                                          image_format_names(), grid_format_names()));
    ImageHeader header;
    header.kind = format->kind;
    Result<void> read;
    switch (format->kind) {
        case ImageKind::tiff:
            read = read_tiff_header(path, header);
            break;
        case ImageKind::png:
            read = read_png_header(path, start, header);
            break;
        case ImageKind::jpeg:
            read = read_jpeg_header(path, header);
            break;
        case ImageKind::jpeg2000:
            read = read_jpeg2000_header(path, header);
            break;
        case ImageKind::openexr:
            header.associated_alpha = true;
            break;  // by definition of the format
        case ImageKind::pnm:
        case ImageKind::webp:
        case ImageKind::targa:
            header.rows_per_strip = std::numeric_limits<std::int64_t>::max();
            break;  // whole frame
        case ImageKind::bmp:
            read = read_bmp_header(path, start, header);
            break;
        case ImageKind::hdr:
            break;
    }
    if (!read) return read.error();
    return header;
}

Result<std::optional<ImageHeader>> read_mask_header(const std::string& path, const ImageHeader& image) {
    std::optional<ImageHeader> none;
    if (image.kind != ImageKind::tiff) return none;
    // Offsets of strips are not wanted here: a large file's overviews have many.
    TiffFile tiff(path, "rmD");
    if (!tiff.valid()) return none;
    // A damaged later directory ends the search: the image itself has been checked.
    for (int i = 1; i < kMaxDirectories && TIFFReadDirectory(tiff.get()) == 1; ++i) {
        if (!is_mask_of(tiff.get(), image)) continue;
        ImageHeader mask;
        mask.kind = ImageKind::tiff;
        if (Result<void> read = read_tiff_directory(path, tiff.get(), mask); !read) return read.error();
        mask.plain_tiff->directory = TIFFCurrentDirOffset(tiff.get());
        return std::optional(std::move(mask));
    }
    return none;
}

std::optional<double> nodata_as(SampleType type, const std::string& text) {
    // What one C library printed for infinities.
    if (text.find("1.#INF") != std::string::npos)
        return nodata_as(type,
                         (text.find('-') != std::string::npos ? -1 : 1) * std::numeric_limits<double>::infinity());
    const std::optional<double> value = parse_number(text);
    return value ? nodata_as(type, *value) : std::nullopt;
}

std::optional<double> nodata_as(SampleType type, double value) {
    switch (type) {
        case SampleType::u8:
            return as_integer<std::uint8_t>(value);
        case SampleType::i8:
            return as_integer<std::int8_t>(value);
        case SampleType::u16:
            return as_integer<std::uint16_t>(value);
        case SampleType::i16:
            return as_integer<std::int16_t>(value);
        case SampleType::u32:
            return as_integer<std::uint32_t>(value);
        case SampleType::i32:
            return as_integer<std::int32_t>(value);
        case SampleType::u64:
            return as_integer<std::uint64_t>(value);
        case SampleType::i64:
            return as_integer<std::int64_t>(value);
        case SampleType::f16:
            return static_cast<double>(static_cast<float>(half(static_cast<float>(as_float(value)))));
        case SampleType::f32:
            return as_float(value);
        case SampleType::f64:
            return value;
    }
    return std::nullopt;
}

}  // namespace scree
