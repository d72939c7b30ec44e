// C12: the error against level n - 1 is not the error against level 0.
#include <fmt/format.h>

#include "experiments/claims/claims.h"
#include "experiments/claims/geomip_flight.h"
#include "runtime/report/plot.h"

namespace scree {

Figure claim_c12_level_to_level(const ClaimBench& bench) {
    constexpr int n = 5;
    const GeomipWorld world(bench.terrain, n);
    const auto cameras = high_and_low(bench.terrain, bench.amount(24, 4));
    Figure figure{
        "C12",
        "A level's error against the level before it is too small in most blocks, and several pixels are missed.",
        "DB section 2.2",
        "delta of a level, its largest change of height from the level before, bounds what is seen when it is drawn.",
        fmt::format(
            "{}, {} blocks of 33 x 33 vertices; {} frames high and low, 40 degrees, 800 x 800, neighbours within "
            "one level, distance to the centre",
            bench.terrain.name, world.blocks().size(), cameras.size()),
        {},
        {},
        {}};
    FigureTable table{"",
                      {"level", "blocks whose step is too small (%)", "greatest error over step",
                       "mean of summed steps over error", "blocks whose error falls from the level before (%)"},
                      {}};
    BarChart chart{"Blocks in which the error against the level before is too small",
                   figure.setting,
                   "level",
                   {},
                   {"blocks (%)", false, std::pair{0.0, 100.0}},
                   {{"", {}}},
                   {}};
    double at_3 = 0, worst = 0;
    for (int level = 2; level <= n; ++level) {
        const auto k = static_cast<std::size_t>(level);
        int small = 0, falling = 0, counted = 0;
        double greatest = 1, summed = 0;
        for (const GeomipBlock& block : world.blocks()) {
            if (!(block.error[k] > 0)) continue;
            ++counted;
            double sum = 0;
            for (std::size_t g = 1; g <= k; ++g) sum += block.step[g];
            summed += sum / block.error[k];
            small += block.step[k] < block.error[k] ? 1 : 0;
            if (block.step[k] > 0) greatest = std::max(greatest, block.error[k] / block.step[k]);
            falling += block.error[k] < block.error[k - 1] ? 1 : 0;
        }
        const double of = std::max(counted, 1);
        table.rows.push_back({static_cast<double>(level), 100 * small / of, greatest, summed / of, 100 * falling / of});
        chart.groups.push_back(fmt::format("{}", level));
        chart.series[0].values.push_back(100 * small / of);
        worst = std::max(worst, greatest);
        if (level == 3) at_3 = 100 * small / of;
    }
    FigureTable flown{
        "flown",
        {"delta", "tau (px)", "triangles a frame", "greatest error (px)", "not passed by 99 % (px)", "mean error (px)"},
        {}};
    double by_step = 0;
    for (const bool step : {true, false})
        for (const double tau_px : {0.5, 1.0, 2.0}) {
            const GeomipMetric metric{step ? GeomipMetric::Delta::step : GeomipMetric::Delta::error, false, false,
                                      tau_px};
            GeomipFlown f = fly_geomip(world, cameras, metric);
            flown.rows.push_back({std::string(step ? "against the level before" : "against level 0"), tau_px,
                                  std::round(f.triangles), f.errors.max(), f.errors.quantile(0.99), f.errors.mean()});
            if (step) by_step = std::max(by_step, f.errors.max() / tau_px);
        }
    figure.checks = {at_least("level 3: blocks whose step is too small (%)", at_3, 40),
                     at_least("greatest error over step", worst, 1.5),
                     at_least("flown by steps: greatest error over tau", by_step, 1.5)};
    figure.tables = {std::move(table), std::move(flown)};
    figure.svg = to_svg(chart);
    return figure;
}

}  // namespace scree
