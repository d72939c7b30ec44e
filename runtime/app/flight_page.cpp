#include "runtime/app/flight_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace scree {
namespace {

constexpr double kMega = 1e6;
/// What is as good as the tolerance: rounding of its sums.
constexpr double kTauSlack = 1 + 1e-9;

std::vector<double> scaled(const Series& series, double unit) {
    std::vector<double> values = series.values;
    for (double& v : values) v /= unit;
    return values;
}

// Why the promise was wider than the tolerance: each frame counts for the first cause that holds.
std::string beyond_tau_text(const FlightLog& log, const FlightFacts& facts) {
    std::int64_t beyond = 0, limited = 0, missing = 0, raised = 0, growing = 0;
    for (const FlightFrame& f : log.frames) {
        if (!(f.max_bound_px > facts.tau_px * kTauSlack)) continue;
        ++beyond;
        ++(f.limited                                       ? limited
           : f.incomplete                                  ? missing
           : f.tau_effective_px > facts.tau_px * kTauSlack ? raised
                                                           : growing);
    }
    if (beyond == 0) return {};
    std::string text =
        fmt::format(" ({} of {} frames went beyond the tolerance of {:g} px", beyond, log.frames.size(), facts.tau_px);
    if (limited > 0) text += fmt::format("; in {} the budget bound", limited);
    if (missing > 0) text += fmt::format("; in {} tiles were still missing", missing);
    if (growing > 0) text += fmt::format("; in {} tiles that came late were still growing", growing);
    if (raised > 0)
        text += facts.fps > 0
                    ? fmt::format("; in {} it was raised for the sake of {:g} frames a second", raised, facts.fps)
                    : fmt::format("; in {} a quick first picture was shown", raised);
    return text + ")";
}

std::string charts(const FlightLog& log, const FlightFacts& facts) {
    std::string html = "<div class=\"charts\">\n";
    LineChart times = frame_chart("Frame time and selection", "milliseconds",
                                  {{"frame", log.of(&FlightFrame::frame_ms).values},
                                   {"selection and requests, CPU", log.of(&FlightFrame::select_ms).values}});
    times.y.logarithmic = true;
    html += to_figure(times);

    html += to_figure(frame_chart("Triangles", "triangles drawn", {{"", log.of(&FlightFrame::triangles).values}}));

    const Series promised = log.of(&FlightFrame::max_bound_px);
    LineChart error = frame_chart("Error on screen", "pixels",
                                  {{"greatest that anything drawn may have", promised.values},
                                   {"tolerance in force", log.of(&FlightFrame::tau_effective_px).values, true},
                                   {"mean over the screen", log.of(&FlightFrame::mean_bound_px).values}});
    error.levels.push_back({fmt::format("tau {:g}", facts.tau_px), facts.tau_px});
    error.y.logarithmic = is_wide(promised.values, facts.tau_px);
    html += to_figure(error);

    LineChart memory = frame_chart("Memory for tiles", "MB",
                                   {{"heights", scaled(log.of(&FlightFrame::resident_heights_bytes), kMega)},
                                    {"textures", scaled(log.of(&FlightFrame::resident_textures_bytes), kMega)}});
    const double budget_mb = static_cast<double>(facts.budget_bytes) / kMega;
    memory.levels.push_back({fmt::format("budget {} MB", page_megabytes(facts.budget_bytes)), budget_mb});
    html += to_figure(memory);

    html += to_figure(frame_chart("Waiting", "tiles",
                                  {{"asked for and not there yet", log.of(&FlightFrame::queue).values},
                                   {"drawn in place of what is missing", log.of(&FlightFrame::stand_ins).values}}));

    html +=
        to_figure(frame_chart("Uploaded in a frame", "MB", {{"", scaled(log.of(&FlightFrame::upload_bytes), kMega)}}));

    Series uploaded;
    for (const FlightFrame& f : log.frames)
        uploaded.add((uploaded.values.empty() ? 0 : uploaded.values.back()) + static_cast<double>(f.upload_bytes));
    html += to_figure(frame_chart("Read and uploaded so far", "MB",
                                  {{"read from the store, compressed", scaled(log.of(&FlightFrame::bytes_read), kMega)},
                                   {"uploaded", scaled(uploaded, kMega)}}));

    html += to_figure(frame_chart("Memory of the whole process", "MB resident",
                                  {{"", scaled(log.of(&FlightFrame::rss_bytes), kMega)}}));
    return html + "</div>\n";
}

Result<std::string> picture_section(const FlightLog& log, const std::vector<PosePicture>& pictures) {
    if (pictures.empty()) return std::string();
    std::vector<std::string> captions;
    for (const PosePicture& p : pictures) {
        const FlightFrame& f = log.frames[p.frame];
        captions.push_back(fmt::format("Frame {}: {} triangles, at most {} px{}", p.frame, f.triangles,
                                       short_number(f.max_bound_px),
                                       f.stand_ins > 0 ? fmt::format(", {} stand-ins", f.stand_ins) : ""));
    }
    auto html = pictures_html(pictures, captions);
    if (!html) return html;
    return "<h2>Along the flight</h2>\n<p>As drawn, made smaller for this page.</p>\n" + *html;
}

using Rows = std::vector<std::vector<std::string>>;

std::string settings_table(const FlightFacts& f) {
    return html_table(
        {"setting", "value", "meaning"},
        Rows{{"tolerance", fmt::format("{:g} px", f.tau_px), "how far anything drawn may be from the finest data"},
             {"texture tolerance", fmt::format("{:g} px", f.texture_tau_px), "pixels that a texel may cover"},
             {"budget", fmt::format("{} MB", page_megabytes(f.budget_bytes)),
              fmt::format("for tiles; divided beforehand, {} MB of it taken", page_megabytes(f.peak_resident_bytes))},
             {"method", fmt::format("<code>{}</code>", escaped(f.lod)),
              f.guaranteed ? "its error is promised" : "its error is not promised beforehand"},
             {"picture", fmt::format("{} x {}, {:g} degrees", f.width_px, f.height_px, f.fov_deg),
              "size in pixels, vertical field of view"},
             {"heights", fmt::format("x {:g}", f.exaggeration), "as drawn; errors count in these"},
             {"rounding of heights", fmt::format("{:.3g} m at most", f.height_quantum_error_m),
              "when the store was built; comes on top of every error here"},
             {"renderer", escaped(f.renderer), "as OpenGL names it"},
             {"machine", escaped(f.machine), ""}},
        3);
}

std::vector<std::string> spread_row(const std::string& name, const Series& s) {
    return {name, short_number(s.quantile(0.5)), short_number(s.quantile(0.99)), short_number(s.max()),
            short_number(s.mean())};
}

std::string spread_table(const FlightLog& log) {
    return html_table({"a frame", "median", "99 % within", "most", "mean"},
                      Rows{spread_row("frame, ms", log.of(&FlightFrame::frame_ms)),
                           spread_row("selection and requests, ms CPU", log.of(&FlightFrame::select_ms)),
                           spread_row("triangles", log.of(&FlightFrame::triangles)),
                           spread_row("tiles drawn", log.of(&FlightFrame::tiles_drawn)),
                           spread_row("greatest error promised, px", log.of(&FlightFrame::max_bound_px)),
                           spread_row("mean error promised, px", log.of(&FlightFrame::mean_bound_px)),
                           spread_row("tolerance in force, px", log.of(&FlightFrame::tau_effective_px)),
                           spread_row("tiles waited for", log.of(&FlightFrame::queue)),
                           spread_row("stand-ins", log.of(&FlightFrame::stand_ins)),
                           spread_row("uploaded, bytes", log.of(&FlightFrame::upload_bytes))},
                      1);
}

std::string whole_table(const FlightLog& log, const FlightFacts& f) {
    const PagerCounters& c = f.paging;
    Rows rows{{"frames with stand-ins", fmt::format("{}", log.total(&FlightFrame::incomplete))},
              {"frames in which the budget bound", fmt::format("{}", log.total(&FlightFrame::limited))},
              {"holes, cells", fmt::format("{}", log.total(&FlightFrame::holes))},
              {"tiles that came, of these ahead of need", fmt::format("{}, {}", c.tiles_paged_in, c.prefetched)},
              {"tiles that went", fmt::format("{}", c.tiles_paged_out)},
              {"read, MB", page_megabytes(c.bytes_read)},
              {"uploaded, MB", page_megabytes(c.upload_bytes)},
              {"damaged tiles", fmt::format("{}", c.damaged_tiles)},
              {"tiles in memory at most, MB", page_megabytes(log.most_resident_bytes())},
              {"process at most, MB", page_megabytes(f.peak_rss_bytes)},
              {"of which not for tiles, MB", page_megabytes(log.fixed_rss_bytes)},
              {"first picture within 8 px, ms", short_number(log.coarse_after_ms)},
              {"first picture within the tolerance, ms", short_number(log.true_after_ms)}};
    if (f.store_updates > 0) rows.push_back({"updates of the store taken up", fmt::format("{}", f.store_updates)});
    if (f.settled)
        rows.push_back({"mean error promised with nothing missing, px", short_number(log.settled_mean_bound.mean())});
    if (f.see_through)
        rows.push_back(
            {fmt::format("pixels seen through, in {} frames", log.looked_through), fmt::format("{}", log.see_through)});
    return html_table({"the flight", "figure"}, rows, 1);
}

}  // namespace

