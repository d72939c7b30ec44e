#include "runtime/report/plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string_view>

#include "runtime/report/html.h"

namespace scree {
namespace {

/// A sheet's size, and what lies round its frame.
struct Form {
    bool in_page;  ///< no paper, style, title and legend of its own
    double width_px, height_px, left_px, top_px, bottom_px, right_px;
    double label_px;  ///< of the axis below, from the frame down
};
constexpr Form kFile{false, 760, 440, 74, 62, 60, 18, 42};
constexpr Form kFigure{true, 560, 290, 74, 12, 54, 14, 46};
constexpr double kLine_px = 16;
constexpr double kLegendKey_px = 26;  // line and marker before a name
constexpr double kLetter_px = 6.4;    // mean width at 12 px of the usual sans serif faces
constexpr std::size_t kColours = 8;

/// White paper unless the reader asks for dark; all colours stand off their paper by 3:1 at least.
constexpr std::string_view kStyle =
    ".p{fill:#ffffff}.t{fill:#1c2024;font-family:system-ui,sans-serif;font-size:12px}.h{font-size:15px;font-weight:600}"
    ".u{fill:#5b6470}.g{stroke:#d9dde2;stroke-width:1}.a{stroke:#5b6470;stroke-width:1}"
    ".n{paint-order:stroke;stroke:#ffffff;stroke-width:3px;stroke-linejoin:round}"
    ".l{stroke:#5b6470;stroke-width:1.2;stroke-dasharray:2 3}"
    ".s{fill:none;stroke-width:1.8;stroke-linejoin:round}.d{stroke-dasharray:6 4}"
    ".c0{color:#0b62a8}.c1{color:#c2410c}.c2{color:#15803d}.c3{color:#7c3aed}.c4{color:#a16207}.c5{color:#be185d}"
    ".c6{color:#0f766e}.c7{color:#525252}"
    "@media(prefers-color-scheme:dark){.p{fill:#14171a}.t{fill:#e6e9ec}.u{fill:#9aa4af}.n{stroke:#14171a}.g{stroke:#"
    "30363d}"
    ".a,.l{stroke:#9aa4af}.c0{color:#6cb6ff}.c1{color:#ff9466}.c2{color:#5fd38d}.c3{color:#b79cff}.c4{color:#e3bf5a}"
    ".c5{color:#ff8fc0}.c6{color:#5ed1c5}.c7{color:#b5b5b5}}";

/// As in running text: 0.05, 1500, 2e6.
std::string number(double value) {
    std::string text = fmt::format("{:.4g}", value == 0 ? 0.0 : value);  // no -0
    if (const auto plus = text.find("e+"); plus != std::string::npos) text.erase(plus + 1, 1);
    const auto e = text.find('e');
    while (e != std::string::npos && e + 2 < text.size()) {
        const auto digit = text.find_first_not_of('-', e + 1);
        if (text[digit] != '0') break;
        text.erase(digit, 1);
    }
    return text;
}

double text_px(std::string_view text) {
    const auto letters = std::count_if(text.begin(), text.end(), [](char c) { return (c & 0xC0) != 0x80; });
    return kLetter_px * static_cast<double>(letters);
}

/// Lines of at most so many pixels; a longer word has one to itself.
std::vector<std::string> wrapped(const std::string& text, double width_px) {
    std::vector<std::string> lines;
    for (std::size_t at = 0; at < text.size();) {
        std::size_t end = text.find(' ', at);
        for (std::size_t next = end; next != std::string::npos;) {
            next = text.find(' ', end + 1);
            if (text_px(text.substr(at, next - at)) > width_px) break;
            end = next;
        }
        lines.push_back(text.substr(at, end - at));
        at = end == std::string::npos ? text.size() : end + 1;
    }
    return lines;
}

/// One axis laid out: the values at its ends, in log10 where it is logarithmic, and where its ticks stand.
class Scale {
public:
    Scale(const PlotAxis& axis, std::pair<double, double> span) : logarithmic_(axis.logarithmic) {
        const auto range = axis.range.value_or(span);
        logarithmic_ ? lay_out_log(range) : lay_out_linear(range, !axis.range.has_value());
    }

