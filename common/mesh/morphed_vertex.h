// The height of a drawn vertex under morphing: one piece of code for the mesh that is written, the audit and the tests;
// terrain.vert holds the same lines. Source: geomorphing of de Boer, section 2.3, by absolute level (Scree lod, C15,
// C16).
#pragma once

#include <array>
#include <bit>
#include <cstdint>

#include "common/mesh/tile_patterns.h"
#include "common/mesh/vertex_slot.h"

namespace scree {

/// How a tile is drawn: see DrawItem.
struct MorphedPattern {
    int geomip = 0;
    unsigned edge_mask = 0;
    float morph = 0;
    std::array<float, 4> edge_morph{};  ///< north, east, south, west
};

struct VertexMorph {
    float weight = 0;  ///< 0: own height, 1: on the next coarser surface
    /// Squared distance, in the tile's own samples, to the two vertices between which it moves: curvature adds weight *
    /// that / (2 R) to the drop, the mean of theirs.
    float reach_squared = 0;
    /// Share of SlotVertex::rim_n: its own weight times that of the border vertex it moves half-way to.
    float rim_weight = 0;
};

/// Weight of a drawn vertex (i, j), 0 <= i, j <= m.
inline VertexMorph vertex_morph(int i, int j, int tile_cells_log2, const MorphedPattern& p) {
    const int m = 1 << tile_cells_log2;
    const bool north = j == 0, east = i == m, south = j == m, west = i == 0;
    if ((north || south) && (east || west)) return {};
    int stride = 1 << p.geomip;
    float weight = p.morph;
    if (north || east || south || west) {
        const int edge = north ? 0 : east ? 1 : south ? 2 : 3;
        weight = p.edge_morph[static_cast<std::size_t>(edge)];
        if ((p.edge_mask >> edge & 1u) != 0) stride *= 2;
    }
    // Born at this stride: not on the grid of twice the stride.
    if (((i | j) & (2 * stride - 1)) != stride) return {};
    const bool diagonal = (i & (2 * stride - 1)) != 0 && (j & (2 * stride - 1)) != 0;
    const float reach_squared = static_cast<float>(diagonal ? 2 * stride * stride : stride * stride);
    if (diagonal || north || east || south || west) return {weight, reach_squared, 0};
    // One stride from a thinned border, half-way to a vertex that moves along it: goes with it, or the surface would
    // jump where the tile reaches its next level.
    const int near = j == stride ? 0 : i == m - stride ? 1 : j == m - stride ? 2 : i == stride ? 3 : -1;
    const int along = near % 2 == 0 ? i : j;
    if (near < 0 || (p.edge_mask >> near & 1u) == 0 || (along & (4 * stride - 1)) != 2 * stride)
        return {weight, reach_squared, 0};
    const float rim = p.edge_morph[static_cast<std::size_t>(near)];
    return {weight, reach_squared * (1 + 2 * rim), weight * rim};
}

/// Height in quanta, as the vertex shader computes it (no fused multiply-add anywhere).
inline float morphed_height(float height_n, float next_n, float weight) {
    return height_n * (1.0f - weight) + next_n * weight;
}

inline float morphed_height(const SlotVertex& vertex, const VertexMorph& morph) {
    return morphed_height(vertex.height_n, vertex.next_n, morph.weight) + vertex.rim_n * morph.rim_weight;
}

}  // namespace scree
