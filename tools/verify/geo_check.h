// A store's longitudes and latitudes against PROJ, at places of its own choosing.
#pragma once

#include <optional>
#include <string>

#include "common/dataset.h"

namespace scree {

struct GeoCheck {
    /// Greatest distance between the store's answer and PROJ's, metres on the ground; none where there is nothing to
    /// compare, or nothing to compare with.
    std::optional<double> error_m;
    /// Why there is no error; or what makes it say less than it seems to. Empty otherwise.
    std::string reason;
    /// The error is beyond what the store states, and the CRS's own datum shift does not excuse it.
    bool broken = false;
};

/// Milliseconds.
GeoCheck check_geo_grid(const Dataset& dataset);

}  // namespace scree
