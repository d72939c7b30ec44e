// How a height tile's vertices lie in a slot of the vertex arena: each carries its height and its height on the next
// coarser surface that it moves to when it morphs (docs/lod-and-paging.md, "Morphing").
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace scree {

struct SlotVertex {
    float height_n = 0;  ///< own height, quanta
    /// Where the vertex is born at geomip level k (its coordinates share k factors of two): height on the surface of
    /// level k + 1, that is the mean of the two vertices beside it along an edge, or along the diagonal of the level
    /// k + 1 cell whose middle it is. The mid-point of a whole edge of the tile (k = n - 1) has the mean of the edge's
    /// ends; the tile's corners and its centre, which never move, their own height. Exact (multiples of one half).
    float next_n = 0;
    /// Half of what a border vertex moves when it goes to its next_n: of the vertices that lie one stride s from a
    /// border, where they are born, half-way to a border vertex born at 2 s. On a thinned border that one moves while
    /// they do. Elsewhere 0.
    float rim_n = 0;
};
static_assert(sizeof(SlotVertex) == 12);

/// (m+1)^2 grid vertices; 33^2 = 1089 vertices = 13,068 bytes.
inline std::size_t slot_vertex_count(int tile_cells_log2) {
    const std::size_t m = std::size_t{1} << tile_cells_log2;
    return (m + 1) * (m + 1);
}

inline std::size_t slot_bytes(int tile_cells_log2) { return slot_vertex_count(tile_cells_log2) * sizeof(SlotVertex); }

/// Fills a slot from a tile's samples, (m+1)^2. out.size() == slot_vertex_count().
void fill_vertex_slot(std::span<const std::int32_t> samples, int tile_cells_log2, std::span<SlotVertex> out);

}  // namespace scree
