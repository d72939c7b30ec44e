// What people call a dataset's CRS: never its whole definition, which may be a page of WKT.
#pragma once

#include <string>

#include "common/dataset.h"

namespace scree {

/// One short line: "EPSG:n (name)"; of a CRS without a code its name; "none".
std::string crs_label(const Dataset& dataset);
/// "EPSG:n"; of a CRS without a code its name; empty where there is neither.
std::string crs_code_or_name(const Dataset& dataset);

}  // namespace scree