    bool can_show(double value) const { return std::isfinite(value) && (!logarithmic_ || value > 0); }
    /// 0 at the axis' low end, 1 at its high end; what lies beyond is drawn at the end.
    double share(double value) const {
        const double at = logarithmic_ ? std::log10(value) : value;
        return std::clamp((at - low_) / (high_ - low_), 0.0, 1.0);
    }
    const std::vector<double>& ticks() const { return ticks_; }

private:
    void lay_out_linear(std::pair<double, double> range, bool round_out) {
        auto [low, high] = range;
        if (!(low < high)) high = low + std::max(1.0, std::abs(low));
        const double rough = (high - low) / 6;
        const double decade = std::pow(10.0, std::floor(std::log10(rough)));
        const double step = decade * (rough / decade <= 1 ? 1 : rough / decade <= 2 ? 2 : rough / decade <= 5 ? 5 : 10);
        low_ = round_out ? std::floor(low / step + 1e-9) * step : low;
        high_ = round_out ? std::ceil(high / step - 1e-9) * step : high;
        for (double k = std::ceil(low_ / step - 1e-9); k <= high_ / step + 1e-9; ++k) ticks_.push_back(k * step);
    }

    void lay_out_log(std::pair<double, double> range) {
        double low = std::log10(range.first), high = std::log10(range.second);
        if (!std::isfinite(low) || !std::isfinite(high)) low = 0, high = 1;
        if (!(low < high)) high = low + 1;
        const bool whole_decades = high - low > 1.5;
        low_ = whole_decades ? std::floor(low + 1e-9) : low - 0.03 * (high - low);
        high_ = whole_decades ? std::ceil(high - 1e-9) : high + 0.03 * (high - low);
        const double every = std::max(1.0, std::ceil((high_ - low_) / 8));
        for (double decade = std::floor(low_); decade <= high_ + 1e-9; ++decade)
            for (const double mantissa : {1.0, 2.0, 5.0}) {
                if (whole_decades && (mantissa != 1 || std::fmod(decade - low_, every) != 0)) continue;
                const double at = decade + std::log10(mantissa);
                if (at >= low_ - 1e-9 && at <= high_ + 1e-9) ticks_.push_back(mantissa * std::pow(10.0, decade));
            }
    }

    bool logarithmic_;
    double low_ = 0, high_ = 1;
    std::vector<double> ticks_;
};

/// Least and greatest of what an axis can show.
class Span {
public:
    explicit Span(const PlotAxis& axis, bool from_zero) : logarithmic_(axis.logarithmic) {
        if (from_zero && !logarithmic_) add(0);
    }
    void add(double value) {
        if (!std::isfinite(value) || (logarithmic_ && !(value > 0))) return;
        low_ = std::min(low_, value);
        high_ = std::max(high_, value);
    }
    std::pair<double, double> ends() const {
        if (low_ <= high_) return {low_, high_};
        return logarithmic_ ? std::pair{1.0, 10.0} : std::pair{0.0, 1.0};
    }

private:
    bool logarithmic_;
    double low_ = std::numeric_limits<double>::infinity(), high_ = -std::numeric_limits<double>::infinity();
};

struct LegendEntry {
    std::string name;
    std::size_t colour = 0;
    bool line = false, dashed = false, marked = false, bar = false;
};

/// Of a figure in a page: under its title.
std::string legend_html(const std::vector<LegendEntry>& legend) {
    std::string html = "<ul class=\"keys\">";
    for (const LegendEntry& entry : legend)
        html += fmt::format("<li><span class=\"c{}{}{}\"></span>{}</li>", entry.colour % kColours,
                            entry.bar ? " b" : "", entry.dashed ? " d" : "", escaped(entry.name));
    return html + "</ul>";
}

/// The sheet: paper, frame, axes, legend; and what is drawn on it.
class Sheet {
public:
    Sheet(const Form& form, const std::string& title, const std::string& subtitle,
          const std::vector<LegendEntry>& legend)
        : form_(form), right_px_(form.width_px - form.right_px), top_px_(form.top_px) {
        form.in_page ? begin_figure(title, subtitle, legend) : begin_file(title, subtitle, legend);
    }

