// MeshPool: the triangles made for tiles that are not drawn by a pattern (runtime/lod/page_mesher.h), in a ring of
// vertex indices, three a triangle, as TilePatterns numbers and turns them. Meshes are written one after another; the
// newest overwrite the oldest, and nothing is allocated after construction. No OpenGL here: the renderer's copy is
// brought up to date by what written_since() tells (Renderer::upload_mesh). One thread.
//
// All meshes of a frame must still be held when it is drawn. Who makes them has three ways to see to that:
//   - clear(), then put() all of them: they stay while no more than capacity() indices are put;
//   - before keeping a mesh of an earlier frame, ask outlasts(mesh, n) with what the frame may still put, n indices in
//   all.
//     A mesh that would not outlast them is put once more: put(indices(mesh));
//   - where not even room_for() all of the frame's own is given, draw patterns: DrawItem::mesh left empty, for all
//   tiles
//     alike, or edges no longer meet.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace scree {

/// Where a mesh lies in a MeshPool.
struct MeshRange {
    /// Indices that the pool had taken up before it, ever: what says whether it is still there.
    std::uint64_t position = 0;
    std::uint32_t first = 0;  ///< index in the pool: position % capacity
    std::uint32_t count = 0;  ///< indices; 0: no mesh

    /// `size` of its indices from the `offset`th on: a mesh written part after part can be drawn part by part.
    MeshRange section(std::uint32_t offset, std::uint32_t size) const {
        return {position + offset, first + offset, size};
    }
    friend bool operator==(const MeshRange&, const MeshRange&) = default;
};

class MeshPool {
public:
    /// Indices, taken at once: 4 bytes each here and 2 or 4 in the renderer. Smaller: meshes are made anew more often,
    /// and a frame may not fit. No mesh has more than `largest_mesh`, 1 <= largest_mesh <= capacity < 2^32.
    MeshPool(std::size_t capacity, std::size_t largest_mesh);

    /// Writes a mesh over the oldest ones, in one piece: what is left before the ring's end is skipped where it is too
    /// short. Not empty, at most largest_mesh. May be a mesh of this pool that is still held.
    MeshRange put(std::span<const std::uint32_t> indices);
    /// All are gone, and the whole ring is free in one piece.
    void clear();

    /// Whether a range is still what was put. False for an empty range.
    bool holds(const MeshRange& mesh) const;
    /// Whether it will still be held after `count` more indices, in whatever meshes.
    bool outlasts(const MeshRange& mesh, std::size_t count) const;
    /// Whether `count` indices that are put from now on, in whatever meshes, are all held at the end.
    bool room_for(std::size_t count) const { return furthest_advance(count) <= capacity(); }
    /// Of a range that is held; valid until it is not.
    std::span<const std::uint32_t> indices(const MeshRange& mesh) const;

    /// Rises with every put() and clear(): where a reader of written_since() has got to.
    std::uint64_t written() const { return written_; }
    struct Piece {
        std::uint32_t first = 0;  ///< index in the pool
        std::span<const std::uint32_t> indices;
    };
    /// What may have changed since written() was `position`, as at most two pieces, empty ones last; 0: all that is
    /// held. Valid until the next put().
    std::array<Piece, 2> written_since(std::uint64_t position) const;

    std::size_t capacity() const { return ring_.size(); }
    std::size_t largest_mesh() const { return largest_mesh_; }
    std::size_t bytes() const { return ring_.size() * sizeof(std::uint32_t); }

private:
    std::size_t next() const { return static_cast<std::size_t>(written_ % ring_.size()); }
    /// The first position that is still there.
    std::uint64_t oldest() const;
    /// How far written() moves at most for so many indices: further than they are where the ring's end is skipped.
    std::uint64_t furthest_advance(std::size_t count) const;

    std::vector<std::uint32_t> ring_;
    std::size_t largest_mesh_;
    std::uint64_t written_ = 0;
    std::uint64_t cleared_at_ = 0;
};

}  // namespace scree
