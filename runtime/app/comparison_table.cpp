#include "runtime/app/comparison_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace scree {
namespace {

using Json = nlohmann::ordered_json;

double finite(double value) { return std::isfinite(value) ? std::min(value, kBeyondMeasure) : kBeyondMeasure; }

// In the order of the CSV's columns. No value has a comma or a quote but the method's name.
Json report_of(const ComparedCase& c) {
    const ComparisonCase& w = c.what;
    const CaseFigures& f = c.figures;
    return {{"sweep", to_string(w.sweep)},
            {"method", w.method},
            {"options", options_of(w)},
            {"guaranteed", w.lod.is_guaranteed()},
            {"tau_px", w.tau_px},
            {"s_px", w.lod.s_px},
            {"texture_tau_px", w.texture_tau_px},
            {"budget_bytes", w.budget_bytes},
            {"triangles_mean", f.triangles_mean},
            {"triangles_max", f.triangles_max},
            {"lod_ms", f.lod_ms},
            {"lod_p99_ms", f.lod_p99_ms},
            {"lod_cold_ms", f.lod_cold_ms},
            {"draw_ms", f.draw_ms},
            {"frame_ms", f.frame_ms},
            {"frame_p99_ms", f.frame_p99_ms},
            {"frames_paged_in", f.frames_paged_in},
            {"tile_bytes", f.tile_bytes},
            {"resident_bytes", f.resident_bytes},
            {"promised_px", finite(c.promised_px())},
            {"bound_px", finite(f.bound_px)},
            {"true_max_px", finite(f.true_max_px)},
            {"true_p99_px", finite(f.true_p99_px)},
            {"true_mean_px", finite(f.true_mean_px)},
            {"samples", f.samples},
            {"holes", f.holes},
            {"open_edges", f.open_edges},
            {"t_junctions", f.t_junctions},
            {"budget_limited_frames", f.budget_limited_frames},
            {"psnr_db", f.psnr_db},
            {"ssim", f.ssim},
            {"kept", f.kept}};
}

std::string cell(const Json& value) {
    if (value.is_string()) {
        const auto text = value.get<std::string>();
        return text.find(',') == std::string::npos ? text : "\"" + text + "\"";
    }
    if (value.is_boolean()) return value.get<bool>() ? "1" : "0";
    if (value.is_number_integer()) return fmt::format("{}", value.get<std::int64_t>());
    return fmt::format("{:.6g}", value.get<double>());
}

// Nothing where there is no such case.
void add_short_report(Json& to, const char* key, const Comparison& comparison, std::optional<std::size_t> at) {
    if (!at) return;
    const ComparedCase& c = comparison.cases[*at];
    to[key] = {{"method", c.what.method},
               {"options", options_of(c.what)},
               {"promised_px", finite(c.promised_px())},
               {"true_max_px", finite(c.figures.true_max_px)},
               {"triangles_mean", c.figures.triangles_mean},
               {"frame_ms", c.figures.frame_ms},
               {"frame_p99_ms", c.figures.frame_p99_ms}};
}

Json cheapest_report(const Comparison& comparison) {
    Json rows = Json::array();
    for (const double error_px : kErrors_px) {
        const auto cheapest = [&](Cost cost, bool guaranteed) {
            return cheapest_within(comparison.cases, error_px, cost, guaranteed);
        };
        Json row = {{"error_px", error_px}};
        add_short_report(row, "by_frame_ms", comparison, cheapest(Cost::frame_ms, true));
        add_short_report(row, "by_triangles", comparison, cheapest(Cost::triangles, true));
        add_short_report(row, "without_promise_by_frame_ms", comparison, cheapest(Cost::frame_ms, false));
        rows.push_back(row);
    }
    return rows;
}

Json front_report(const Comparison& comparison) {
    const auto front = [&](Cost cost) {
        Json options = Json::array();
        for (const std::size_t k : pareto_front(comparison.cases, cost))
            options.push_back(options_of(comparison.cases[k].what));
        return options;
    };
    return {
        {"triangles", front(Cost::triangles)}, {"lod_ms", front(Cost::lod_ms)}, {"frame_ms", front(Cost::frame_ms)}};
}

Json quanta_report(const Comparison& comparison) {
    Json rows = Json::array();
    for (const CoarserQuantum& q : comparison.coarser_quanta)
        rows.push_back({{"quantum_m", q.quantum_m},
                        {"max_px", finite(q.max_px)},
                        {"p99_px", finite(q.p99_px)},
                        {"mean_px", finite(q.mean_px)}});
    return rows;
}

Json skipped_report(const Comparison& comparison) {
    Json rows = Json::array();
    for (const SkippedCase& s : comparison.skipped)
        rows.push_back({{"sweep", to_string(s.what.sweep)},
                        {"method", s.what.method},
                        {"options", options_of(s.what)},
                        {"reason", s.reason}});
    return rows;
}

}  // namespace

