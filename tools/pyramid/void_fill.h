// Fills the interior voids of a spool: 8-connected regions of voids that touch neither the raster's border nor an
// uncovered sample (void_regions.h). What lies outside stays absent. Regions do not touch each other, so each is filled
// for itself, from the samples around it alone; neither memory nor threads change a value.
#pragma once

#include <cstdint>
#include <functional>

#include "common/result.h"
#include "tools/pyramid/height_spool.h"

namespace scree {

/// Regions in windows (bounding box and rim) above this stay absent. More would hide more and need more memory: 19
/// bytes a sample while a membrane is solved, and up to 6 more while the region is searched, 100 MiB in all. Not
/// derived from
/// --memory, because the store must not depend on that.
inline constexpr std::int64_t kMaxFillWindowSamples = std::int64_t{1} << 22;  // 2048 x 2048

struct FillRule {
    enum class Kind {
        none,    ///< voids stay absent
        smooth,  ///< a membrane over each void (membrane.h): no value leaves the range of the samples around it
        value    ///< one height
    };
    Kind kind = Kind::smooth;
    double value = 0;      ///< raw, finite, and in float32's range unless the spool is wide; for Kind::value
    bool integer = false;  ///< round to the nearest raw integer, so that integer heights stay integers
};

struct FillReport {
    std::int64_t filled_regions = 0, filled_samples = 0;
    double min_raw = 0, max_raw = 0;  ///< over filled samples, as stored; 0 where there are none
    /// Voids that lie outside; those joined by uncovered samples count as one region.
    std::int64_t outside_regions = 0, outside_samples = 0;
    std::int64_t too_large_regions = 0, too_large_samples = 0;
    struct Box {
        std::int64_t west = 0, north = 0, width = 0, height = 0;  ///< samples
    } largest_left;  ///< of the too large ones, by area; the first of equals in the order of their southern ends
};

/// After spool.finish(). `memory_bytes` bounds what is held besides the window of one region: rows that are read once
/// instead of many times. keep_going is asked every few
/// rows and large cycles; when it says no: ErrorCode::interrupted. Does
/// nothing for Kind::none, and reads no row where no sample is missing.
Result<FillReport> fill_interior_voids(HeightSpool& spool, const FillRule& rule, std::int64_t memory_bytes,
                                       const std::function<bool()>& keep_going);

}  // namespace scree
