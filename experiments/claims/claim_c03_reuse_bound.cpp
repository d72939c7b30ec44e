// C3: from |g1 - g0| < (s / tau) g0 follows only g1 > g0 (1 - s/tau), so an error of up to tau / (1 - s/tau).
#include <fmt/format.h>

#include "experiments/claims/claims.h"
#include "experiments/claims/sampling.h"
#include "runtime/report/plot.h"

namespace scree {
namespace {

constexpr double kFocal_px = 1098.99097, kTau_px = 1;

/// Correction that a vertex may have and be dropped.
double allowed_m(const glm::dvec3& eye, const glm::dvec3& vertex) {
    const glm::dvec3 d = vertex - eye;
    const double h2 = d.x * d.x + d.y * d.y;
    return kTau_px * (h2 + d.z * d.z) / (kFocal_px * std::sqrt(h2));
}

/// At which of the two eyes the allowance s is projected.
enum class At { old_eye, new_eye };

bool reused(const glm::dvec3& then, const glm::dvec3& now, double s_px, At at) {
    const double before = allowed_m(then, {0, 0, 0}), after = allowed_m(now, {0, 0, 0});
    return std::abs(after - before) < s_px / kTau_px * (at == At::old_eye ? before : after);
}

/// Of a vertex that just passed at the old eye.
double error_px(const glm::dvec3& then, const glm::dvec3& now) {
    return kTau_px * allowed_m(then, {0, 0, 0}) / allowed_m(now, {0, 0, 0});
}

/// Greatest error over random motions that the test lets pass.
double random_worst(Sampler& random, int samples, double s_px, At at) {
    double worst = 0;
    for (int k = 0; k < samples; ++k) {
        const glm::dvec3 then = random.log_uniform(10, 10000) * random.direction();
        const glm::dvec3 now = then + glm::length(then) * random.log_uniform(1e-3, 1) * random.direction();
        if (reused(then, now, s_px, at)) worst = std::max(worst, error_px(then, now));
    }
    return worst;
}

/// Straight at the vertex everything shrinks alike: the last eye that the test lets pass, to a share of the way.
double straight_worst(Sampler& random, double s_px, At at) {
    const glm::dvec3 then = random.log_uniform(10, 10000) * random.direction();
    double low = 0, high = 1;
    for (int k = 0; k < 60; ++k) {
        const double middle = (low + high) / 2;
        (reused(then, (1 - middle) * then, s_px, at) ? low : high) = middle;
    }
    return error_px(then, (1 - low) * then);
}

}  // namespace

Figure claim_c03_reuse_bound(const ClaimBench& bench) {
    const int samples = bench.amount(1'000'000, 50'000);
    Figure figure{
        "C3",
        "Reuse as published lets errors grow to tau / (1 - s/tau), and without bound from s = tau on.",
        "UC section 4",
        "A block is reused while the projected error stays below tau + s.",
        fmt::format("one vertex whose correction was just allowed at the old eye; {} random motions a row, and "
                    "straight flights at the vertex",
                    samples),
        {},
        {},
        {}};
    FigureTable table{"",
                      {"s / tau", "stated bound (tau)", "random motions (tau)", "straight at it (tau)",
                       "theory 1 / (1 - s/tau) (tau)", "allowance at the new eye (tau)"},
                      {}};
    LineChart chart{"Greatest error of reused vertices",
                    figure.setting,
                    {"s / tau", false, std::pair{0.0, 1.0}},
                    {"error / tau", true, {}},
                    {{"measured", {}},
                     {"theory", {}, true, false, true},
                     {"stated: 1 + s/tau", {}},
                     {"allowance at the new eye", {}}},
                    {}};
    Sampler random(bench.seed + 3);
    double off_theory = 0, over_stated = 0, fixed_over = -1, random_over = -1;
    for (const double share : {0.05, 0.1, 0.2, 0.5, 0.9}) {
        const double theory = 1 / (1 - share), scattered = random_worst(random, samples, share, At::old_eye);
        const double straight = straight_worst(random, share, At::old_eye);
        const double fixed =
            std::max(straight_worst(random, share, At::new_eye), random_worst(random, samples, share, At::new_eye));
        table.rows.push_back({share, 1 + share, scattered, straight, theory, fixed});
        off_theory = std::max(off_theory, std::abs(straight / theory - 1));
        over_stated = std::max(over_stated, straight / (1 + share));
        random_over = std::max(random_over, scattered / theory - 1);
        fixed_over = std::max(fixed_over, fixed - (1 + share));
        chart.series[0].points.emplace_back(share, straight);
        chart.series[1].points.emplace_back(share, theory);
        chart.series[2].points.emplace_back(share, 1 + share);
        chart.series[3].points.emplace_back(share, fixed);
    }
    const double unbounded = straight_worst(random, 1.0001, At::old_eye);
    table.rows.push_back({1.0001, 2.0001, random_worst(random, samples, 1.0001, At::old_eye), unbounded,
                          std::string("no bound"), straight_worst(random, 1.0001, At::new_eye)});
    figure.checks = {at_most("relative distance from the theory", off_theory, 1e-6),
                     at_most("random motions over the theory", random_over, 1e-9),
                     at_least("measured over stated at s = 0.9 tau", over_stated, 5),
                     at_least("error at s just above tau, over tau", unbounded, 1e9),
                     at_most("allowance at the new eye: error beyond tau + s, over tau", fixed_over, 1e-9)};
    figure.tables.push_back(std::move(table));
    figure.svg = to_svg(chart);
    return figure;
}

}  // namespace scree
