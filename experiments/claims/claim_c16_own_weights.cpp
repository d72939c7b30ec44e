// C16: two blocks of one level are at different distances, so the vertices of their common edge move differently.
#include <fmt/format.h>

#include "common/mesh/morphed_vertex.h"
#include "experiments/claims/claims.h"
#include "experiments/claims/geomip_flight.h"
#include "runtime/report/plot.h"

namespace scree {
namespace {

struct EdgeTally {
    std::int64_t vertices = 0, apart = 0, apart_by_rule = 0;
    PixelErrors gaps_m;
};

/// How far a block has moved from its level to the next, by its own distance (DB, eq. 3).
float own_weight(const GeomipWorld& world, std::size_t k, const GeomipDrawn& drawn, const Camera& camera,
                 const GeomipMetric& metric) {
    const auto passed = world.distances(world.blocks()[k], camera, metric);
    const auto level = static_cast<std::size_t>(drawn.level);
    const double from = passed[level], to = std::max(passed[level + 1], 1.25 * from);
    return static_cast<float>(std::clamp((drawn.distance_m - from) / (to - from), 0.0, 1.0));
}

void look_at_edge(const GeomipWorld& world, const GeomipBlock& west, int level, float of_west, float of_east,
                  EdgeTally& tally) {
    const int m = 1 << world.cells_log2(), stride = 1 << level;
    const auto z = [&](int j) { return static_cast<float>(west.heights_n[static_cast<std::size_t>(j * (m + 1) + m)]); };
    const float edge = std::max(of_west, of_east);
    for (int j = stride; j < m; j += 2 * stride) {
        const float next = 0.5f * (z(j - stride) + z(j + stride));
        const float a = morphed_height(z(j), next, of_west), b = morphed_height(z(j), next, of_east);
        // Each side computes it for itself: from the same numbers.
        const float c = morphed_height(z(j), next, edge), d = morphed_height(z(j), next, edge);
        ++tally.vertices;
        tally.apart += a != b ? 1 : 0;
        tally.apart_by_rule += c != d ? 1 : 0;
        tally.gaps_m.add(world.terrain().quantum_m * std::abs(static_cast<double>(a) - static_cast<double>(b)));
    }
}

}  // namespace

Figure claim_c16_own_weights(const ClaimBench& bench) {
    constexpr int n = 5;
    const GeomipWorld world(bench.terrain, n);
    const auto cameras = high_and_low(bench.terrain, bench.amount(20, 4));
    const int floats = bench.amount(1'000'000, 50'000);
    Figure figure{
        "C16",
        "Blocks that morph by their own distances open cracks along edges that they share at one level.",
        "DB section 2.3",
        "Morphing each block by its own distance gives a continuous surface.",
        fmt::format("{}, blocks of 33 x 33 vertices, {} frames high and low, tau 1 px; vertices of the edges between "
                    "blocks of one level, in floats",
                    bench.terrain.name, cameras.size()),
        {},
        {},
        {}};
    std::array<EdgeTally, n> tallies;
    const GeomipMetric metric{GeomipMetric::Delta::error, false, false, 1};
    for (const Camera& camera : cameras) {
        const auto drawn = world.select(camera, metric);
        for (int y = 0; y < world.rows(); ++y)
            for (int x = 0; x + 1 < world.columns(); ++x) {
                const std::size_t a = world.index(x, y), b = world.index(x + 1, y);
                const int level = drawn[a].level;
                if (level != drawn[b].level || level + 1 >= n) continue;
                const float of_a = own_weight(world, a, drawn[a], camera, metric),
                            of_b = own_weight(world, b, drawn[b], camera, metric);
                look_at_edge(world, world.blocks()[a], level, of_a, of_b, tallies[static_cast<std::size_t>(level)]);
            }
    }
    FigureTable table{"",
                      {"level", "vertices of common edges", "apart (%)", "mean gap (m)", "greatest gap (m)",
                       "apart with one weight an edge (%)"},
                      {}};
    BarChart chart{"Gaps between blocks of one level that morph by their own distances",
                   figure.setting,
                   "level",
                   {},
                   {"gap (m)", true, {}},
                   {{"mean", {}}, {"greatest", {}}},
                   {}};
    std::int64_t vertices = 0, apart = 0, by_rule = 0;
    double gap = 0;
    for (std::size_t level = 0; level < n; ++level) {
        EdgeTally& tally = tallies[level];
        if (tally.vertices == 0) continue;
        const auto percent = [&](std::int64_t part) {
            return 100.0 * static_cast<double>(part) / static_cast<double>(tally.vertices);
        };
        table.rows.push_back({static_cast<double>(level), static_cast<double>(tally.vertices), percent(tally.apart),
                              tally.gaps_m.mean(), tally.gaps_m.max(), percent(tally.apart_by_rule)});
        chart.groups.push_back(fmt::format("{}", level));
        chart.series[0].values.push_back(tally.gaps_m.mean());
        chart.series[1].values.push_back(tally.gaps_m.max());
        vertices += tally.vertices;
        apart += tally.apart;
        by_rule += tally.apart_by_rule;
        gap = std::max(gap, tally.gaps_m.max());
    }
    // z + w (c - z) against z (1 - w) + c w, at w = 1, where the next level takes over at c.
    Sampler random(bench.seed + 16);
    int missed = 0, missed_by_rule = 0;
    for (int k = 0; k < floats; ++k) {
        const volatile auto z = static_cast<float>(random.uniform(0, 4000)),
                            c = static_cast<float>(random.uniform(0, 4000));
        const volatile float difference = c - z;
        missed += z + 1.0f * difference != c ? 1 : 0;
        missed_by_rule += morphed_height(z, c, 1.0f) != c ? 1 : 0;
    }
    FigureTable ends{"ends",
                     {"formula at w = 1", "random floats that miss the next level's height (%)"},
                     {{std::string("z + w (c - z)"), 100.0 * missed / floats},
                      {std::string("z (1 - w) + c w"), 100.0 * missed_by_rule / floats}}};
    figure.checks = {
        at_least("vertices of common edges", static_cast<double>(vertices), 100),
        at_least("apart by own weights (%)",
                 vertices > 0 ? 100.0 * static_cast<double>(apart) / static_cast<double>(vertices) : 0, 30),
        at_least("greatest gap (m)", gap, 0.1),
        at_most("apart with one weight an edge", static_cast<double>(by_rule), 0),
        at_least("z + w (c - z) at w = 1: misses (%)", 100.0 * missed / floats, 5),
        at_most("z (1 - w) + c w at w = 1: misses (%)", 100.0 * missed_by_rule / floats, 0)};
    figure.tables = {std::move(table), std::move(ends)};
    figure.svg = to_svg(chart);
    return figure;
}

}  // namespace scree