    double left() const { return form_.left_px; }
    double right() const { return right_px_; }
    double top() const { return top_px_; }
    double bottom() const { return form_.height_px - form_.bottom_px; }
    double x(double share) const { return left() + share * (right() - left()); }
    double y(double share) const { return bottom() - share * (bottom() - top()); }

    void line(double x1, double y1, double x2, double y2, std::string_view style) {
        out_ += fmt::format("<line class=\"{}\" x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\"/>\n", style, x1,
                            y1, x2, y2);
    }
    void text(double at_x, double at_y, std::string_view words, std::string_view style, std::string_view anchor,
              double turned_deg = 0) {
        if (words.empty()) return;
        const std::string turn =
            turned_deg == 0 ? "" : fmt::format(" transform=\"rotate({:.0f} {:.1f} {:.1f})\"", turned_deg, at_x, at_y);
        out_ += fmt::format("<text class=\"{}\" x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\"{}>{}</text>\n", style,
                            at_x, at_y, anchor, turn, escaped(words));
    }
    void y_axis(const Scale& scale, const std::string& label) {
        for (const double tick : scale.ticks()) {
            const double at = y(scale.share(tick));
            line(left(), at, right(), at, "g");
            text(left() - 7, at + 4, tick_text(tick), "t", "end");
        }
        text(form_.in_page ? 14 : 20, (top() + bottom()) / 2, label, "t", "middle", -90);
        line(left(), top(), left(), bottom(), "a");
    }
    void x_axis(const Scale& scale, const std::string& label) {
        for (const double tick : scale.ticks()) {
            const double at = x(scale.share(tick));
            line(at, bottom(), at, bottom() + 4, "a");
            text(at, bottom() + 18, tick_text(tick), "t", "middle");
        }
        text((left() + right()) / 2, bottom() + form_.label_px, label, "t", "middle");
        line(left(), bottom(), right(), bottom(), "a");
    }
    void levels(const Scale& scale, const std::vector<PlotLevel>& levels) {
        for (const PlotLevel& level : levels) {
            if (!scale.can_show(level.y)) continue;
            const double at = y(scale.share(level.y));
            line(left(), at, right(), at, "l");
            text(right() - 4, at - 4, level.name, "t u n", "end");
        }
    }
    void marker(std::size_t shape, std::size_t colour, double at_x, double at_y) {
        static constexpr std::string_view kShapes[] = {
            "M-4,0a4,4 0 1,0 8,0a4,4 0 1,0 -8,0z", "M-3.5,-3.5h7v7h-7z",
            "M0,-4.5L4.3,3.4L-4.3,3.4z",           "M0,-5L5,0L0,5L-5,0z",
            "M-4.3,-3.4L4.3,-3.4L0,4.5z",          "M-5,-1.5h3.5v-3.5h3v3.5h3.5v3h-3.5v3.5h-3v-3.5h-3.5z"};
        out_ +=
            fmt::format("<path class=\"c{}\" fill=\"currentColor\" transform=\"translate({:.1f} {:.1f})\" d=\"{}\"/>\n",
                        colour % kColours, at_x, at_y, kShapes[shape % std::size(kShapes)]);
    }
    void bar(std::size_t colour, double at_x, double at_y, double width, double height) {
        out_ += fmt::format(
            "<rect class=\"c{}\" fill=\"currentColor\" x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" "
            "height=\"{:.1f}\"/>\n",
            colour % kColours, at_x, at_y, width, height);
    }
    void polyline(std::size_t colour, bool dashed, const std::vector<std::pair<double, double>>& points) {
        if (points.size() < 2) return;
        out_ += fmt::format("<polyline class=\"s{} c{}\" stroke=\"currentColor\" points=\"", dashed ? " d" : "",
                            colour % kColours);
        for (std::size_t k = 0; k < points.size(); ++k)
            out_ += fmt::format("{}{:.1f},{:.1f}", k == 0 ? "" : " ", points[k].first, points[k].second);
        out_ += "\"/>\n";
    }
    std::string finish() && { return std::move(out_) + (form_.in_page ? "</svg></figure>\n" : "</svg>\n"); }

private:
    std::string tick_text(double tick) const { return form_.in_page ? tick_number(tick) : number(tick); }
    void begin_file(const std::string& title, const std::string& subtitle, const std::vector<LegendEntry>& legend) {
        double legend_px = 0;
        for (const LegendEntry& entry : legend)
            legend_px = std::max(legend_px, kLegendKey_px + text_px(entry.name) + 14);
        right_px_ -= legend_px;
        out_ = fmt::format(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0:.0f} {1:.0f}\" width=\"{0:.0f}\" "
            "height=\"{1:.0f}\" role=\"img\">\n<title>{2}</title>\n<desc>{3}</desc>\n<style>{4}</style>\n"
            "<rect class=\"p\" width=\"{0:.0f}\" height=\"{1:.0f}\"/>\n",
            form_.width_px, form_.height_px, escaped(title), escaped(subtitle), kStyle);
        text(left(), 26, title, "t h", "start");
        for (const std::string& line : wrapped(subtitle, form_.width_px - left() - form_.right_px)) {
            text(left(), top_px_ - 17, line, "t u", "start");
            top_px_ += kLine_px;
        }
        if (!subtitle.empty()) top_px_ -= kLine_px;
        draw_legend(legend);
    }

