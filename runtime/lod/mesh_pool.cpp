#include "runtime/lod/mesh_pool.h"

#include <algorithm>
#include <cassert>
#include <cstring>
#include <limits>

namespace scree {

MeshPool::MeshPool(std::size_t capacity, std::size_t largest_mesh) : ring_(capacity), largest_mesh_(largest_mesh) {
    assert(largest_mesh >= 1 && largest_mesh <= capacity);
    assert(capacity <= std::numeric_limits<std::uint32_t>::max());
}

MeshRange MeshPool::put(std::span<const std::uint32_t> indices) {
    assert(!indices.empty() && indices.size() <= largest_mesh_);
    if (const std::size_t left = ring_.size() - next(); indices.size() > left) written_ += left;
    const std::size_t first = next();
    std::memmove(ring_.data() + first, indices.data(), indices.size_bytes());  // may come from the ring itself
    const MeshRange mesh{written_, static_cast<std::uint32_t>(first), static_cast<std::uint32_t>(indices.size())};
    written_ += indices.size();
    return mesh;
}

void MeshPool::clear() {
    if (next() != 0) written_ += ring_.size() - next();
    cleared_at_ = written_;
}

std::uint64_t MeshPool::oldest() const {
    return std::max(cleared_at_, written_ - std::min<std::uint64_t>(written_, ring_.size()));
}

bool MeshPool::holds(const MeshRange& mesh) const {
    return mesh.count > 0 && mesh.position >= oldest() && mesh.position + mesh.count <= written_;
}

// An advance of no more than the capacity passes the end of the ring once. What is skipped there is shorter than the
// mesh that did not fit.
std::uint64_t MeshPool::furthest_advance(std::size_t count) const {
    const std::size_t left = ring_.size() - next();
    return count <= left ? count : std::uint64_t{count} + std::min(left, largest_mesh_ - 1);
}

bool MeshPool::outlasts(const MeshRange& mesh, std::size_t count) const {
    return holds(mesh) && written_ + furthest_advance(count) <= mesh.position + ring_.size();
}

std::span<const std::uint32_t> MeshPool::indices(const MeshRange& mesh) const {
    assert(holds(mesh) && mesh.first == mesh.position % ring_.size());
    return std::span(ring_).subspan(mesh.first, mesh.count);
}

std::array<MeshPool::Piece, 2> MeshPool::written_since(std::uint64_t position) const {
    assert(position <= written_);
    const std::uint64_t from = std::max(position, oldest());
    const auto first = static_cast<std::size_t>(from % ring_.size()), count = static_cast<std::size_t>(written_ - from);
    const std::size_t before_end = std::min(count, ring_.size() - first);
    const std::span<const std::uint32_t> ring(ring_);
    return {
        {{static_cast<std::uint32_t>(first), ring.subspan(first, before_end)}, {0, ring.first(count - before_end)}}};
}

}  // namespace scree
