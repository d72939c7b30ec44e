// The surface that a tile draws, evaluated exactly. One piece of code for what the builder certifies, the runtime draws
// and the audit checks (docs/architecture.md, "Errors are certified").
#pragma once

#include <cstdint>
#include <span>

#include "common/mesh/tile_patterns.h"

namespace scree {

/// How a tile is drawn: geomip level g and the edges thinned by 2.
struct DrawnPattern {
    int geomip = 0;
    unsigned edge_mask = 0;
};

/// An exact height: numerator / denominator quanta, denominator a power of two.
struct ExactHeight {
    std::int64_t numerator = 0;
    std::int64_t denominator = 1;
    double quanta() const { return static_cast<double>(numerator) / static_cast<double>(denominator); }
};

/// Height of the drawn surface at (u, v), counted in units of 1/`unit` of the tile's own sample distance from its
/// north-west corner (u east, v south, 0 <= u, v <= m * unit). `samples` are the (m+1)^2 heights. Exact: no rounding
/// anywhere.
ExactHeight drawn_height(std::span<const std::int32_t> samples, int tile_cells_log2, DrawnPattern pattern,
                         std::int64_t u, std::int64_t v, std::int64_t unit);

/// The same at a real-valued position (s, t) in sample distances; evaluated in double.
double drawn_height_at(std::span<const std::int32_t> samples, int tile_cells_log2, DrawnPattern pattern, double s,
                       double t);

}  // namespace scree
