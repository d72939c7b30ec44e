// scree_chart: a chart of columns of a CSV, for scripts.
#include <fmt/format.h>

#include <charconv>
#include <fstream>
#include <iterator>

#include "experiments/chart/table.h"
#include "experiments/program.h"

namespace {

using namespace scree;

constexpr const char* kProgram = "scree_chart";

struct Options {
    std::string csv, out, title, subtitle, x_label, y_label;
    chart::Choice choice;
    std::vector<std::string> levels;
    bool bars = false, log_x = false, log_y = false;
};

// NAME=VALUE: a level to compare with.
Result<std::vector<PlotLevel>> levels_of(const std::vector<std::string>& texts) {
    std::vector<PlotLevel> levels;
    for (const std::string& text : texts) {
        const std::size_t sign = text.rfind('=');
        double y = 0;
        const char* end = text.data() + text.size();
        if (sign == std::string::npos || std::from_chars(text.data() + sign + 1, end, y).ptr != end ||
            sign + 1 == text.size())
            return Error{ErrorCode::usage, fmt::format("--level {} is not NAME=VALUE", text)};
        levels.push_back({text.substr(0, sign), y});
    }
    return levels;
}

Result<std::string> svg_of(const Options& o, const chart::Table& table) {
    auto levels = levels_of(o.levels);
    if (!levels) return levels.error();
    const PlotAxis y{o.y_label.empty() ? o.choice.y : o.y_label, o.log_y, {}};
    const std::string x_label = o.x_label.empty() ? o.choice.x : o.x_label;
    if (o.bars) {
        BarChart bars{o.title, o.subtitle, x_label, {}, y, {}, *levels};
        if (auto ok = chart::set_bars(table, o.choice, bars); !ok) return ok.error();
        return to_svg(bars);
    }
    auto series = chart::line_series(table, o.choice);
    if (!series) return series.error();
    return to_svg(LineChart{o.title, o.subtitle, {x_label, o.log_x, {}}, y, *series, *levels});
}

Result<void> run(const Options& o) {
    std::ifstream in(o.csv, std::ios::binary);
    const std::string text{std::istreambuf_iterator<char>(in), {}};
    if (!in) return Error{ErrorCode::input, fmt::format("{}: cannot be read, so there is nothing to draw", o.csv)};
    const auto table = chart::read_csv(text);
    if (!table) return Error{table.error().code, fmt::format("{}: {}", o.csv, table.error().message)};
    const auto svg = svg_of(o, *table);
    if (!svg) return Error{svg.error().code, fmt::format("{}: {}", o.csv, svg.error().message)};
    std::ofstream out(o.out, std::ios::binary);
    out << *svg;
    out.close();
    if (!out) return Error{ErrorCode::io, fmt::format("{}: cannot be written", o.out)};
    return {};
}

int main_of(int argc, char** argv) {
    CLI::App app{"Draws columns of a CSV as an SVG chart.", kProgram};
    Options o;
    app.add_option("csv", o.csv, "The table")->required();
    app.add_option("-o,--output", o.out, "The SVG; replaced")->required();
    app.add_option("--x", o.choice.x, "Column: abscissa, or the groups of bars")->required();
    app.add_option("--y", o.choice.y, "Column: ordinate")->required();
    app.add_option("--series", o.choice.series, "Column whose values are the series");
    app.add_option("--title", o.title, "For people");
    app.add_option("--subtitle", o.subtitle, "Data, settings: what the figure holds for");
    app.add_option("--x-label", o.x_label, "With its unit; default: the column's name");
    app.add_option("--y-label", o.y_label, "With its unit; default: the column's name");
    app.add_option("--level", o.levels, "NAME=VALUE: a level to compare with")->expected(1)->take_all();
    app.add_flag("--bars", o.bars, "Bars, not lines");
    app.add_flag("--log-x", o.log_x, "Logarithmic abscissa");
    app.add_flag("--log-y", o.log_y, "Logarithmic ordinate");
    if (const int code = parse_words(app, argc, argv); code >= 0) return code;
    if (auto ok = run(o); !ok) return report_error(kProgram, ok.error());
    return 0;
}

}  // namespace

int main(int argc, char** argv) { return scree::run_program(kProgram, argc, argv, main_of); }
