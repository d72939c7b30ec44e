// One opened raster file, read in bands of rows. Pixels come from OpenImageIO (plain TIFFs: from
// libtiff itself, see tiff_decoder.cpp; DEM formats: our own readers, see grid_file.h), georeference from GeoTIFF keys
// (libgeotiff), the format's own header or a world file, and a .prj file. Memory held is one band of the file's own
// storage unit (a strip group, or one row of tiles). Not thread-safe: one reader thread per object.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "common/result.h"
#include "tools/source/colour_reading.h"
#include "tools/source/georeference.h"

namespace scree {

enum class SampleType { u8, i8, u16, i16, u32, i32, u64, i64, f16, f32, f64 };

bool is_integer(SampleType type);
/// True where every value of the type is exact in float32 (8 and 16 bit integers, half, float).
bool fits_float32(SampleType type);

struct ImageInfo {
    std::int64_t width = 0;   ///< samples a row
    std::int64_t height = 0;  ///< rows
    int channels = 0;
    int alpha_channel = -1;  ///< index, or -1
    SampleType type = SampleType::u8;
    bool tiled = false;
    std::optional<double> nodata;     ///< GDAL_NODATA tag, already cast to the pixel type
    std::int64_t unit_bytes = 0;      ///< decoded bytes of the largest unit that must be held at once
    std::int64_t unit_rows = 1;       ///< rows decoded together: a band that starts at a multiple of it costs least
    bool values_are_colours = false;  ///< palette, CMYK, YCbCr, Lab: read_channel refuses
    bool eight_bit = true;            ///< what is shown has 8 bits or fewer as it is stored
    bool opaque = false;              ///< read_rgba8 gives alpha 255 everywhere: no alpha, mask, nodata nor NaN
    int shown_bands = 1;              ///< 1 (grey) or 3: what read_shown gives a pixel
    /// What samples stand for: value * value_scale + value_offset, in Georeference::height_unit_m where that is said
    /// (GDAL's SCALE and OFFSET). read_channel and nodata are of the samples as they are stored.
    double value_scale = 1, value_offset = 0;
};

struct OpenOptions {
    std::int64_t max_unit_bytes =
        INT64_MAX;            ///< a strip, row of tiles or frame above this is refused, naming the size needed
    ColourReading colours{};  ///< for read_rgba8
    int height_band = 1;      ///< 1-based, for read_channel
};

class ImageSource {
public:
    /// Opens and checks the header; pixels are not touched. Errors: ErrorCode::input, naming file, value, consequence.
    static Result<std::unique_ptr<ImageSource>> open(const std::string& path, const OpenOptions& options = {});
    virtual ~ImageSource() = default;

    virtual const ImageInfo& info() const = 0;
    /// Absent when the file carries none. A file whose georeference cannot be used (rotated, non-square...) still
    /// opens: the facts are in Georeference and the caller decides.
    virtual const std::optional<Georeference>& georeference() const = 0;

    /// Rows [row_begin, row_end) of the height band, row-major into out ((row_end-row_begin)*width values), as they are
    /// stored; NaN where the file's alpha is 0 or its mask says that there is nothing. No nodata handling.
    /// Error where the samples are colours (a palette's indices...). Reading forward is cheap; going back may decode
    /// again.
    virtual Result<void> read_channel(std::int64_t row_begin, std::int64_t row_end, std::span<float> out) = 0;
    virtual Result<void> read_channel(std::int64_t row_begin, std::int64_t row_end, std::span<double> out) = 0;
    /// Rows as 8-bit RGBA by ColourReading (colour_reading.h). Grey is replicated; without a stretch 16-bit integers
    /// and floats are scaled to 0..255 by the type's range, float 0..1. Colours come out unassociated. Alpha is the
    /// file's (255 without any), and 0 where mask, nodata or NaN say that there is nothing.
    virtual Result<void> read_rgba8(std::int64_t row_begin, std::int64_t row_end, std::span<std::uint8_t> out) = 0;
    /// Rows of the shown bands before any stretch, info().shown_bands values a pixel, all NaN where it is transparent.
    /// For choose_stretch, so not of eight_bit images; sources that are made for something else need not have it.
    virtual Result<void> read_shown(std::int64_t row_begin, std::int64_t row_end, std::span<float> out);
};

}  // namespace scree
