// What resampling cost: how far the samples of the sources are from the finest stored surface at their places
// (docs/inputs.md, "Errors stated"). Rounding to the height quantum is in it.
#pragma once

#include <atomic>
#include <cstdint>

#include "common/result.h"
#include "tools/mosaic/mosaic_plan.h"
#include "tools/mosaic/stack.h"
#include "tools/pyramid/deep_branch.h"
#include "tools/pyramid/deep_tree.h"
#include "tools/pyramid/height_quantizer.h"
#include "tools/pyramid/height_spool.h"

namespace scree {

struct WarpErrorJob {
    const HeightStack& stack;
    bool raw_values;           ///< the stack hands out file values: the quantizer knows their metres
    const HeightSpool& spool;  ///< complete
    const MosaicPlan& plan;
    HeightQuantizer quantizer;
    const DeepTree* tree = nullptr;     ///< where finer layers go on below the spool; with `deep` or neither
    const DeepHeights* deep = nullptr;  ///< their heights
    const std::atomic<bool>* stop = nullptr;
};

struct WarpError {
    double greatest_m = 0, rms_m = 0;
    std::int64_t samples = 0;  ///< that lie over present cells and under no other layer
};

/// Over the samples of all layers that are not hidden by a layer above and lie over present cells. In parallel; the
/// result does not depend on the threads. Memory: some 8 MiB a thread. Errors: ErrorCode::io, ErrorCode::interrupted.
Result<WarpError> measure_warp_error(const WarpErrorJob& job);

}  // namespace scree
