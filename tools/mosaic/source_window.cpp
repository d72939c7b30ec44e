#include "tools/mosaic/source_window.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace scree {
namespace {

struct Span {
    double low = std::numeric_limits<double>::infinity(), high = -std::numeric_limits<double>::infinity();

    void include(double v) {
        low = std::min(low, v);
        high = std::max(high, v);
    }
    void clip(double low_limit, double high_limit) {
        low = std::max(low, low_limit);
        high = std::min(high, high_limit);
    }
};

}  // namespace

std::optional<SampleRectangle> source_window(const SourcePoints& points, const Layer& layer, const ResampleRule& rule) {
    Span across, down;
    for (std::size_t k = 0; k < points.column.size(); ++k) {
        const double c = points.column[k], r = points.row[k];
        if (!std::isfinite(c) || !std::isfinite(r)) continue;
        across.include(c);
        down.include(r);
    }
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
