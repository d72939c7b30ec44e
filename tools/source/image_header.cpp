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

#include "tools/source/number_text.h"
#include "tools/source/tiff_file.h"

namespace scree {
namespace {

constexpr std::int64_t kMaxSide = std::int64_t{1} << 30;  // the lattice has no more cells a side
constexpr int kMaxChannels = 1024;
constexpr std::uint32_t kGdalNodataTag = 42113;
constexpr std::size_t kSniffBytes = 64;

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

Result<void> check_tiff_layout(const std::string& path, TIFF* file, ImageHeader& header) {
    std::uint16_t bits = 1;
    std::uint16_t samples = 1;
    std::uint16_t format = SAMPLEFORMAT_UINT;
    std::uint16_t photometric = PHOTOMETRIC_MINISBLACK;
    std::uint16_t compression = COMPRESSION_NONE;
    std::uint32_t depth = 1;
    TIFFGetFieldDefaulted(file, TIFFTAG_BITSPERSAMPLE, &bits);
    TIFFGetFieldDefaulted(file, TIFFTAG_SAMPLESPERPIXEL, &samples);
    TIFFGetFieldDefaulted(file, TIFFTAG_SAMPLEFORMAT, &format);
    TIFFGetField(file, TIFFTAG_PHOTOMETRIC, &photometric);
    TIFFGetFieldDefaulted(file, TIFFTAG_COMPRESSION, &compression);
    TIFFGetFieldDefaulted(file, TIFFTAG_IMAGEDEPTH, &depth);

    if (depth > 1) return unusable(path, fmt::format("it is a volume of {} slices; only flat images are read", depth));
    if (format == SAMPLEFORMAT_COMPLEXIEEEFP || format == SAMPLEFORMAT_COMPLEXINT)
        return unusable(path, "its samples are complex numbers, which are neither heights nor colours");
    const bool is_float = format == SAMPLEFORMAT_IEEEFP;
    if (is_float ? bits != 16 && bits != 32 && bits != 64 : bits == 0 || (bits > 32 && bits != 64))
        return unusable(
            path,
            fmt::format(
                "its samples are {}-bit {}; integers of 1 to 32 and 64 bits and floats of 16, 32 and 64 bits are read",
                bits, is_float ? "floats" : "integers"));
    if (photometric == PHOTOMETRIC_SEPARATED || photometric == PHOTOMETRIC_CIELAB ||
        photometric == PHOTOMETRIC_ICCLAB || photometric == PHOTOMETRIC_ITULAB || photometric == PHOTOMETRIC_LOGL ||
        photometric == PHOTOMETRIC_LOGLUV)
        return unusable(path, fmt::format("its colours are {} (photometric {}); convert it to RGB or grey first",
                                          photometric == PHOTOMETRIC_SEPARATED ? "CMYK" : "Lab or Luv", photometric));
    if (samples == 0 || samples > kMaxChannels)
        return unusable(path, fmt::format("its header says {} channels; 1 to {} can be read", samples, kMaxChannels));
    const std::optional<SampleType> type = whole_byte_type(bits, format);
    if (type && (photometric == PHOTOMETRIC_MINISBLACK || photometric == PHOTOMETRIC_RGB)) {
        std::uint16_t planes = PLANARCONFIG_CONTIG;
        std::uint32_t tile_width = 0;
        TIFFGetFieldDefaulted(file, TIFFTAG_PLANARCONFIG, &planes);
        if (TIFFIsTiled(file) != 0) TIFFGetField(file, TIFFTAG_TILEWIDTH, &tile_width);
        header.plain_tiff = PlainTiff{*type, samples, planes == PLANARCONFIG_SEPARATE && samples > 1, tile_width};
    } else if (bits == 64 && !is_float) {
        return unusable(
            path, fmt::format("its samples are 64-bit integers of photometric {}; only grey and RGB ones are read",
                              photometric));
    } else if (!type && photometric != PHOTOMETRIC_PALETTE) {
        header.significant_bits = bits;
    }
    header.inverted_by_decoder =
        !header.plain_tiff && photometric == PHOTOMETRIC_MINISWHITE && bits <= 8 && format == SAMPLEFORMAT_UINT;

    std::uint16_t extra_count = 0;
    std::uint16_t* extra = nullptr;
    if (TIFFGetField(file, TIFFTAG_EXTRASAMPLES, &extra_count, &extra) == 1) {
        for (int i = 0; i < extra_count && header.alpha_channel < 0; ++i) {
            if (extra[i] != EXTRASAMPLE_ASSOCALPHA && extra[i] != EXTRASAMPLE_UNASSALPHA) continue;
            header.alpha_channel = samples - extra_count + i;
            header.associated_alpha = extra[i] == EXTRASAMPLE_ASSOCALPHA;
        }
    }
    // Such colours are decoded by libtiff's whole-image RGBA interface.
    if (photometric == PHOTOMETRIC_YCBCR && compression != COMPRESSION_JPEG) header.rows_per_strip = header.height;
    return {};
}

Result<void> read_tiff_header(const std::string& path, ImageHeader& header) {
    TiffFile tiff(path, "rm");
    if (!tiff.valid()) return unusable(path, fmt::format("not a readable TIFF ({})", tiff.messages()));
    TIFF* file = tiff.get();
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

    if (const TIFFField* field = TIFFFindField(file, kGdalNodataTag, TIFF_ASCII)) {
        const char* text = nullptr;
        if (TIFFFieldPassCount(field) != 0) {
            std::uint32_t count = 0;
            if (TIFFGetField(file, kGdalNodataTag, &count, &text) == 1 && text != nullptr)
                header.nodata = std::string(text, count);
        } else if (TIFFGetField(file, kGdalNodataTag, &text) == 1 && text != nullptr) {
            header.nodata = text;
        }
    }
    return check_tiff_layout(path, file, header);
}

Result<void> read_png_header(const std::string& path, std::string_view start, ImageHeader& header) {
    // Signature 8, chunk length 4, "IHDR" 4, width 4, height 4, depth, colour, compression, filter, interlace.
    if (start.size() < 29 || start.substr(12, 4) != "IHDR") return unusable(path, "the PNG ends within its header");
    const auto* bytes = reinterpret_cast<const unsigned char*>(start.data());
    header.width = big_endian(bytes + 16, 4);
    header.height = big_endian(bytes + 20, 4);
    header.rows_per_strip = bytes[28] != 0 ? header.height : 1;
    const int bits = bytes[24];
    const bool grey = bytes[25] == 0 || bytes[25] == 4;
    if (grey && bits < 8) header.significant_bits = bits;
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
            if (bytes[5] == 4) return unusable(path, "its colours are CMYK; convert it to RGB or grey first");
            header.rows_per_strip = marker == 0xC0 || marker == 0xC1 ? 1 : header.height;
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
    if (siz == std::string_view::npos || text.size() - siz < 24)
        return unusable(path, "the JPEG 2000 file has no codestream header in its first 64 KiB");
    const auto* bytes = reinterpret_cast<const unsigned char*>(text.data()) + siz;
    header.width = std::int64_t{big_endian(bytes + 8, 4)} - big_endian(bytes + 16, 4);
    header.height = std::int64_t{big_endian(bytes + 12, 4)} - big_endian(bytes + 20, 4);
    header.rows_per_strip = header.height;
    // Of the first component: bit depth - 1, and whether it is signed.
    if (text.size() - siz < 43) return unusable(path, "the JPEG 2000 file ends within its codestream header");
    const int bits = (bytes[42] & 0x7F) + 1;
    if ((bytes[42] & 0x80) != 0)
        return unusable(path,
                        fmt::format("its samples are signed {}-bit integers, which are not read from JPEG 2000", bits));
    if (bits > 16)
        return unusable(path,
                        fmt::format("its samples are {}-bit integers; of JPEG 2000 up to 16 bits are read", bits));
    if (bits != 8 && bits != 16) header.significant_bits = bits;
    return check_sides(path, header.width, header.height);
}

std::optional<ImageKind> kind_of(std::string_view start, const std::string& path) {
    const auto begins = [&](std::string_view magic) { return start.substr(0, magic.size()) == magic; };
    if (looks_like_tiff(path)) return ImageKind::tiff;
    if (begins("\x89PNG\r\n\x1a\n")) return ImageKind::png;
    if (begins("\xFF\xD8\xFF")) return ImageKind::jpeg;
    if (begins("\xFF\x4F\xFF\x51") || begins(std::string_view("\0\0\0\x0CjP  \r\n\x87\n", 12)))
        return ImageKind::jpeg2000;
    if (begins("\x76\x2f\x31\x01")) return ImageKind::openexr;
    if (begins("BM")) return ImageKind::bmp;
    if (begins("RIFF") && start.size() >= 12 && start.substr(8, 4) == "WEBP") return ImageKind::webp;
    if (begins("#?RADIANCE") || begins("#?RGBE")) return ImageKind::hdr;
    if (start.size() >= 3 && start[0] == 'P' && std::string_view("123456Ff").find(start[1]) != std::string_view::npos &&
        std::isspace(static_cast<unsigned char>(start[2])) != 0)
        return ImageKind::pnm;
    std::string extension = std::filesystem::path(path).extension().string();
    for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    if (extension == ".tga") return ImageKind::targa;  // the one format without a signature
    return std::nullopt;
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

const char* reader_name(ImageKind kind) {
    switch (kind) {
        case ImageKind::tiff:
            return "tiff";
        case ImageKind::png:
            return "png";
        case ImageKind::jpeg:
            return "jpeg";
        case ImageKind::jpeg2000:
            return "jpeg2000";
        case ImageKind::openexr:
            return "openexr";
        case ImageKind::bmp:
            return "bmp";
        case ImageKind::pnm:
            return "pnm";
        case ImageKind::webp:
            return "webp";
        case ImageKind::targa:
            return "targa";
        case ImageKind::hdr:
            return "hdr";
    }
    return "";
}

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

    const std::optional<ImageKind> kind = kind_of(start, path);
    if (!kind) {
        return unusable(
            path, "not an image of a known kind (TIFF, PNG, JPEG, JPEG 2000, OpenEXR, BMP, PNM, WebP, Targa, HDR)");
    }
    ImageHeader header;
    header.kind = *kind;
    Result<void> read;
    switch (*kind) {
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
        case ImageKind::hdr:
            break;
    }
    if (!read) return read.error();
    return header;
}

std::optional<double> nodata_as(SampleType type, const std::string& text) {
    const std::optional<double> value = parse_number(text);
    if (!value) return std::nullopt;
    switch (type) {
        case SampleType::u8:
            return as_integer<std::uint8_t>(*value);
        case SampleType::i8:
            return as_integer<std::int8_t>(*value);
        case SampleType::u16:
            return as_integer<std::uint16_t>(*value);
        case SampleType::i16:
            return as_integer<std::int16_t>(*value);
        case SampleType::u32:
            return as_integer<std::uint32_t>(*value);
        case SampleType::i32:
            return as_integer<std::int32_t>(*value);
        case SampleType::u64:
            return as_integer<std::uint64_t>(*value);
        case SampleType::i64:
            return as_integer<std::int64_t>(*value);
        case SampleType::f16:
            return static_cast<double>(static_cast<float>(half(static_cast<float>(as_float(*value)))));
        case SampleType::f32:
            return as_float(*value);
        case SampleType::f64:
            return *value;
    }
    return std::nullopt;
}

}  // namespace scree
