// How far a strip one cell wide between two blocks (runtime/lod/dike.h) is from the same strip with all its vertices,
// and what a row of cells is from one that is zipped.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "runtime/lod/dike.h"

namespace scree {

/// Base on one side, from `low` to `high` along the strip, apex on the other.
struct StripTriangle {
    bool base_on_a = true;
    int low = 0, high = 0, apex = 0;
};

/// Of the selected samples of both sides: see walk_zipper.
inline std::vector<StripTriangle> zip_strip(std::span<const std::int32_t> a, std::span<const std::int32_t> b) {
    std::vector<StripTriangle> triangles;
    walk_zipper(a, b, [&](bool on_b, std::int32_t base, std::int32_t apex) {
        const auto side = on_b ? b : a, other = on_b ? a : b;
        const auto k = static_cast<std::size_t>(base);
        triangles.push_back({!on_b, side[k], side[k + 1], other[static_cast<std::size_t>(apex)]});
    });
    return triangles;
}

/// Height of the strip with all vertices, t of the way from side A to side B, y cells along it.
inline double whole_strip_height(std::span<const double> a, std::span<const double> b, double t, double y) {
    const auto j = std::min(static_cast<std::size_t>(y), a.size() - 2);
    const double u = y - static_cast<double>(j);
    if (u <= 1 - t) return a[j] + u * (a[j + 1] - a[j]) + t * (b[j] - a[j]);
    return b[j + 1] + (1 - t) * (a[j + 1] - b[j + 1]) + (1 - u) * (b[j] - b[j + 1]);
}

/// visit(t, y, drawn height, whole height) at places inside every triangle: eighths of the width, quarters of a cell.
template <class Visit>
void sample_strip(std::span<const double> a, std::span<const double> b, std::span<const StripTriangle> triangles,
                  const Visit& visit) {
    for (const StripTriangle& triangle : triangles) {
        const std::span<const double> base = triangle.base_on_a ? a : b, other = triangle.base_on_a ? b : a;
        for (int eighth = 1; eighth < 8; ++eighth) {
            const double s = eighth / 8.0;  // from the base to the apex
            const double from = triangle.low + s * (triangle.apex - triangle.low);
            const double to = triangle.high + s * (triangle.apex - triangle.high);
            for (double y = std::ceil(4 * from) / 4; y <= to; y += 0.25) {
                const double share = to > from ? (y - from) / (to - from) : 0;
                const double along = base[static_cast<std::size_t>(triangle.low)] * (1 - share) +
                                     base[static_cast<std::size_t>(triangle.high)] * share;
                const double drawn = along * (1 - s) + other[static_cast<std::size_t>(triangle.apex)] * s;
                const double t = triangle.base_on_a ? s : 1 - s;
                visit(t, y, drawn, whole_strip_height(a, b, t, y));
            }
        }
    }
}

}  // namespace scree
