// What selection hands to the renderer, by slot numbers: an item a tile, or several where a tile of the deepest height
// level carries textures deeper still, one a part of the tile. No OpenGL here.
#pragma once

#include <cstdint>
#include <vector>

#include "common/mesh/tile_patterns.h"
#include "common/tile_id.h"

namespace scree {

struct DrawItem {
    TileId tile;
    std::int32_t height_slot = 0;
    std::int32_t texture_slot = 0;
    std::int32_t geomip = 0;      ///< stride 2^geomip of the tile's own samples
    std::uint32_t edge_mask = 0;  ///< EdgeMask: edges thinned by 2
    TilePart part;                ///< what of the tile this item draws
    /// Texture coordinates: u = offset_u + scale * (i / m), v likewise; the texture may be an ancestor's.
    float texture_scale = 1;
    float texture_offset_u = 0;
    float texture_offset_v = 0;
};

using DrawList = std::vector<DrawItem>;

}  // namespace scree
