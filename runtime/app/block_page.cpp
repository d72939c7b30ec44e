#include "runtime/app/block_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace scree {
namespace {

using Rows = std::vector<std::vector<std::string>>;
constexpr std::size_t kMostRows = 100;
constexpr double kMega = 1e6;

double sum_of(const Series& s) { return s.mean() * static_cast<double>(s.values.size()); }

Series in_mega(Series s) {
    for (double& v : s.values) v /= kMega;
    return s;
}

std::string settings_table(const BlockFacts& f) {
    Rows rows{{"tolerance", fmt::format("{:g} px", f.tau_px), "how far anything drawn may be from the finest data"},
              {"method", fmt::format("<code>{}</code>", escaped(f.lod)),
               f.promise_px ? "its error is promised" : "its error is not promised beforehand"},
              {"budget", fmt::format("{} MB", page_megabytes(f.budget_bytes)),
               fmt::format("for heights and meshes, all of them in memory: {} MB", page_megabytes(f.resident_bytes))},
              {"heights", fmt::format("x {:g}", f.exaggeration), "as drawn; errors count in these"},
              {"picture", fmt::format("{} x {}, {:g} degrees", f.width_px, f.height_px, f.fov_deg),
               "size in pixels, vertical field of view"},
              {"rounding of heights", fmt::format("{:.3g} m at most", f.height_quantum_error_m),
               "when the store was built; comes on top of every error here"}};
    if (f.dropped_columns + f.dropped_rows > 0)
        rows.push_back({"not shown", fmt::format("{} columns, {} rows", f.dropped_columns, f.dropped_rows),
                        "samples in the east and south that are no whole block"});
    if (!f.renderer.empty()) rows.push_back({"renderer", escaped(f.renderer), "as OpenGL names it"});
    rows.push_back({"machine", escaped(f.machine), ""});
    return html_table({"setting", "value", "meaning"}, rows, 3);
}

std::vector<std::string> spread_row(const std::string& name, const Series& s) {
    return {name, short_number(s.quantile(0.5)), short_number(s.quantile(0.99)), short_number(s.max()),
            short_number(s.mean())};
}

std::string flight_charts(const BlockFlightFigures& f, const BlockFacts& facts) {
    std::string html = "<div class=\"charts\">\n";
    LineChart times = frame_chart("Frame time and selection", "milliseconds",
                                  {{"frame", f.frame_ms.values}, {"selection, CPU", f.select_ms.values}});
    times.y.logarithmic = true;
    html += to_figure(times);
    html += to_figure(frame_chart("Triangles", "triangles drawn", {{"", f.triangles.values}}));
    html += to_figure(
        frame_chart("Blocks and strips", "drawn", {{"blocks", f.blocks.values}, {"strips", f.strips.values}}));
    html += to_figure(frame_chart("Blocks kept and made", "blocks",
                                  {{"reused", f.reused.values}, {"meshes made", f.meshes_made.values}}));
    std::vector<FrameSeries> error{{"tolerance in force", f.tau_px.values, true}};
    if (facts.promise_px) error.push_back({"greatest that anything drawn may have", f.promised_px.values});
    LineChart promised = frame_chart("Error on screen", "pixels", error);
    promised.levels.push_back({fmt::format("tau {:g}", facts.tau_px), facts.tau_px});
    html += to_figure(promised);
    html += to_figure(frame_chart("Memory of the whole process", "MB resident", {{"", in_mega(f.rss_bytes).values}}));
    return html + "</div>\n";
}

std::string audit_charts(const BlockAuditFigures& f, const BlockFacts& facts) {
    std::vector<FrameSeries> series{{"greatest, blocks", f.blocks_max_px.values},
                                    {"greatest, strips between them", f.strips_max_px.values},
                                    {"mean, blocks", f.mean_px.values}};
    LineChart chart = frame_chart(facts.promise_px ? "True error and promise" : "True error", "pixels", series);
    if (facts.promise_px) chart.levels.push_back({"promised", *facts.promise_px});
    chart.levels.push_back({fmt::format("tau {:g}", facts.tau_px), facts.tau_px});
    return "<div class=\"charts\">\n" + to_figure(chart) +
           to_figure(frame_chart("Triangles", "triangles drawn", {{"", f.triangles.values}})) + "</div>\n";
}

std::string audit_table(const BlockAuditFigures& f) {
    Rows rows;
    std::vector<std::string> row_classes;
    for (std::size_t k = 0; k < std::min(f.triangles.values.size(), kMostRows); ++k) {
        const double broken = f.open_edges.values[k] + f.t_junctions.values[k] + f.holes.values[k];
        rows.push_back({fmt::format("{}", k), fmt::format("{:.0f}", f.triangles.values[k]),
                        fmt::format("{:.0f}", f.samples.values[k]), fmt::format("{:.4g}", f.blocks_max_px.values[k]),
                        fmt::format("{:.4g}", f.strips_max_px.values[k]), fmt::format("{:.3g}", f.mean_px.values[k]),
                        fmt::format("{:.0f}", f.open_edges.values[k]), fmt::format("{:.0f}", f.t_junctions.values[k]),
                        fmt::format("{:.0f}", f.holes.values[k])});
        row_classes.push_back(broken > 0 ? "bad" : "");
    }
    std::string html = html_table({"frame", "triangles", "samples", "blocks max, px", "strips max, px", "mean, px",
                                   "open edges", "T-junctions", "holes, cells"},
                                  rows, 0, row_classes);
    if (f.triangles.values.size() > kMostRows)
        html += fmt::format("<p class=\"soft\">The first {} of {} frames.</p>\n", kMostRows, f.triangles.values.size());
    return html;
}

}  // namespace

