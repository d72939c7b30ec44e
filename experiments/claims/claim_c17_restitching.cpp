// C17: when an edge's level passes a whole number, a band that is made anew has other inner edges: the surface jumps,
// though every vertex of the edge had moved to its place. A fan that only loses a vertex does not jump.
#include <fmt/format.h>

#include "common/mesh/drawn_surface.h"
#include "common/mesh/tile_patterns.h"
#include "experiments/claims/claims.h"
#include "experiments/claims/geomip_world.h"
#include "experiments/claims/strip.h"
#include "runtime/report/plot.h"

namespace scree {
namespace {

/// The band along a block's north edge at a level: its outer row and the row inside, in vertices of the level.
struct Band {
    std::vector<double> outer, inner;  ///< m / stride + 1 each
};

Band band_of(const GeomipBlock& block, int cells_log2, int level) {
    const int m = 1 << cells_log2, stride = 1 << level;
    Band band;
    for (int i = 0; i <= m; i += stride) {
        band.outer.push_back(block.heights_n[static_cast<std::size_t>(i)]);
        band.inner.push_back(block.heights_n[static_cast<std::size_t>(stride * (m + 1) + i)]);
    }
    return band;
}

/// A band of whole cells, all split from north-west to south-east as in one triangle strip, at t from outer to inner
/// and y cells along.
double whole_cells(const Band& band, double t, double y) {
    const auto j = std::min(static_cast<std::size_t>(y), band.outer.size() - 2);
    const double u = y - static_cast<double>(j);
    const double nw = band.outer[j], ne = band.outer[j + 1], sw = band.inner[j], se = band.inner[j + 1];
    return u >= t ? nw + u * (ne - nw) + t * (se - ne) : nw + t * (sw - nw) + u * (se - sw);
}

/// Greatest jump, quanta, where the band is zipped anew once its outer vertices of odd number lie on their chords.
double restitched_jump(Band band) {
    std::vector<std::int32_t> outer, inner;
    for (std::size_t k = 0; k < band.outer.size(); ++k) {
        if (k % 2 == 0)
            outer.push_back(static_cast<int>(k));
        else
            band.outer[k] = (band.outer[k - 1] + band.outer[k + 1]) / 2;
        inner.push_back(static_cast<int>(k));
    }
    double jump = 0;
    sample_strip(band.outer, band.inner, zip_strip(outer, inner), [&](double t, double y, double drawn, double) {
        jump = std::max(jump, std::abs(drawn - whole_cells(band, t, y)));
    });
    return jump;
}

/// The same where the fans of common/mesh lose the vertex, on a grid of quarter cells.
double fan_jump(const GeomipBlock& block, int cells_log2, int level) {
    const int m = 1 << cells_log2, stride = 1 << level;
    std::vector<std::int32_t> doubled(block.heights_n);  // so that a chord's middle is a whole number
    for (std::int32_t& z : doubled) z *= 2;
    std::vector<std::int32_t> moved(doubled);
    for (int i = stride; i < m; i += 2 * stride)
        moved[static_cast<std::size_t>(i)] =
            (doubled[static_cast<std::size_t>(i - stride)] + doubled[static_cast<std::size_t>(i + stride)]) / 2;
    double jump = 0;
    for (int v = 0; v <= 4 * stride; v += stride)
        for (int u = 0; u <= 4 * m; u += stride) {
            const double before = drawn_height(moved, cells_log2, {level, 0}, u, v, 4).quanta();
            const double after = drawn_height(doubled, cells_log2, {level, kEdgeNorth}, u, v, 4).quanta();
            jump = std::max(jump, std::abs(after - before) / 2);
        }
    return jump;
}

}  // namespace

Figure claim_c17_restitching(const ClaimBench& bench) {
    constexpr int n = 5;
    const GeomipWorld world(bench.terrain, n);
    Figure figure{
        "C17",
        "Bands that are stitched anew jump by metres when an edge reaches the next level.",
        "DB sections 2.3 and 2.4",
        "Morphing makes the change from level to level continuous in time.",
        fmt::format("{}, {} blocks of 33 x 33 vertices, north edges: the moment when an edge reaches the next level, "
                    "all its vertices where they will be",
                    bench.terrain.name, world.blocks().size()),
        {},
        {},
        {}};
    FigureTable table{"",
                      {"level", "mean jump, band zipped anew (m)", "greatest (m)",
                       "mean jump over the level's error with bands", "greatest jump, fan without its vertex (m)"},
                      {}};
    BarChart chart{"Jump of the surface when an edge reaches the next level",
                   figure.setting,
                   "level",
                   {},
                   {"jump (m)", false, {}},
                   {{"zipped anew, mean", {}}, {"zipped anew, greatest", {}}, {"fan, greatest", {}}},
                   {}};
    double least_mean = 1e9, by_fan = 0;
    for (int level = 0; level < n; ++level) {
        PixelErrors jumps, shares;
        double fan = 0;
        for (const GeomipBlock& block : world.blocks()) {
            const double jump_m = bench.terrain.quantum_m * restitched_jump(band_of(block, n, level));
            jumps.add(jump_m);
            const double bands = block.bands[static_cast<std::size_t>(level)];
            if (bands > 0) shares.add(jump_m / bands);
            fan = std::max(fan, bench.terrain.quantum_m * fan_jump(block, n, level));
        }
        table.rows.push_back({static_cast<double>(level), jumps.mean(), jumps.max(), shares.mean(), fan});
        chart.groups.push_back(fmt::format("{}", level));
        chart.series[0].values.push_back(jumps.mean());
        chart.series[1].values.push_back(jumps.max());
        chart.series[2].values.push_back(fan);
        least_mean = std::min(least_mean, jumps.mean());
        by_fan = std::max(by_fan, fan);
    }
    figure.checks = {at_least("band zipped anew: mean jump at any level (m)", least_mean, 0.5),
                     at_most("fan without its vertex: greatest jump (m)", by_fan, 0)};
    figure.tables.push_back(std::move(table));
    figure.svg = to_svg(chart);
    return figure;
}

}  // namespace scree
