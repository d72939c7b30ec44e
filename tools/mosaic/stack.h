// The layers of a mosaic, one over the other, as values on the points of a square north-up grid.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/result.h"
#include "tools/mosaic/layer.h"
#include "tools/mosaic/raster_spool.h"
#include "tools/source/height_source.h"
#include "tools/source/resample.h"

namespace scree {

struct StackOptions {
    Kernel kernel = Kernel::bilinear;
    OpenOptions open;
    HeightReading heights;  ///< of a height stack
    std::string temporary;  ///< what the names of temporary files begin with
    /// Of the pixels that may wait in a temporary file so many wait in memory. 16384 pixels that lean by 2 degrees
    /// against the grid are 43 MB for a band of 64 rows; with less they are written and read again. Of image stacks.
    std::int64_t spool_memory_bytes = std::int64_t{128} << 20;
};

/// What a long reading calls now and then with the samples read since the last call; false stops it
/// (ErrorCode::interrupted).
using ReadProgress = std::function<bool(std::int64_t samples)>;

/// Bytes of temporary disk that reading these layers may take.
std::int64_t height_stack_bytes(const std::vector<PlacedFile>& files);
/// Where everything is read at once; ImageStack::temporary_bytes where it is not.
std::int64_t image_stack_bytes(const std::vector<PlacedFile>& files);

class HeightGrid;

struct HeightRange {
    double low = std::numeric_limits<double>::infinity(), high = -std::numeric_limits<double>::infinity();
    void include(const HeightRange& other) {
        low = std::min(low, other.low);
        high = std::max(high, other.high);
    }
};

/// Heights in metres: value * scale + offset as HeightReading and the file say; or the files' raw values.
class HeightStack {
public:
    /// Decodes every file once. `raw_values`: hands out file values as they are. Errors: those of the files.
    static Result<std::unique_ptr<HeightStack>> read(const std::vector<PlacedFile>& files, std::vector<Layer> layers,
                                                     bool raw_values, const StackOptions& options,
                                                     const ReadProgress& progress);
    ~HeightStack();

    /// The heights on the points of a grid. The stack must outlive it. `reach`: the part of a step that a point stands
    /// for, over which finer samples are averaged; less than 1 where the points are picked out of a finer grid.
    Result<std::unique_ptr<HeightGrid>> on(const TargetGrid& grid, const Crs& grid_crs, double reach = 1) const;

    /// Of all values in the files, whether hidden or not; widened by cubic resampling's overshoot.
    HeightRange range() const;
    /// What the files hold that looks like undeclared nodata, one sentence a file.
    const std::vector<std::string>& warnings() const;
    std::size_t layer_count() const;
    const Layer& layer(std::size_t k) const;
    /// Samples of a layer as they are after its files were laid over one another: [column, column + columns) x ...,
    /// row-major; NaN: void, -infinity: no file, also outside the layer. Any thread.
    Result<void> samples(std::size_t k, std::int64_t column, std::int64_t row, std::int64_t columns, std::int64_t rows,
                         std::span<double> out) const;
    /// The blocks of RasterSpool::kBlock samples a side of a layer that hold anything, by rows.
    struct Block {
        std::int64_t column = 0, row = 0;  ///< first sample
    };
    std::vector<Block> blocks(std::size_t k) const;

    struct Impl;

private:
    explicit HeightStack(std::unique_ptr<Impl> impl);
    std::unique_ptr<Impl> impl_;
};

class HeightGrid {
public:
    ~HeightGrid();
    /// Points (i + c * stride, j + r * stride), c < columns, r < rows, row-major: the topmost layer's value; NaN: a
    /// void of the files; -infinity: no file reaches here. Any thread. A point's value does not depend on the
    /// rectangle.
    Result<void> sample(std::int64_t i, std::int64_t j, std::int64_t columns, std::int64_t rows, std::int64_t stride,
                        std::span<double> out) const;

    struct Impl;

private:
    friend class HeightStack;
    explicit HeightGrid(std::unique_ptr<Impl> impl);
    std::unique_ptr<Impl> impl_;
};

/// Colours as RGBA (R lowest byte): the topmost layer's pixel with alpha >= 128, opaque; 0 where there is none. What a
/// point gets depends on the files and the grid alone, not on what is asked for and when.
///
/// North-up files in the grid's CRS wait in memory, whole rows of them (as many as are prepared and not released);
/// others, those that are shrunk much, and layers of very many files side by side wait in a temporary file.
class ImageStack {
public:
    /// Opens nothing yet: files are decoded as points of the grid are asked for.
    static Result<std::unique_ptr<ImageStack>> open(const std::vector<PlacedFile>& files, std::vector<Layer> layers,
                                                    const TargetGrid& grid, const Crs& grid_crs,
                                                    const StackOptions& options);
    /// The same, with everything decoded, on disk.
    static Result<std::unique_ptr<ImageStack>> read(const std::vector<PlacedFile>& files, std::vector<Layer> layers,
                                                    const TargetGrid& grid, const Crs& grid_crs,
                                                    const StackOptions& options, const ReadProgress& progress);
    ~ImageStack();

    /// Makes the points [i, i + columns) x [j, j + rows) ready, until they are released: decodes what they need and is
    /// not there yet. One thread at a time, no sample() meanwhile. Cheapest in bands across the grid from north to
    /// south. Errors: those of the files, ErrorCode::io, ErrorCode::interrupted (what is there stays).
    Result<void> prepare(std::int64_t i, std::int64_t j, std::int64_t columns, std::int64_t rows,
                         const ReadProgress& progress);
    /// Nothing in rows north of j will be asked for again: what only they needed may go. Alone, as prepare().
    void release_north_of(std::int64_t j);
    /// Points that are prepared, in rows `pitch` apart. True: all are opaque; false: nobody has looked. Any thread.
    /// Errors: ErrorCode::io.
    Result<bool> sample(std::int64_t i, std::int64_t j, std::int64_t columns, std::int64_t rows, std::uint32_t* out,
                        std::int64_t pitch) const;
    /// Rows that are best prepared at a time.
    std::int64_t rows_at_once() const;

    /// Memory that bands of 64 grid rows take, each prepared when the one before it is released: pixels that wait and
    /// decoders' bands, without what sample() takes on each thread. Files are decoded in their whole width, however
    /// wide the bands are.
    static std::int64_t bytes_needed(const std::vector<PlacedFile>& files, const std::vector<Layer>& layers,
                                     const TargetGrid& grid, const Crs& grid_crs, std::int64_t points_wide);
    /// Temporary disk at most.
    static std::int64_t temporary_bytes(const std::vector<PlacedFile>& files, const std::vector<Layer>& layers,
                                        const TargetGrid& grid, const Crs& grid_crs);
    /// Temporary disk that it takes now.
    std::int64_t temporary_bytes_taken() const;

private:
    struct Impl;
    explicit ImageStack(std::unique_ptr<Impl> impl);
    std::unique_ptr<Impl> impl_;
};

/// A layer whose samples are grid points, each at a whole number of steps: it is copied, not resampled.
bool on_grid(const Layer& layer, const TargetGrid& grid, const Crs& grid_crs);

}  // namespace scree
