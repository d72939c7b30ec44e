// Makes a landscape to try things on: DIR/dem.tif and DIR/ortho.tif, of any size, the same bytes for the same options
// whatever the number of threads. See landscape.h for the ground itself.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <string>

#include "common/result.h"

namespace scree {

struct SynthOptions {
    std::string directory;     ///< is made when it does not exist
    std::int64_t size = 4097;  ///< samples a side, 3..2^20; time and bytes grow with its square
    double spacing_m = 10;     ///< smaller: a closer look at less of the same landscape
    std::uint64_t seed = 1;    ///< another seed, another landscape
    int imagery_scale = 4;     ///< ortho pixels per cell side, 0..64; 0 writes no ortho; bytes grow with its square
    int threads = 0;           ///< 0: all cores; each holds about 4 MiB
    bool force = false;        ///< replace what stands under the final names
    const std::atomic<bool>* stop = nullptr;  ///< polled; set: partial files are removed, ErrorCode::interrupted
};

struct SynthReport {
    std::string dem_path;
    std::string ortho_path;         ///< empty when none was asked for
    std::int64_t dem_samples = 0;   ///< a side
    std::int64_t ortho_pixels = 0;  ///< a side
    double lowest_m = 0;
    double highest_m = 0;
    std::int64_t bytes = 0;  ///< of pixel data in both files
    double dem_seconds = 0;
    double ortho_seconds = 0;
};

struct SynthProgress {
    const char* phase = "";        ///< "dem" or "ortho"
    std::int64_t pixels_done = 0;  ///< samples and ortho pixels together
    std::int64_t pixels_total = 0;
};

/// Called a few times a second at most, by one thread at a time (not always the same). May be empty.
using ProgressSink = std::function<void(const SynthProgress&)>;

/// Errors: usage (an option out of range, or an output that exists without force), io (no space, write failed),
/// interrupted. The files appear under their final names whole, both or (on a failure) neither.
Result<SynthReport> synthesize(const SynthOptions& options, ProgressSink progress);

}  // namespace scree
