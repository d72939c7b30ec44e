#include "runtime/report/html.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <utility>

#include "runtime/render/png.h"

namespace scree {
namespace {

constexpr std::string_view kStyle = R"css(
:root { color-scheme: light dark; --page: #ffffff; --ink: #1b1f24; --soft: #59636e; --rule: #d5dae0; --panel: #f6f8fa;
  --blue: #0b62c4; --orange: #c2410c; --green: #0f7b4f; --violet: #7c3aed; --good: #0f7b4f; --bad: #b3261e;
  --amber: #a16207; --rose: #be185d; --teal: #0f766e; --grey: #525252; }
@media (prefers-color-scheme: dark) { :root { --page: #14171b; --ink: #e6e9ed; --soft: #a0aab5; --rule: #3a424c;
  --panel: #1d2227; --blue: #6cb2ff; --orange: #ff9a5c; --green: #57d39b; --violet: #b79cff; --good: #57d39b;
  --bad: #ff8a80; --amber: #e3bf5a; --rose: #ff8fc0; --teal: #5ed1c5; --grey: #b5b5b5; } }
* { box-sizing: border-box; }
body { margin: 0 auto; padding: 2rem 1.25rem 4rem; max-width: 76rem; background: var(--page); color: var(--ink);
  font: 16px/1.5 system-ui, -apple-system, "Segoe UI", Roboto, "Noto Sans", sans-serif; }
h1 { font-size: 1.7rem; line-height: 1.2; margin: 0 0 .3rem; overflow-wrap: anywhere; }
h2 { font-size: 1.2rem; margin: 2.6rem 0 .4rem; }
p, li { max-width: 48rem; }
p { margin: .4rem 0 .9rem; }
.soft { color: var(--soft); }
.note { border-left: 4px solid var(--blue); background: var(--panel); padding: .7rem 1rem; margin: 1.2rem 0; }
.note.good { border-color: var(--good); }
.note.bad { border-color: var(--bad); }
code { font: .88em ui-monospace, "DejaVu Sans Mono", Menlo, monospace; overflow-wrap: anywhere; }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; font-size: .88rem; font-variant-numeric: tabular-nums; min-width: 100%; }
th, td { padding: .3rem .6rem; text-align: right; border-bottom: 1px solid var(--rule); white-space: nowrap; }
th { color: var(--soft); font-weight: 600; vertical-align: bottom; white-space: normal; line-height: 1.25; }
th.l, td.l { text-align: left; }
.words td { white-space: normal; vertical-align: top; }
.words td:first-child, .words .soft { white-space: nowrap; }
tr.loose td { color: var(--soft); }
tr.bad td { color: var(--bad); font-weight: 600; }
.charts { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(30rem, 100%), 1fr)); gap: 1.6rem; }
figure { margin: 0; }
figcaption { font-weight: 600; font-size: .95rem; margin-bottom: .2rem; }
.charts svg { width: 100%; height: auto; display: block; }
svg text { fill: var(--soft); font: 13px system-ui, -apple-system, "Segoe UI", Roboto, "Noto Sans", sans-serif; }
svg .grid { stroke: var(--rule); stroke-width: 1; }
.c0 { color: var(--blue); } .c1 { color: var(--orange); } .c2 { color: var(--green); } .c3 { color: var(--violet); }
.c4 { color: var(--amber); } .c5 { color: var(--rose); } .c6 { color: var(--teal); } .c7 { color: var(--grey); }
svg.plot .g { stroke: var(--rule); stroke-width: 1; }
svg.plot .a { stroke: var(--soft); stroke-width: 1; }
svg.plot .l { stroke: var(--ink); stroke-width: 1.2; stroke-dasharray: 2 3; }
svg.plot .s { fill: none; stroke-width: 1.7; stroke-linejoin: round; }
svg.plot .d { stroke-dasharray: 6 4; }
svg.plot .n { fill: var(--ink); paint-order: stroke; stroke: var(--page); stroke-width: 4px; stroke-linejoin: round; }
.keys { display: flex; flex-wrap: wrap; gap: 0 1.1rem; margin: 0 0 .3rem; padding: 0; list-style: none;
  font-size: .86rem; color: var(--soft); }
.keys span { display: inline-block; width: 1.3rem; margin-right: .4rem; border-top: 3px solid currentColor;
  vertical-align: .25em; }
.keys .d { border-top-style: dashed; }
.keys .b { width: .8rem; border-top-width: .8rem; vertical-align: -.05em; }
.about { font-size: .86rem; color: var(--soft); margin: 0 0 .3rem; }
@media (max-width: 40rem) { svg.plot text { font-size: 17px; } svg.plot .s { stroke-width: 2.4; } }
.pictures { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(19rem, 100%), 1fr)); gap: 1.2rem; }
.pictures.along { grid-template-columns: repeat(auto-fit, minmax(min(16rem, 100%), 1fr)); }
.pictures img { width: 100%; height: auto; display: block; border: 1px solid var(--rule); margin-bottom: 3px; }
.pictures figcaption { font-weight: 400; font-size: .86rem; }
dl code { white-space: nowrap; }
dt { font-weight: 600; margin-top: .7rem; }
dd { margin: 0; max-width: 48rem; }
)css";

