#include "common/mesh/geometric_error.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "common/mesh/error_kernels.h"
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

const ErrorKernels& kernels() {
    static const ErrorKernels& best = best_error_kernels();
    return best;
}

// --- a block over a tile that one of its quadrants holds ---

// One side of the block, or both halves of its thinned side, as planes over the distances (u, v) of a vertex from the
// block's centre, east or west and north or south. Integers, in units of 1 / (2 stride) quanta.
struct QuadrantPlane {
    std::int64_t centre, along_u, along_v;
    bool where_u_leads;  // holds u >= v, else v >= u
};

// Vertices of a tile as seen from the block's centre: (u0 + k, v0 + r) for 0 <= k, r <= m.
struct QuadrantTile {
    std::int64_t u0, v0, m;
    const std::int32_t* samples;  // of (u0, v0)
    const std::uint8_t* present;  // or nullptr
    std::int64_t step_u, step_v;  // through samples
    std::int64_t double_stride;

    bool on_diagonal() const { return u0 == v0; }
};

QuadrantTile quadrant_tile(std::int64_t stride, std::int64_t x0, std::int64_t y0, const FinestVertices& finest) {
    const std::int64_t m = std::int64_t{1} << finest.tile_cells_log2, pitch = m + 1;
    const bool east = x0 >= 0, south = y0 >= 0;
    const std::int64_t first = (east ? 0 : m) + (south ? 0 : m * pitch);
    return {east ? x0 : -x0 - m,
            south ? y0 : -y0 - m,
            m,
            finest.samples + first,
            finest.present == nullptr ? nullptr : finest.present + first,
            east ? 1 : -1,
            south ? pitch : -pitch,
            2 * stride};
}

struct QuadrantPlanes {
    std::array<QuadrantPlane, 4> all{};
    std::size_t count = 0;
};

// The planes that meet the tile, each side whole and thinned.
QuadrantPlanes quadrant_planes(const BlockVertices& block, bool east, bool south, const QuadrantTile& tile) {
    const auto vertex = [&](int column, int row) {
        return static_cast<std::int64_t>(block[static_cast<std::size_t>(3 * row + column)]);
    };
    const int far_column = east ? 2 : 0, far_row = south ? 2 : 0;
    const std::int64_t centre = vertex(1, 1), corner = vertex(far_column, far_row);
    QuadrantPlanes planes;
    const auto add = [&](bool where_u_leads, std::int64_t twice_mid) {
        const std::int64_t outwards = twice_mid - 2 * centre, sideways = 2 * corner - twice_mid;
        planes.all[planes.count++] = {tile.double_stride * centre, where_u_leads ? outwards : sideways,
                                      where_u_leads ? sideways : outwards, where_u_leads};
    };
    if (tile.u0 >= tile.v0) {
        add(true, 2 * vertex(far_column, 1));
        add(true, corner + vertex(far_column, 2 - far_row));
    }
    if (tile.v0 >= tile.u0) {
        add(false, 2 * vertex(1, far_row));
        add(false, corner + vertex(2 - far_column, far_row));
    }
    return planes;
}

// Greatest distances from a plane, in its units.
struct Distances {
    std::int64_t anywhere = 0;    // over the vertices looked at
    std::int64_t at_present = 0;  // over those of present cells
};

// At the tile's vertices a multiple of `step` cells from its corner.
void look_at_vertices(const QuadrantTile& tile, const QuadrantPlane& plane, std::int64_t step, Distances& greatest) {
    const bool diagonal = tile.on_diagonal();
    for (std::int64_t r = 0; r <= tile.m; r += step) {
        const std::int64_t first = diagonal && plane.where_u_leads ? r : 0;
        const std::int64_t last = diagonal && !plane.where_u_leads ? r : tile.m;
        const std::int64_t row = plane.centre + plane.along_v * (tile.v0 + r) + plane.along_u * tile.u0;
        for (std::int64_t k = first; k <= last; k += step) {
            const std::int64_t at = r * tile.step_v + k * tile.step_u;
            const std::int64_t d = std::abs(tile.double_stride * tile.samples[at] - (row + plane.along_u * k));
            greatest.anywhere = std::max(greatest.anywhere, d);
            if (tile.present == nullptr || tile.present[at] != 0)
                greatest.at_present = std::max(greatest.at_present, d);
        }
    }
}

// The same at all of a tile's vertices, in the tile's own columns and rows.
std::int64_t greatest_distance(const QuadrantTile& tile, const QuadrantPlane& plane, const FinestVertices& finest) {
    const bool east = tile.step_u > 0, south = tile.step_v > 0;
    const std::int64_t u = tile.u0 + (east ? 0 : tile.m), v = tile.v0 + (south ? 0 : tile.m);
    TilePlane own{static_cast<double>(plane.centre + plane.along_u * u + plane.along_v * v),
                  static_cast<double>(east ? plane.along_u : -plane.along_u),
                  static_cast<double>(south ? plane.along_v : -plane.along_v), TilePlane::whole};
    if (tile.on_diagonal()) {
        if (east == south)
            own.part = plane.where_u_leads == east ? TilePlane::north_east : TilePlane::south_west;
        else
            own.part = plane.where_u_leads == east ? TilePlane::south_east : TilePlane::north_west;
    }
    return static_cast<std::int64_t>(
        kernels().plane_distance(finest.samples, finest.tile_cells_log2, static_cast<double>(tile.double_stride), own));
}

