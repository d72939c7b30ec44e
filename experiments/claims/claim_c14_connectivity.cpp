// C14: thinning an edge changes the surface, not only its shading; a block at level 0 beside one at level 1 errs.
#include <fmt/format.h>

#include "common/mesh/tile_patterns.h"
#include "experiments/claims/claims.h"
#include "experiments/claims/geomip_flight.h"
#include "runtime/report/plot.h"

namespace scree {
namespace {

/// Of a block and its eastern neighbour, one level coarser, both just past the distances of their levels: greatest
/// error of the block, over tau.
PixelErrors just_past(const GeomipWorld& world, Sampler& random, const GeomipMetric& metric, int samples) {
    const Camera camera = camera_at({}, 0, 0);
    PixelErrors errors;
    while (samples-- > 0) {
        const int x = random.whole(0, world.columns() - 2), y = random.whole(0, world.rows() - 1);
        const GeomipBlock &west = world.block(x, y), &east = world.block(x + 1, y);
        GeomipDrawn drawn;
        drawn.level = random.whole(1, world.cells_log2() - 2);
        drawn.thinned = kEdgeEast;
        const auto level = static_cast<std::size_t>(drawn.level);
        const double west_m = world.distances(west, camera, metric)[level];
        const double east_m = world.distances(east, camera, metric)[level + 1];
        const double turn = random.uniform(0, 6.283185307179586);
        const glm::dvec3 ahead{std::cos(turn), std::sin(turn), random.uniform(0, 0.3)};
        const glm::dvec3 from = 0.5 * (west.box.low + west.box.high);
        double near = 0, far = 1e7;
        for (int k = 0; k < 60; ++k) {
            const double middle = (near + far) / 2;
            const glm::dvec3 eye = from + middle * ahead;
            const bool past = distance_to_box(eye, west.box) > west_m && distance_to_box(eye, east.box) > east_m;
            (past ? far : near) = middle;
        }
        errors.add(world.error_on_axis_px(west, drawn, from + far * ahead, camera.focal_px()) / metric.tau_px);
    }
    return errors;
}

}  // namespace

Figure claim_c14_connectivity(const ClaimBench& bench) {
    const auto cameras = high_and_low(bench.terrain, bench.amount(16, 3));
    Figure figure{
        "C14",
        "Bands that close cracks err by metres where the level is taken for exact, and pass tau if not counted.",
        "DB section 2.4",
        "Connecting blocks of different levels changes only the shading.",
        fmt::format("{}, {} frames high and low, 40 degrees, 800 x 800, distance to the box, K, neighbours within one "
                    "level",
                    bench.terrain.name, cameras.size()),
        {},
        {},
        {}};
    FigureTable still{"",
                      {"block (cells)", "level", "mean error with thinned edges (m)", "greatest (m)",
                       "mean of thinned over whole", "greatest of thinned over whole"},
                      {}};
    FigureTable flown{"flown",
                      {"block (cells)", "bands counted", "tau (px)", "triangles a frame", "greatest error (px)",
                       "not passed by 99 % (px)"},
                      {}};
    LineChart chart{"Greatest error with and without bands in the levels' errors",
                    figure.setting,
                    {"tau (px)", true, {}},
                    {"greatest error (px)", true, {}},
                    {{"17 x 17, bands not counted", {}},
                     {"17 x 17, counted", {}},
                     {"33 x 33, bands not counted", {}},
                     {"33 x 33, counted", {}},
                     {"tau", {{1, 1}, {8, 8}}, true, false, true}},
                    {}};
    FigureTable past{
        "just_past", {"block (cells)", "bands counted", "mean error over tau", "greatest error over tau"}, {}};
    Sampler random(bench.seed + 14);
    double uncounted_past = 0, counted_past = 0;
    double at_0 = 0, counted = 0;
    for (const int n : {4, 5}) {
        const GeomipWorld world(bench.terrain, n);
        for (int level = 0; level < n; ++level) {
            const auto k = static_cast<std::size_t>(level);
            PixelErrors thinned, over;
            for (const GeomipBlock& block : world.blocks()) {
                thinned.add(block.bands[k]);
                if (block.error[k] > 0) over.add(block.bands[k] / block.error[k]);
            }
            const std::string none = "level 0 is exact whole";
            still.rows.push_back({static_cast<double>(1 << n), static_cast<double>(level), thinned.mean(),
                                  thinned.max(), level > 0 ? FigureCell(over.mean()) : FigureCell(none),
                                  level > 0 ? FigureCell(over.max()) : FigureCell(none)});
            if (level == 0) at_0 = std::max(at_0, thinned.mean());
        }
        for (const bool with : {false, true}) {
            const auto delta = with ? GeomipMetric::Delta::bands : GeomipMetric::Delta::error;
            const PixelErrors errors = just_past(world, random, {delta, true, false, 8}, bench.amount(6000, 2500));
            past.rows.push_back(
                {static_cast<double>(1 << n), std::string(with ? "yes" : "no"), errors.mean(), errors.max()});
            double& over = with ? counted_past : uncounted_past;
            over = std::max(over, errors.max());
        }
        for (const bool with : {false, true})
            for (const double tau_px : {1.0, 2.0, 8.0}) {
                const auto delta = with ? GeomipMetric::Delta::bands : GeomipMetric::Delta::error;
                GeomipFlown f = fly_geomip(world, cameras, {delta, true, true, tau_px});
                const double worst = f.errors.max();
                flown.rows.push_back({static_cast<double>(1 << n), std::string(with ? "yes" : "no"), tau_px,
                                      std::round(f.triangles), worst, f.errors.quantile(0.99)});
                chart.series[static_cast<std::size_t>((n - 4) * 2 + (with ? 1 : 0))].points.emplace_back(tau_px, worst);
                if (with) counted = std::max(counted, worst / tau_px);
            }
    }
    figure.checks = {
        at_least("level 0 beside level 1: mean error (m)", at_0, 1),
        at_least("bands not counted, just past the levels' distances: greatest error over tau", uncounted_past, 1.05),
        at_most("bands counted, the same", counted_past, 1 + 1e-6),
        at_most("bands counted: greatest error over tau", counted, 1)};
    figure.tables = {std::move(still), std::move(past), std::move(flown)};
    figure.svg = to_svg(chart);
    return figure;
}

}  // namespace scree