std::string base64(const std::vector<std::uint8_t>& bytes) {
    constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string s;
    s.reserve((bytes.size() + 2) / 3 * 4);
    for (std::size_t k = 0; k < bytes.size(); k += 3) {
        const std::size_t left = std::min<std::size_t>(3, bytes.size() - k);
        std::uint32_t group = 0;
        for (std::size_t j = 0; j < 3; ++j) group = group << 8 | (j < left ? bytes[k + j] : 0u);
        for (std::size_t j = 0; j < 4; ++j) s += j <= left ? kDigits[group >> (18 - 6 * j) & 63] : '=';
    }
    return s;
}

// IEC 61966-2-1.
double light_of(double srgb) { return srgb <= 0.04045 ? srgb / 12.92 : std::pow((srgb + 0.055) / 1.055, 2.4); }
double srgb_of(double light) { return light <= 0.0031308 ? 12.92 * light : 1.055 * std::pow(light, 1 / 2.4) - 0.055; }

/// How much of a pixel of the wide picture lies in one of the narrow.
double overlap(double a_from, double a_to, double b_from, double b_to) {
    return std::max(0.0, std::min(a_to, b_to) - std::max(a_from, b_from));
}

}  // namespace

std::string escaped(std::string_view text) {
    std::string s;
    for (const char c : text) switch (c) {
            case '&':
                s += "&amp;";
                break;
            case '<':
                s += "&lt;";
                break;
            case '>':
                s += "&gt;";
                break;
            case '"':
                s += "&quot;";
                break;
            default:
                s += c;
        }
    return s;
}

std::string short_number(double v) {
    if (!std::isfinite(v)) return "&infin;";
    if (v >= 1e6) return fmt::format("{:.3g} M", v / 1e6);
    if (v >= 1e4) return fmt::format("{:.3g} k", v / 1e3);
    if (v >= 100) return fmt::format("{:.0f}", v);
    return fmt::format("{:.3g}", v);
}

std::string tick_number(double v) {
    if (v == 0) return "0";  // no -0
    if (std::abs(v) >= 1e6) return fmt::format("{:g}M", v / 1e6);
    if (std::abs(v) >= 1e3) return fmt::format("{:g}k", v / 1e3);
    return fmt::format("{:g}", v);
}

std::string page_megabytes(std::int64_t bytes) { return fmt::format("{:.1f}", static_cast<double>(bytes) / 1e6); }

std::string shell_quoted(const std::string& word) {
    const bool plain = !word.empty() && word.find_first_not_of(
                                            "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz"
                                            "0123456789_./-+=:,@%") == std::string::npos;
    if (plain) return word;
    std::string q = "'";
    for (const char c : word) q += c == '\'' ? std::string("'\\''") : std::string(1, c);
    return q + "'";
}

