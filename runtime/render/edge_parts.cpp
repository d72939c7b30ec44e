#include "runtime/render/edge_parts.h"

#include <algorithm>
#include <cmath>

namespace scree {

EdgeParts::EdgeParts(const Lattice& lattice, double band_m)
    : lattice_(lattice), band_cells_(band_m / lattice.spacing_m) {}

std::span<const TilePart> EdgeParts::of(const DrawItem& item, int finest_level) {
    corner_ = lattice_.corner(item.tile);
    side_ = static_cast<double>(lattice_.tile_extent(item.tile.level));
    finest_level_ = std::min(finest_level, 3);
    count_ = 0;
    add(item.part);
    return {parts_.data(), count_};
}

void EdgeParts::add(TilePart part) {
    const double side = std::ldexp(side_, -part.level);
    const double west = static_cast<double>(corner_.i) + part.x * side,
                 north = static_cast<double>(corner_.j) + part.y * side, east = west + side, south = north + side;
    const auto cells_x = static_cast<double>(lattice_.cells_x), cells_y = static_cast<double>(lattice_.cells_y);
    if (west >= cells_x || north >= cells_y) return;
    const bool at_end =
        west < band_cells_ || north < band_cells_ || east > cells_x - band_cells_ || south > cells_y - band_cells_;
    if (!at_end) return;
    if (part.level >= finest_level_) {
        parts_[count_++] = part;
        return;
    }
    for (int q = 0; q < 4; ++q) add({part.level + 1, 2 * part.x + (q & 1), 2 * part.y + (q >> 1)});
}

}  // namespace scree
