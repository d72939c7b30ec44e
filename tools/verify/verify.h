// Reads a whole store and checks everything it promises (docs/store-format.md, "What a reader must check"): the file,
// its rows, the tree, every sample that two tiles share, every certified error, every height range, every transparent
// texel. Errors are recomputed from the finest data with exact integers by code that the builder does not share.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "common/result.h"
#include "tools/verify/geo_check.h"

namespace scree {

struct VerifyOptions {
    std::function<void(double fraction)>
        progress;                             ///< called on the caller's thread, 0..1, never falling; may be empty
    const std::atomic<bool>* stop = nullptr;  ///< set: verify_store returns ErrorCode::interrupted soon
};

struct VerifyReport {
    std::int64_t tiles_checked = 0;  ///< height and texture tiles that were read and decoded
    std::int64_t shared_samples_compared = 0;
    std::int64_t shared_samples_differing = 0;
    std::int64_t bounds_checked = 0;  ///< certified errors compared with the truth
    std::int64_t bound_violations = 0;
    GeoCheck lon_lat;                   ///< what is wrong with it is among the problems
    std::vector<std::string> problems;  ///< at most 100 and one line that counts the rest

    bool sound() const { return shared_samples_differing == 0 && bound_violations == 0 && problems.empty(); }
};

/// Memory is bounded by the depth of the pyramid, not by its size. Damage that leaves something to read becomes a
/// problem of the report. Errors: ErrorCode::input missing, ErrorCode::store not a store or of another version,
/// ErrorCode::io, ErrorCode::interrupted.
Result<VerifyReport> verify_store(const std::string& path, const VerifyOptions& options = {});

}  // namespace scree
