// How far a frame of a BlockWorld is from the full mesh, in pixels: over every vertex in view, and over every crossing
// of a strip's rungs with the full strip's edges, which is where a strip errs most. What hides what is ignored. One
// thread.
#pragma once

#include <cstdint>
#include <vector>

#include "runtime/lod/block_world.h"

namespace scree {

/// Greatest, mean and quantiles of many errors; a quantile is up to 1.6 % too large.
class PixelErrors {
public:
    PixelErrors() : bins_(kBins) {}
    void add(double px);
    std::int64_t count() const { return count_; }
    double max_px() const { return max_; }
    double mean_px() const { return count_ == 0 ? 0 : sum_ / static_cast<double>(count_); }
    /// 0 <= share <= 1.
    double quantile_px(double share) const;

private:
    // By the sign, exponent and 6 bits of the mantissa of a float.
    static constexpr std::size_t kBins = std::size_t{1} << 15;
    std::vector<std::int64_t> bins_;
    std::int64_t count_ = 0;
    double max_ = 0, sum_ = 0;
};

struct BlockTruth {
    PixelErrors blocks, dikes;
    std::int64_t strips = 0, strips_above = 0;  ///< judged: those in view; of these, with an error above `limit_px`
};

/// Adds the errors of what select() has just drawn for this camera, on an earth of `half_curvature` = 1 / (2 R), 1/m.
void judge_frame(const BlockWorld& world, const Camera& camera, const BlockFrame& frame, double limit_px,
                 BlockTruth& truth, double half_curvature = 0);

/// Of the paper's own test, over the blocks of a frame.
struct SelectionTruth {
    std::int64_t wanted = 0;   ///< vertices that would be selected for this eye without a cache
    std::int64_t missing = 0;  ///< of these, those that are not
    std::int64_t failing = 0;  ///< vertices whose own test fails: the others are wanted by what depends on them
    std::int64_t failing_missing = 0;
    std::int64_t blocks = 0;
    std::int64_t blocks_lacking = 0;  ///< with a vertex whose own test fails and that is not selected
    std::int64_t blocks_above = 0;    ///< with a vertex, not selected, above tau + s by the paper's test
    double worst_px = 0;              ///< greatest f delta m of a vertex that is not selected

    double missing_share() const {
        return wanted == 0 ? 0 : static_cast<double>(missing) / static_cast<double>(wanted);
    }
};
void judge_selection(const BlockWorld& world, const Camera& camera, const BlockFrame& frame, const BlockRules& rules,
                     SelectionTruth& truth);

}  // namespace scree
