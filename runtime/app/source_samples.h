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

/// One DEM. Sample (column, row) stands at x = x0 + column * dx, y = y0 - row * dy, in metres of its CRS.
struct SourceRaster {
    std::string name;  ///< of the file, without folders
    double x0 = 0, y0 = 0, dx = 1, dy = 1;
    std::int64_t columns = 0, rows = 0;

    /// Height in metres; NaN for a void. The sample must exist: 0 <= column < columns, 0 <= row < rows.
    double at(std::int64_t column, std::int64_t row) const;

    std::span<const std::byte> samples;  ///< columns * rows, row-major; lives as long as the SourceSamples
    std::size_t sample_bytes = 4;        ///< 4: float, 8: double
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

    const std::vector<SourceRaster>& rasters() const { return rasters_; }

private:
    SourceSamples() = default;
    std::shared_ptr<const std::byte> mapping_;
    std::vector<SourceRaster> rasters_;
};

/// How the sources are to be read: as they were for the build.
struct SamplingOptions {
    std::optional<double> spacing_m;  ///< for files without georeference
    double height_scale = 1;          ///< z = value * scale + offset
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
