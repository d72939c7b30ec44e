#include "runtime/app/comparison_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string_view>
#include <utility>
#include <vector>

#include "runtime/app/comparison_table.h"
#include "runtime/report/html.h"
#include "runtime/report/plot.h"

namespace scree {
namespace {

// What could not be measured is said to be without end.
std::string number(double v) { return v >= kBeyondMeasure ? "&infin;" : short_number(v); }

/// One method of the tolerance sweep: its cases in the order of tau.
struct Curve {
    std::string method;
    LodSettings lod;
    std::vector<std::size_t> cases;
};

std::vector<Curve> curves_of(const Comparison& comparison) {
    std::vector<Curve> curves;
    for (std::size_t k = 0; k < comparison.cases.size(); ++k) {
        const ComparisonCase& c = comparison.cases[k].what;
        if (c.sweep != Sweep::tolerance) continue;
        auto at = std::find_if(curves.begin(), curves.end(), [&](const Curve& v) { return v.method == c.method; });
        if (at == curves.end()) {
            curves.push_back({c.method, c.lod, {}});
            at = curves.end() - 1;
        }
        at->cases.push_back(k);
    }
    for (Curve& curve : curves)
        std::stable_sort(curve.cases.begin(), curve.cases.end(), [&](std::size_t a, std::size_t b) {
            return comparison.cases[a].what.tau_px < comparison.cases[b].what.tau_px;
        });
    return curves;
}

// A line a method, its marks the tolerances; dashed: no promise.
std::string chart(const Comparison& comparison, const std::vector<Curve>& curves, Cost cost, std::string_view title,
                  std::string_view label) {
    LineChart chart;
    chart.title = title;
    chart.x = {"greatest true error, pixels", true, {}};
    chart.y = {std::string(label), true, {}};
    const auto point = [&](std::size_t k) {
        return std::pair{comparison.cases[k].figures.true_max_px, cost_of(comparison.cases[k], cost)};
    };
    for (const Curve& curve : curves) {
        PlotSeries series;
        series.name = curve.lod.is_guaranteed() ? curve.method : curve.method + " (no promise)";
        for (const std::size_t k : curve.cases)
            if (comparison.cases[k].figures.true_max_px < kBeyondMeasure) series.points.push_back(point(k));
        series.dashed = !curve.lod.is_guaranteed();
        chart.series.push_back(std::move(series));
    }
    return to_figure(chart);
}

std::string front_section(const Comparison& comparison) {
    std::vector<std::vector<std::string>> rows;
    for (const auto& [cost, name] :
         {std::pair(Cost::triangles, "triangles"), std::pair(Cost::frame_ms, "selection and drawing"),
          std::pair(Cost::lod_ms, "selection")}) {
        std::string cases;
        for (const std::size_t k : pareto_front(comparison.cases, cost))
            cases += fmt::format("{}{} at {:g}", cases.empty() ? "" : ", ", escaped(comparison.cases[k].what.method),
                                 comparison.cases[k].what.tau_px);
        rows.push_back({name, cases.empty() ? "&ndash;" : cases});
    }
    return html_table({"by", "the Pareto front: no case with a promise is both truer and cheaper"}, rows, 2);
}

std::string cheapest_section(const Comparison& comparison) {
    std::vector<std::vector<std::string>> rows;
    for (const double error_px : kErrors_px) {
        const auto named = [&](Cost cost, bool guaranteed) -> std::string {
            const auto at = cheapest_within(comparison.cases, error_px, cost, guaranteed);
            if (!at) return "&ndash;";
            const ComparedCase& c = comparison.cases[*at];
            return fmt::format("{}, tau {:g} <span class=\"soft\">({} {})</span>", escaped(c.what.method),
                               c.what.tau_px, number(cost_of(c, cost)), cost == Cost::triangles ? "triangles" : "ms");
        };
        rows.push_back({fmt::format("{:g} px", error_px), named(Cost::frame_ms, true), named(Cost::triangles, true),
                        named(Cost::frame_ms, false)});
    }
    return "<h2>For this error, the cheapest method</h2>\n<p>Every case whose greatest true error on this path was "
           "within the error of the row. The first two columns have only methods that promise a bound everywhere; the "
           "last has those that do not, which may err by more elsewhere.</p>\n" +
           html_table(
               {"true error at most", "least selection + drawing", "fewest triangles", "least, without a promise"},
               rows, 4);
}

Result<std::string> image(const Comparison& c, const std::vector<std::uint8_t>& rgb, const std::string& what) {
    return image_html({c.picture_width_px, c.picture_height_px, rgb}, what);
}

Result<std::string> picture_section(const Comparison& c) {
    if (c.reference_picture.empty()) return std::string();
    std::string html = fmt::format(
        "<h2>What it looks like</h2>\n<p>One pose, the middle of the picture pixel by pixel. Under each picture: "
        "{} times its difference from the full-resolution picture; black is none.</p>\n<div class=\"pictures\">\n",
        kDifferenceGain);
    auto reference = image(c, c.reference_picture, "the full-resolution picture");
    if (!reference) return reference;
    html +=
        fmt::format("<figure>{}<figcaption>Full resolution: the finest data everywhere in view</figcaption></figure>\n",
                    *reference);
    for (const CasePicture& p : c.pictures) {
        const std::string name = fmt::format("{}, tau {:g} px{}", c.cases[p.at].what.method, c.cases[p.at].what.tau_px,
                                             c.cases[p.at].what.sweep == Sweep::texture
                                                 ? fmt::format(", texels of {:g} px", c.cases[p.at].what.texture_tau_px)
                                                 : "");
        auto drawn = image(c, p.rgb, name);
        if (!drawn) return drawn;
        auto difference = image(c, p.difference, name + ": difference");
        if (!difference) return difference;
        html += fmt::format("<figure>{}{}<figcaption>{}: PSNR {:.1f} dB, SSIM {:.4f}</figcaption></figure>\n", *drawn,
                            *difference, escaped(name), p.psnr_db, p.ssim);
    }
    return html + "</div>\n";
}

std::string sweep_table(const Comparison& comparison, Sweep sweep) {
    std::vector<std::vector<std::string>> rows;
    for (const ComparedCase& c : comparison.cases) {
        if (c.what.sweep != sweep) continue;
        const CaseFigures& f = c.figures;
        rows.push_back({sweep == Sweep::texture ? fmt::format("{:g} px", c.what.texture_tau_px)
                                                : fmt::format("{} MiB", c.what.budget_bytes >> 20),
                        page_megabytes(f.tile_bytes), page_megabytes(f.resident_bytes), number(f.triangles_mean),
                        number(f.frame_ms), number(c.promised_px()), number(f.true_max_px),
                        fmt::format("{:.1f}", f.psnr_db), fmt::format("{:.4f}", f.ssim),
                        fmt::format("{} of {}", f.budget_limited_frames, comparison.frames)});
    }
    if (rows.empty()) return "<p class=\"soft\">Not measured.</p>\n";
    return html_table(
        {sweep == Sweep::texture ? "texel covers" : "budget", "tiles kept, MB", "taken of the budget, MB", "triangles",
         "frame, ms", "promised, px", "true max, px", "PSNR, dB", "SSIM", "frames the budget bound"},
        rows, 0);
}

std::string all_cases(const Comparison& comparison, const std::vector<Curve>& curves) {
    std::vector<std::vector<std::string>> rows;
    std::vector<std::string> row_classes;
    for (const Curve& curve : curves)
        for (const std::size_t k : curve.cases) {
            const ComparedCase& c = comparison.cases[k];
            const CaseFigures& f = c.figures;
            const bool promises = c.what.lod.is_guaranteed();
            row_classes.push_back(promises ? "" : "loose");
            rows.push_back({escaped(c.what.method), fmt::format("{:g}", c.what.tau_px), number(f.triangles_mean),
                            number(f.lod_ms), number(f.lod_cold_ms), number(f.draw_ms), number(f.frame_ms),
                            number(f.frame_p99_ms), page_megabytes(f.tile_bytes),
                            promises ? number(c.promised_px()) : "nothing", number(f.true_max_px),
                            number(f.true_p99_px), number(f.true_mean_px), fmt::format("{:.1f}", f.psnr_db),
                            fmt::format("{:.4f}", f.ssim), number(static_cast<double>(f.holes)),
                            number(static_cast<double>(f.open_edges + f.t_junctions)),
                            !promises ? "&ndash;"
                            : f.kept  ? "kept"
                                      : "BROKEN"});
        }
    return html_table({"method", "tau, px", "triangles", "LOD, ms", "LOD cold, ms", "draw, ms", "frame, ms",
                       "frame p99, ms", "tiles, MB", "promised, px", "true max, px", "p99, px", "mean, px", "PSNR, dB",
                       "SSIM", "holes, cells", "cracks", "promise"},
                      rows, 1, row_classes);
}

std::string quantum_text(const HeightQuantum& q) {
    if (!(q.error_m > 0)) return "Stored heights may be rounded; those of this store are exact.";
    return fmt::format(
        "Stored heights are rounded, here by at most {:.4g} m. The nearest drawn vertex of this path was {} m away: "
        "seen "
        "from there, at most {} px, which no other figure of this page counts. A coarser quantum makes smaller files.",
        q.error_m, number(q.nearest_m), number(q.error_px));
}

std::string settings_section(const Comparison& c) {
    constexpr std::array<std::array<std::string_view, 3>, 9> kSettings{{
        {"Tolerance", "--tau",
         "How far, in pixels, anything drawn may be from the finest data. Smaller is truer and costs triangles (about "
         "1/tau), pages and drawing time."},
        {"Method", "--lod",
         "<code>geomip</code> gives each tile one density: the least thinking, the most triangles; it morphs, so "
         "nothing "
         "pops. <code>rsg</code> chooses vertex by vertex: the fewest triangles for an error, the most thinking. "
         "<code>block-rsg</code> thins by one threshold a tile and keeps meshes from frame to frame: in between."},
        {"Morphing", "--no-morph",
         "Morphing moves vertices between densities, so that changes glide; each picture is then nearer to the next "
         "coarser "
         "one than it need be. Without it single pictures are a little truer, and changes pop."},
        {"Reuse", "--cache exact --s",
         "Keeps a mesh while it provably errs by at most tau + s. Larger s: less thinking, more error. <code>--cache "
         "paper</code> keeps meshes by the published test, which proves nothing."},
        {"Metric", "--metric uc, deboer",
         "The published estimates of a vertex's or a tile's error. They draw less for the same tau because they see "
         "less "
         "of the error: compare them by true error, not by tau."},
        {"Culling", "--cull corners",
         "As published: a tile none of whose corners is in view is not drawn. Loses ground that is in view: see "
         "holes."},
        {"Cracks", "--cracks dike",
         "As published: strips between blocks that share nothing, in place of shared edges."},
        {"Texture tolerance", "--texture-tau",
         "How many pixels a texel may cover. Smaller is sharper and costs memory (1/tau&sup2;); below 1 there are more "
         "texels than pixels."},
        {"Budget", "--budget",
         "The ceiling of tile memory. Where it binds, the tolerance is raised as far as needed, evenly, and the "
         "promise "
         "with it."},
    }};
    std::string html = "<h2>What each setting trades</h2>\n<dl>\n";
    for (const auto& [name, option, text] : kSettings)
        html += fmt::format("<dt>{}, <code>{}</code></dt><dd>{}</dd>\n", name, option, text);
    return html + fmt::format("<dt>Height quantum, <code>scree build --height-quantum</code></dt><dd>{}</dd>\n</dl>\n",
                              quantum_text(c.quantum));
}

std::string quanta_section(const Comparison& c) {
    if (c.coarser_quanta.empty()) return {};
    std::vector<std::vector<std::string>> rows;
    for (const CoarserQuantum& q : c.coarser_quanta)
        rows.push_back({number(q.quantum_m), number(q.max_px), number(q.p99_px), number(q.mean_px)});
    return "<h2>Height quantum</h2>\n<p>What the finest heights in view, rounded to a coarser quantum as they are read "
           "out, would be seen as at most. The store is as it was: a build with that quantum also has other tiles, and "
           "its file is smaller. These errors come on top of the promise.</p>\n" +
           html_table({"quantum, m", "max, px", "p99, px", "mean, px"}, rows, 0);
}

std::string how_section(const Comparison& c) {
    std::string html = fmt::format(
        "<h2>How it was measured</h2>\n<ul>\n"
        "<li>{} poses along the path, each with everything there that it wants (nothing was still being loaded), and "
        "the eye "
        "moving on twice by {:g} m from each.</li>\n"
        "<li><b>LOD</b>: CPU time of selection and requests, where the eye has just moved on; <b>cold</b>: where it "
        "has leapt. "
        "<b>Draw</b>: until the picture was finished. <b>Frame</b>: both. Medians over {} rounds, in which the cases "
        "took turns; then over poses.</li>\n"
        "<li><b>True error</b>: every finest vertex in view against the drawn surface above or below it, in pixels; "
        "what hides "
        "what is ignored, so it is an upper figure. What is missing altogether is counted as holes.</li>\n"
        "<li><b>Promised</b>: the bound that holds from everywhere: tau (and s), or what the budget allowed.</li>\n"
        "<li><b>PSNR</b> over sRGB bytes, <b>SSIM</b> over luma (Wang et al. 2004), against pictures of tolerance 0{}; "
        "for the "
        "textures' table also texels of {:g} px, for dikes untextured blocks. 100 dB: the same picture.</li>\n</ul>\n",
        c.frames, c.step_m, c.rounds,
        c.reference_bound_px > 0
            ? fmt::format(" as far as memory allowed ({} px at most)", number(c.reference_bound_px))
            : "",
        c.reference_texture_px);
    if (c.skipped.empty()) return html;
    html += "<p>Not measured:</p><ul>\n";
    for (const SkippedCase& s : skipped_methods(c))
        html += fmt::format("<li>{}: {}</li>\n", escaped(s.what.method), escaped(s.reason));
    return html + "</ul>\n";
}

std::string verdict(const Comparison& c, const std::optional<Wish>& wish, const std::string& command) {
    std::string html;
    if (!c.kept())
        html +=
            "<p class=\"note bad\"><b>A promise was broken.</b> See the last column of the table of all cases.</p>\n";
    if (!wish) return html;
    const Recommendation r = recommend(c.cases, *wish);
    html += fmt::format("<div class=\"note\"><b>For {:g} frames a second within {:g} px on this machine:</b> {}.",
                        wish->fps, wish->most_error_px, escaped(r.reason));
    if (!command.empty()) html += fmt::format("<br><code>{}</code>", escaped(command));
    if (r.cheaper_here)
        html += fmt::format(
            "<br><span class=\"soft\">Cheaper, and within {:g} px on this path though not by promise: {}</span>",
            wish->most_error_px, escaped(options_of(c.cases[*r.cheaper_here].what)));
    return html + "</div>\n";
}

}  // namespace

Result<std::string> comparison_page(const Comparison& c, const std::optional<Wish>& wish, const std::string& command) {
    const std::vector<Curve> curves = curves_of(c);
    auto pictures = picture_section(c);
    if (!pictures) return pictures;
    HtmlPage page(
        fmt::format("What accuracy costs: {}", c.store),
        fmt::format("{} cases, {} poses, {} x {} pixels, drawn by {}. Times are of this machine; triangles and errors "
                    "are not.",
                    c.cases.size(), c.frames, c.width_px, c.height_px, escaped(c.renderer)));
    page.add(verdict(c, wish, command));
    page.add(cheapest_section(c));
    page.section("Cost against true error",
                 "A line a method, a mark a tolerance; further left is truer, further down is cheaper. Both axes are "
                 "logarithmic. Dashed: no promise.");
    page.add("<div class=\"charts\">\n");
    page.add(chart(c, curves, Cost::triangles, "Triangles", "triangles a frame, mean"));
    page.add(chart(c, curves, Cost::frame_ms, "Selection and drawing", "frame, milliseconds"));
    page.add(chart(c, curves, Cost::lod_ms, "Selection alone", "LOD, CPU milliseconds"));
    page.add("</div>\n" + front_section(c) + *pictures);
    page.section("Texture tolerance", "Against full resolution in heights and textures.");
    page.add(sweep_table(c, Sweep::texture));
    page.section("Memory budget", "Where the budget binds, the tolerance rises.");
    page.add(sweep_table(c, Sweep::budget));
    page.add(quanta_section(c));
    page.add(settings_section(c));
    page.section("All methods and tolerances");
    page.add(all_cases(c, curves));
    page.add(how_section(c));
    return std::move(page).finish();
}

}  // namespace scree
