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

namespace scree {
namespace {

/// Beyond the style of all pages: colour is a family of methods.
constexpr std::string_view kStyle = R"css(
:root { --geomip: var(--blue); --rsg: var(--orange); --block: var(--green); }
svg .front { fill: none; stroke: var(--ink); stroke-width: 9; stroke-opacity: .13; stroke-linejoin: round;
  stroke-linecap: round; }
svg .ring { fill: none; stroke: var(--ink); stroke-width: 1.5; }
.curve { color: var(--geomip); }
.curve.rsg { color: var(--rsg); }
.curve.block { color: var(--block); }
.curve path.line { fill: none; stroke: currentColor; stroke-width: 2; }
.curve.loose path.line { stroke-dasharray: 5 4; }
.curve .mark { fill: currentColor; stroke: var(--page); stroke-width: 1; }
.curve.loose .mark { fill: var(--page); stroke: currentColor; stroke-width: 1.6; }
.legend { display: flex; flex-direction: column; gap: .3rem; margin: 0; padding: 1.6rem 0 0; list-style: none;
  font-size: .92rem; }
.legend li { display: flex; align-items: center; gap: .4rem; cursor: default; }
.legend svg { width: 34px; height: 16px; flex: none; }
body[data-method] .curve { opacity: .15; }
body[data-method] .curve.chosen { opacity: 1; }
)css";

// Pointing at a name in the legend leaves its curve alone in the charts.
constexpr std::string_view kScript = R"js(
for (const item of document.querySelectorAll('.legend [data-of]')) {
  const mark = on => {
    for (const curve of document.querySelectorAll('.curve'))
      curve.classList.toggle('chosen', on && curve.dataset.of === item.dataset.of);
    if (on) document.body.dataset.method = ''; else delete document.body.dataset.method;
  };
  item.addEventListener('pointerenter', () => mark(true));
  item.addEventListener('pointerleave', () => mark(false));
}
)js";

// What could not be measured is said to be without end.
std::string number(double v) { return v >= kBeyondMeasure ? "&infin;" : short_number(v); }

/// One method of the tolerance sweep: its cases in the order of tau.
struct Curve {
    std::string method;
    LodSettings lod;
    std::vector<std::size_t> cases;
    int shape = 0;
};

// Colour is the family, a mark the variant; hollow and dashed: no promise.
std::string_view family(const LodSettings& lod) {
    switch (lod.method) {
        case LodMethod::geomip:
            return "geomip";
        case LodMethod::rsg:
            return "rsg";
        case LodMethod::block_rsg:
            return "block";
    }
    return "";
}

std::string classes(const Curve& curve) {
    return fmt::format("curve {}{}", family(curve.lod), curve.lod.is_guaranteed() ? "" : " loose");
}

