// BuildPlan: everything decided before the first pixel is read: lattice, levels, memory and disk.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "common/dataset.h"
#include "common/result.h"
#include "tools/source/height_source.h"

namespace scree {

inline constexpr std::int64_t kMinMemoryBytes = std::int64_t{192} << 20;

struct BuildOptions : HeightReading {
    std::string dem;
    std::optional<std::string> imagery;
    std::string out;
    std::optional<double> height_quantum_m;
    int tile_size = 33;
    int texture_size = 256;
    int threads = 0;                                      ///< 0: all cores
    std::int64_t memory_bytes = std::int64_t{256} << 20;  ///< ceiling of the process's resident memory
    std::string attribution;
    bool force = false;
    bool quiet = false;
};

struct BuildPlan {
    std::unique_ptr<ImageSource> dem;
    std::unique_ptr<ImageSource> imagery;   ///< or null
    Georeference imagery_where;             ///< resolved, in the dataset's CRS
    Dataset dataset;                        ///< lattice, CRS, texture depth; heights still unknown
    std::int64_t memory_bytes = 0;          ///< estimate of the peak
    std::int64_t temporary_bytes = 0;       ///< disk, during the build
    std::int64_t store_bytes_estimate = 0;  ///< an upper figure
};

/// Errors: ErrorCode::input for a source that cannot be used as it is (geographic, rotated, not square, no common
/// place), ErrorCode::usage for options that make no sense together or a memory ceiling below what the widths need.
Result<BuildPlan> plan_build(const BuildOptions& options);

}  // namespace scree
