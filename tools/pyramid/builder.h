// The build: heights, then textures, into one file that gets its final name only when it is complete
// (docs/architecture.md, "The builder"; docs/resume-and-update.md).
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <string>
#include <vector>

#include "common/result.h"
#include "tools/pyramid/build_plan.h"
#include "tools/stage_clock.h"

namespace scree {

struct BuildReport {
    double seconds = 0;
    double cpu_seconds = 0;
    std::int64_t peak_rss_bytes = 0;
    double source_megapixels = 0;
    double warp_error_m = 0, warp_rms_m = 0;  ///< what resampling cost (warp_error.h); 0: heights were copied
    std::int64_t height_tiles = 0;
    std::int64_t texture_tiles = 0;
    std::int64_t store_bytes = 0;
    std::int64_t reused_tiles = 0;                ///< of a build that was cut off
    std::array<double, kStages> stage_seconds{};  ///< CPU, by Stage; decode with the decoders' processes
    std::int64_t filled_samples = 0;              ///< of interior voids
    std::vector<std::string> warnings;            ///< what the user should look into
    std::vector<std::string> notes;               ///< what was done that may surprise
};

/// Checks the disk and that OUT may be written; prints what will be needed unless quiet.
Result<void> announce_build(const BuildPlan& plan, const BuildOptions& options);

/// Goes on with OUT.partial where there is one of the same build. Polls `stop` (Ctrl-C): ErrorCode::interrupted; what
/// has been committed stays in OUT.partial. Errors: ErrorCode::usage for the partial file of another build.
Result<BuildReport> build_store(BuildPlan plan, const BuildOptions& options, const std::atomic<bool>& stop);

}  // namespace scree
