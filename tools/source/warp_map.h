// Where the points of a square north-up grid fall in another raster: CRS transform and affine placement in one, by
// interpolation with a bound. Work goes by fixed chunks of the grid, so the answer for a point does not depend on who
// asks for what; immutable after make(), every call may come from any thread.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "common/result.h"
#include "tools/source/crs.h"
#include "tools/source/georeference.h"

namespace scree {

/// Point (i, j) stands at x = x_m + i * step_m, y = y_m - j * step_m.
struct TargetGrid {
    double x_m = 0, y_m = 0;
    double step_m = 1;
};

/// Greatest distance in source samples between the interpolated and PROJ's own position.
inline constexpr double kWarpBoundSamples = 1.0 / 64;

struct SourcePoints {
    std::span<double> column, row;  ///< fractional sample coordinates (0, 0 = centre of the first sample); NaN: nowhere
};

/// What make() may be told besides.
struct WarpOptions {
    /// The source's size. Longitudes are brought to within half a turn of its middle; without a size (0) to within
    /// the turn that begins at the first column, so that points west of the raster seem far to its east.
    std::int64_t source_columns = 0, source_rows = 0;
    const LonLatBox* area = nullptr;  ///< for CrsTransform::make; read by make() alone
};

class WarpMap {
public:
    /// Points per chunk side; chunks begin at multiples of it.
    static constexpr std::int64_t kChunk = 64;

    /// Errors: CrsTransform::make's, and ErrorCode::input for a grid or a placement without extent.
    static Result<WarpMap> make(const TargetGrid& grid, const Crs& grid_crs, const Georeference& source,
                                const Crs& source_crs, const WarpOptions& options = {});

    /// The points [i0, i0 + columns) x [j0, j0 + rows), row-major. Exact (to rounding) where no transform is needed;
    /// and then column depends on i alone and row on j alone if the source is axis-aligned. Requests of whole chunks
    /// cost least: a part of a chunk takes nearly as many transforms.
    void map(std::int64_t i0, std::int64_t j0, std::int64_t columns, std::int64_t rows, SourcePoints out) const;

    /// A box that holds what map() gives for these points, but for rounding in the last digits; none where all are
    /// nowhere. Costs a fraction of map().
    struct Bounds {
        double west, east, north, south;  ///< columns and rows
    };
    std::optional<Bounds> bounds(std::int64_t i0, std::int64_t j0, std::int64_t columns, std::int64_t rows) const;

    /// Source samples from one grid point to the next around (i, j), along the source's columns and rows: above 1 the
    /// grid shrinks the source. 1 where the point or its neighbours have no image.
    struct Shrink {
        double columns = 1, rows = 1;
    };
    Shrink shrink_at(std::int64_t i, std::int64_t j) const;

    bool exact() const;  ///< no CRS transform: an affine map

    WarpMap(WarpMap&&) noexcept;
    WarpMap& operator=(WarpMap&&) noexcept;
    ~WarpMap();

private:
    struct Impl;
    explicit WarpMap(std::unique_ptr<Impl> impl);
    std::unique_ptr<Impl> impl_;
};

}  // namespace scree