    void begin_figure(const std::string& title, const std::string& subtitle, const std::vector<LegendEntry>& legend) {
        out_ = fmt::format("<figure><figcaption>{}</figcaption>", escaped(title));
        if (!subtitle.empty()) out_ += fmt::format("<p class=\"about\">{}</p>", escaped(subtitle));
        if (legend.size() > 1) out_ += legend_html(legend);
        out_ += fmt::format("\n<svg class=\"plot\" viewBox=\"0 0 {:.0f} {:.0f}\" role=\"img\" aria-label=\"{}\">\n",
                            form_.width_px, form_.height_px, escaped(title));
    }
    void draw_legend(const std::vector<LegendEntry>& legend) {
        double at_y = top_px_ + 8;
        const double at_x = right_px_ + 14;
        for (std::size_t k = 0; k < legend.size(); ++k) {
            const LegendEntry& entry = legend[k];
            if (entry.line) polyline(entry.colour, entry.dashed, {{at_x, at_y}, {at_x + 20, at_y}});
            if (entry.marked) marker(entry.colour, entry.colour, at_x + 10, at_y);
            if (entry.bar) bar(entry.colour, at_x + 4, at_y - 6, 12, 12);
            text(at_x + kLegendKey_px, at_y + 4, entry.name, "t", "start");
            at_y += 20;
        }
    }

