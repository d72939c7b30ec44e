// EdgeParts: which parts of a tile lie where the data ends. No OpenGL here.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "common/lattice.h"
#include "common/mesh/tile_patterns.h"
#include "runtime/lod/draw_list.h"

namespace scree {

class EdgeParts {
public:
    /// `band_m`: width of what lies at the end, inwards from the box of the data.
    EdgeParts(const Lattice& lattice, double band_m);

    /// Parts of what the item draws that reach into the band, none coarser than need be and none finer than
    /// `finest_level` (0 to 3) levels below the tile; what lies beyond the data is left out. Valid until the next call.
    std::span<const TilePart> of(const DrawItem& item, int finest_level);

private:
    void add(TilePart part);

    const Lattice& lattice_;
    double band_cells_;
    LatticePoint corner_;
    double side_ = 0;  ///< of the tile, cells
    int finest_level_ = 0;
    std::array<TilePart, 64> parts_;
    std::size_t count_ = 0;
};

}  // namespace scree
