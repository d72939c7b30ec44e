#include "common/mesh/geometric_error.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "common/mesh/tile_patterns.h"

namespace scree {
namespace {

// Rectangle of finest vertices inside a block, in finest cells from the block's centre, with the samples at its corner.
struct Region {
    std::int64_t x0, y0, x1, y1;  // inclusive
    const std::int32_t* samples;
    const std::uint8_t* present;  // or nullptr
    std::int64_t pitch;
};

// Greatest |denominator * z - (start + slope * k)| for k = 0..count-1.
double row_error(const std::int32_t* z, const std::uint8_t* present, std::int64_t count, double denominator,
                 double start, double slope) {
    double high = 0, low = 0;
    if (present == nullptr) {
        for (std::int64_t k = 0; k < count; ++k) {
            const double d = denominator * z[k] - (start + slope * static_cast<double>(static_cast<std::int32_t>(k)));
            high = d > high ? d : high;
            low = d < low ? d : low;
        }
    } else {
        for (std::int64_t k = 0; k < count; ++k) {
            if (present[k] == 0) continue;
            const double d = denominator * z[k] - (start + slope * static_cast<double>(k));
            high = d > high ? d : high;
            low = d < low ? d : low;
        }
    }
    return std::max(high, -low);
}

// Error of one block over a region, `removable` = sides whose mid-vertex may be missing. In units of 1/(2 stride)
// quanta.
double block_error(const BlockVertices& v, std::int64_t stride, unsigned removable, const Region& r) {
    const double s = static_cast<double>(stride);
    const double centre = v[4];
    double worst = 0;
    for (std::int64_t dy = r.y0; dy <= r.y1; ++dy) {
        const std::int32_t* z = r.samples + (dy - r.y0) * r.pitch;
        const std::uint8_t* present = r.present == nullptr ? nullptr : r.present + (dy - r.y0) * r.pitch;
        const bool south = dy > 0;
        const std::int64_t ay = std::abs(dy);
        // Along a row the surface is linear between -stride, -|dy|, 0, |dy| and stride.
        const std::int64_t breaks[5] = {-stride, -ay, 0, ay, stride};
        for (int part = 0; part < 4; ++part) {
            const std::int64_t from = std::max(breaks[part], r.x0);
            const std::int64_t to = std::min(breaks[part + 1], r.x1);
            if (from > to || (breaks[part] == breaks[part + 1])) continue;
            const bool east = part >= 2;
            const bool side_is_x = part == 0 || part == 3;
            const double corner = v[static_cast<std::size_t>((south ? 6 : 0) + (east ? 2 : 0))];
            const double mid = side_is_x ? v[east ? 5 : 3] : v[south ? 7 : 1];
            const double other = side_is_x ? v[static_cast<std::size_t>((south ? 0 : 6) + (east ? 2 : 0))]
                                           : v[static_cast<std::size_t>((south ? 6 : 0) + (east ? 0 : 2))];
            const unsigned side = side_is_x ? (east ? kEdgeEast : kEdgeWest) : (south ? kEdgeSouth : kEdgeNorth);
            const auto surface = [&](double twice_mid, std::int64_t dx) {
                const double ax = static_cast<double>(std::abs(dx));
                const double a = std::max(ax, static_cast<double>(ay)), b = std::min(ax, static_cast<double>(ay));
                return 2 * (s - a) * centre + (a - b) * twice_mid + 2 * b * corner;
            };
            const auto part_error = [&](double twice_mid) {
                const double start = surface(twice_mid, from);
                // Slope of one step of dx inside this part, exact: d/d|dx| times the direction.
                const double along = side_is_x ? twice_mid - 2 * centre : 2 * corner - twice_mid;
                const double slope = east ? along : -along;
                return row_error(z + (from - r.x0), present == nullptr ? nullptr : present + (from - r.x0),
                                 to - from + 1, 2 * s, start, slope);
            };
            worst = std::max(worst, part_error(2 * mid));
            if ((removable & side) != 0) worst = std::max(worst, part_error(corner + other));
        }
    }
    return worst;
}

}  // namespace

std::vector<std::uint8_t> present_vertices(std::span<const std::uint8_t> cells, int n) {
    if (cells.empty()) return {};
    const std::size_t m = std::size_t{1} << n, pitch = m + 1;
    assert(cells.size() == m * m);
    std::vector<std::uint8_t> vertices(pitch * pitch, 0);
    for (std::size_t j = 0; j < m; ++j)
        for (std::size_t i = 0; i < m; ++i)
            if (cells[j * m + i] != 0)
                for (const std::size_t k :
                     {j * pitch + i, j * pitch + i + 1, (j + 1) * pitch + i, (j + 1) * pitch + i + 1})
                    vertices[k] = 1;
    return vertices;
}

double coarse_block_error(const BlockVertices& block, std::int64_t stride, std::int64_t offset_i, std::int64_t offset_j,
                          const FinestVertices& finest) {
    const std::int64_t m = std::int64_t{1} << finest.tile_cells_log2;
    assert(offset_i >= 0 && offset_j >= 0 && offset_i + m <= 2 * stride && offset_j + m <= 2 * stride);
    const Region region{offset_i - stride,
                        offset_j - stride,
                        offset_i - stride + m,
                        offset_j - stride + m,
                        finest.samples,
                        finest.present,
                        m + 1};
    const double s2 = 2 * static_cast<double>(stride);
    return block_error(block, stride, kEdgeNorth | kEdgeEast | kEdgeSouth | kEdgeWest, region) / s2;
}

std::array<double, kMaxTileCellsLog2> leaf_errors(const FinestVertices& finest) {
    const int n = finest.tile_cells_log2;
    const std::int64_t m = std::int64_t{1} << n, pitch = m + 1;
    std::array<double, kMaxTileCellsLog2> errors{};
    double running = 0;
    for (int g = 0; g < n; ++g) {
        const std::int64_t stride = std::int64_t{1} << g;
        const std::int64_t blocks = m / (2 * stride);
        double worst = 0;
        for (std::int64_t bj = 0; bj < blocks; ++bj)
            for (std::int64_t bi = 0; bi < blocks; ++bi) {
                const std::int64_t first = 2 * bj * stride * pitch + 2 * bi * stride;
                BlockVertices v{};
                for (std::int64_t k = 0; k < 9; ++k)
                    v[static_cast<std::size_t>(k)] =
                        finest.samples[first + (k / 3) * stride * pitch + (k % 3) * stride];
                unsigned removable = 0;
                if (bj == 0) removable |= kEdgeNorth;
                if (bi == blocks - 1) removable |= kEdgeEast;
                if (bj == blocks - 1) removable |= kEdgeSouth;
                if (bi == 0) removable |= kEdgeWest;
                if (g == 0 && removable == 0) continue;  // the finest surface itself
                const Region region{-stride,
                                    -stride,
                                    stride,
                                    stride,
                                    finest.samples + first,
                                    finest.present == nullptr ? nullptr : finest.present + first,
                                    pitch};
                worst = std::max(worst, block_error(v, stride, removable, region) / (2 * static_cast<double>(stride)));
            }
        running = std::max(running, worst);
        errors[static_cast<std::size_t>(g)] = running;
    }
    return errors;
}

float round_up_to_float(double value) {
    const float rounded = static_cast<float>(value);
    return static_cast<double>(rounded) < value ? std::nextafter(rounded, std::numeric_limits<float>::infinity())
                                                : rounded;
}

}  // namespace scree
