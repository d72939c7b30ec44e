// What exports of heights and of imagery do alike: which part of the lattice, and a GeoTIFF that is whole or absent.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "common/store/sqlite_store.h"
#include "tools/source/geotiff_writer.h"

namespace scree {

/// Metres in the dataset's CRS.
struct ExportBox {
    double x_min = 0, y_min = 0, x_max = 0, y_max = 0;
};

struct RasterExport {
    std::string out;
    std::optional<ExportBox> box;             ///< none: the dataset's extent
    std::optional<int> level;                 ///< none: the finest
    std::optional<std::pair<int, int>> size;  ///< heights only: so many samples over the box, along its edges too
    bool force = false;
    bool quiet = false;
};

struct RasterReport {
    GeotiffLayout layout;
    int level = 0;
    std::int64_t absent = 0;  ///< samples without heights, transparent texels
    std::string sidecar;      ///< the .prj file, or empty
    std::int64_t bytes = 0;
};

ExportBox whole_extent(const Lattice& lattice);

/// Writes options.out. `fill` makes block (columns and rows from `column`, `row` on, those beyond the raster left as
/// they are) and returns how many of its samples are absent. Errors: ErrorCode::usage for a file that exists,
/// ErrorCode::interrupted, ErrorCode::io, those of `fill`.
using FillBlock = std::function<Result<std::int64_t>(std::int64_t column, std::int64_t row, std::int64_t columns,
                                                     std::int64_t rows, std::span<std::uint8_t> samples)>;
Result<RasterReport> write_raster(const RasterExport& options, const GeotiffLayout& layout, const FillBlock& fill);

/// Heights of the finest surface. Errors: ErrorCode::usage for a level or box that the store has nothing of, those of
/// the store and of write_raster.
Result<RasterReport> export_heights(const SqliteStore& store, const RasterExport& options);
/// The texels of a texture level; a coarser one stands for several where no finer is stored. Errors as above.
Result<RasterReport> export_imagery(const SqliteStore& store, const RasterExport& options);

}  // namespace scree
