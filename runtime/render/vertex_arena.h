// VertexArena: the heights of all resident tiles in one buffer of equal slots, taken once (common/mesh/vertex_slot.h
// says what a slot holds). A tile's base vertex is slot * slot_vertex_count. OpenGL thread only.
#pragma once

#include <cstddef>
#include <span>

#include "common/mesh/vertex_slot.h"
#include "common/result.h"
#include "runtime/render/gl_handle.h"

namespace scree {

/// What an arena of `slots` slots takes of a memory budget.
inline std::size_t vertex_arena_bytes(int tile_cells_log2, int slots) {
    return slot_bytes(tile_cells_log2) * static_cast<std::size_t>(slots);
}

class VertexArena {
public:
    VertexArena() = default;
    /// Errors (ErrorCode::display): the driver has no memory for it, or vertices would pass 2^31 - 1.
    static Result<VertexArena> create(int tile_cells_log2, int slots);

    /// vertices.size() == slot_vertex_count(tile_cells_log2), 0 <= slot < slots(). What was drawn before keeps the old
    /// heights.
    void upload(int slot, std::span<const SlotVertex> vertices);

    int slots() const { return slots_; }
    int slot_vertices() const { return slot_vertices_; }
    std::uint32_t buffer() const { return buffer_.name(); }

private:
    BufferHandle buffer_;
    int slots_ = 0;
    int slot_vertices_ = 0;
};

}  // namespace scree
