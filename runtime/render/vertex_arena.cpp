#include "runtime/render/vertex_arena.h"

#include <epoxy/gl.h>
#include <fmt/format.h>

#include <cassert>
#include <limits>

namespace scree {

Result<VertexArena> VertexArena::create(int tile_cells_log2, int slots) {
    assert(slots >= 1);
    const std::size_t slot_vertices = slot_vertex_count(tile_cells_log2);
    if (slot_vertices * static_cast<std::size_t>(slots) > std::numeric_limits<std::int32_t>::max())
        return Error{ErrorCode::display,
                     fmt::format("{} height slots of {} vertices pass OpenGL's 2^31 vertices; lower the memory budget",
                                 slots, slot_vertices)};
    VertexArena arena;
    arena.slots_ = slots;
    arena.slot_vertices_ = static_cast<int>(slot_vertices);
    GLuint name = 0;
    glCreateBuffers(1, &name);
    arena.buffer_ = BufferHandle(name);
    const std::size_t bytes = vertex_arena_bytes(tile_cells_log2, slots);
    glNamedBufferStorage(name, static_cast<GLsizeiptr>(bytes), nullptr, GL_DYNAMIC_STORAGE_BIT);
    if (glGetError() != GL_NO_ERROR)
        return Error{ErrorCode::display,
                     fmt::format("OpenGL has no {} bytes for {} height slots; lower the memory budget", bytes, slots)};
    return arena;
}

void VertexArena::upload(int slot, std::span<const SlotVertex> vertices) {
    assert(slot >= 0 && slot < slots_ && vertices.size() == static_cast<std::size_t>(slot_vertices_));
    glNamedBufferSubData(buffer_.name(), static_cast<GLintptr>(vertices.size_bytes()) * slot,
                         static_cast<GLsizeiptr>(vertices.size_bytes()), vertices.data());
}

}  // namespace scree
