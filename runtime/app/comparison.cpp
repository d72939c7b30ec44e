#include "runtime/app/comparison.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace scree {
namespace {

/// A line of the curves: settings, but for what goes by tau.
struct Method {
    std::string name;
    LodSettings lod;
    bool morph = true;
    double s_share = 0;  ///< s / tau
};

Method with_cache(ReuseTest reuse, double share) {
    LodSettings lod{LodMethod::rsg};
    lod.reuse = reuse;
    return {fmt::format("rsg, cache {}, s = {} tau", to_string(reuse), share), lod, true, share};
}

// Another method is another line here.
std::vector<Method> methods() {
    const auto of = [](LodMethod method, ErrorMetric metric, Culling culling, CrackFix cracks) {
        return LodSettings{method, metric, ReuseTest::off, 0, culling, cracks};
    };
    constexpr auto kGuaranteed = ErrorMetric::guaranteed;
    constexpr auto kStitch = CrackFix::stitch;
    return {
        {"geomip", {}},
        {"geomip, no morph", {}, false},
        {"rsg", of(LodMethod::rsg, kGuaranteed, Culling::box, kStitch)},
        with_cache(ReuseTest::exact, 0.1),
        with_cache(ReuseTest::exact, 0.25),
        with_cache(ReuseTest::exact, 0.5),
        {"block-rsg", of(LodMethod::block_rsg, kGuaranteed, Culling::box, kStitch)},
        {"rsg, dikes", of(LodMethod::rsg, kGuaranteed, Culling::box, CrackFix::dike)},
        {"geomip, metric deboer", of(LodMethod::geomip, ErrorMetric::deboer, Culling::box, kStitch)},
        {"rsg, metric uc", of(LodMethod::rsg, ErrorMetric::uc, Culling::box, kStitch)},
        with_cache(ReuseTest::paper, 0.1),
        {"geomip, cull corners", of(LodMethod::geomip, kGuaranteed, Culling::corners, kStitch)},
    };
}

constexpr double kTextureTaus_px[] = {0.5, 0.71, 1, 1.41, 2, 2.83, 4};
constexpr std::int64_t kMebibyte = std::int64_t{1} << 20;
constexpr std::int64_t kBudgets_bytes[] = {32 * kMebibyte, 64 * kMebibyte, 128 * kMebibyte, 256 * kMebibyte,
                                           512 * kMebibyte};

// As it can be typed, and never up: tau + s must not pass what it was made for.
double to_type(double px) { return std::floor(px * 1e4 + 1e-6) / 1e4; }

ComparisonCase at_tolerance(const Method& m, double tau_px, const ComparisonCase& base) {
    ComparisonCase c = base;
    c.sweep = Sweep::tolerance;
    c.method = m.name;
    c.lod = m.lod;
    c.lod.s_px = to_type(m.s_share * tau_px);
    c.morph = m.morph;
    c.tau_px = tau_px;
    return c;
}

bool in_tolerance_sweep(const ComparedCase& c) { return c.what.sweep == Sweep::tolerance; }

// Ties go to what errs less.
bool better(const std::vector<ComparedCase>& cases, std::size_t a, std::size_t b, Cost cost) {
    const double cost_a = cost_of(cases[a], cost), cost_b = cost_of(cases[b], cost);
    if (cost_a != cost_b) return cost_a < cost_b;
    return cases[a].figures.true_max_px < cases[b].figures.true_max_px;
}

template <class Fits>
std::optional<std::size_t> cheapest_where(const std::vector<ComparedCase>& cases, Cost cost, const Fits& fits) {
    std::optional<std::size_t> best;
    for (std::size_t k = 0; k < cases.size(); ++k)
        if (fits(cases[k]) && (!best || better(cases, k, *best, cost))) best = k;
    return best;
}

bool keeps_promise(const ComparedCase& c) { return c.what.lod.is_guaranteed() && c.figures.kept; }

std::string named(const ComparedCase& c) { return fmt::format("{} at tau {:g} px", c.what.method, c.what.tau_px); }

}  // namespace

