#include "tools/verify/surface_error.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace scree {
namespace {

struct Quadrant {
    std::int64_t stride = 1;
    std::int64_t centre = 0, corner = 0;
    std::int64_t mid_p = 0, mid_q = 0;        // mid-points of the sides p = stride and q = stride
    std::int64_t mirror_p = 0, mirror_q = 0;  // the other corners of those sides
    bool thin_p = false, thin_q = false;      // whether those sides may lose their mid-points
};

// Vertices p0 .. p0 + count - 1 by q0 .. q0 + rows - 1 of a quadrant, somewhere in a finest tile's arrays.
struct Window {
    const std::int32_t* z = nullptr;
    const std::uint8_t* present = nullptr;  // or nullptr
    std::ptrdiff_t step_p = 1, step_q = 1;
    std::int64_t p0 = 0, q0 = 0, count = 0, rows = 0;
};

std::int64_t row_worst(const Window& w, std::int64_t row, std::int64_t from, std::int64_t to, std::int64_t twice_stride,
                       std::int64_t base, std::int64_t slope) {
    std::int64_t worst = 0;
    std::ptrdiff_t at =
        static_cast<std::ptrdiff_t>(row) * w.step_q + static_cast<std::ptrdiff_t>(from - w.p0) * w.step_p;
    std::int64_t surface = base + slope * from;
    for (std::int64_t p = from; p <= to; ++p, at += w.step_p, surface += slope) {
        if (w.present != nullptr && w.present[at] == 0) continue;
        worst = std::max(worst, std::abs(twice_stride * w.z[at] - surface));
    }
    return worst;
}

std::int64_t window_worst(const Quadrant& c, const Window& w) {
    const std::int64_t twice = 2 * c.stride;
    std::int64_t worst = 0;
    for (std::int64_t row = 0; row < w.rows; ++row) {
        const std::int64_t q = w.q0 + row;
        const std::int64_t last = w.p0 + w.count - 1;
        const auto q_side = [&](std::int64_t twice_mid) {  // p <= q
            worst =
                std::max(worst, row_worst(w, row, w.p0, std::min(q, last), twice,
                                          twice * c.centre + q * (twice_mid - 2 * c.centre), 2 * c.corner - twice_mid));
        };
        const auto p_side = [&](std::int64_t twice_mid) {  // p >= q
            worst =
                std::max(worst, row_worst(w, row, std::max(q, w.p0), last, twice,
                                          twice * c.centre + q * (2 * c.corner - twice_mid), twice_mid - 2 * c.centre));
        };
        q_side(2 * c.mid_q);
        p_side(2 * c.mid_p);
        if (c.thin_q) q_side(c.corner + c.mirror_q);
        if (c.thin_p) p_side(c.corner + c.mirror_p);
    }
    return worst;
}

// Quadrant of a 3 x 3 block.
Quadrant quadrant_of_block(const std::array<std::int32_t, 9>& v, std::int64_t stride, bool east, bool south,
                           bool thin_p, bool thin_q) {
    const std::size_t i = east ? 2 : 0, j = south ? 2 : 0;
    return {stride, v[4], v[3 * j + i], v[3 + i], v[3 * j + 1], v[3 * (2 - j) + i], v[3 * j + (2 - i)], thin_p, thin_q};
}

// A window over `cells` + 1 vertices a side of the tile from column/row `first_i`, `first_j`, seen from a block's
// centre that lies west/north of it (towards_east/south) or on the other side.
Window window_of(const FinestTile& tile, std::int64_t first_i, std::int64_t first_j, std::int64_t cells, bool east,
                 bool south, std::int64_t p0, std::int64_t q0) {
    const std::int64_t pitch = (std::int64_t{1} << tile.tile_cells_log2) + 1;
    const std::int64_t i = east ? first_i : first_i + cells;
    const std::int64_t j = south ? first_j : first_j + cells;
    Window w;
    w.z = tile.samples.data() + j * pitch + i;
    w.present = tile.present.empty() ? nullptr : tile.present.data() + j * pitch + i;
    w.step_p = east ? 1 : -1;
    w.step_q = static_cast<std::ptrdiff_t>(south ? pitch : -pitch);
    w.p0 = p0;
    w.q0 = q0;
    w.count = w.rows = cells + 1;
    return w;
}

}  // namespace

