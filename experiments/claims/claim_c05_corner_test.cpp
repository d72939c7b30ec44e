// C5: the block test at the corners does not imply the vertex test; T1 (Scree lod, 1.2) does.
#include <fmt/format.h>

#include "experiments/claims/claims.h"
#include "experiments/claims/eye_rings.h"
#include "runtime/report/plot.h"
#include "runtime/lod/reuse.h"

namespace scree {
namespace {

constexpr double kFocal_px = 1098.99097, kTau_px = 1, kShare = 0.1;  // s / tau

enum class Test { p1, p2, t1 };
constexpr std::array<Test, 3> kTests{Test::p1, Test::p2, Test::t1};
std::string name_of(Test test) {
    return test == Test::p1   ? "P1: greatest change < least allowance"
           : test == Test::p2 ? "P2: each corner by itself"
                              : "T1: hyperbolic, exact";
}

bool reused(Test test, const std::array<glm::dvec3, 4>& corners, const Box& box, const glm::dvec3& then,
            const glm::dvec3& now) {
    if (test == Test::p1) return reuse_p1(then, now, corners, box, kFocal_px, kShare * kTau_px, kTau_px);
    if (test == Test::p2) return reuse_p2(then, now, corners, box, kFocal_px, kShare * kTau_px, kTau_px);
    return reuse_t1(eye_to_box(then, box), eye_to_box(now, box), glm::distance(then, now), {kTau_px, kShare * kTau_px});
}

/// Of one test and ring.
struct Tally {
    int motions = 0, accepted = 0, violating = 0, over = 0;
    double worst = 0;  ///< error over tau
};

/// What becomes of vertices that just passed at the old eye.
void follow(const RsgWorld& world, const RsgBlock& block, const glm::dvec3& then, const glm::dvec3& now, double& growth,
            bool& violates) {
    growth = 0;
    violates = false;
    for (std::int32_t v = 0; v < static_cast<std::int32_t>(block.z.size()); ++v) {
        const glm::dvec3 place = world.place(block, v);
        const double before = allowance(then, place), after = allowance(now, place);
        growth = std::max(growth, before / after);
        violates = violates || std::abs(after - before) >= kShare * before;
    }
}

/// Block side 960 m, flat: 10 m from the middle of a side, 9 m nearer. The corners hardly change, the vertex there
/// does.
double counter_example(Test test) {
    const std::array<glm::dvec3, 4> corners{{{0, 0, 0}, {960, 0, 0}, {0, 960, 0}, {960, 960, 0}}};
    const Box box{{0, 0, 0}, {960, 960, 0}};
    const glm::dvec3 then{480, -10, 0}, now{480, -1, 0}, vertex{480, 0, 0};
    return reused(test, corners, box, then, now) ? allowance(then, vertex) / allowance(now, vertex) : 0;
}

}  // namespace

Figure claim_c05_corner_test(const ClaimBench& bench) {
    const int samples = bench.amount(20000, 1500);
    const RsgWorld world(bench.terrain);
    Figure figure{
        "C5",
        "Blocks that the corner test lets reuse hold vertices far beyond tau + s; the hyperbolic test none.",
        "UC section 4",
        "If the test holds at the block's corners, every vertex keeps to tau + s.",
        fmt::format("{}, blocks of {} m, s = tau / 10, {} motions of 1 to 200 m a ring, eyes in the relief or up "
                    "to 1000 m above",
                    bench.terrain.name, kRsgBlock * bench.terrain.spacing_m, samples),
        {},
        {},
        {}};
    FigureTable table{
        "",
        {"test", "distance in plan (block sides)", "accepted (%)", "of these a vertex fails its own test (%)",
         "of these a vertex passes tau + s (%)", "greatest error (tau)"},
        {}};
    BarChart chart{"Blocks reused in which some vertex passes tau + s",
                   figure.setting,
                   "distance in plan to the block (block sides)",
                   {},
                   {"of the blocks accepted (%)", false, {}},
                   {},
                   {}};
    for (const EyeRing& ring : kEyeRings) chart.groups.push_back(ring.name);
    std::array<std::array<Tally, kEyeRings.size()>, kTests.size()> tallies{};
    for (std::size_t r = 0; r < kEyeRings.size(); ++r) {
        Sampler random(bench.seed + 5 + r);
        for (int k = 0; k < samples; ++k) {
            const RsgBlock& block = random_block(random, world);
            const double z =
                random.uniform(block.box.low.z, block.box.high.z) + (k % 2 == 0 ? 0 : random.uniform(0, 1000));
            const glm::dvec3 then = eye_in_ring(random, block.box, kEyeRings[r], z);
            const glm::dvec3 now = then + random.log_uniform(1, 200) * random.direction();
            if (distance_in_plan(now, block.box) == 0) continue;
            const auto corners = corners_of(world, block);
            double growth = -1;
            bool violates = false;
            for (std::size_t t = 0; t < kTests.size(); ++t) {
                Tally& tally = tallies[t][r];
                ++tally.motions;
                if (!reused(kTests[t], corners, block.box, then, now)) continue;
                if (growth < 0) follow(world, block, then, now, growth, violates);
                ++tally.accepted;
                tally.violating += violates ? 1 : 0;
                tally.over += growth > 1 + kShare + 1e-9 ? 1 : 0;
                tally.worst = std::max(tally.worst, growth);
            }
        }
    }
    const auto percent = [](int part, int of) { return of > 0 ? 100.0 * part / of : 0.0; };
    for (std::size_t t = 0; t < kTests.size(); ++t) {
        chart.series.push_back({name_of(kTests[t]), {}});
        for (std::size_t r = 0; r < kEyeRings.size(); ++r) {
            const Tally& tally = tallies[t][r];
            table.rows.push_back({name_of(kTests[t]), kEyeRings[r].name, percent(tally.accepted, tally.motions),
                                  percent(tally.violating, tally.accepted), percent(tally.over, tally.accepted),
                                  tally.worst});
            chart.series.back().values.push_back(percent(tally.over, tally.accepted));
        }
        table.rows.push_back({name_of(kTests[t]), std::string("counter-example: 10 m before a side, 9 m nearer"),
                              counter_example(kTests[t]) > 0 ? 100.0 : 0.0,
                              counter_example(kTests[t]) > 0 ? 100.0 : 0.0,
                              counter_example(kTests[t]) > 0 ? 100.0 : 0.0, counter_example(kTests[t])});
    }
    double exact_worst = 0, exact_accepted = 0;
    for (const Tally& tally : tallies[2]) {
        exact_worst = std::max(exact_worst, tally.worst);
        exact_accepted += tally.accepted;
    }
    figure.checks = {at_least("P1, within a tenth of a side: blocks with a vertex beyond tau + s (%)",
                              percent(tallies[0][0].over, tallies[0][0].accepted), 10),
                     at_least("P1: greatest error (tau)", tallies[0][0].worst, 3),
                     at_least("P2: greatest error (tau)", tallies[1][0].worst, 3),
                     at_most("T1: greatest error (tau)", exact_worst, 1 + kShare + 1e-9),
                     at_least("T1: blocks accepted", exact_accepted, samples / 2.0),
                     at_most("P1 accepts the counter-example, whose error grows tenfold: from 10",
                             std::abs(counter_example(Test::p1) - 10), 1e-9),
                     at_most("T1 accepts the counter-example", counter_example(Test::t1), 0)};
    figure.tables.push_back(std::move(table));
    figure.svg = to_svg(chart);
    return figure;
}

}  // namespace scree
