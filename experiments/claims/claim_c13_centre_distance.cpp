// C13: the distance to a block's centre passes the distance to its nearest point, without bound near the block.
#include <fmt/format.h>

#include "experiments/claims/claims.h"
#include "experiments/claims/geomip_flight.h"
#include "runtime/report/plot.h"

namespace scree {
namespace {

/// Of blocks drawn at a level whose distance the eye has just passed: greatest error, over tau.
PixelErrors just_past(const GeomipWorld& world, Sampler& random, const GeomipMetric& metric, int samples) {
    const Camera camera = camera_at({}, 0, 0);
    PixelErrors errors;
    while (samples-- > 0) {
        const GeomipBlock& block =
            world.blocks()[static_cast<std::size_t>(random.whole(0, static_cast<int>(world.blocks().size()) - 1))];
        GeomipDrawn drawn;
        drawn.level = random.whole(1, world.cells_log2() - 1);
        const double past_m =
            world.distances(block, camera, metric)[static_cast<std::size_t>(drawn.level)] * (1 + 1e-9);
        const glm::dvec3 centre = 0.5 * (block.box.low + block.box.high);
        const double turn = random.uniform(0, 6.283185307179586);
        const glm::dvec3 ahead{std::cos(turn), std::sin(turn), random.uniform(0, 0.3)};
        double near = 0, far = 1e7;  // along the ray from the centre
        for (int k = 0; k < 60; ++k) {
            const double middle = (near + far) / 2;
            const glm::dvec3 eye = centre + middle * ahead;
            const double d = metric.to_box ? distance_to_box(eye, block.box) : glm::distance(eye, centre);
            (d < past_m ? near : far) = middle;
        }
        const glm::dvec3 eye = centre + far * ahead;
        if (!(distance_to_box(eye, block.box) > 0)) continue;  // within the block anything may be
        errors.add(world.error_on_axis_px(block, drawn, eye, camera.focal_px()) / metric.tau_px);
    }
    return errors;
}

}  // namespace

Figure claim_c13_centre_distance(const ClaimBench& bench) {
    constexpr int n = 5;
    const GeomipWorld world(bench.terrain, n);
    const int samples = bench.amount(200'000, 10'000);
    const auto cameras = high_and_low(bench.terrain, bench.amount(24, 3));
    Figure figure{
        "C13",
        "By the distance to the centre errors near the eye are taken for a fraction of what they are.",
        "DB section 2.2",
        "The distance from the eye to the block's centre decides its level.",
        fmt::format(
            "{}, {} blocks of 33 x 33 vertices; {} eyes a row over or within two blocks of one; {} frames high and "
            "low, 40 degrees, 800 x 800, true errors against level 0 with edges thinned",
            bench.terrain.name, world.blocks().size(), samples, cameras.size()),
        {},
        {},
        {}};
    FigureTable table{
        "", {"eye above the block's highest point (m)", "mean of centre over box distance", "greatest"}, {}};
    Sampler random(bench.seed + 13);
    std::vector<double> means;
    const double side = bench.terrain.spacing_m * (1 << n);
    for (const double above_m : {2.0, 100.0, 1000.0}) {
        PixelErrors ratios;
        for (int k = 0; k < samples; ++k) {
            const Box& box =
                world.blocks()[static_cast<std::size_t>(random.whole(0, static_cast<int>(world.blocks().size()) - 1))]
                    .box;
            const glm::dvec3 eye{random.uniform(box.low.x - 2 * side, box.high.x + 2 * side),
                                 random.uniform(box.low.y - 2 * side, box.high.y + 2 * side), box.high.z + above_m};
            ratios.add(glm::distance(eye, 0.5 * (box.low + box.high)) / distance_to_box(eye, box));
        }
        table.rows.push_back({above_m, ratios.mean(), ratios.max()});
        means.push_back(ratios.mean());
    }
    FigureTable past{"just_past", {"distance", "tau (px)", "mean error over tau", "greatest error over tau"}, {}};
    double centre_past = 0, box_past = 0;
    for (const bool to_box : {false, true})
        for (const double tau_px : {2.0, 8.0, 32.0}) {
            const PixelErrors errors =
                just_past(world, random, {GeomipMetric::Delta::error, to_box, false, tau_px}, bench.amount(2000, 200));
            past.rows.push_back({std::string(to_box ? "box" : "centre"), tau_px, errors.mean(), errors.max()});
            (to_box ? box_past : centre_past) = std::max(to_box ? box_past : centre_past, errors.max());
        }
    FigureTable flown{
        "flown",
        {"distance", "K", "tau (px)", "triangles a frame", "greatest error (px)", "not passed by 99 % (px)"},
        {}};
    LineChart chart{"Greatest error by what the distance is measured to",
                    figure.setting,
                    {"tau (px)", true, {}},
                    {"greatest error (px)", true, {}},
                    {{"centre (DB)", {}}, {"box", {}}, {"box, K", {}}, {"tau", {{1, 1}, {8, 8}}, true, false, true}},
                    {}};
    double centre_over = 0, box_over = 0, guaranteed_over = 0;
    for (int rule = 0; rule < 3; ++rule)
        for (const double tau_px : {1.0, 2.0, 8.0}) {
            GeomipFlown f = fly_geomip(world, cameras, {GeomipMetric::Delta::bands, rule > 0, rule == 2, tau_px});
            const double worst = f.errors.max();
            flown.rows.push_back({std::string(rule == 0 ? "centre" : "box"), std::string(rule == 2 ? "yes" : "no"),
                                  tau_px, std::round(f.triangles), worst, f.errors.quantile(0.99)});
            chart.series[static_cast<std::size_t>(rule)].points.emplace_back(tau_px, worst);
            double& over = rule == 0 ? centre_over : rule == 1 ? box_over : guaranteed_over;
            over = std::max(over, worst / tau_px);
        }
    figure.checks = {
        at_least("2 m above: mean of centre over box distance", means[0], 5),
        at_least("1000 m above: the same", means[2], 1.15),
        at_least("centre, just past a level's distance: greatest error over tau", centre_past, 1.3),
        at_most("box, just past a level's distance: greatest error over tau", box_past, 1 + 1e-6),
        at_least("centre, flown: greatest error over tau, beyond that by the box", centre_over - box_over, 0),
        at_most("box and K: greatest error over tau", guaranteed_over, 1)};
    figure.tables = {std::move(table), std::move(past), std::move(flown)};
    figure.svg = to_svg(chart);
    return figure;
}

}  // namespace scree