std::string_view to_string(Sweep sweep) {
    switch (sweep) {
        case Sweep::tolerance:
            return "tolerance";
        case Sweep::texture:
            return "texture";
        case Sweep::budget:
            return "budget";
    }
    return "?";
}

double ComparedCase::promised_px() const { return std::max(what.lod.promise_px(what.tau_px), figures.bound_px); }

std::string options_of(const ComparisonCase& c) {
    std::string line = fmt::format("{} --tau {}", command_line_of(c.lod), c.tau_px);
    if (!c.morph) line += " --no-morph";
    if (c.texture_tau_px != 1) line += fmt::format(" --texture-tau {}", c.texture_tau_px);
    if (c.budget_bytes % kMebibyte != 0)
        line += fmt::format(" --budget {}", c.budget_bytes);
    else if (c.budget_bytes != 256 * kMebibyte)
        line += fmt::format(" --budget {}M", c.budget_bytes / kMebibyte);
    return line;
}

bool Comparison::kept() const {
    return std::all_of(cases.begin(), cases.end(), [](const ComparedCase& c) { return c.figures.kept; });
}

bool is_pictured(const ComparisonCase& c) {
    if (c.sweep == Sweep::texture) return c.texture_tau_px == 4;
    if (c.sweep != Sweep::tolerance) return false;
    if (c.method == "geomip") return c.tau_px == 1 || c.tau_px == 4 || c.tau_px == 16;
    return c.tau_px == 4 && (c.method == "rsg" || c.method == "block-rsg" || c.method == "rsg, metric uc" ||
                             c.method == "geomip, metric deboer");
}

std::vector<ComparisonCase> without_idle_budgets(std::vector<ComparisonCase> cases, std::int64_t all_tiles_bytes) {
    bool enough = false;
    const auto idle = [&](const ComparisonCase& c) {
        if (c.sweep != Sweep::budget) return false;
        const bool before = enough;
        enough = enough || c.budget_bytes >= all_tiles_bytes;
        return before;
    };
    std::vector<ComparisonCase> some;
    for (ComparisonCase& c : cases)
        if (!idle(c)) some.push_back(std::move(c));
    return some;
}

std::vector<ComparisonCase> comparison_cases(const CaseList& list) {
    std::vector<ComparisonCase> cases;
    for (const Method& m : methods()) {
        if (list.promises_only && !m.lod.is_guaranteed()) continue;
        for (const double tau_px : list.tau_px) cases.push_back(at_tolerance(m, tau_px, list.base));
        if (list.just_px > 0) {
            const double tau_px = to_type(list.just_px / (1 + m.s_share));
            if (tau_px > 0 && std::find(list.tau_px.begin(), list.tau_px.end(), tau_px) == list.tau_px.end())
                cases.push_back(at_tolerance(m, tau_px, list.base));
        }
    }
    if (list.promises_only) return cases;
    ComparisonCase c = list.base;
    c.sweep = Sweep::texture;
    for (const double texture_tau_px : kTextureTaus_px) {
        c.texture_tau_px = texture_tau_px;
        cases.push_back(c);
    }
    c = list.base;
    c.sweep = Sweep::budget;
    for (const std::int64_t budget_bytes : kBudgets_bytes) {
        c.budget_bytes = budget_bytes;
        cases.push_back(c);
    }
    return cases;
}

std::vector<SkippedCase> skipped_methods(const Comparison& comparison) {
    std::vector<SkippedCase> first;
    for (const SkippedCase& s : comparison.skipped)
        if (std::none_of(first.begin(), first.end(),
                         [&](const SkippedCase& f) { return f.what.method == s.what.method; }))
            first.push_back(s);
    return first;
}

double cost_of(const ComparedCase& c, Cost cost) {
    switch (cost) {
        case Cost::triangles:
            return c.figures.triangles_mean;
        case Cost::lod_ms:
            return c.figures.lod_ms;
        case Cost::frame_ms:
            return c.figures.frame_ms;
    }
    return 0;
}

