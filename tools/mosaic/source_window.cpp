#include "tools/mosaic/source_window.h"

#include <emmintrin.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

namespace scree {
namespace {

struct Range {
    double low = std::numeric_limits<double>::infinity(), high = -std::numeric_limits<double>::infinity();

    void clip(double low_limit, double high_limit) {
        low = std::max(low, low_limit);
        high = std::min(high, high_limit);
    }
};

// NaN takes no part: minimum and maximum are then their second operand.
Range range_of(std::span<const double> values) {
    Range range;
    __m128d low = _mm_set1_pd(range.low), high = _mm_set1_pd(range.high);
    std::size_t k = 0;
    for (; k + 2 <= values.size(); k += 2) {
        const __m128d both = _mm_loadu_pd(&values[k]);
        low = _mm_min_pd(both, low);
        high = _mm_max_pd(both, high);
    }
    if (k < values.size()) {
        const __m128d last = _mm_set1_pd(values[k]);
        low = _mm_min_pd(last, low);
        high = _mm_max_pd(last, high);
    }
    return {std::min(_mm_cvtsd_f64(low), _mm_cvtsd_f64(_mm_unpackhi_pd(low, low))),
            std::max(_mm_cvtsd_f64(high), _mm_cvtsd_f64(_mm_unpackhi_pd(high, high)))};
}

}  // namespace

std::optional<SampleRectangle> source_window(const SourcePoints& points, const Layer& layer, const ResampleRule& rule) {
    const Range across = range_of(points.column), down = range_of(points.row);
    return source_window({across.low, across.high, down.low, down.high}, layer, rule);
}

std::optional<SampleRectangle> source_window(const WarpMap::Bounds& bounds, const Layer& layer,
                                             const ResampleRule& rule) {
    Range across{bounds.west, bounds.east}, down{bounds.north, bounds.south};
    across.clip(-1, static_cast<double>(layer.columns));
    down.clip(-1, static_cast<double>(layer.rows));
    if (!(across.low <= across.high && down.low <= down.high)) return std::nullopt;
    const std::int64_t reach_x = kernel_reach(rule.kernel, rule.shrink.columns) + 1;
    const std::int64_t reach_y = kernel_reach(rule.kernel, rule.shrink.rows) + 1;
    SampleRectangle w;
    w.column = static_cast<std::int64_t>(std::floor(across.low)) - reach_x;
    w.row = static_cast<std::int64_t>(std::floor(down.low)) - reach_y;
    w.columns = static_cast<std::int64_t>(std::ceil(across.high)) + reach_x + 1 - w.column;
    w.rows = static_cast<std::int64_t>(std::ceil(down.high)) + reach_y + 1 - w.row;
    return w;
}

std::int64_t chunk_of(std::int64_t i) {
    return i >= 0 ? i / WarpMap::kChunk : -((WarpMap::kChunk - 1 - i) / WarpMap::kChunk);
}

std::int64_t chunk_middle(std::int64_t i) { return chunk_of(i) * WarpMap::kChunk + WarpMap::kChunk / 2; }

}  // namespace scree
