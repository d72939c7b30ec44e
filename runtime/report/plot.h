// Charts as SVG: lines and bars, linear or logarithmic axes. A file of its own, or a figure in an HtmlPage; no script
// and no font of its own; colours follow the reader's light or dark scheme, and marked series differ by marker as well
// as by colour. The same chart gives the same bytes. Pure functions; any thread.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace scree {

/// What an axis measures, with its unit: "greatest error (px)". Without a range it spans the data, a linear axis of
/// values 0 too.
struct PlotAxis {
    std::string label;
    bool logarithmic = false;  ///< values that are not above 0 are left out
    std::optional<std::pair<double, double>> range;
};

/// Points in the order in which they are joined. A point that is not finite, or that a logarithmic axis cannot show,
/// is left out and breaks the line.
struct PlotSeries {
    std::string name;  ///< in the legend; empty: not in it
    std::vector<std::pair<double, double>> points;
    bool joined = true;
    bool marked = true;
    bool dashed = false;  ///< theory, as against what was measured
};

/// A level to compare with: the tolerance, a promise.
struct PlotLevel {
    std::string name;
    double y = 0;
};

struct LineChart {
    std::string title;
    std::string subtitle;  ///< data, settings, machine: what the figure holds for
    PlotAxis x, y;
    std::vector<PlotSeries> series;
    std::vector<PlotLevel> levels;
};

/// A bar for each series in each group. A value that cannot be shown leaves its place empty.
struct BarSeries {
    std::string name;
    std::vector<double> values;  ///< by group
};

struct BarChart {
    std::string title;
    std::string subtitle;
    std::string groups_label;  ///< what the groups are, with unit
    std::vector<std::string> groups;
    PlotAxis y;
    std::vector<BarSeries> series;
    std::vector<PlotLevel> levels;
};

/// A file.
std::string to_svg(const LineChart& chart);
std::string to_svg(const BarChart& chart);

/// `<figure>` of an HtmlPage, for `<div class="charts">`: title, subtitle and legend are the page's text.
std::string to_figure(const LineChart& chart);
std::string to_figure(const BarChart& chart);

/// At most about so many of a long series: of each run of points the least and the greatest, where they stand, so that
/// no peak is lost.
std::vector<std::pair<double, double>> thinned(const std::vector<std::pair<double, double>>& points, std::size_t most);

}  // namespace scree
