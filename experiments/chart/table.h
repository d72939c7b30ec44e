// A table as CSV, and charts of its columns. Pure functions; any thread.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "common/result.h"
#include "runtime/report/plot.h"

namespace scree::chart {

struct Table {
    std::vector<std::string> columns;
    std::vector<std::vector<std::string>> rows;  ///< each as long as `columns`
};

/// CSV with a header line; fields with commas stand in quotes, a quote in them twice (RFC 4180, without line ends in
/// fields). Fails on an open quote and on a row of another length than the header, naming the line.
Result<Table> read_csv(std::string_view text);

struct Choice {
    std::string x, y;    ///< columns
    std::string series;  ///< column whose values are the series, in order of first appearance; empty: one series
};

/// Rows whose x or y is not a number are left out. Fails where a column is not there or no row is left.
Result<std::vector<PlotSeries>> line_series(const Table& table, const Choice& choice);

/// `x` names the groups. Values that are no number leave their place empty. Sets groups and series of `chart`.
Result<void> set_bars(const Table& table, const Choice& choice, BarChart& chart);

}  // namespace scree::chart
