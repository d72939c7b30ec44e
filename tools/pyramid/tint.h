// Hypsometric tint with hillshade: what the terrain shows where there is no imagery. One colour a cell.
#pragma once

#include <cstdint>
#include <span>

namespace scree {

struct TintOptions {
    double min_height_m = 0;
    double max_height_m = 1;
    double spacing_m = 1;
};

/// Colours of the cells between two rows of samples (metres, `upper` the northern one). out: 4 bytes a cell, alpha 255.
void tint_row(std::span<const double> upper, std::span<const double> lower, const TintOptions& options,
              std::span<std::uint8_t> out);

}  // namespace scree