bool ExactError::within(float bound) const {
    // Doubling the bound `stride` times over is a change of exponent: exact. An integer is <= x iff it is <= floor(x).
    const double scaled = static_cast<double>(bound) * (2.0 * static_cast<double>(stride));
    return numerator <= static_cast<std::int64_t>(std::floor(scaled));
}

FinestTile make_finest_tile(std::span<const std::int32_t> samples, std::span<const std::uint8_t> cells, int n) {
    FinestTile tile{samples, {}, n};
    if (cells.empty()) return tile;
    const std::size_t m = std::size_t{1} << n;
    tile.present.assign((m + 1) * (m + 1), 0);
    for (std::size_t k = 0; k < m * m; ++k) {
        if (cells[k] == 0) continue;
        std::uint8_t* north_west = tile.present.data() + (k / m) * (m + 1) + k % m;
        north_west[0] = north_west[1] = north_west[m + 1] = north_west[m + 2] = 1;
    }
    return tile;
}

std::array<std::int32_t, 9> coarsest_block(std::span<const std::int32_t> samples, int n) {
    const std::size_t half = std::size_t{1} << (n - 1), pitch = 2 * half + 1;
    std::array<std::int32_t, 9> block{};
    for (std::size_t k = 0; k < 9; ++k) block[k] = samples[(k / 3) * half * pitch + (k % 3) * half];
    return block;
}

std::int64_t ancestor_error(const std::array<std::int32_t, 9>& block, std::int64_t stride, std::int64_t offset_i,
                            std::int64_t offset_j, const FinestTile& finest) {
    const std::int64_t m = std::int64_t{1} << finest.tile_cells_log2;
    const bool east = offset_i >= stride, south = offset_j >= stride;
    const std::int64_t p0 = east ? offset_i - stride : stride - offset_i - m;
    const std::int64_t q0 = south ? offset_j - stride : stride - offset_j - m;
    return window_worst(quadrant_of_block(block, stride, east, south, true, true),
                        window_of(finest, 0, 0, m, east, south, p0, q0));
}

std::vector<ExactError> own_errors(const FinestTile& finest) {
    const int n = finest.tile_cells_log2;
    const std::int64_t m = std::int64_t{1} << n, pitch = m + 1;
    std::vector<ExactError> errors;
    for (int g = 0; g < n; ++g) {
        const std::int64_t stride = std::int64_t{1} << g, blocks = m / (2 * stride);
        ExactError error{0, stride};
        for (std::int64_t bj = 0; bj < blocks; ++bj) {
            for (std::int64_t bi = 0; bi < blocks; ++bi) {
                const bool border = bi == 0 || bj == 0 || bi == blocks - 1 || bj == blocks - 1;
                if (g == 0 && !border) continue;  // drawn whole, this is the finest surface
                std::array<std::int32_t, 9> block{};
                for (std::int64_t k = 0; k < 9; ++k)
                    block[static_cast<std::size_t>(k)] = finest.samples[static_cast<std::size_t>(
                        (2 * bj + k / 3) * stride * pitch + (2 * bi + k % 3) * stride)];
                for (int quadrant = 0; quadrant < 4; ++quadrant) {
                    const bool east = (quadrant & 1) != 0, south = (quadrant & 2) != 0;
                    const bool thin_p = east ? bi == blocks - 1 : bi == 0;
                    const bool thin_q = south ? bj == blocks - 1 : bj == 0;
                    const std::int64_t i = (2 * bi + (east ? 1 : 0)) * stride, j = (2 * bj + (south ? 1 : 0)) * stride;
                    error.numerator = std::max(
                        error.numerator, window_worst(quadrant_of_block(block, stride, east, south, thin_p, thin_q),
                                                      window_of(finest, i, j, stride, east, south, 0, 0)));
                }
            }
        }
        errors.push_back(error);
    }
    return errors;
}

}  // namespace scree
