// A rectangle of a raster's samples, and its two halves: how work that would need too large a window is divided.
#pragma once

#include <cstdint>
#include <utility>

namespace scree {

struct SampleRectangle {
    std::int64_t column = 0, row = 0, columns = 0, rows = 0;
    std::int64_t count() const { return columns * rows; }
};

/// Across its longer side. The rectangle has two samples at least.
inline std::pair<SampleRectangle, SampleRectangle> halves_of(const SampleRectangle& whole) {
    SampleRectangle first = whole, second = whole;
    if (whole.columns >= whole.rows) {
        first.columns = whole.columns / 2;
        second.column += first.columns;
        second.columns -= first.columns;
    } else {
        first.rows = whole.rows / 2;
        second.row += first.rows;
        second.rows -= first.rows;
    }
    return {first, second};
}

}  // namespace scree