std::vector<Curve> curves_of(const Comparison& comparison) {
    std::vector<Curve> curves;
    for (std::size_t k = 0; k < comparison.cases.size(); ++k) {
        const ComparisonCase& c = comparison.cases[k].what;
        if (c.sweep != Sweep::tolerance) continue;
        auto at = std::find_if(curves.begin(), curves.end(), [&](const Curve& v) { return v.method == c.method; });
        if (at == curves.end()) {
            const auto variants = std::count_if(curves.begin(), curves.end(), [&](const Curve& v) {
                return v.lod.method == c.lod.method && v.lod.is_guaranteed() == c.lod.is_guaranteed();
            });
            curves.push_back({c.method, c.lod, {}, static_cast<int>(variants)});
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

std::string mark(double x, double y, int shape, const std::string& title) {
    std::string path;
    switch (shape % 5) {
        case 0:
            path = fmt::format("M{:.1f},{:.1f}m-4.5,0a4.5,4.5 0 1,0 9,0a4.5,4.5 0 1,0 -9,0z", x, y);
            break;
        case 1:
            path = fmt::format("M{:.1f},{:.1f}m-4,-4h8v8h-8z", x, y);
            break;
        case 2:
            path = fmt::format("M{:.1f},{:.1f}m0,-5.5l5.5,5.5l-5.5,5.5l-5.5,-5.5z", x, y);
            break;
        case 3:
            path = fmt::format("M{:.1f},{:.1f}m0,-5.5l5.5,9.5h-11z", x, y);
            break;
        default:
            path = fmt::format("M{:.1f},{:.1f}m0,5.5l5.5,-9.5h-11z", x, y);
            break;
    }
    return fmt::format("<path class=\"mark\" d=\"{}\">{}</path>", path,
                       title.empty() ? "" : fmt::format("<title>{}</title>", title));
}

/// Values of one axis, by their logarithm. What is not above 0 stands at the low end.
class LogAxis {
public:
    void cover(double v) {
        if (!(v > 0) || !(v < kBeyondMeasure)) return;
        low_ = std::min(low_, v);
        high_ = std::max(high_, v);
    }
    void settle(double from, double to) {
        if (!(low_ <= high_)) low_ = high_ = 1;
        if (high_ < 1.5 * low_) high_ *= 1.25, low_ /= 1.25;
        low_ /= 1.15, high_ *= 1.15;
        from_ = from, to_ = to;
    }
    double at(double v) const {
        const double t = (std::log(std::clamp(v, low_, high_)) - std::log(low_)) / (std::log(high_) - std::log(low_));
        return from_ + t * (to_ - from_);
    }
    /// 1, 2, 5 of each decade; only powers of ten where there are many.
    std::vector<double> ticks() const {
        std::vector<double> ticks;
        const double decades = std::log10(high_ / low_);
        for (int e = static_cast<int>(std::floor(std::log10(low_)));
             e <= static_cast<int>(std::ceil(std::log10(high_))); ++e)
            for (const double lead : {1.0, 2.0, 5.0}) {
                const double v = lead * std::pow(10.0, e);
                if (v < low_ || v > high_ || (decades > 3.5 && lead != 1)) continue;
                ticks.push_back(v);
            }
        return ticks;
    }

private:
    double low_ = std::numeric_limits<double>::infinity(), high_ = 0, from_ = 0, to_ = 1;
};

constexpr double kWidth = 560, kHeight = 390, kLeft = 66, kRight = 14, kTop = 10, kBottom = 48;

std::string point_title(const ComparedCase& c, Cost cost, std::string_view unit) {
    return fmt::format("{}, tau {:g} px: true error {} px, {} {}", escaped(c.what.method), c.what.tau_px,
                       number(c.figures.true_max_px), number(cost_of(c, cost)), unit);
}

std::string chart(const Comparison& comparison, const std::vector<Curve>& curves, Cost cost, std::string_view title,
                  std::string_view label, std::string_view unit) {
    LogAxis across, up;
    for (const Curve& curve : curves)
        for (const std::size_t k : curve.cases) {
            across.cover(comparison.cases[k].figures.true_max_px);
            up.cover(cost_of(comparison.cases[k], cost));
        }
    across.settle(kLeft, kWidth - kRight);
    up.settle(kHeight - kBottom, kTop);
    std::string svg = fmt::format(
        "<figure><figcaption>{}</figcaption><svg viewBox=\"0 0 {} {}\" role=\"img\" aria-label=\"{} against true "
        "error, "
        "a line a method\">\n",
        title, kWidth, kHeight, label);
    for (const double v : across.ticks())
        svg += fmt::format(
            "<line class=\"grid\" x1=\"{0:.1f}\" x2=\"{0:.1f}\" y1=\"{1}\" y2=\"{2}\"/><text x=\"{0:.1f}\" y=\"{3}\" "
            "text-anchor=\"middle\">{4}</text>\n",
            across.at(v), kTop, kHeight - kBottom, kHeight - kBottom + 17, tick_number(v));
    for (const double v : up.ticks())
        svg += fmt::format(
            "<line class=\"grid\" x1=\"{0}\" x2=\"{1}\" y1=\"{2:.1f}\" y2=\"{2:.1f}\"/><text x=\"{3}\" y=\"{4:.1f}\" "
            "text-anchor=\"end\">{5}</text>\n",
            kLeft, kWidth - kRight, up.at(v), kLeft - 7, up.at(v) + 4, tick_number(v));
    svg += fmt::format("<text x=\"{:.0f}\" y=\"{}\" text-anchor=\"middle\">greatest true error, pixels</text>\n",
                       (kLeft + kWidth - kRight) / 2, kHeight - 8);
    svg += fmt::format("<text transform=\"translate(13 {:.0f}) rotate(-90)\" text-anchor=\"middle\">{}</text>\n",
                       (kTop + kHeight - kBottom) / 2, label);
    const auto place = [&](std::size_t k) {
        return std::pair{across.at(comparison.cases[k].figures.true_max_px), up.at(cost_of(comparison.cases[k], cost))};
    };
    const auto line_through = [&](const std::vector<std::size_t>& cases) {
        std::string d;
        for (const std::size_t k : cases) {
            const auto [x, y] = place(k);
            d += fmt::format("{}{:.1f},{:.1f}", d.empty() ? "M" : "L", x, y);
        }
        return d;
    };
    const std::vector<std::size_t> front = pareto_front(comparison.cases, cost);
    svg += fmt::format("<path class=\"front\" d=\"{}\"/>\n", line_through(front));
    for (const Curve& curve : curves) {
        svg += fmt::format("<g class=\"{}\" data-of=\"{}\"><path class=\"line\" d=\"{}\"/>", classes(curve),
                           escaped(curve.method), line_through(curve.cases));
        for (const std::size_t k : curve.cases) {
            const auto [x, y] = place(k);
            svg += mark(x, y, curve.shape, point_title(comparison.cases[k], cost, unit));
        }
        svg += "</g>\n";
    }
    for (const std::size_t k : front) {
        const auto [x, y] = place(k);
        svg +=
            fmt::format("<circle class=\"ring\" cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"8\" pointer-events=\"none\"/>\n", x, y);
    }
    return svg + "</svg></figure>\n";
}

std::string legend(const std::vector<Curve>& curves) {
    std::string list = "<ul class=\"legend\">\n";
    for (const Curve& curve : curves)
        list += fmt::format(
            "<li data-of=\"{0}\"><svg viewBox=\"0 0 34 16\" aria-hidden=\"true\"><g class=\"{1}\"><path class=\"line\" "
            "d=\"M1,8H33\"/>{2}</g></svg>{0}{3}</li>\n",
            escaped(curve.method), classes(curve), mark(17, 8, curve.shape, ""),
            curve.lod.is_guaranteed() ? "" : " <span class=\"soft\">(no promise)</span>");
    return list +
           "<li><svg viewBox=\"0 0 34 16\" aria-hidden=\"true\"><path class=\"front\" d=\"M5,8H29\"/><circle "
           "class=\"ring\" cx=\"17\" cy=\"8\" r=\"6\"/></svg>Pareto front</li>\n</ul>\n";
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
        "textures' table also texels of {:g} px. 100 dB: the same picture.</li>\n</ul>\n",
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
    page.style(kStyle);
    page.script(kScript);
    page.add(verdict(c, wish, command));
    page.add(cheapest_section(c));
    page.section("Cost against true error",
                 "A line a method, a mark a tolerance; further left is truer, further down is cheaper. Both axes are "
                 "logarithmic. Ringed: no method with a promise is both truer and cheaper (the Pareto front). Hollow "
                 "and dashed: no promise.");
    page.add("<div class=\"charts\">\n");
    page.add(chart(c, curves, Cost::triangles, "Triangles", "triangles a frame, mean", "triangles"));
    page.add(chart(c, curves, Cost::frame_ms, "Selection and drawing", "frame, milliseconds", "ms"));
    page.add(chart(c, curves, Cost::lod_ms, "Selection alone", "LOD, CPU milliseconds", "ms"));
    page.add(legend(curves) + "</div>\n" + *pictures);
    page.section("Texture tolerance", "Against full resolution in heights and textures.");
    page.add(sweep_table(c, Sweep::texture));
    page.section("Memory budget", "Where the budget binds, the tolerance rises.");
    page.add(sweep_table(c, Sweep::budget));
    page.add(settings_section(c));
    page.section("All methods and tolerances");
    page.add(all_cases(c, curves));
    page.add(how_section(c));
    return std::move(page).finish();
}

}  // namespace scree
