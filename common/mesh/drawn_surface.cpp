#include "common/mesh/drawn_surface.h"

#include <algorithm>
#include <cassert>
#include <cstdlib>

namespace scree {
namespace {

// In a block of 2 x 2 cells round its centre, with a = max(|dx|, |dy|), b = min(|dx|, |dy|) in strides, the point lies
// in the triangle (centre, mid-point of the nearer side, corner) and z = (1 - a) z_centre + (a - b) z_mid + b z_corner.
// A thinned side's mid-point stands at the mean of its two corners.
struct Fan {
    std::int64_t centre, corner;
    std::int64_t twice_mid;  // doubled, so that a thinned side's mean stays an integer
};

Fan fan_at(std::span<const std::int32_t> samples, int n, DrawnPattern pattern, int block_i, int block_j, bool east,
           bool south, bool along_x) {
    const int m = 1 << n;
    const int pitch = m + 1;
    const int stride = 1 << pattern.geomip;
    const int ci = (2 * block_i + 1) * stride;
    const int cj = (2 * block_j + 1) * stride;
    const auto at = [&](int i, int j) { return std::int64_t{samples[static_cast<std::size_t>(j * pitch + i)]}; };
    const int si = east ? stride : -stride;
    const int sj = south ? stride : -stride;
    Fan fan{at(ci, cj), at(ci + si, cj + sj), 0};
    bool thinned = false;
    if (along_x) {
        thinned = east ? ((pattern.edge_mask & kEdgeEast) != 0 && ci + stride == m)
                       : ((pattern.edge_mask & kEdgeWest) != 0 && ci == stride);
        fan.twice_mid = thinned ? fan.corner + at(ci + si, cj - sj) : 2 * at(ci + si, cj);
    } else {
        thinned = south ? ((pattern.edge_mask & kEdgeSouth) != 0 && cj + stride == m)
                        : ((pattern.edge_mask & kEdgeNorth) != 0 && cj == stride);
        fan.twice_mid = thinned ? fan.corner + at(ci - si, cj + sj) : 2 * at(ci, cj + sj);
    }
    return fan;
}

}  // namespace

ExactHeight drawn_height(std::span<const std::int32_t> samples, int tile_cells_log2, DrawnPattern pattern,
                         std::int64_t u, std::int64_t v, std::int64_t unit) {
    const std::int64_t m = std::int64_t{1} << tile_cells_log2;
    assert(static_cast<std::int64_t>(samples.size()) == (m + 1) * (m + 1));
    assert(u >= 0 && v >= 0 && u <= m * unit && v <= m * unit);
    const std::int64_t stride = unit << pattern.geomip;  // in the caller's units
    const std::int64_t blocks = m >> (pattern.geomip + 1);
    const std::int64_t bi = std::min(u / (2 * stride), blocks - 1);
    const std::int64_t bj = std::min(v / (2 * stride), blocks - 1);
    const std::int64_t dx = u - (2 * bi + 1) * stride;
    const std::int64_t dy = v - (2 * bj + 1) * stride;
    const std::int64_t ax = std::abs(dx), ay = std::abs(dy);
    const Fan fan =
        fan_at(samples, tile_cells_log2, pattern, static_cast<int>(bi), static_cast<int>(bj), dx > 0, dy > 0, ax >= ay);
    const std::int64_t a = std::max(ax, ay), b = std::min(ax, ay);
    return {2 * (stride - a) * fan.centre + (a - b) * fan.twice_mid + 2 * b * fan.corner, 2 * stride};
}

double drawn_height_at(std::span<const std::int32_t> samples, int tile_cells_log2, DrawnPattern pattern, double s,
                       double t) {
    const int m = 1 << tile_cells_log2;
    const double stride = 1 << pattern.geomip;
    const int blocks = m >> (pattern.geomip + 1);
    const int bi = std::clamp(static_cast<int>(s / (2 * stride)), 0, blocks - 1);
    const int bj = std::clamp(static_cast<int>(t / (2 * stride)), 0, blocks - 1);
    const double dx = s - (2 * bi + 1) * stride;
    const double dy = t - (2 * bj + 1) * stride;
    const double ax = std::abs(dx), ay = std::abs(dy);
    const Fan fan = fan_at(samples, tile_cells_log2, pattern, bi, bj, dx > 0, dy > 0, ax >= ay);
    const double a = std::max(ax, ay) / stride, b = std::min(ax, ay) / stride;
    return (1 - a) * static_cast<double>(fan.centre) + (a - b) * 0.5 * static_cast<double>(fan.twice_mid) +
           b * static_cast<double>(fan.corner);
}

}  // namespace scree
