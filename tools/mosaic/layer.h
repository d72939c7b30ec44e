// Layers: the files of a mosaic that share one native grid, joined before anything is resampled (docs/inputs.md).
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/result.h"
#include "tools/source/crs.h"
#include "tools/source/georeference.h"
#include "tools/source/image_source.h"

namespace scree {

/// Heights above one vertical reference that are to stand above another (VerticalCrs::parse).
struct DatumChange {
    std::string from, to;
    LonLatBox area;  ///< of all heights: what the operation is chosen for
};

/// A file whose header has been read and whose place is known. Longitudes are within 180 degrees of the mosaic's first
/// file's middle.
struct PlacedFile {
    std::string path;
    ImageInfo info;
    Georeference where;
    Crs crs;
    std::optional<DatumChange> datum_change = std::nullopt;  ///< of heights
};

struct LayerMember {
    std::size_t file = 0;              ///< index of the PlacedFile
    std::int64_t column = 0, row = 0;  ///< the file's first sample in the layer's grid
};

struct Layer {
    Georeference where;  ///< of sample (0, 0) of the layer's grid
    Crs crs;
    std::int64_t columns = 0, rows = 0;
    bool half_sample_rim = false;      ///< every member's samples stand for areas: values reach half a sample out
    std::vector<LayerMember> members;  ///< bottom to top
};

/// In the files' order, bottom to top. Errors: ErrorCode::input where a grid would pass 2^40 samples a side.
Result<std::vector<Layer>> group_layers(const std::vector<PlacedFile>& files);

/// Where the corners, the edges and the inside of a raster lie in `to`: the box of a 17 x 17 sample grid (clear of
/// points without an image). Errors: ErrorCode::input, naming the file, where no point has an image.
struct PlaneBox {
    double west = 0, south = 0, east = 0, north = 0;
};
Result<PlaneBox> box_of(const PlacedFile& file, const Crs& to);

/// ErrorCode::input where a file that is opened again is not what it was.
Result<void> check_unchanged(const PlacedFile& file, const ImageInfo& now);

/// Brings the file's longitudes within 180 degrees of `longitude`; nothing for a projected CRS.
void turn_towards(double longitude, PlacedFile& file);

}  // namespace scree
