// What the first bytes of an image file claim, read with our own bounds-checked code before any decoder sees the file:
// decoders allocate by the header, and some abort where they cannot.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "common/result.h"
#include "tools/source/image_source.h"

namespace scree {

enum class ImageKind { tiff, png, jpeg, jpeg2000, openexr, bmp, pnm, webp, targa, hdr };

/// A TIFF whose samples are stored as they are meant: grey or RGB, whole bytes.
struct PlainTiff {
    SampleType type = SampleType::u8;
    int channels = 1;
    bool separate_planes = false;
    std::int64_t tile_width = 0;  ///< 0: strips
};

struct ImageHeader {
    ImageKind kind = ImageKind::tiff;
    /// Zero where only the decoder can tell (formats whose decoder allocates no more than a row on opening).
    std::int64_t width = 0;
    std::int64_t height = 0;
    std::int64_t rows_per_strip = 1;   ///< rows that are decoded together; height when only the whole frame can be
    int significant_bits = 0;          ///< bits a sample holds in the file when fewer than its type has, else 0
    bool inverted_by_decoder = false;  ///< 8-bit samples come as 255 - what the file holds: white is zero there
    std::optional<PlainTiff> plain_tiff;
    int alpha_channel = -1;             ///< TIFF only: from ExtraSamples
    bool associated_alpha = false;      ///< colours are stored multiplied by alpha
    std::optional<std::string> nodata;  ///< text of the GDAL_NODATA tag
};

/// The name OpenImageIO gives the reader of this kind.
const char* reader_name(ImageKind kind);

/// Errors (ErrorCode::input): missing or empty file, unknown kind, sides of zero or above 2^30, a sample layout that is
/// refused (CMYK, Lab, complex, volumes), a JPEG cut off before its end.
Result<ImageHeader> read_image_header(const std::string& path);

/// The tag's value as a pixel of that type would hold it; nullopt when no pixel can (a fraction or a value out of range
/// in an integer image) or when the text is no number.
std::optional<double> nodata_as(SampleType type, const std::string& text);

}  // namespace scree