std::string block_flight_verdict(const BlockFlightFigures& f, const BlockFacts& facts) {
    std::string text = fmt::format("{}, median {:.3g} ms, 99 % within {:.3g} ms; ",
                                   counted(static_cast<std::int64_t>(f.frame_ms.values.size()), "frame", "frames"),
                                   f.frame_ms.quantile(0.5), f.frame_ms.quantile(0.99));
    text += facts.promise_px ? fmt::format("nothing drawn was further than {} px from the finest data; ",
                                           short_number(f.promised_px.max()))
                             : "how far from the finest data is not promised; ";
    const double drawn = sum_of(f.blocks);
    text += fmt::format("{:.0f} % of the blocks reused; ", drawn > 0 ? 100 * sum_of(f.reused) / drawn : 0);
    return text + counted(f.holes, "hole", "cells in holes") + ".";
}

Result<std::string> block_flight_page(const BlockFlightFigures& f, const BlockFacts& facts,
                                      const std::vector<PosePicture>& pictures) {
    std::vector<std::string> captions;
    for (const PosePicture& p : pictures)
        captions.push_back(fmt::format("Frame {}: {:.0f} triangles in {:.0f} blocks", p.frame,
                                       f.triangles.values[p.frame], f.blocks.values[p.frame]));
    auto seen = pictures_html(pictures, captions);
    if (!seen) return seen;
    HtmlPage page(fmt::format("A flight over {}", facts.store),
                  fmt::format("{} frames of {} x {} pixels of separate blocks, drawn by {} on {}. Times are of this "
                              "machine; triangles and errors are not.",
                              f.frame_ms.values.size(), facts.width_px, facts.height_px, escaped(facts.renderer),
                              escaped(facts.machine)));
    page.add(fmt::format("<p class=\"note {}\">{}</p>\n", f.holes == 0 ? "good" : "bad",
                         escaped(block_flight_verdict(f, facts))));
    page.section("Frame by frame");
    page.add(flight_charts(f, facts));
    if (!pictures.empty()) {
        page.section("Along the flight");
        page.add("<p>As drawn, made smaller for this page.</p>\n" + *seen);
    }
    page.section("Settings");
    page.add(settings_table(facts));
    page.section("Figures");
    page.add(html_table({"a frame", "median", "99 % within", "most", "mean"},
                        Rows{spread_row("frame, ms", f.frame_ms), spread_row("selection, ms CPU", f.select_ms),
                             spread_row("triangles", f.triangles), spread_row("blocks", f.blocks),
                             spread_row("strips", f.strips), spread_row("blocks reused", f.reused),
                             spread_row("meshes made", f.meshes_made), spread_row("tolerance in force, px", f.tau_px)},
                        1));
    page.add(command_html(facts.command));
    return std::move(page).finish();
}

std::string block_audit_verdict(const BlockAuditFigures& f, const BlockFacts& facts) {
    std::string text =
        fmt::format("{}, {} samples of the finest data: nothing drawn was further than {:.3g} px from it",
                    counted(static_cast<std::int64_t>(f.triangles.values.size()), "frame", "frames"),
                    short_number(sum_of(f.samples)), std::max(f.blocks_max_px.max(), f.strips_max_px.max()));
    if (facts.promise_px) text += fmt::format("; promised was {} px", short_number(*facts.promise_px));
    const auto total = [](const Series& s) { return static_cast<std::int64_t>(std::lround(sum_of(s))); };
    text += fmt::format("; {}, {}, {}", counted(total(f.open_edges), "open edge", "open edges"),
                        counted(total(f.t_junctions), "T-junction", "T-junctions"),
                        counted(total(f.holes), "hole", "cells in holes"));
    if (!facts.promise_px) return text + ". No error is promised.";
    return text + (f.kept ? ". The promise holds." : ". The promise is broken.");
}

Result<std::string> block_audit_page(const BlockAuditFigures& f, const BlockFacts& facts,
                                     const std::vector<PosePicture>& pictures, const std::string& no_pictures) {
    std::vector<std::string> captions;
    for (const PosePicture& p : pictures)
        captions.push_back(fmt::format("Frame {}: {:.0f} triangles, true error at most {:.3g} px", p.frame,
                                       f.triangles.values[p.frame],
                                       std::max(f.blocks_max_px.values[p.frame], f.strips_max_px.values[p.frame])));
    auto seen = pictures_html(pictures, captions);
    if (!seen) return seen;
    HtmlPage page(
        fmt::format("An audit of {}", facts.store),
        fmt::format("{} poses, {} x {} pixels of separate blocks. Every vertex of the finest data in view, and "
                    "every crossing of a strip with the full strip, against the drawn surface straight above "
                    "or below it; what hides what is ignored, so these are upper figures.",
                    f.triangles.values.size(), facts.width_px, facts.height_px));
    const bool good = !facts.promise_px || f.kept;
    page.add(
        fmt::format("<p class=\"note {}\">{}</p>\n", good ? "good" : "bad", escaped(block_audit_verdict(f, facts))));
    page.section("Errors");
    page.add(audit_charts(f, facts));
    page.section("From the poses");
    page.add(no_pictures.empty() ? *seen
                                 : fmt::format("<p class=\"soft\">No pictures: {}.</p>\n", escaped(no_pictures)));
    page.section("Frame by frame");
    page.add(audit_table(f));
    page.section("Settings");
    page.add(settings_table(facts));
    page.add(command_html(facts.command));
    return std::move(page).finish();
}

}  // namespace scree
