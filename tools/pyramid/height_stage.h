// The height pyramid of a planned build: sources to lattice, voids, quantum, tiles.
#pragma once

#include <atomic>
#include <cstdint>
#include <string>
#include <vector>

#include "common/progress.h"
#include "common/result.h"
#include "tools/pyramid/build_plan.h"
#include "tools/pyramid/height_index.h"
#include "tools/pyramid/tile_writer.h"

namespace scree {

struct HeightStageResult {
    Dataset dataset;  ///< the plan's, heights known, textures not
    double warp_rms_m = 0;
    std::int64_t filled_samples = 0;
    std::vector<std::string> warnings;  ///< what the user should look into
    std::vector<std::string> notes;     ///< what was done that may surprise
};

/// Puts every height tile into `writer` and notes it in `index`. Polls `stop`: ErrorCode::interrupted.
Result<HeightStageResult> build_heights(const BuildPlan& plan, const BuildOptions& options, TileWriter& writer,
                                        HeightIndex& index, Progress& progress, const std::atomic<bool>& stop);

}  // namespace scree
