// scree update: sources laid over a finished store (docs/resume-and-update.md, "Update").
#pragma once

#include <atomic>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/result.h"

namespace scree {

struct UpdateOptions {
    std::string store;
    std::vector<std::string> dems, images;  ///< files and folders, over what is there
    std::vector<std::string> remove;        ///< file names as the store lists them
    std::vector<std::string> sources;       ///< folders where the store's own sources are looked for
    std::optional<std::string> attribution;
    int threads = 0;
    std::int64_t memory_bytes = std::int64_t{256} << 20;
    bool quiet = false;
};

struct UpdateReport {
    double seconds = 0, cpu_seconds = 0;
    std::int64_t peak_rss_bytes = 0;
    std::int64_t height_tiles_written = 0, texture_tiles_written = 0, tiles_removed = 0;
    std::int64_t districts = 0, districts_built = 0;
    std::vector<std::string> warnings;
};

/// The store is the old one until it is the new one, in one transaction; readers go on. Errors: ErrorCode::input for a
/// source that is not found; ErrorCode::usage where every tile would change (another lattice, depth or CRS) or the
/// store does not know its options.
Result<UpdateReport> update_store(const UpdateOptions& options, const std::atomic<bool>& stop);

}  // namespace scree
