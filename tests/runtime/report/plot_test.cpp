// What a chart must show, read back from its SVG.
#include "runtime/report/plot.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <sstream>
#include <string>
#include <vector>

#include "tests/runtime/report/html_support.h"

namespace scree {
namespace {

std::size_t count(const std::string& text, const std::string& part) {
    std::size_t found = 0;
    for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + part.size())) ++found;
    return found;
}

/// Values of an attribute of every element with that beginning.
std::vector<double> attribute(const std::string& svg, const std::string& beginning, const std::string& name) {
    std::vector<double> values;
    for (std::size_t at = svg.find(beginning); at != std::string::npos; at = svg.find(beginning, at + 1)) {
        const std::size_t value = svg.find(' ' + name + "=\"", at) + name.size() + 3;
        values.push_back(std::strtod(svg.c_str() + value, nullptr));
    }
    return values;
}

std::vector<std::pair<double, double>> polyline_points(const std::string& svg) {
    std::vector<std::pair<double, double>> points;
    std::size_t at = svg.rfind("points=\"") + 8;
    while (svg[at - 1] != '"' || points.empty()) {
        char* end = nullptr;
        const double x = std::strtod(svg.c_str() + at, &end);
        const double y = std::strtod(end + 1, &end);
        points.emplace_back(x, y);
        at = static_cast<std::size_t>(end - svg.c_str()) + 1;
        if (*end == '"') break;
    }
    return points;
}

bool has_text(const std::string& svg, const std::string& words) { return count(svg, '>' + words + "</text>") == 1; }

LineChart chart_of(std::vector<std::pair<double, double>> points) {
    LineChart chart;
    chart.x.label = "distance (m)";
    chart.y.label = "error (px)";
    chart.series.push_back({"", std::move(points)});
    return chart;
}

TEST(PlotTest, EqualRatiosAreEqualLengthsOnALogarithmicAxis) {
    LineChart chart = chart_of({{1, 1}, {10, 2}, {100, 3}, {1000, 4}});
    chart.x.logarithmic = true;
    const auto points = polyline_points(to_svg(chart));
    ASSERT_EQ(points.size(), 4u);
    const double step = points[1].first - points[0].first;
    EXPECT_GT(step, 50);
    for (std::size_t k = 1; k + 1 < points.size(); ++k) EXPECT_NEAR(points[k + 1].first - points[k].first, step, 0.2);
    EXPECT_GT(points[0].second, points[3].second);
}

TEST(PlotTest, WhatCannotBeShownBreaksTheLineAndIsNotMarked) {
    const double nan = std::nan(""), infinity = std::numeric_limits<double>::infinity();
    const std::string svg = to_svg(chart_of({{0, 1}, {1, 2}, {2, nan}, {3, 1}, {4, 2}, {5, infinity}}));
    EXPECT_EQ(count(svg, "<polyline"), 2u);
    EXPECT_EQ(count(svg, "<path"), 4u);
    EXPECT_EQ(count(svg, "nan"), 0u);
    EXPECT_EQ(count(svg, "inf"), 0u);

    LineChart log = chart_of({{0, 1}, {1, 2}, {2, 0}, {3, -1}, {4, 2}});
    log.y.logarithmic = true;
    EXPECT_EQ(count(to_svg(log), "<path"), 3u);
}

TEST(PlotTest, AxesSayWhatTheyMeasureAndLinearOnesStartAtZero) {
    const std::string svg = to_svg(chart_of({{0, 30}, {50, 90}}));
    EXPECT_TRUE(has_text(svg, "distance (m)"));
    EXPECT_TRUE(has_text(svg, "error (px)"));
    for (const char* tick : {"20", "40", "60", "80", "100"}) EXPECT_GE(count(svg, std::string(">") + tick + "<"), 1u);
    EXPECT_EQ(count(svg, ">0</text>"), 2u);
}

TEST(PlotTest, NumbersOnAxesAreShort) {
    LineChart chart = chart_of({{1e-6, 1}, {1e6, 2}});
    chart.x.logarithmic = true;
    const std::string svg = to_svg(chart);
    EXPECT_TRUE(has_text(svg, "1e6")) << svg;
    EXPECT_TRUE(has_text(svg, "1e-6"));
    EXPECT_TRUE(has_text(svg, "100"));
}

TEST(PlotTest, NamesAreEscapedAndListed) {
    LineChart chart = chart_of({{0, 1}, {1, 2}});
    chart.title = "a < b & \"c\"";
    chart.series[0].name = "x > y";
    chart.levels.push_back({"tau", 1.5});
    const std::string svg = to_svg(chart);
    EXPECT_TRUE(has_text(svg, "a &lt; b &amp; &quot;c&quot;"));
    EXPECT_TRUE(has_text(svg, "x &gt; y"));
    EXPECT_TRUE(has_text(svg, "tau"));
}

