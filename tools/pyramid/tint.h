// Hypsometric tint with relief shading: what the terrain shows where there is no imagery. One colour a cell.
#pragma once

#include <cstdint>
#include <span>

#include "common/tint/hypsometry.h"

namespace scree {

struct TintOptions {
    double min_height_m = 0;
    double max_height_m = 1;
    double spacing_m = 1;
};

/// Light comes from four sides, each the more the more it grazes the slope (Mark, "Multidirectional, oblique-weighted,
/// shaded-relief image of the Island of Hawaii", USGS Open-File Report 92-422), and as much again from the north-west
/// alone, as maps have it; lit slopes are a little warmer than shaded ones (Imhof, chapter 9). Immutable; any thread.
class Tint {
public:
    explicit Tint(const TintOptions& options);

    /// Colours of the cells between two rows of samples (metres, `upper` the northern one). out: 4 bytes a cell, alpha
    /// 255.
    void row(std::span<const double> upper, std::span<const double> lower, std::span<std::uint8_t> out) const;

private:
    Hypsometry colours_;
    double per_2_spacings_;
};

}  // namespace scree