// --- tiles side by side ---

constexpr auto kLanes = static_cast<std::size_t>(kLeafErrorTiles);

// Vertex by vertex, the tiles' values side by side; lanes without a tile of their own hold the last one.
struct SideBySide {
    std::vector<std::int32_t> samples, present;

    void arrange(std::span<const FinestVertices> tiles, std::size_t vertices) {
        samples.resize(vertices * kLanes);
        present.clear();
        std::array<const std::int32_t*, kLanes> from;
        for (std::size_t lane = 0; lane < kLanes; ++lane) from[lane] = tiles[std::min(lane, tiles.size() - 1)].samples;
        for (std::size_t k = 0; k < vertices; ++k)
            for (std::size_t lane = 0; lane < kLanes; ++lane) samples[k * kLanes + lane] = from[lane][k];
        if (std::none_of(tiles.begin(), tiles.end(), [](const FinestVertices& t) { return t.present != nullptr; }))
            return;
        present.assign(vertices * kLanes, -1);
        for (std::size_t lane = 0; lane < tiles.size(); ++lane) {
            if (tiles[lane].present == nullptr) continue;
            for (std::size_t k = 0; k < vertices; ++k)
                present[k * kLanes + lane] = tiles[lane].present[k] != 0 ? -1 : 0;
        }
    }
};

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

double greatest_block_error(const BlockVertices& block, std::int64_t stride, std::int64_t offset_i,
                            std::int64_t offset_j, const FinestVertices& finest, const LeafErrors& own, double known) {
    const std::int64_t x0 = offset_i - stride, y0 = offset_j - stride;
    const QuadrantTile tile = quadrant_tile(stride, x0, y0, finest);
    assert(x0 % tile.m == 0 && y0 % tile.m == 0 && tile.u0 + tile.m <= stride && tile.v0 + tile.m <= stride);
    const QuadrantPlanes planes = quadrant_planes(block, x0 >= 0, y0 >= 0, tile);
    const auto units = static_cast<double>(tile.double_stride);
    // Through vertices `step` apart goes the tile's surface of that stride. The block is plane over each of its
    // triangles, so between them it is no farther from the block than at them, and no sample is farther from it than
    // the tile's error there.
    // Once that does not settle it, what looks at all vertices does so faster than they can be chosen.
    for (int log2_step = finest.tile_cells_log2 - 1;; --log2_step) {
        Distances greatest;
        for (std::size_t k = 0; k < planes.count; ++k)
            look_at_vertices(tile, planes.all[k], std::int64_t{1} << log2_step, greatest);
        known = std::max(known, static_cast<double>(greatest.at_present) / units);
        if (log2_step == 0) return known;
        const double beyond = own[static_cast<std::size_t>(log2_step)] * units;
        if (static_cast<double>(greatest.anywhere) + beyond <= known * units) return known;
        if (finest.present == nullptr && finest.tile_cells_log2 >= kMinPlaneLog2) break;
    }
    for (std::size_t k = 0; k < planes.count; ++k)
        known = std::max(known, static_cast<double>(greatest_distance(tile, planes.all[k], finest)) / units);
    return known;
}

LeafErrors leaf_errors(const FinestVertices& finest) {
    const int n = finest.tile_cells_log2;
    const std::int64_t m = std::int64_t{1} << n, pitch = m + 1;
    LeafErrors errors{};
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

void leaf_errors(std::span<const FinestVertices> tiles, std::span<LeafErrors> errors) {
    assert(tiles.size() == errors.size());
    thread_local SideBySide lanes;
    for (std::size_t first = 0; first < tiles.size(); first += kLanes) {
        const auto group = tiles.subspan(first, std::min(kLanes, tiles.size() - first));
        const int n = group.front().tile_cells_log2;
        if (n > kMaxLeafErrorLog2) {
            for (std::size_t k = 0; k < group.size(); ++k) errors[first + k] = leaf_errors(group[k]);
            continue;
        }
        const std::size_t pitch = (std::size_t{1} << n) + 1;
        lanes.arrange(group, pitch * pitch);
        std::array<std::int32_t, kLanes * kMaxLeafErrorLog2> worst{};
        kernels().leaf_errors(lanes.samples.data(), lanes.present.empty() ? nullptr : lanes.present.data(), n,
                              worst.data());
        for (std::size_t k = 0; k < group.size(); ++k) {
            LeafErrors& of_tile = errors[first + k];
            of_tile = {};
            double running = 0;
            for (int g = 0; g < n; ++g) {
                const auto level = static_cast<std::size_t>(g);
                running = std::max(running, std::ldexp(static_cast<double>(worst[level * kLanes + k]), -(g + 1)));
                of_tile[level] = running;
            }
        }
    }
}

const ErrorKernels& best_error_kernels() {
    if (__builtin_cpu_supports("avx512f")) return kErrorKernelsAvx512;
    return __builtin_cpu_supports("avx2") ? kErrorKernelsAvx2 : kErrorKernelsSse2;
}

float round_up_to_float(double value) {
    const float rounded = static_cast<float>(value);
    return static_cast<double>(rounded) < value ? std::nextafter(rounded, std::numeric_limits<float>::infinity())
                                                : rounded;
}

}  // namespace scree