TEST(PlotTest, ALongSubtitleIsWrappedWithoutLosingAWord) {
    LineChart chart = chart_of({{0, 1}, {1, 2}});
    for (int k = 0; k < 60; ++k) chart.subtitle += "word" + std::to_string(k) + (k < 59 ? " " : "");
    const std::string svg = to_svg(chart);
    std::size_t lines = 0;
    int next = 0;
    for (std::size_t at = svg.find("class=\"t u\""); at != std::string::npos; at = svg.find("class=\"t u\"", at + 1)) {
        const std::size_t from = svg.find('>', at) + 1, to = svg.find('<', from);
        EXPECT_LT(to - from, 115u);
        std::istringstream words(svg.substr(from, to - from));
        for (std::string word; words >> word;) EXPECT_EQ(word, "word" + std::to_string(next++));
        ++lines;
    }
    EXPECT_EQ(next, 60);
    EXPECT_GT(lines, 2u);
}

TEST(PlotTest, BarsAreAsHighAsTheirValues) {
    BarChart chart;
    chart.groups = {"near", "far"};
    chart.y.range = std::pair{0.0, 100.0};
    chart.series = {{"corners", {50, 100}}, {"box", {0, std::nan("")}}};
    const std::string svg = to_svg(chart);
    const auto heights = attribute(svg, "<rect class=\"c", "height");
    ASSERT_EQ(heights.size(), 5u);  // the legend's two, then three bars
    EXPECT_NEAR(heights[4], 2 * heights[2], 0.2);
    EXPECT_NEAR(heights[3], 0, 0.05);
    EXPECT_GT(heights[2], 100);
}

TEST(PlotTest, EmptyAndConstantDataMakeAChart) {
    EXPECT_EQ(count(to_svg(LineChart{}), "nan"), 0u);
    EXPECT_EQ(count(to_svg(BarChart{}), "nan"), 0u);
    LineChart log = chart_of({{5, 0}, {5, 0}});
    log.x.logarithmic = log.y.logarithmic = true;
    EXPECT_EQ(count(to_svg(log), "nan"), 0u);
    EXPECT_EQ(polyline_points(to_svg(chart_of({{5, 5}, {5, 5}}))).size(), 2u);
}

TEST(PlotTest, FiguresArePartsOfAPage) {
    LineChart lines = chart_of({{0, 1}, {1, 2}, {2, 5000}});
    lines.title = "a < b";
    lines.series[0].name = "one & all";
    lines.series.push_back({"two", {{0, 2}, {2, 1}}});
    lines.levels.push_back({"tau", 1.5});
    BarChart bars;
    bars.title = "bars";
    bars.groups = {"near", "far"};
    bars.series = {{"", {1, 2}}};
    for (const std::string& figure :
         {to_figure(lines), to_figure(bars), to_figure(LineChart{}), to_figure(BarChart{})}) {
        test::expect_well_formed(figure);
        test::expect_self_contained(figure);
        EXPECT_EQ(figure.rfind("<figure><figcaption>", 0), 0u);
        EXPECT_EQ(count(figure, "<style"), 0u) << "the page's style is the chart's";
    }
    const std::string figure = to_figure(lines);
    EXPECT_NE(figure.find("<figcaption>a &lt; b</figcaption>"), std::string::npos);
    EXPECT_NE(figure.find("one &amp; all</li>"), std::string::npos);
    EXPECT_TRUE(has_text(figure, "2k"));
    EXPECT_EQ(count(to_figure(chart_of({{0, 1}, {1, 2}})), "class=\"keys\""), 0u) << "one line needs no legend";
}

TEST(PlotTest, ThinningALongSeriesLosesNoPeak) {
    std::vector<std::pair<double, double>> points;
    for (int k = 0; k < 100000; ++k) points.emplace_back(k, k == 70007 ? 1e6 : k == 333 ? -5 : std::sin(0.01 * k));
    const auto few = thinned(points, 1000);
    EXPECT_LE(few.size(), 1000u);
    EXPECT_GT(few.size(), 500u);
    EXPECT_TRUE(std::is_sorted(few.begin(), few.end(), [](auto a, auto b) { return a.first < b.first; }));
    EXPECT_NE(std::find(few.begin(), few.end(), std::pair(70007.0, 1e6)), few.end());
    EXPECT_NE(std::find(few.begin(), few.end(), std::pair(333.0, -5.0)), few.end());
    EXPECT_EQ(thinned(points, 100000), points);
}

TEST(PlotTest, DarkReadersGetADarkSheetAndOthersAWhiteOne) {
    const std::string svg = to_svg(chart_of({{0, 1}}));
    EXPECT_NE(svg.find(".p{fill:#ffffff}"), std::string::npos);
    EXPECT_NE(svg.find("prefers-color-scheme:dark"), std::string::npos);
    EXPECT_NE(svg.find("<rect class=\"p\""), std::string::npos);
}

}  // namespace
}  // namespace scree
