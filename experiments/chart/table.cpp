#include "experiments/chart/table.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>

namespace scree::chart {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

// Locale-independent. Anything but a whole finite number is none.
double number_or_none(const std::string& text) {
    double value = kNone;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    return error == std::errc{} && end == text.data() + text.size() && std::isfinite(value) ? value : kNone;
}

// Nothing where a quote stays open.
std::optional<std::vector<std::string>> fields_of(std::string_view line) {
    std::vector<std::string> fields(1);
    bool quoted = false;
    for (std::size_t k = 0; k < line.size(); ++k) {
        const char c = line[k];
        if (c == '"' && quoted && k + 1 < line.size() && line[k + 1] == '"')
            fields.back() += line[++k];
        else if (c == '"')
            quoted = !quoted;
        else if (c == ',' && !quoted)
            fields.emplace_back();
        else
            fields.back() += c;
    }
    if (quoted) return std::nullopt;
    return fields;
}

Result<std::size_t> column_of(const Table& table, const std::string& name) {
    const auto found = std::find(table.columns.begin(), table.columns.end(), name);
    if (found == table.columns.end())
        return Error{ErrorCode::input, fmt::format("no column {}, so there is nothing to draw", name)};
    return static_cast<std::size_t>(found - table.columns.begin());
}

struct Places {
    std::size_t x = 0, y = 0;
    std::optional<std::size_t> series;

    std::string series_of(const std::vector<std::string>& row) const { return series ? row[*series] : std::string(); }
};

Result<Places> places_of(const Table& table, const Choice& choice) {
    const auto x = column_of(table, choice.x);
    if (!x) return x.error();
    const auto y = column_of(table, choice.y);
    if (!y) return y.error();
    Places places{*x, *y, std::nullopt};
    if (choice.series.empty()) return places;
    const auto series = column_of(table, choice.series);
    if (!series) return series.error();
    places.series = *series;
    return places;
}

// The one of that name, made where there is none.
template <typename Series>
Series& named(std::vector<Series>& all, const std::string& name) {
    for (Series& series : all)
        if (series.name == name) return series;
    all.emplace_back();
    all.back().name = name;
    return all.back();
}

std::vector<std::string> distinct(const Table& table, std::size_t column) {
    std::vector<std::string> values;
    for (const auto& row : table.rows)
        if (std::find(values.begin(), values.end(), row[column]) == values.end()) values.push_back(row[column]);
    return values;
}

Error nothing_to_draw(const Choice& choice) {
    return Error{ErrorCode::input, fmt::format("no row has a number in {}, so there is nothing to draw", choice.y)};
}

}  // namespace

Result<Table> read_csv(std::string_view text) {
    Table table;
    for (std::size_t line = 1; !text.empty(); ++line) {
        const std::size_t end = std::min(text.find('\n'), text.size());
        std::string_view one = text.substr(0, end);
        text.remove_prefix(std::min(end + 1, text.size()));
        if (!one.empty() && one.back() == '\r') one.remove_suffix(1);
        if (one.empty()) continue;
        auto fields = fields_of(one);
        if (!fields) return Error{ErrorCode::input, fmt::format("line {}: a quote is not closed", line)};
        if (table.columns.empty()) {
            table.columns = std::move(*fields);
        } else if (fields->size() != table.columns.size()) {
            return Error{ErrorCode::input, fmt::format("line {}: {} fields under {} columns", line, fields->size(),
                                                       table.columns.size())};
        } else {
            table.rows.push_back(std::move(*fields));
        }
    }
    return table;
}

Result<std::vector<PlotSeries>> line_series(const Table& table, const Choice& choice) {
    const auto at = places_of(table, choice);
    if (!at) return at.error();
    std::vector<PlotSeries> all;
    for (const auto& row : table.rows) {
        const double x = number_or_none(row[at->x]), y = number_or_none(row[at->y]);
        if (std::isnan(x) || std::isnan(y)) continue;
        named(all, at->series_of(row)).points.emplace_back(x, y);
    }
    if (all.empty()) return nothing_to_draw(choice);
    return all;
}

Result<void> set_bars(const Table& table, const Choice& choice, BarChart& chart) {
    const auto at = places_of(table, choice);
    if (!at) return at.error();
    chart.groups = distinct(table, at->x);
    chart.series.clear();
    bool any = false;
    for (const auto& row : table.rows) {
        BarSeries& series = named(chart.series, at->series_of(row));
        series.values.resize(chart.groups.size(), kNone);
        const auto group = std::find(chart.groups.begin(), chart.groups.end(), row[at->x]) - chart.groups.begin();
        const double value = number_or_none(row[at->y]);
        series.values[static_cast<std::size_t>(group)] = value;
        any = any || !std::isnan(value);
    }
    if (!any) return nothing_to_draw(choice);
    return {};
}

}  // namespace scree::chart
