// The range of many heights, as a loop that the compiler turns into vectors.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>

namespace scree {

struct SampleRange {
    std::int32_t low = 0, high = 0;
};

/// Of at least one sample.
inline SampleRange range_of(std::span<const std::int32_t> samples) {
    SampleRange range{samples.front(), samples.front()};
    for (const std::int32_t z : samples) {
        range.low = std::min(range.low, z);
        range.high = std::max(range.high, z);
    }
    return range;
}

}  // namespace scree
