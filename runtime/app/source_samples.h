// The samples of the DEMs that a store was built from, to judge the store by: read from the files themselves by
// `scree samples`, because this program links no image library (docs/measuring.md, "Judging a store by its sources").
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/result.h"

namespace scree {

/// A place in metres of the dataset's CRS; NaN, both: nowhere in it.
struct SourcePoint {
    double x = 0, y = 0;
};

/// One layer: the samples of files on one grid after they were laid over one another, in any CRS and attitude. Where
/// samples stand is given at control points, every `step` columns and rows and on the last ones; bilinear between.
struct SourceLayer {
    std::vector<std::string> names;  ///< of its files, bottom to top, without folders
    std::int64_t columns = 0, rows = 0;
    std::int64_t step = 1;

    /// Height in metres, times `exaggeration`; NaN where the sample is no truth: a void, uncovered, or hidden by a
    /// layer above. The sample must exist: 0 <= column < columns, 0 <= row < rows.
    double at(std::int64_t column, std::int64_t row) const;
    /// The sample has a height or lies under one: there is terrain.
    bool covered(std::int64_t column, std::int64_t row) const;
    SourcePoint position(double column, double row) const;

    std::int64_t control_columns() const { return (columns - 2) / step + 2; }
    std::int64_t control_rows() const { return (rows - 2) / step + 2; }
    /// Sample column of a control column, sample row of a control row.
    std::int64_t control_column(std::int64_t k) const { return k + 1 < control_columns() ? k * step : columns - 1; }
    std::int64_t control_row(std::int64_t k) const { return k + 1 < control_rows() ? k * step : rows - 1; }
    SourcePoint control(std::int64_t control_column, std::int64_t control_row) const;

    double exaggeration = 1;              ///< of the store that is judged
    std::span<const std::byte> samples;   ///< columns * rows, row-major; lives as long as the SourceSamples
    std::size_t sample_bytes = 4;         ///< 4: float, 8: double
    std::span<const std::byte> controls;  ///< x and y, doubles, row-major; lives as long as the SourceSamples

private:
    double stored(std::int64_t column, std::int64_t row) const;
};

/// A mapped file of samples: what is looked at costs memory that the system takes back as it likes. Any number of
/// threads may read.
class SourceSamples {
public:
    /// Errors: ErrorCode::io when the file cannot be read, ErrorCode::input, naming the value, when it is not whole and
    /// sound. Nothing may shorten the file while it is mapped.
    static Result<SourceSamples> open(const std::string& path);
    /// The same for an open file, which may be closed afterwards; `name` is for messages.
    static Result<SourceSamples> map(int descriptor, const std::string& name);

    /// Bottom to top.
    const std::vector<SourceLayer>& layers() const { return layers_; }
    /// Their heights so many times as high.
    void exaggerate(double factor) {
        for (SourceLayer& layer : layers_) layer.exaggeration = factor;
    }

private:
    SourceSamples() = default;
    std::shared_ptr<const std::byte> mapping_;
    std::vector<SourceLayer> layers_;
};

/// How the sources are to be read: as they were for the build.
struct SamplingOptions {
    std::string crs;                        ///< the dataset's; empty: metres of the files' own
    std::optional<std::string> assume_crs;  ///< of files that name none
    std::string vertical_crs;               ///< the dataset's; empty: of the files' own
    bool assume_same_datum = false;
    std::optional<double> spacing_m;     ///< for files without georeference
    std::optional<double> height_scale;  ///< z = value * scale + offset; none: as the files say
    double height_offset_m = 0;
    std::optional<double> nodata;             ///< besides the files' own
    const std::atomic<bool>* stop = nullptr;  ///< ends the child, too, when it becomes true
    std::string program;                      ///< empty: `scree` in this program's folder, else on PATH
};

/// Runs `scree samples` into a temporary file without a name (in $TMPDIR or /tmp) and maps it; the child's messages go
/// to standard error. Errors: the child's own exit code where it is one of ours, ErrorCode::io where the program cannot
/// be run or was killed, ErrorCode::interrupted after `stop`.
Result<SourceSamples> sample_sources(const std::vector<std::string>& sources, const SamplingOptions& options = {});

}  // namespace scree