    std::string out_;
    const Form& form_;
    double right_px_, top_px_;
};

void draw(Sheet& sheet, const PlotSeries& series, std::size_t colour, const Scale& x, const Scale& y) {
    std::vector<std::pair<double, double>> run;
    const auto end_run = [&] {
        if (series.joined) sheet.polyline(colour, series.dashed, run);
        run.clear();
    };
    for (const auto& [px, py] : series.points) {
        if (!x.can_show(px) || !y.can_show(py)) {
            end_run();
            continue;
        }
        run.emplace_back(sheet.x(x.share(px)), sheet.y(y.share(py)));
        if (series.marked) sheet.marker(colour, colour, run.back().first, run.back().second);
    }
    end_run();
}

std::string drawn(const LineChart& chart, const Form& form) {
    Span across(chart.x, false), up(chart.y, true);
    std::vector<LegendEntry> legend;
    for (std::size_t k = 0; k < chart.series.size(); ++k) {
        const PlotSeries& series = chart.series[k];
        for (const auto& [px, py] : series.points) across.add(px), up.add(py);
        if (!series.name.empty())
            legend.push_back({series.name, k, series.joined, series.dashed, series.marked, false});
    }
    for (const PlotLevel& level : chart.levels) up.add(level.y);
    const Scale x(chart.x, across.ends()), y(chart.y, up.ends());
    Sheet sheet(form, chart.title, chart.subtitle, legend);
    sheet.y_axis(y, chart.y.label);
    sheet.x_axis(x, chart.x.label);
    sheet.levels(y, chart.levels);
    for (std::size_t k = 0; k < chart.series.size(); ++k) draw(sheet, chart.series[k], k, x, y);
    return std::move(sheet).finish();
}

std::string drawn(const BarChart& chart, const Form& form) {
    Span up(chart.y, true);
    std::vector<LegendEntry> legend;
    for (std::size_t k = 0; k < chart.series.size(); ++k) {
        for (const double value : chart.series[k].values) up.add(value);
        if (!chart.series[k].name.empty()) legend.push_back({chart.series[k].name, k, false, false, false, true});
    }
    for (const PlotLevel& level : chart.levels) up.add(level.y);
    const Scale y(chart.y, up.ends());
    Sheet sheet(form, chart.title, chart.subtitle, legend);
    sheet.y_axis(y, chart.y.label);
    const double group_px =
        (sheet.right() - sheet.left()) / static_cast<double>(std::max<std::size_t>(1, chart.groups.size()));
    double widest_px = 0;
    for (const std::string& group : chart.groups) widest_px = std::max(widest_px, 1.5 * text_px(group));
    const double bar_px = 0.8 * group_px / static_cast<double>(std::max<std::size_t>(1, chart.series.size()));
    const double base = chart.y.logarithmic || !y.can_show(0) ? sheet.bottom() : sheet.y(y.share(0));
    for (std::size_t g = 0; g < chart.groups.size(); ++g) {
        const double middle = sheet.left() + (static_cast<double>(g) + 0.5) * group_px;
        for (std::size_t k = 0; k < chart.series.size(); ++k) {
            const auto& values = chart.series[k].values;
            if (g >= values.size() || !y.can_show(values[g])) continue;
            const double at = sheet.y(y.share(values[g]));
            sheet.bar(k, middle - 0.4 * group_px + static_cast<double>(k) * bar_px, std::min(at, base), 0.92 * bar_px,
                      std::abs(base - at));
        }
        // A page's text is larger where the screen is narrow; there all names turn alike.
        const bool crowded = form.in_page ? widest_px > group_px : text_px(chart.groups[g]) > group_px;
        sheet.text(middle, sheet.bottom() + (crowded ? 14 : 18), chart.groups[g], "t", crowded ? "end" : "middle",
                   crowded ? -25 : 0);
    }
    sheet.levels(y, chart.levels);
    sheet.text((sheet.left() + sheet.right()) / 2, sheet.bottom() + (form.in_page ? form.label_px : 50),
               chart.groups_label, "t", "middle");
    sheet.line(sheet.left(), sheet.bottom(), sheet.right(), sheet.bottom(), "a");
    return std::move(sheet).finish();
}

}  // namespace

std::string to_svg(const LineChart& chart) { return drawn(chart, kFile); }
std::string to_svg(const BarChart& chart) { return drawn(chart, kFile); }
std::string to_figure(const LineChart& chart) { return drawn(chart, kFigure); }
std::string to_figure(const BarChart& chart) { return drawn(chart, kFigure); }

std::vector<std::pair<double, double>> thinned(const std::vector<std::pair<double, double>>& points, std::size_t most) {
    if (points.size() <= most || most < 2) return points;
    const std::size_t run = (2 * points.size() + most - 1) / most;
    std::vector<std::pair<double, double>> kept;
    for (std::size_t from = 0; from < points.size(); from += run) {
        const auto first = points.begin() + static_cast<std::ptrdiff_t>(from);
        const auto last = points.begin() + static_cast<std::ptrdiff_t>(std::min(from + run, points.size()));
        const auto [low, high] =
            std::minmax_element(first, last, [](const auto& a, const auto& b) { return a.second < b.second; });
        kept.push_back(*std::min(low, high));
        if (low != high) kept.push_back(*std::max(low, high));
    }
    return kept;
}

}  // namespace scree