std::string flight_verdict(const FlightLog& log, const FlightFacts& facts) {
    const Series frame_ms = log.of(&FlightFrame::frame_ms);
    const std::int64_t holes = log.total(&FlightFrame::holes);
    std::string text = fmt::format("{}, median {:.3g} ms, 99 % within {:.3g} ms; ",
                                   counted(static_cast<std::int64_t>(log.frames.size()), "frame", "frames"),
                                   frame_ms.quantile(0.5), frame_ms.quantile(0.99));
    text += fmt::format("nothing drawn was further than {} px from the finest data{}; ",
                        short_number(log.of(&FlightFrame::max_bound_px).max()), beyond_tau_text(log, facts));
    text += fmt::format("memory for tiles stayed at {:.0f} of {:.0f} MB; ",
                        static_cast<double>(log.most_resident_bytes()) / kMega,
                        static_cast<double>(facts.budget_bytes) / kMega);
    text += counted(holes, "hole", "cells in holes");
    if (facts.see_through && log.see_through > 0) text += fmt::format("; {} pixels seen through", log.see_through);
    if (facts.paging.damaged_tiles > 0)
        text += "; " + counted(facts.paging.damaged_tiles, "damaged tile", "damaged tiles");
    return text + ".";
}

Result<std::string> flight_page(const FlightLog& log, const FlightFacts& facts,
                                const std::vector<PosePicture>& pictures) {
    auto seen = picture_section(log, pictures);
    if (!seen) return seen;
    HtmlPage page(
        fmt::format("A flight over {}", facts.store),
        fmt::format("{} frames of {} x {} pixels, drawn by {} on {}. Times are of this machine; triangles and "
                    "errors are not.",
                    log.frames.size(), facts.width_px, facts.height_px, escaped(facts.renderer),
                    escaped(facts.machine)));
    const bool good = log.total(&FlightFrame::holes) == 0 && facts.paging.damaged_tiles == 0 && log.see_through == 0;
    page.add(fmt::format("<p class=\"note {}\">{}</p>\n", good ? "good" : "bad", escaped(flight_verdict(log, facts))));
    page.section("Frame by frame");
    page.add(charts(log, facts));
    page.add(*seen);
    page.section("Settings");
    page.add(settings_table(facts));
    page.section("Figures");
    page.add(spread_table(log));
    page.add("<p></p>\n");
    page.add(whole_table(log, facts));
    page.add(command_html(facts.command));
    return std::move(page).finish();
}

}  // namespace scree
