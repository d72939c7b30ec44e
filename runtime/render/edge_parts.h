// EdgeParts: which parts of a tile lie where the ground ends. No OpenGL here.
#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "common/mesh/tile_patterns.h"
#include "runtime/lod/draw_list.h"
#include "runtime/view/edge_field.h"

namespace scree {

class EdgeParts {
public:
    /// `field` outlives it.
    explicit EdgeParts(const EdgeField& field) : field_(field) {}

    /// Parts of what the item draws that reach into the field's band, none coarser than need be and none finer than
    /// `finest_level` (0 to 3) levels below the tile. Valid until the next call.
    std::span<const TilePart> of(const DrawItem& item, int finest_level);

private:
    void add(TileId tile, TilePart part);

    const EdgeField& field_;
    int finest_level_ = 0;
    std::array<TilePart, 64> parts_;
    std::size_t count_ = 0;
};

}  // namespace scree
