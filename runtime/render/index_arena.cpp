#include "runtime/render/index_arena.h"

#include <epoxy/gl.h>
#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <limits>

namespace scree {
namespace {

/// Indices narrowed at a time: 32 KB stay in the nearest cache.
constexpr std::size_t kNarrowed = 16 * 1024;

}  // namespace

IndexRange IndexArena::append_blocks(int geomip, unsigned mask, bool at_border,
                                     std::vector<std::uint32_t>& indices) const {
    const int level = patterns_.finest_part_level(geomip), last = (1 << level) - 1;
    const auto first = static_cast<std::uint32_t>(indices.size());
    for (int y = 0; y <= last; ++y)
        for (int x = 0; x <= last; ++x) {
            if ((x == 0 || y == 0 || x == last || y == last) != at_border) continue;
            const PatternRange block = patterns_.range(geomip, mask, {level, x, y});
            const auto from = patterns_.indices().begin() + block.first;
            indices.insert(indices.end(), from, from + block.count);
        }
    return {first, static_cast<std::uint32_t>(indices.size()) - first};
}

Result<IndexArena> IndexArena::create(int tile_cells_log2, std::size_t mesh_indices) {
    IndexArena arena;
    arena.patterns_ = TilePatterns(tile_cells_log2);
    std::vector<std::uint32_t> indices = arena.patterns_.indices();
    for (int geomip = 0; geomip < arena.patterns_.geomip_levels(); ++geomip) {
        arena.inner_.push_back(arena.append_blocks(geomip, 0, false, indices));
        for (unsigned mask = 0; mask < kEdgeMaskCount; ++mask)
            arena.rings_.push_back(arena.append_blocks(geomip, mask, true, indices));
    }
    arena.meshes_first_ = indices.size();
    arena.mesh_indices_ = mesh_indices;
    if (mesh_indices > std::numeric_limits<std::int32_t>::max() - indices.size())
        return Error{ErrorCode::display,
                     fmt::format("{} indices of meshes pass OpenGL's 2^31; lower the memory budget", mesh_indices)};
    const std::size_t bytes = index_bytes(tile_cells_log2);
    arena.type_ = bytes == 2 ? GL_UNSIGNED_SHORT : GL_UNSIGNED_INT;
    if (bytes == 2) arena.small_.resize(kNarrowed);
    GLuint name = 0;
    glCreateBuffers(1, &name);
    arena.buffer_ = BufferHandle(name);
    glNamedBufferStorage(name, static_cast<GLsizeiptr>((indices.size() + mesh_indices) * bytes), nullptr,
                         GL_DYNAMIC_STORAGE_BIT);
    arena.write(0, indices);
    if (glGetError() != GL_NO_ERROR)
        return Error{ErrorCode::display,
                     fmt::format("OpenGL has no {} bytes for the index lists of this tile size and its meshes",
                                 (indices.size() + mesh_indices) * bytes)};
    return arena;
}

IndexRange IndexArena::mesh_range(const DrawItem& item) const {
    assert(item.mesh.count % 3 == 0 && std::size_t{item.mesh.first} + item.mesh.count <= mesh_indices_);
    return {static_cast<std::uint32_t>(meshes_first_) + item.mesh.first, item.mesh.count};
}

IndexRange IndexArena::pattern_range(const DrawItem& item) const {
    const PatternRange range = patterns_.range(item.geomip, item.edge_mask, item.part);
    return {range.first, range.count};
}

void IndexArena::upload_mesh(std::uint32_t first, std::span<const std::uint32_t> indices) {
    assert(first + indices.size() <= mesh_indices_);
    write(meshes_first_ + first, indices);
}

void IndexArena::write(std::size_t first, std::span<const std::uint32_t> indices) {
    const auto put = [&](const auto& from, std::size_t count) {
        glNamedBufferSubData(buffer_.name(), static_cast<GLintptr>(first * sizeof(from[0])),
                             static_cast<GLsizeiptr>(count * sizeof(from[0])), from.data());
    };
    if (type_ == GL_UNSIGNED_INT) {
        if (!indices.empty()) put(indices, indices.size());
        return;
    }
    while (!indices.empty()) {
        const std::size_t count = std::min(indices.size(), small_.size());
        std::transform(indices.begin(), indices.begin() + static_cast<std::ptrdiff_t>(count), small_.begin(),
                       [](std::uint32_t index) { return static_cast<std::uint16_t>(index); });
        put(small_, count);
        indices = indices.subspan(count);
        first += count;
    }
}

}  // namespace scree
