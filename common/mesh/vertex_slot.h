// How a height tile's vertices lie in a slot of the vertex arena. Laid out for morphing: each vertex carries its
// height, its height on the next geomip level's surface and on the second next; behind the grid come the mid-points of
// the border edges, which a finer neighbour's vertices need (docs/lod-and-paging.md).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace scree {

struct SlotVertex {
    float height_n = 0;       ///< own height, quanta
    float next_n = 0;         ///< on the surface of the next geomip level
    float second_next_n = 0;  ///< on the surface of the one after
};
static_assert(sizeof(SlotVertex) == 12);

/// (m+1)^2 grid vertices + 4m border mid-points; 33^2 + 4*32 = 1217 vertices = 14,604 bytes.
inline std::size_t slot_vertex_count(int tile_cells_log2) {
    const std::size_t m = std::size_t{1} << tile_cells_log2;
    return (m + 1) * (m + 1) + 4 * m;
}

inline std::size_t slot_bytes(int tile_cells_log2) { return slot_vertex_count(tile_cells_log2) * sizeof(SlotVertex); }

/// Fills a slot from a tile's samples. out.size() == slot_vertex_count(). Border mid-points run north, east, south,
/// west, each from west to east or north to south.
void fill_vertex_slot(std::span<const std::int32_t> samples, int tile_cells_log2, std::span<SlotVertex> out);

}  // namespace scree
