#include "experiments/claims/figure.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "common/report.h"

namespace scree {
namespace {

std::string csv_field(const std::string& text) {
    if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
    std::string quoted = "\"";
    for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
    return quoted + '"';
}

std::string csv_field(const FigureCell& cell) {
    if (const auto* number = std::get_if<double>(&cell)) return fmt::format("{}", *number);
    return csv_field(std::get<std::string>(cell));
}

template <class Fields>
std::string csv_line(const Fields& fields) {
    std::string line;
    for (std::size_t k = 0; k < fields.size(); ++k) line += (k == 0 ? "" : ",") + csv_field(fields[k]);
    return line + "\r\n";
}

nlohmann::ordered_json finite(double value) {
    if (!std::isfinite(value)) return nullptr;
    return value;
}

nlohmann::ordered_json json_of(const FigureTable& table) {
    nlohmann::ordered_json rows = nlohmann::ordered_json::array();
    for (const auto& row : table.rows) {
        nlohmann::ordered_json fields = nlohmann::ordered_json::object();
        for (std::size_t k = 0; k < row.size() && k < table.columns.size(); ++k)
            if (const auto* number = std::get_if<double>(&row[k]))
                fields[table.columns[k]] = finite(*number);
            else
                fields[table.columns[k]] = std::get<std::string>(row[k]);
        rows.push_back(std::move(fields));
    }
    return {{"name", table.name}, {"rows", std::move(rows)}};
}

nlohmann::ordered_json json_of(const Figure& figure) {
    nlohmann::ordered_json json{{"id", figure.id},           {"title", figure.title},
                                {"source", figure.source},   {"statement", figure.statement},
                                {"setting", figure.setting}, {"confirmed", figure.confirmed()}};
    json["checks"] = nlohmann::ordered_json::array();
    for (const FigureCheck& check : figure.checks)
        json["checks"].push_back({{"what", check.what},
                                  {"measured", finite(check.measured)},
                                  {"is", check.is == FigureCheck::Is::at_least ? "at least" : "at most"},
                                  {"limit", finite(check.limit)},
                                  {"holds", check.holds()}});
    json["tables"] = nlohmann::ordered_json::array();
    for (const FigureTable& table : figure.tables) json["tables"].push_back(json_of(table));
    return json;
}

/// "C2" to "c02": files sort as the claims are numbered.
std::string file_stem(const std::string& id) {
    std::string digits;
    for (const char c : id)
        if (std::isdigit(static_cast<unsigned char>(c)) != 0) digits += c;
    return "c" + std::string(digits.size() < 2 ? 2 - digits.size() : 0, '0') + digits;
}

}  // namespace

bool Figure::confirmed() const {
    return !checks.empty() && std::all_of(checks.begin(), checks.end(), [](const FigureCheck& c) { return c.holds(); });
}

std::string to_csv(const FigureTable& table) {
    std::string text = csv_line(table.columns);
    for (const auto& row : table.rows) text += csv_line(row);
    return text;
}

std::string to_json(const std::vector<Figure>& figures) {
    nlohmann::ordered_json json = nlohmann::ordered_json::array();
    for (const Figure& figure : figures) json.push_back(json_of(figure));
    return nlohmann::ordered_json{{"claims", std::move(json)}}.dump(1) + '\n';
}

Result<void> write_figures(const std::vector<Figure>& figures, const std::string& folder) {
    std::error_code error;
    std::filesystem::create_directories(folder, error);
    if (error) return Error{ErrorCode::io, fmt::format("{}: {}", folder, error.message())};
    const auto file = [&](const std::string& name) { return (std::filesystem::path(folder) / name).string(); };
    for (const Figure& figure : figures) {
        const std::string stem = file_stem(figure.id);
        for (const FigureTable& table : figure.tables) {
            const std::string name = stem + (table.name.empty() ? "" : "_" + table.name) + ".csv";
            if (auto ok = write_text(file(name), to_csv(table)); !ok) return ok;
        }
        if (figure.svg.empty()) continue;
        if (auto ok = write_text(file(stem + ".svg"), figure.svg); !ok) return ok;
    }
    return write_text(file("claims.json"), to_json(figures));
}

}  // namespace scree