std::string comparison_csv(const Comparison& comparison) {
    std::string csv;
    const auto line = [&](const Json& row, bool keys) {
        std::string text;
        for (const auto& [key, value] : row.items()) text += (text.empty() ? "" : ",") + (keys ? key : cell(value));
        csv += text + "\n";
    };
    line(report_of({}), true);
    for (const ComparedCase& c : comparison.cases) line(report_of(c), false);
    return csv;
}

nlohmann::ordered_json comparison_json(const Comparison& c, const std::optional<Wish>& wish) {
    Json report = {
        {"store", c.store},
        {"renderer", c.renderer},
        {"frames", c.frames},
        {"rounds", c.rounds},
        {"step_m", c.step_m},
        {"size_px", {c.width_px, c.height_px}},
        {"seconds", c.seconds},
        {"reference", {{"bound_px", finite(c.reference_bound_px)}, {"texture_tau_px", c.reference_texture_px}}},
        {"height_quantum",
         {{"error_m", c.quantum.error_m},
          {"nearest_m", finite(c.quantum.nearest_m)},
          {"error_px", finite(c.quantum.error_px)},
          {"coarser", quanta_report(c)}}},
        {"cases", Json::array()},
        {"pareto", front_report(c)},
        {"cheapest", cheapest_report(c)},
        {"skipped", skipped_report(c)}};
    for (const ComparedCase& one : c.cases) report["cases"].push_back(report_of(one));
    if (wish) {
        const Recommendation r = recommend(c.cases, *wish);
        Json& said = report["recommendation"] = {
            {"fps", wish->fps}, {"max_error_px", wish->most_error_px}, {"fits", r.fits}, {"reason", r.reason}};
        add_short_report(said, "best", c, r.best);
        add_short_report(said, "cheaper_on_this_path", c, r.cheaper_here);
    }
    report["kept"] = c.kept();
    return report;
}

std::string comparison_text(const Comparison& comparison) {
    std::string text =
        fmt::format("{:<10} {:<28} {:>6} {:>9} {:>8} {:>9} {:>9} {:>10} {:>9} {:>7} {:>6}\n", "sweep", "method", "tau",
                    "triangles", "lod ms", "frame ms", "promised", "true max px", "tiles MB", "PSNR dB", "SSIM");
    for (const ComparedCase& c : comparison.cases) {
        const CaseFigures& f = c.figures;
        std::string name = c.what.method;
        if (c.what.sweep == Sweep::texture) name += fmt::format(", texel {:g} px", c.what.texture_tau_px);
        if (c.what.sweep == Sweep::budget) name += fmt::format(", budget {} MiB", c.what.budget_bytes >> 20);
        text += fmt::format(
            "{:<10} {:<28} {:>6.4g} {:>9.0f} {:>8.3f} {:>9.2f} {:>9} {:>11.4f} {:>9.1f} {:>7.2f} {:>6.4f}{}\n",
            to_string(c.what.sweep), name, c.what.tau_px, f.triangles_mean, f.lod_ms, f.frame_ms,
            c.what.lod.is_guaranteed() ? fmt::format("{:.4g}", c.promised_px()) : "nothing", f.true_max_px,
            static_cast<double>(f.tile_bytes) / 1e6, f.psnr_db, f.ssim, f.kept ? "" : "  THE PROMISE IS BROKEN");
    }
    for (const SkippedCase& s : skipped_methods(comparison))
        text += fmt::format("not measured: {}: {}\n", s.what.method, s.reason);
    return text;
}

}  // namespace scree
