// A dataset's CRS, as commands use it.
#pragma once

#include <optional>

#include "common/crs_label.h"
#include "common/dataset.h"
#include "tools/source/crs.h"

namespace scree {

/// None where the dataset says none, or one that PROJ does not know.
std::optional<Crs> crs_of(const Dataset& dataset);

}  // namespace scree
