// What the first bytes of an image file claim, read with our own bounds-checked code before any decoder sees the file:
// decoders allocate by the header, and some abort where they cannot.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/result.h"
#include "tools/source/image_source.h"

namespace scree {

enum class ImageKind { tiff, png, jpeg, jpeg2000, openexr, bmp, pnm, webp, targa, hdr };

/// How the samples of one directory of a TIFF are stored.
struct PlainTiff {
    SampleType type = SampleType::u8;  ///< in memory; the smallest that holds `bits`
    int bits = 8;                      ///< a sample in the file
    int channels = 1;
    bool separate_planes = false;
    bool ycbcr_jpeg = false;       ///< the JPEG decoder makes RGB of it
    bool rgba_by_libtiff = false;  ///< other YCbCr and CIE Lab: libtiff makes 8-bit RGBA of it, `channels` is 4
    std::int64_t tile_width = 0;   ///< 0: strips
    std::uint64_t directory = 0;   ///< offset of the directory in the file; 0: the first
};

/// What the channels before alpha are. CMYK: 0 is no ink; no colour profile is applied.
enum class ColourModel { grey_or_rgb, palette, cmyk };

struct ImageHeader {
    ImageKind kind = ImageKind::tiff;
    /// Zero where only the decoder can tell (formats whose decoder allocates no more than a row on opening).
    std::int64_t width = 0;
    std::int64_t height = 0;
    std::int64_t rows_per_strip = 1;  ///< rows that are decoded together; height when only the whole frame can be
    bool interlaced = false;          ///< PNG only
    /// Bits a sample has when fewer than its type, else 0. TIFF: samples are handed out as they are, 0..2^bits - 1.
    int significant_bits = 0;
    /// The same for PNG and JPEG 2000, whose decoder spreads them over the type's range: the upper bits are the file's.
    int spread_bits = 0;
    std::optional<PlainTiff> plain_tiff;  ///< every TIFF that is read
    ColourModel model = ColourModel::grey_or_rgb;
    std::vector<std::array<std::uint8_t, 4>> palette;  ///< RGBA of every index, where model is palette
    bool values_are_colours = false;                   ///< no heights: palettes, CMYK, YCbCr, Lab
    bool min_is_white = false;                         ///< grey only
    int alpha_channel = -1;                            ///< TIFF only: from ExtraSamples
    bool associated_alpha = false;                     ///< colours are stored multiplied by alpha
    std::optional<std::string> nodata;                 ///< text of the GDAL_NODATA tag
    double value_scale = 1, value_offset = 0;          ///< of GDAL_METADATA, see ImageInfo
};

/// The name OpenImageIO gives the reader of this kind.
const char* reader_name(ImageKind kind);

/// Errors (ErrorCode::input): missing or empty file, unknown kind, sides of zero or above 2^30, a sample layout that is
/// refused (complex, volumes, signed JPEG 2000, BMP of runs, LogLuv, inks other than CMYK, colour filter mosaics), a
/// JPEG cut off before its end.
Result<ImageHeader> read_image_header(const std::string& path);

/// The transparency mask of a TIFF's first image (NewSubfileType 4, same size, one sample for all channels or one for
/// each): a header that make_tiff_decoder takes. nullopt: none. Sample 0 means that the image says nothing there.
Result<std::optional<ImageHeader>> read_mask_header(const std::string& path, const ImageHeader& image);

/// The tag's value as a pixel of that type would hold it; nullopt when no pixel can (a fraction or a value out of range
/// in an integer image) or when the text is no number.
std::optional<double> nodata_as(SampleType type, const std::string& text);
std::optional<double> nodata_as(SampleType type, double value);

}  // namespace scree
