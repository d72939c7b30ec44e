// What commands call a dataset's CRS.
#pragma once

#include <optional>
#include <string>

#include "common/dataset.h"
#include "tools/source/crs.h"

namespace scree {

/// One short line: "EPSG:n (name)"; of a CRS without a code its name; "none".
std::string crs_label(const Dataset& dataset);

/// None where the dataset says none, or one that PROJ does not know.
std::optional<Crs> crs_of(const Dataset& dataset);

}  // namespace scree
