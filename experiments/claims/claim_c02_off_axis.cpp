// C2: E = f |delta| |(u x P)_xy| / (Z_P Z_Q), u = up, P the point in camera axes; |u x P| = h, Z >= r / sqrt(K).
#include <fmt/format.h>

#include "experiments/claims/claims.h"
#include "experiments/claims/sampling.h"
#include "runtime/report/plot.h"

namespace scree {
namespace {

struct Screen {
    double fov_deg;
    int width_px, height_px;
};

/// A vertical displacement somewhere in view: how many times what the formula says of it is seen.
struct Seen {
    double ratio = 0;
    double identity_error = 0;  ///< relative, of the exact formula
};

Seen displace(Sampler& random, const Screen& screen) {
    for (;;) {
        const Camera camera = camera_at({0, 0, 0}, random.uniform(0, 6.283185307179586), random.uniform(-1.5, 0.5),
                                        screen.fov_deg, screen.width_px, screen.height_px);
        // Half of them at the very rim of the picture.
        const double reach = random.whole(0, 1) == 0 ? 1 : random.uniform(0, 1);
        const double across = random.uniform(-1, 1), up = reach * (random.whole(0, 1) == 0 ? 1 : -1);
        const double depth = random.log_uniform(1, 10000);
        const glm::dvec3 p = depth * (camera.forward + across * camera.tan_half_x() * camera.right() +
                                      up * camera.tan_half_y() * camera.up);
        const double delta = depth * random.log_uniform(1e-5, 0.05) * (random.whole(0, 1) == 0 ? 1 : -1);
        const glm::dvec3 q = p + glm::dvec3(0, 0, delta);
        // A hair within the rim, where rounding may take P to the other side.
        if (!Frustum(camera).contains(p * (1 - 1e-12)) || !Frustum(camera).contains(q)) continue;
        const double seen_px = screen_distance_px(camera, p, q);
        const double h = std::hypot(p.x, p.y),
                     stated_px = camera.focal_px() * std::abs(delta) * h / (glm::length(p) * glm::length(q));
        const glm::dvec3 u{camera.right().z, camera.up.z, camera.forward.z};
        const glm::dvec3 c{glm::dot(p, camera.right()), glm::dot(p, camera.up), depth};
        const glm::dvec3 turned = glm::cross(u, c);
        const double exact_px = camera.focal_px() * std::abs(delta) * std::hypot(turned.x, turned.y) /
                                (depth * glm::dot(q, camera.forward));
        return {seen_px / stated_px, std::abs(seen_px - exact_px) / exact_px};
    }
}

}  // namespace

Figure claim_c02_off_axis(const ClaimBench& bench) {
    const int samples = bench.amount(1'000'000, 50'000);
    Figure figure{
        "C2",
        "Off the optical axis a vertical error is seen larger than the formula says, by up to K.",
        "Lindstrom et al. 1996; UC section 3",
        "A vertex displaced vertically by delta is seen displaced by f delta h / (h^2 + dz^2).",
        fmt::format("{} vertical displacements in view a row, of 1e-5 to 1/20 of their depth, from any pose; half "
                    "at the rim of the picture",
                    samples),
        {},
        {},
        {}};
    FigureTable table{"",
                      {"vertical field of view (deg)", "picture (px)", "K", "greatest ratio", "greatest / K",
                       "ratio not passed by 99 %", "mean ratio"},
                      {}};
    BarChart chart{"What is seen over what the formula says",
                   figure.setting,
                   "vertical field of view, picture",
                   {},
                   {"seen / formula", false, {}},
                   {{"greatest", {}}, {"99 %", {}}, {"K", {}}},
                   {{"the formula", 1}}};
    Sampler random(bench.seed);
    double greatest_of_k = 0, identity = 0, at_40 = 0;
    for (const Screen& screen : {Screen{40, 800, 800}, {60, 800, 800}, {90, 800, 800}, {90, 1920, 1080}}) {
        PixelErrors ratios;
        for (int k = 0; k < samples; ++k) {
            const Seen seen = displace(random, screen);
            ratios.add(seen.ratio);
            identity = std::max(identity, seen.identity_error);
        }
        const double k_factor =
            camera_at({}, 0, 0, screen.fov_deg, screen.width_px, screen.height_px).off_axis_factor();
        const double most = ratios.quantile(0.99);
        const std::string picture = fmt::format("{} x {}", screen.width_px, screen.height_px);
        table.rows.push_back(
            {screen.fov_deg, picture, k_factor, ratios.max(), ratios.max() / k_factor, most, ratios.mean()});
        chart.groups.push_back(fmt::format("{:g} deg, {}", screen.fov_deg, picture));
        chart.series[0].values.push_back(ratios.max());
        chart.series[1].values.push_back(most);
        chart.series[2].values.push_back(k_factor);
        greatest_of_k = std::max(greatest_of_k, ratios.max() / k_factor);
        if (screen.fov_deg == 40) at_40 = ratios.max();
    }
    figure.checks = {at_least("greatest ratio at 40 degrees", at_40, 1.2),
                     at_most("greatest ratio over K", greatest_of_k, 1 + 1e-9),
                     at_most("greatest relative error of the exact formula", identity, 1e-6)};
    figure.tables.push_back(std::move(table));
    figure.svg = to_svg(chart);
    return figure;
}

}  // namespace scree
