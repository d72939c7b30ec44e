// C10: what the strips between blocks miss is not bounded by what the blocks miss.
#include <fmt/format.h>

#include "experiments/claims.h"
#include "experiments/plot.h"
#include "experiments/rsg_world.h"
#include "experiments/strip.h"

namespace scree {
namespace {

/// A side of a block: the vertices along it, in the order of the strip.
struct Side {
    std::vector<double> z;
    std::vector<int> selected;
};

Side side_of(const RsgWorld& world, const RsgBlock& block, const BlockSelection& selection, bool along_x, int at) {
    Side side;
    for (int k = 0; k <= kRsgBlock; ++k) {
        const std::int32_t v = along_x ? world.bisection().index(k, at) : world.bisection().index(at, k);
        side.z.push_back(block.z[static_cast<std::size_t>(v)]);
        if (selection.is_active(v)) side.selected.push_back(k);
    }
    return side;
}

struct Strips {
    PixelErrors errors;  ///< the greatest of each strip in view
    PixelErrors blocks;  ///< of every vertex in view
};

/// Greatest error in view of the strip that goes from `corner` along one axis and lies across the other.
double strip_error_px(const Camera& camera, const Frustum& frustum, const Side& a, const Side& b,
                      const glm::dvec3& corner, const glm::dvec3& along, const glm::dvec3& across) {
    double worst = -1;
    sample_strip(a.z, b.z, zip_strip(a.selected, b.selected), [&](double t, double y, double drawn, double whole) {
        glm::dvec3 truth = corner + y * along + t * across, shown = truth;
        truth.z = whole;
        shown.z = drawn;
        if (frustum.contains(truth) && frustum.contains(shown))
            worst = std::max(worst, screen_distance_px(camera, truth, shown));
    });
    return worst;
}

Strips fly(const RsgWorld& world, const std::vector<Camera>& cameras, RsgMetric metric, double tau_px) {
    Strips strips;
    const double spacing = world.terrain().spacing_m;
    std::vector<BlockSelection> selections(world.blocks().size(), BlockSelection(world.bisection()));
    for (const Camera& camera : cameras) {
        const Frustum frustum(camera);
        for (std::size_t k = 0; k < world.blocks().size(); ++k) {
            world.select(world.blocks()[k], camera, metric, tau_px, selections[k]);
            if (frustum.may_see(world.blocks()[k].box))
                world.judge(world.blocks()[k], camera, selections[k], strips.blocks);
        }
        for (int y = 0; y < world.rows(); ++y)
            for (int x = 0; x < world.columns(); ++x)
                for (const bool eastward : {true, false}) {
                    const int x2 = x + (eastward ? 1 : 0), y2 = y + (eastward ? 0 : 1);
                    if (x2 >= world.columns() || y2 >= world.rows()) continue;
                    const auto at = [&](int i, int j) { return static_cast<std::size_t>(j * world.columns() + i); };
                    const Side a = side_of(world, world.block(x, y), selections[at(x, y)], !eastward, kRsgBlock);
                    const Side b = side_of(world, world.block(x2, y2), selections[at(x2, y2)], !eastward, 0);
                    const RsgBlock& block = world.block(x, y);
                    const glm::dvec3 east{spacing, 0, 0}, south{0, -spacing, 0};
                    const glm::dvec3 corner = world.terrain().place(block.i + (eastward ? kRsgBlock : 0),
                                                                    block.j + (eastward ? 0 : kRsgBlock));
                    const double px = strip_error_px(camera, frustum, a, b, {corner.x, corner.y, 0},
                                                     eastward ? south : east, eastward ? east : south);
                    if (px >= 0) strips.errors.add(px);
                }
    }
    return strips;
}

double share_over(PixelErrors& errors, double tau_px) {
    double low = 0, high = 1;  // of the values that do not pass tau
    for (int k = 0; k < 40; ++k) {
        const double middle = (low + high) / 2;
        (errors.quantile(middle) <= tau_px ? low : high) = middle;
    }
    return 100 * (1 - high);
}

/// Side A flat, side B rising 20 m a cell of 40 m, both drawn exactly by their two ends: greatest error of the strip.
double twisted_strip_m() {
    std::vector<double> a, b;
    for (int k = 0; k <= kRsgBlock; ++k) {
        a.push_back(0);
        b.push_back(20.0 * k);
    }
    const std::vector<int> ends{0, kRsgBlock};
    double worst = 0;
    sample_strip(a, b, zip_strip(ends, ends),
                 [&](double, double, double drawn, double whole) { worst = std::max(worst, std::abs(drawn - whole)); });
    return worst;
}

}  // namespace

Figure claim_c10_dikes(const ClaimBench& bench) {
    const RsgWorld world(bench.terrain);
    const auto cameras = loop_cameras(bench.terrain, {}, bench.amount(24, 5));
    Figure figure{
        "C10",
        "The dikes between blocks err by several pixels whatever the tolerance of the blocks.",
        "UC section 5",
        "The dike blends smoothly between blocks of any density.",
        fmt::format("{}, blocks of 33 x 33 vertices and strips one cell wide zipped between them, {} frames of a loop "
                    "at 1000 m, 8 degrees down, 40 degrees, 800 x 800",
                    bench.terrain.name, cameras.size()),
        {},
        {},
        {}};
    FigureTable table{"",
                      {"metric of the blocks", "tau (px)", "greatest error in blocks (px)",
                       "greatest error in strips (px)", "strips above tau (%)"},
                      {}};
    LineChart chart{"Greatest error in blocks and in the strips between them",
                    figure.setting,
                    {"tau (px)", true, {}},
                    {"greatest error (px)", true, {}},
                    {{"strips, own correction (UC)", {}},
                     {"strips, saturated (N*K)", {}},
                     {"blocks, saturated (N*K)", {}},
                     {"tau", {{0.5, 0.5}, {2, 2}}, true, false, true}},
                    {}};
    std::vector<double> strips;
    double blocks_over = 0, least_over = 1e9;
    for (const RsgMetric metric : {RsgMetric::local, RsgMetric::saturated})
        for (const double tau_px : {0.5, 1.0, 2.0}) {
            const bool local = metric == RsgMetric::local;
            Strips flown = fly(world, cameras, metric, tau_px);
            const double in_blocks = flown.blocks.max(), in_strips = flown.errors.max();
            table.rows.push_back({std::string(local ? "own correction (UC)" : "saturated, K (N*K)"), tau_px, in_blocks,
                                  in_strips, share_over(flown.errors, tau_px)});
            chart.series[local ? 0 : 1].points.emplace_back(tau_px, in_strips);
            if (local) continue;
            chart.series[2].points.emplace_back(tau_px, in_blocks);
            strips.push_back(in_strips);
            blocks_over = std::max(blocks_over, in_blocks / tau_px);
            least_over = std::min(least_over, in_strips / tau_px);
        }
    const double twisted = twisted_strip_m();
    FigureTable example{"twisted",
                        {"strip of 32 cells of 40 m, one side level, the other rising 0.5 m/m", "error (m)"},
                        {{std::string("both sides exact with two vertices"), twisted}}};
    figure.checks = {
        at_most("twisted strip: error from 160 m", std::abs(twisted - 160), 1e-9),
        at_most("saturated: greatest error in blocks over tau", blocks_over, 1),
        at_least("saturated: greatest error in strips over tau, at any tau", least_over, 1.1),
        at_least("greatest error in strips at tau 0.5 over that at tau 2", strips.front() / strips.back(), 0.35)};
    figure.tables = {std::move(table), std::move(example)};
    figure.svg = to_svg(chart);
    return figure;
}

}  // namespace scree
