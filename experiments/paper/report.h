// The tables of a run as files: a CSV a table, charts, a JSON of everything, and a page for people.
#pragma once

#include <string>
#include <vector>

#include "experiments/paper/tables.h"

namespace scree::paper {

struct Subject {
    std::string name;   ///< in file names: paper_NAME_caching.csv
    std::string title;  ///< for people
    std::int64_t columns = 0, rows = 0;
    std::int64_t dropped_columns = 0, dropped_rows = 0;
    double spacing_m = 0;
    double lowest_m = 0, highest_m = 0;
    std::int64_t complete_triangles = 0;
    int frames = 0;
};

/// Writes paper_NAME_*.csv, paper_NAME_*.svg, paper_NAME.json and paper_NAME.md into a folder that is there.
Result<void> write_report(const std::string& folder, const Subject& subject, const std::vector<Row>& rows);

}  // namespace scree::paper
