// C7: delta(v) is one level's correction; vertices dropped above one another add up. The saturated metric keeps tau.
#include <fmt/format.h>

#include "experiments/claims/claims.h"
#include "experiments/claims/rsg_world.h"
#include "runtime/report/plot.h"

namespace scree {
namespace {

struct Flown {
    PixelErrors errors;
    double triangles = 0;  ///< a frame
    std::int64_t links = 0, links_that_pass = 0;
};

Flown fly(const RsgWorld& world, const std::vector<Camera>& cameras, RsgMetric metric, double tau_px) {
    Flown flown;
    BlockSelection selection(world.bisection());
    for (const Camera& camera : cameras) {
        const Frustum frustum(camera);
        for (const RsgBlock& block : world.blocks()) {
            if (!frustum.may_see(block.box)) continue;
            world.select(block, camera, metric, tau_px, selection);
            world.judge(block, camera, selection, flown.errors);
            flown.triangles += static_cast<double>(selection.triangles()) / static_cast<double>(cameras.size());
            for (const std::int32_t v : world.bisection().coarse_to_fine()) {
                if (!world.test_fails(block, v, camera, metric, tau_px)) continue;
                for (const std::int32_t parent : world.bisection().vertex(v).parents) {
                    if (parent < 0 || world.bisection().vertex(parent).level == 0) continue;
                    ++flown.links;
                    flown.links_that_pass += world.test_fails(block, parent, camera, metric, tau_px) ? 0 : 1;
                }
            }
        }
    }
    return flown;
}

}  // namespace

Figure claim_c07_local_corrections(const ClaimBench& bench) {
    const RsgWorld world(bench.terrain);
    const auto cameras = loop_cameras(bench.terrain, {}, bench.amount(24, 4));
    Figure figure{
        "C7",
        "Without any caching the published vertex test lets errors of about twice tau pass.",
        "UC section 3; Lindstrom et al. 1996",
        "Dropping the vertices whose own projected correction is within tau keeps the surface within tau.",
        fmt::format("{}, blocks of 33 x 33 vertices, {} frames of a loop at 1000 m, 8 degrees down, 40 degrees, 800 x "
                    "800; vertices in view against the finest surface",
                    bench.terrain.name, cameras.size()),
        {},
        {},
        {}};
    FigureTable table{"",
                      {"metric", "tau (px)", "triangles a frame", "greatest error (px)", "not passed by 99 % (px)",
                       "mean error (px)", "parents that pass of vertices that fail (%)"},
                      {}};
    LineChart chart{
        "Greatest error of what is drawn, no caching",
        figure.setting,
        {"tau (px)", true, {}},
        {"greatest error (px)", true, {}},
        {{"own correction (UC)", {}}, {"saturated, K (N*K)", {}}, {"tau", {{0.5, 0.5}, {2, 2}}, true, false, true}},
        {}};
    double least_local = 1e9, worst_saturated = 0, links = 0, broken = 0;
    for (const RsgMetric metric : {RsgMetric::local, RsgMetric::saturated}) {
        const bool local = metric == RsgMetric::local;
        for (const double tau_px : {0.5, 1.0, 2.0}) {
            Flown flown = fly(world, cameras, metric, tau_px);
            const double worst = flown.errors.max();
            const double open =
                flown.links > 0 ? 100.0 * static_cast<double>(flown.links_that_pass) / static_cast<double>(flown.links)
                                : 0;
            table.rows.push_back({std::string(local ? "own correction (UC)" : "saturated, K (N*K)"), tau_px,
                                  std::round(flown.triangles), worst, flown.errors.quantile(0.99), flown.errors.mean(),
                                  open});
            chart.series[local ? 0 : 1].points.emplace_back(tau_px, worst);
            if (local) {
                least_local = std::min(least_local, worst / tau_px);
                links = std::max(links, open);
            } else {
                worst_saturated = std::max(worst_saturated, worst / tau_px);
                broken = std::max(broken, open);
            }
        }
    }
    figure.checks = {at_least("own correction: greatest error over tau, at any tau", least_local, 1.3),
                     at_most("saturated, K: greatest error over tau", worst_saturated, 1),
                     at_least("own correction: parents that pass of vertices that fail (%)", links, 10),
                     at_most("saturated, K: the same", broken, 0)};
    figure.tables.push_back(std::move(table));
    figure.svg = to_svg(chart);
    return figure;
}

}  // namespace scree
