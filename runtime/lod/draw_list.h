// What selection hands to the renderer, by slot numbers: an item a tile, or several where a tile of the deepest height
// level carries textures deeper still, one a part of the tile. No OpenGL here.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/mesh/tile_patterns.h"
#include "common/tile_id.h"
#include "runtime/lod/mesh_pool.h"

namespace scree {

/// Where a texture lies on a tile: at (i, j) of its m cells, u = offset_u + scale * (i / m), v likewise with j. The
/// texture may be an ancestor's.
struct TexturePlacement {
    std::int32_t slot = 0;
    float scale = 1;
    float offset_u = 0;
    float offset_v = 0;

    friend bool operator==(const TexturePlacement&, const TexturePlacement&) = default;
};

/// Order of neighbour_textures: the eight tiles round one, row by row.
enum TextureSide : std::size_t {
    kSideNorthWest,
    kSideNorth,
    kSideNorthEast,
    kSideWest,
    kSideEast,
    kSideSouthWest,
    kSideSouth,
    kSideSouthEast
};

struct DrawItem {
    TileId tile;
    std::int32_t height_slot = 0;
    std::int32_t geomip = 0;      ///< stride 2^geomip of the tile's own samples
    std::uint32_t edge_mask = 0;  ///< EdgeMask: edges thinned by 2
    TilePart part;                ///< what of the tile this item draws
    /// Triangles made for this item, in the frame's MeshPool: those of `part` alone. Empty: the pattern of geomip and
    /// edge_mask. With a mesh those still say what strides the tile is drawn with, and nothing morphs: all weights are
    /// 0.
    MeshRange mesh;

    /// Geomorph (docs/lod-and-paging.md, "Morphing"): how far vertices have moved from their own height (0) to their
    /// height on the next coarser surface (1). Inner vertices born at the stride drawn move by `morph`; those of an
    /// edge born at the edge's stride (twice the tile's where it is thinned) by that edge's weight, in the order north,
    /// east, south, west. All others, and the tile's corners, stay.
    float morph = 0;
    std::array<float, 4> edge_morph{};

    TexturePlacement texture;
    /// While a texture is newly come: its share, the rest is `coarse_texture`, an ancestor's. 1: coarse_texture unused.
    float texture_share = 1;
    TexturePlacement coarse_texture;
    /// Slots of the eight textures round `texture` on its own level, -1 where there is none; all -1 unless
    /// `texture` may be magnified here. The renderer filters across their common borders.
    std::array<std::int32_t, 8> neighbour_textures{-1, -1, -1, -1, -1, -1, -1, -1};

    /// Pixels that the surface drawn here may be off the finest one, in any view: this tile's share of
    /// Selection::max_bound_px.
    float bound_px = 0;
};

using DrawList = std::vector<DrawItem>;

}  // namespace scree
