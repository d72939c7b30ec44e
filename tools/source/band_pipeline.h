// Bands of rows made by several threads and written in order by whichever thread made them: memory is one band a
// thread, and what is written does not depend on how many threads there were.
#pragma once

#include <cstdint>
#include <functional>

#include "common/result.h"

namespace scree {

struct BandPipeline {
    std::int64_t bands = 0;
    int threads = 1;
    /// Called on `threads` threads with the thread's index (0..threads-1) and its next band.
    std::function<Result<void>(int thread, std::int64_t band)> make;
    /// Called for bands 0, 1, 2... one at a time, on the thread that made the band.
    std::function<Result<void>(int thread, std::int64_t band)> write;
};

/// Runs until all bands are written or one call fails; returns the first failure. An exception out of either call
/// (memory) becomes ErrorCode::io.
Result<void> run_bands(const BandPipeline& pipeline);

}  // namespace scree
