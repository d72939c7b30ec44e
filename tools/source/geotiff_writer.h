// Writes a raster as a GeoTIFF, block by block: tiles of 256 x 256, deflate with a predictor, BigTIFF where it may pass
// 4 GB. Source: OGC 19-008r4 (GeoTIFF 1.1), TIFF 6.0; the nodata tag (42113) is GDAL's.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "common/result.h"
#include "tools/source/crs.h"
#include "tools/source/image_source.h"

namespace scree {

class TiffFile;

struct GeotiffLayout {
    std::int64_t width = 0;   ///< samples a row
    std::int64_t height = 0;  ///< rows
    SampleType type = SampleType::f32;
    int channels = 1;  ///< 1: heights; 4: red, green, blue, unassociated alpha
    /// Samples are points and (x, y) is the first one; else they are areas and (x, y) is the north-west corner.
    bool point = true;
    double x = 0, y = 0;            ///< in units of the CRS
    double step_x = 1, step_y = 1;  ///< from column to column and from row to row, both > 0
    std::optional<Crs> crs;
    std::string vertical;          ///< "EPSG:n" of what the heights, in metres, are above; or empty
    std::optional<double> nodata;  ///< exact in `type`
};

/// What the keys of a CRS without an EPSG code cannot say: the text of a .prj file; empty where they say it.
std::string geotiff_sidecar(const Crs& crs);

/// One thread per object. Memory: a block, and 16 bytes a block of the raster.
class GeotiffWriter {
public:
    static constexpr std::int64_t kBlock = 256;  ///< samples a side

    /// Replaces `path`. Errors: ErrorCode::usage for sides or a number of blocks that are too large, ErrorCode::io.
    static Result<std::unique_ptr<GeotiffWriter>> create(const std::string& path, const GeotiffLayout& layout);
    ~GeotiffWriter();

    std::size_t block_bytes() const;
    /// Block (column, row), counted from the north-west: kBlock rows of kBlock samples, whole also where the raster
    /// ends within. Its bytes may change. Errors: ErrorCode::io.
    Result<void> write_block(std::int64_t column, std::int64_t row, std::span<std::uint8_t> samples);
    /// The file is complete only after this. Errors: ErrorCode::io.
    Result<void> finish();

private:
    GeotiffWriter(std::string path, const GeotiffLayout& layout, std::unique_ptr<TiffFile> file);
    Error failure() const;

    std::string path_;
    std::int64_t width_, height_;
    std::size_t pixel_bytes_;
    std::unique_ptr<TiffFile> file_;
};

}  // namespace scree
