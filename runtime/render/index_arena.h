// IndexArena: all that is drawn by index in one buffer, taken once: the patterns of every geomip level and edge mask,
// whole and as inner blocks and rings, and behind them a copy of the frames' MeshPool. OpenGL thread only.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/mesh/tile_patterns.h"
#include "common/result.h"
#include "runtime/lod/draw_list.h"
#include "runtime/render/draw_batches.h"
#include "runtime/render/gl_handle.h"

namespace scree {

/// Indices are local to a tile, so 16 bits serve up to m = 128.
inline std::size_t index_bytes(int tile_cells_log2) { return tile_cells_log2 <= 7 ? 2 : 4; }

/// What meshes take of a memory budget; patterns are not counted.
inline std::size_t mesh_arena_bytes(int tile_cells_log2, std::size_t mesh_indices) {
    return index_bytes(tile_cells_log2) * mesh_indices;
}

struct IndexRange {
    std::uint32_t first = 0;
    std::uint32_t count = 0;
};

class IndexArena {
public:
    IndexArena() = default;
    /// Errors (ErrorCode::display): the driver has no memory for it, or indices would pass 2^31 - 1.
    static Result<IndexArena> create(int tile_cells_log2, std::size_t mesh_indices);

    /// Where one draw of an item lies: its mesh if it has one (`whole` then), else what `shape` says of its pattern.
    IndexRange range(const DrawItem& item, DrawShape shape) const {
        if (item.mesh.count > 0) return mesh_range(item);
        if (shape == DrawShape::whole) return pattern_range(item);
        const auto geomip = static_cast<std::size_t>(item.geomip);
        return shape == DrawShape::inner ? inner_[geomip] : rings_[geomip * kEdgeMaskCount + item.edge_mask];
    }
    /// See Renderer::upload_mesh. Allocates nothing.
    void upload_mesh(std::uint32_t first, std::span<const std::uint32_t> indices);

    std::uint32_t buffer() const { return buffer_.name(); }
    std::uint32_t type() const { return type_; }  ///< as OpenGL names it

private:
    IndexRange mesh_range(const DrawItem& item) const;
    IndexRange pattern_range(const DrawItem& item) const;
    /// Appends the blocks that lie at the tile's border, or the others.
    IndexRange append_blocks(int geomip, unsigned mask, bool at_border, std::vector<std::uint32_t>& indices) const;
    void write(std::size_t first, std::span<const std::uint32_t> indices);

    BufferHandle buffer_;
    std::uint32_t type_ = 0;
    TilePatterns patterns_{1};
    std::vector<IndexRange> inner_;  ///< [geomip]: no edge to thin
    std::vector<IndexRange> rings_;  ///< [geomip][edge mask]
    std::size_t meshes_first_ = 0;   ///< index behind the last pattern
    std::size_t mesh_indices_ = 0;
    std::vector<std::uint16_t> small_;  ///< indices on their way to a buffer of 16 bits
};

}  // namespace scree