std::vector<std::size_t> pareto_front(const std::vector<ComparedCase>& cases, Cost cost) {
    std::vector<std::size_t> order;
    for (std::size_t k = 0; k < cases.size(); ++k)
        if (in_tolerance_sweep(cases[k]) && keeps_promise(cases[k])) order.push_back(k);
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
        const double error_a = cases[a].figures.true_max_px, error_b = cases[b].figures.true_max_px;
        return error_a != error_b ? error_a < error_b : cost_of(cases[a], cost) < cost_of(cases[b], cost);
    });
    std::vector<std::size_t> front;
    double least = std::numeric_limits<double>::infinity();
    for (const std::size_t k : order)
        if (cost_of(cases[k], cost) < least) {
            least = cost_of(cases[k], cost);
            front.push_back(k);
        }
    return front;
}

std::optional<std::size_t> cheapest_within(const std::vector<ComparedCase>& cases, double error_px, Cost cost,
                                           bool guaranteed) {
    return cheapest_where(cases, cost, [&](const ComparedCase& c) {
        return in_tolerance_sweep(c) && c.figures.true_max_px <= error_px &&
               (guaranteed ? keeps_promise(c) : !c.what.lod.is_guaranteed());
    });
}

Recommendation recommend(const std::vector<ComparedCase>& cases, const Wish& wish) {
    const double most_ms = 1000 / wish.fps;
    const auto true_enough = [&](const ComparedCase& c) {
        return in_tolerance_sweep(c) && keeps_promise(c) && c.promised_px() <= wish.most_error_px * (1 + 1e-9);
    };
    const auto fast_enough = [&](const ComparedCase& c) { return c.figures.frame_p99_ms <= most_ms; };
    Recommendation r;
    r.best =
        cheapest_where(cases, Cost::frame_ms, [&](const ComparedCase& c) { return true_enough(c) && fast_enough(c); });
    if (r.best) {
        const ComparedCase& best = cases[*r.best];
        r.fits = true;
        r.reason =
            fmt::format("{}: promises {:.4g} px; frames of {:.1f} ms, p99 {:.1f} of {:.1f} ms allowed", named(best),
                        best.promised_px(), best.figures.frame_ms, best.figures.frame_p99_ms, most_ms);
        r.cheaper_here = cheapest_where(cases, Cost::frame_ms, [&](const ComparedCase& c) {
            return in_tolerance_sweep(c) && keeps_promise(c) && fast_enough(c) &&
                   c.figures.true_max_px <= wish.most_error_px && c.figures.frame_ms < best.figures.frame_ms;
        });
        return r;
    }
    // Truth before speed: what is true enough and comes closest to the frame rate.
    for (std::size_t k = 0; k < cases.size(); ++k)
        if (true_enough(cases[k]) && (!r.best || cases[k].figures.frame_p99_ms < cases[*r.best].figures.frame_p99_ms))
            r.best = k;
    if (r.best) {
        const CaseFigures& f = cases[*r.best].figures;
        r.reason = fmt::format(
            "nothing that promises {:.4g} px makes {:.4g} frames a second here; closest: {}, p99 {:.1f} of {:.1f} ms "
            "allowed",
            wish.most_error_px, wish.fps, named(cases[*r.best]), f.frame_p99_ms, most_ms);
        return r;
    }
    for (std::size_t k = 0; k < cases.size(); ++k)
        if (in_tolerance_sweep(cases[k]) && keeps_promise(cases[k]) &&
            (!r.best || cases[k].promised_px() < cases[*r.best].promised_px()))
            r.best = k;
    r.reason = r.best ? fmt::format("nothing measured promises {:.4g} px; closest: {}, which promises {:.4g} px",
                                    wish.most_error_px, named(cases[*r.best]), cases[*r.best].promised_px())
                      : "nothing that was measured promises anything";
    return r;
}

}  // namespace scree
