// CSV tables as the series of charts.
#include <gtest/gtest.h>

#include <cmath>

#include "experiments/chart/table.h"

namespace scree::chart {
namespace {

Table table_of(std::string_view text) {
    auto table = read_csv(text);
    EXPECT_TRUE(table) << table.error().message;
    return table ? *table : Table{};
}

TEST(ChartTable, CommasAndQuotesStandInQuotes) {
    const Table table = table_of("method,ms\r\n\"rsg, cache \"\"P1\"\"\",2\n\ngeomip,\n");
    ASSERT_EQ(table.columns, (std::vector<std::string>{"method", "ms"}));
    ASSERT_EQ(table.rows.size(), 2u);
    EXPECT_EQ(table.rows[0], (std::vector<std::string>{"rsg, cache \"P1\"", "2"}));
    EXPECT_EQ(table.rows[1], (std::vector<std::string>{"geomip", ""}));
}

TEST(ChartTable, RefusesAnOpenQuoteAndARaggedRowByLine) {
    for (const char* text : {"a,b\n1,\"2\n", "a,b\n1\n", "a,b\n1,2,3"}) {
        const auto table = read_csv(text);
        ASSERT_FALSE(table) << text;
        EXPECT_EQ(table.error().code, ErrorCode::input);
        EXPECT_NE(table.error().message.find("line 2"), std::string::npos) << table.error().message;
    }
}

TEST(ChartTable, SeriesStandInOrderOfAppearanceWithoutWhatIsNoNumber) {
    const Table table = table_of("tau,px,method\n1,2,b\n1,3,a\n2,none,b\n4,1e1,b\ninf,1,a\n2,3px,a\n");
    const auto series = line_series(table, {"tau", "px", "method"});
    ASSERT_TRUE(series) << series.error().message;
    ASSERT_EQ(series->size(), 2u);
    EXPECT_EQ((*series)[0].name, "b");
    EXPECT_EQ((*series)[0].points, (std::vector<std::pair<double, double>>{{1, 2}, {4, 10}}));
    EXPECT_EQ((*series)[1].points, (std::vector<std::pair<double, double>>{{1, 3}}));
}

TEST(ChartTable, BarsOfGroupsThatASeriesLacksStayEmpty) {
    const Table table = table_of("terrain,px,metric\nA,1,g\nA,2,d\nB,4,d\nC,x,g\n");
    BarChart chart;
    const auto ok = set_bars(table, {"terrain", "px", "metric"}, chart);
    ASSERT_TRUE(ok) << ok.error().message;
    EXPECT_EQ(chart.groups, (std::vector<std::string>{"A", "B", "C"}));
    ASSERT_EQ(chart.series.size(), 2u);
    ASSERT_EQ(chart.series[0].values.size(), 3u);
    EXPECT_EQ(chart.series[0].values[0], 1);
    EXPECT_TRUE(std::isnan(chart.series[0].values[1]) && std::isnan(chart.series[0].values[2]));
    EXPECT_EQ(chart.series[1].values[0], 2);
    EXPECT_EQ(chart.series[1].values[1], 4);
    EXPECT_TRUE(std::isnan(chart.series[1].values[2]));
}

TEST(ChartTable, NothingToDrawIsAnError) {
    const Table table = table_of("a,b\nx,y\n");
    BarChart chart;
    EXPECT_FALSE(line_series(table, {"a", "c", ""}));
    EXPECT_FALSE(line_series(table, {"a", "b", ""}));
    EXPECT_FALSE(set_bars(table, {"a", "b", ""}, chart));
    EXPECT_FALSE(set_bars(table, {"a", "b", "c"}, chart));
}

}  // namespace
}  // namespace scree::chart
