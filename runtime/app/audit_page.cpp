#include "runtime/app/audit_page.h"

#include <fmt/format.h>

#include <cmath>

namespace scree {
namespace {

/// Frames beyond so many are told by the charts alone.
constexpr std::size_t kMostRows = 100;

template <class Value>
std::vector<double> values(const AuditResult& r, Value AuditFrame::*figure) {
    std::vector<double> all;
    for (const AuditFrame& frame : r.frames) all.push_back(static_cast<double>(frame.*figure));
    return all;
}

std::string percent(double share) {
    if (share <= 0) return "0 %";
    return share < 1e-4 ? fmt::format("{:.0e} %", 100 * share) : fmt::format("{:.3g} %", 100 * share);
}

std::string error_chart(const AuditResult& r, const AuditFacts& facts) {
    std::vector<FrameSeries> series{{"promised", values(r, &AuditFrame::promised_px), true},
                                    {"greatest true error", values(r, &AuditFrame::max_px)},
                                    {"mean true error", values(r, &AuditFrame::mean_px)}};
    if (!facts.sources.empty())
        series.push_back({"greatest against the sources", values(r, &AuditFrame::source_max_px)});
    LineChart chart = frame_chart("True error and promise", "pixels", series);
    chart.levels.push_back({fmt::format("tau {:g}", facts.tau_px), facts.tau_px});
    chart.y.logarithmic = is_wide(values(r, &AuditFrame::promised_px), facts.tau_px);
    return to_figure(chart);
}

// 1, 2, 5 a decade, up to what holds the greatest error.
std::string histogram(const ErrorHistogram& errors, const std::string& title) {
    constexpr int kDecades = 3;
    BarChart chart;
    chart.title = title;
    chart.groups_label = "error up to, pixels";
    chart.y.label = "percent of the samples";
    chart.series.push_back({"", {}});
    double end = std::pow(10.0, std::ceil(std::log10(std::max(errors.max(), 1e-3))));
    if (errors.max() <= end / 5)
        end /= 5;
    else if (errors.max() <= end / 2)
        end /= 2;
    std::int64_t below = 0;
    for (int decade = -kDecades; decade <= 6; ++decade)
        for (const double lead : {1.0, 2.0, 5.0}) {
            const double px = lead * std::pow(10.0, decade);
            if (px < end * std::pow(10.0, -kDecades) * 0.99 || px > end * 1.01 || errors.count() == 0) continue;
            const std::int64_t within = errors.count_within(px);
            chart.groups.push_back(fmt::format("{:g}", px));
            chart.series[0].values.push_back(100 * static_cast<double>(within - below) /
                                             static_cast<double>(errors.count()));
            below = within;
        }
    return to_figure(chart);
}

Result<std::string> picture_section(const AuditResult& r, const AuditFacts& facts,
                                    const std::vector<PosePicture>& pictures, const std::string& no_pictures) {
    std::string html = "<h2>From the poses</h2>\n";
    if (!no_pictures.empty())
        return html + fmt::format("<p class=\"soft\">No pictures: {}.</p>\n", escaped(no_pictures));
    std::vector<std::string> captions;
    for (const PosePicture& p : pictures) {
        const AuditFrame& f = r.frames[p.frame];
        captions.push_back(fmt::format("Frame {}: {} triangles, true error at most {:.3g} px, promised {} px", p.frame,
                                       f.triangles, f.max_px, short_number(f.promised_px)));
    }
    auto seen = pictures_html(pictures, captions);
    if (!seen) return seen;
    return html +
           (facts.moving ? "<p>Drawn afterwards with nothing missing, and made smaller for this page; the figures are "
                           "of what the flight had by then.</p>\n"
                         : "<p>Drawn afterwards, and made smaller for this page.</p>\n") +
           *seen;
}

std::string frame_table(const AuditResult& r, const AuditFacts& facts) {
    std::vector<std::string> heads{"frame",    "triangles",  "samples",    "promised, px", "true max, px", "p99, px",
                                   "mean, px", "of promise", "open edges", "T-junctions",  "holes, cells", ""};
    if (!facts.sources.empty()) heads.insert(heads.begin() + 7, "against sources, px");
    std::vector<std::vector<std::string>> rows;
    std::vector<std::string> row_classes;
    for (std::size_t k = 0; k < std::min(r.frames.size(), kMostRows); ++k) {
        const AuditFrame& f = r.frames[k];
        const bool broken = facts.guaranteed && f.max_px > f.promised_px;
        rows.push_back({fmt::format("{}", k), fmt::format("{}", f.triangles), fmt::format("{}", f.samples),
                        fmt::format("{:.4g}", f.promised_px), fmt::format("{:.4g}", f.max_px),
                        fmt::format("{:.4g}", f.p99_px), fmt::format("{:.3g}", f.mean_px),
                        fmt::format("{:.0f} %", f.promised_px > 0 ? 100 * f.max_px / f.promised_px : 0),
                        fmt::format("{}", f.open_edges), fmt::format("{}", f.t_junctions), fmt::format("{}", f.holes),
                        broken         ? "BROKEN"
                        : f.limited    ? "budget bound"
                        : f.incomplete ? "stand-ins"
                                       : ""});
        if (!facts.sources.empty()) rows.back().insert(rows.back().begin() + 7, fmt::format("{:.4g}", f.source_max_px));
        row_classes.push_back(broken || f.open_edges + f.t_junctions + f.holes > 0 ? "bad" : "");
    }
    std::string html = html_table(heads, rows, 0, row_classes);
    if (r.frames.size() > kMostRows)
        html += fmt::format("<p class=\"soft\">The first {} of {} frames.</p>\n", kMostRows, r.frames.size());
    return html;
}

std::string settings_table(const AuditFacts& f) {
    std::vector<std::vector<std::string>> rows{
        {"tolerance", fmt::format("{:g} px", f.tau_px), "how far anything drawn may be from the finest data"},
        {"budget", fmt::format("{} MB", page_megabytes(f.budget_bytes)), "for tiles"},
        {"method", fmt::format("<code>{}</code>", escaped(f.lod)),
         f.guaranteed ? "its error is promised" : "its error is not promised beforehand"},
        {"poses", f.moving ? "moving" : "settled",
         f.moving ? "as a flight of 30 frames a second would have drawn them" : "each with all that it wants"},
        {"picture", fmt::format("{} x {}, {:g} degrees", f.width_px, f.height_px, f.fov_deg),
         "size in pixels, vertical field of view"},
        {"heights", fmt::format("x {:g}", f.exaggeration), "as drawn; errors count in these"},
        {"rounding of heights", fmt::format("{:.3g} m at most", f.height_quantum_error_m),
         "when the store was built; comes on top of errors against the store"},
        {"resampling", fmt::format("{:.3g} m at most", f.warp_error_m), "likewise"},
        {"machine", escaped(f.machine), ""}};
    for (const std::string& source : f.sources) rows.push_back({"source", escaped(source), "judged by as well"});
    return html_table({"setting", "value", "meaning"}, rows, 3);
}

std::string source_section(const AuditResult& r, const AuditFacts& facts) {
    if (facts.sources.empty()) return {};
    const ErrorHistogram& e = r.source_errors;
    std::string names;
    for (const std::string& source : facts.sources) names += (names.empty() ? "" : ", ") + escaped(source);
    return fmt::format(
        "<h2>Against the sources</h2>\n<p>Judged by every sample in view of {} itself, read anew: {} samples, greatest "
        "error {:.4g} px, 99 % within {:.4g} px, mean {:.3g} px. What the store states of its own heights (rounding, "
        "resampling) accounts for all but {:.4g} px. {}.</p>\n",
        names, e.count(), e.max(), e.quantile(0.99), e.mean(), r.source_excess_px,
        r.samples_not_drawn == 0
            ? "No sample lies over a hole of the store"
            : fmt::format("<b>{} samples lie over no terrain of the store</b>", r.samples_not_drawn));
}

}  // namespace

std::string audit_verdict(const AuditResult& r, const AuditFacts& facts) {
    std::string text =
        fmt::format("{}, {} samples of the finest data: nothing drawn was further than {:.3g} px from it",
                    counted(static_cast<std::int64_t>(r.frames.size()), "frame", "frames"),
                    short_number(static_cast<double>(r.errors.count())), r.errors.max());
    if (r.errors.max() > facts.tau_px)
        text += fmt::format(
            ", {} within {:.3g} px",
            percent(static_cast<double>(r.errors.count_within(facts.tau_px)) / static_cast<double>(r.errors.count())),
            facts.tau_px);
    if (facts.guaranteed)
        text += fmt::format("; promised was {} px", short_number(std::max(facts.tau_px, r.max_bound_px)));
    text += fmt::format("; {}, {}, {}", counted(r.cracks.open_edges, "open edge", "open edges"),
                        counted(r.cracks.t_junctions, "T-junction", "T-junctions"),
                        counted(r.holes, "hole", "cells in holes"));
    if (!r.kept) return text + ". The promise is broken.";
    return text + (facts.guaranteed ? ". The promise holds." : ". No error is promised.");
}

Result<std::string> audit_page(const AuditResult& r, const AuditFacts& facts, const std::vector<PosePicture>& pictures,
                               const std::string& no_pictures) {
    auto seen = picture_section(r, facts, pictures, no_pictures);
    if (!seen) return seen;
    HtmlPage page(
        fmt::format("An audit of {}", facts.store),
        fmt::format("{} poses, {} x {} pixels. Every vertex of the finest data in view against the drawn surface "
                    "straight above or below it; what hides what is ignored, so these are upper figures.",
                    r.frames.size(), facts.width_px, facts.height_px));
    page.add(fmt::format("<p class=\"note {}\">{}</p>\n", r.kept ? "good" : "bad", escaped(audit_verdict(r, facts))));
    page.section("Errors");
    page.add("<div class=\"charts\">\n");
    page.add(error_chart(r, facts));
    page.add(histogram(r.errors, "How great the errors are"));
    page.add(to_figure(frame_chart("Triangles", "triangles drawn", {{"", values(r, &AuditFrame::triangles)}})));
    if (!facts.sources.empty()) page.add(histogram(r.source_errors, "How great they are against the sources"));
    page.add("</div>\n");
    page.add(source_section(r, facts));
    page.add(*seen);
    page.section("Frame by frame");
    page.add(frame_table(r, facts));
    page.section("Settings");
    page.add(settings_table(facts));
    page.add(command_html(facts.command));
    return std::move(page).finish();
}

}  // namespace scree
