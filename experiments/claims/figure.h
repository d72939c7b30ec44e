// A figure: one claim of a paper against numbers. It holds what the paper says, what is measured, what theory expects,
// and a verdict that is computed from the numbers alone. Written as CSV, JSON and SVG.
#pragma once

#include <string>
#include <variant>
#include <vector>

#include "common/result.h"

namespace scree {

using FigureCell = std::variant<double, std::string>;

struct FigureTable {
    std::string name;                  ///< empty for a figure's only or main table; else part of its file's name
    std::vector<std::string> columns;  ///< with units: "greatest error (px)"
    std::vector<std::vector<FigureCell>> rows;
};

/// One number that the verdict goes by.
struct FigureCheck {
    enum class Is { at_least, at_most };
    std::string what;
    double measured = 0;
    Is is = Is::at_least;
    double limit = 0;
    bool holds() const { return is == Is::at_least ? measured >= limit : measured <= limit; }
};

struct Figure {
    std::string id;         ///< "C2", as in the mathematics of the methods
    std::string title;      ///< the finding in one sentence
    std::string source;     ///< whose statement it is
    std::string statement;  ///< what is stated there, in one sentence
    std::string setting;    ///< data, cameras, what is drawn at random
    std::vector<FigureTable> tables;
    std::vector<FigureCheck> checks;
    std::string svg;  ///< empty: no chart

    /// The statement fails by these numbers, as the finding says, and what is put in its place holds.
    bool confirmed() const;
};

inline FigureCheck at_least(std::string what, double measured, double limit) {
    return {std::move(what), measured, FigureCheck::Is::at_least, limit};
}
inline FigureCheck at_most(std::string what, double measured, double limit) {
    return {std::move(what), measured, FigureCheck::Is::at_most, limit};
}

/// RFC 4180; numbers in the shortest form that reads back the same.
std::string to_csv(const FigureTable& table);
/// All figures as one document. Numbers that are not finite are null.
std::string to_json(const std::vector<Figure>& figures);
/// "c02.csv", "c12_flown.csv", "c02.svg" for each figure and "claims.json", in a folder that is made if it is not
/// there. Errors: ErrorCode::io.
Result<void> write_figures(const std::vector<Figure>& figures, const std::string& folder);

}  // namespace scree