Result<std::string> image_html(const PagePicture& p, std::string_view description) {
    auto png = encode_png(p.width_px, p.height_px, p.rgb);
    if (!png) return png.error();
    return fmt::format("<img alt=\"{}\" width=\"{}\" height=\"{}\" src=\"data:image/png;base64,{}\">",
                       escaped(description), p.width_px, p.height_px, base64(*png));
}

PagePicture reduced(const PagePicture& p, int most_width_px) {
    assert(p.rgb.size() == 3 * static_cast<std::size_t>(p.width_px) * static_cast<std::size_t>(p.height_px));
    if (p.width_px <= most_width_px) return p;
    const double scale = static_cast<double>(p.width_px) / most_width_px;
    PagePicture small{most_width_px, std::max(1, static_cast<int>(std::lround(p.height_px / scale))), {}};
    const double scale_y = static_cast<double>(p.height_px) / small.height_px;
    std::array<double, 256> light;
    for (std::size_t v = 0; v < light.size(); ++v) light[v] = light_of(static_cast<double>(v) / 255);
    for (int y = 0; y < small.height_px; ++y)
        for (int x = 0; x < small.width_px; ++x) {
            const double west = x * scale, east = west + scale, north = y * scale_y, south = north + scale_y;
            std::array<double, 3> sum{};
            double weights = 0;
            for (int j = static_cast<int>(north); j < std::min<double>(south, p.height_px); ++j)
                for (int i = static_cast<int>(west); i < std::min<double>(east, p.width_px); ++i) {
                    const double weight = overlap(west, east, i, i + 1) * overlap(north, south, j, j + 1);
                    const std::size_t at = 3 * (static_cast<std::size_t>(j) * static_cast<std::size_t>(p.width_px) +
                                                static_cast<std::size_t>(i));
                    for (std::size_t c = 0; c < 3; ++c) sum[c] += weight * light[p.rgb[at + c]];
                    weights += weight;
                }
            for (const double s : sum)
                small.rgb.push_back(static_cast<std::uint8_t>(std::lround(255 * srgb_of(s / weights))));
        }
    return small;
}

std::string html_table(const std::vector<std::string>& heads, const std::vector<std::vector<std::string>>& rows,
                       std::size_t text_columns, const std::vector<std::string>& row_classes) {
    std::string html = fmt::format("<div class=\"scroll\"><table{}><thead><tr>",
                                   text_columns == heads.size() ? " class=\"words\"" : "");
    const auto side = [&](std::size_t column) { return column < text_columns ? " class=\"l\"" : ""; };
    for (std::size_t k = 0; k < heads.size(); ++k) html += fmt::format("<th{}>{}</th>", side(k), heads[k]);
    html += "</tr></thead><tbody>\n";
    for (std::size_t r = 0; r < rows.size(); ++r) {
        html += r < row_classes.size() && !row_classes[r].empty() ? fmt::format("<tr class=\"{}\">", row_classes[r])
                                                                  : std::string("<tr>");
        for (std::size_t k = 0; k < rows[r].size(); ++k) html += fmt::format("<td{}>{}</td>", side(k), rows[r][k]);
        html += "</tr>\n";
    }
    return html + "</tbody></table></div>\n";
}

HtmlPage::HtmlPage(std::string_view title, std::string_view lead) : title_(escaped(title)), style_(kStyle) {
    body_ = fmt::format("<h1>{}</h1>\n<p class=\"soft\">{}</p>\n", title_, lead);
}

void HtmlPage::section(std::string_view heading, std::string_view words) {
    body_ += fmt::format("<h2>{}</h2>\n", heading);
    if (!words.empty()) body_ += fmt::format("<p>{}</p>\n", words);
}

std::string HtmlPage::finish() && {
    std::string html = fmt::format(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" "
        "content=\"width=device-width, initial-scale=1\">\n<title>{}</title>\n<style>{}</style>\n</head>\n<body>\n",
        title_, style_);
    html += body_;
    if (!script_.empty()) html += fmt::format("<script>{}</script>\n", script_);
    return std::move(html) + "</body>\n</html>\n";
}

}  // namespace scree
