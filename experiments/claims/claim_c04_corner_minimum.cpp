// C4: g = h + dz^2 / h is least at h = |dz|, not at the corners: on an edge near the eye, on higher ground inside, or
// where the 45 degree ring round the eye crosses the block.
#include <fmt/format.h>

#include <limits>

#include "experiments/claims/claims.h"
#include "experiments/claims/eye_rings.h"
#include "runtime/report/plot.h"

namespace scree {
namespace {

struct EyeHeight {
    std::string name;
    double (*z)(Sampler&, const Box&);
};

/// How far the least allowance over the corners is above the least over all vertices.
double corner_excess(const RsgWorld& world, const RsgBlock& block, const glm::dvec3& eye) {
    double corners = std::numeric_limits<double>::infinity(), all = corners;
    for (const glm::dvec3& corner : corners_of(world, block)) corners = std::min(corners, allowance(eye, corner));
    for (std::int32_t v = 0; v < static_cast<std::int32_t>(block.z.size()); ++v)
        all = std::min(all, allowance(eye, world.place(block, v)));
    return corners / all;
}

}  // namespace

Figure claim_c04_corner_minimum(const ClaimBench& bench) {
    const int samples = bench.amount(4000, 400);
    const RsgWorld world(bench.terrain);
    Figure figure{"C4",
                  "The least allowance over a block's corners is mostly not the least over the block.",
                  "UC section 4",
                  "The minimum of the allowance at the four corners bounds it over the block.",
                  fmt::format("{}, blocks of {} m, {} eyes beside a random block for each ring and height",
                              bench.terrain.name, kRsgBlock * bench.terrain.spacing_m, samples),
                  {},
                  {},
                  {}};
    FigureTable table{"",
                      {"eye height", "distance in plan (block sides)", "eyes with a vertex below the corners (%)",
                       "greatest corner minimum over true minimum"},
                      {}};
    BarChart chart{"Eyes from which some vertex lies below the corner minimum",
                   figure.setting,
                   "distance in plan to the block (block sides)",
                   {},
                   {"eyes (%)", false, std::pair{0.0, 100.0}},
                   {},
                   {}};
    for (const EyeRing& ring : kEyeRings) chart.groups.push_back(ring.name);
    const std::array<EyeHeight, 3> heights{
        {{"in the relief", [](Sampler& random, const Box& box) { return random.uniform(box.low.z, box.high.z); }},
         {"100 m above the block", [](Sampler&, const Box& box) { return box.high.z + 100; }},
         {"1000 m", [](Sampler&, const Box&) { return 1000.0; }}}};
    Sampler random(bench.seed + 4);
    double nearest = 100, furthest = 0, worst = 0;
    for (const EyeHeight& height : heights) {
        chart.series.push_back({height.name, {}});
        for (const EyeRing& ring : kEyeRings) {
            int below = 0;
            double greatest = 1;
            for (int k = 0; k < samples; ++k) {
                const RsgBlock& block = random_block(random, world);
                const glm::dvec3 eye = eye_in_ring(random, block.box, ring, height.z(random, block.box));
                const double excess = corner_excess(world, block, eye);
                below += excess > 1 + 1e-12 ? 1 : 0;
                greatest = std::max(greatest, excess);
            }
            const double percent = 100.0 * below / samples;
            table.rows.push_back({height.name, ring.name, percent, greatest});
            chart.series.back().values.push_back(percent);
            if (ring.from == 0) nearest = std::min(nearest, percent);
            if (ring.to == 10) furthest = std::max(furthest, percent);
            worst = std::max(worst, greatest);
        }
    }
    // Flat ground, the eye 1000 m up, 600 m before the middle of a side of 960 m: the ring crosses the block.
    const glm::dvec3 eye{480, -600, 1000};
    double corner = std::numeric_limits<double>::infinity(), inside = corner;
    for (int j = 0; j <= 960; ++j)
        for (int i = 0; i <= 960; i += 480) {
            const double g = allowance(eye, {i, j, 0});
            inside = std::min(inside, g);
            if (i % 960 == 0 && j % 960 == 0) corner = std::min(corner, g);
        }
    table.rows.push_back(
        {std::string("flat block, 1000 m above, 600 m before it"), std::string("one eye"), 100.0, corner / inside});
    figure.checks = {at_least("eyes within a tenth of a side with a vertex below the corners (%)", nearest, 70),
                     at_most("eyes three to ten sides away (%)", furthest, 40),
                     at_least("greatest corner minimum over true minimum", worst, 5),
                     at_most("flat block: corner minimum from 2069.82 m", std::abs(corner - 2069.82), 0.01),
                     at_most("flat block: true minimum from 2000 m", std::abs(inside - 2000), 0.01)};
    figure.tables.push_back(std::move(table));
    figure.svg = to_svg(chart);
    return figure;
}

}  // namespace scree
