// TriangleWalk: the triangle tree of a Bisection laid flat, in the order of a walk down it: a mesh is emitted by one
// loop that looks at each vertex where it splits a triangle, and calls nothing. Immutable; any thread.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "runtime/lod/bisection.h"

namespace scree {

class TriangleWalk {
public:
    explicit TriangleWalk(const Bisection& bisection);

    /// Indices that `out` must have room for below, whatever is written.
    static std::size_t room(const Bisection& bisection) {
        return 6 * static_cast<std::size_t>(bisection.cells()) * static_cast<std::size_t>(bisection.cells()) + 12;
    }
    /// Writes the triangles that a whole block is drawn as, three indices each, `first_vertex` added; returns the end
    /// of what was written. `active`: a byte a vertex, 0 or 1, and one more that is 0.
    std::uint32_t* emit(const std::uint8_t* active, std::uint32_t first_vertex, std::uint32_t* out) const;
    /// Of the cell of stride 2^(n - level) that is number `code` in Morton order (x in the even bits), of which the
    /// sides' vertices are active. Cells may be written one behind the other into the room of one block.
    std::uint32_t* emit_cell(const std::uint8_t* active, int level, int code, std::uint32_t* out) const;

private:
    /// A triangle: where its middle is active the next one is its first half, else `next`.
    template <class Index>
    struct Node {
        Index middle = 0, next = 0;  ///< a middle that is never active: cannot be split
        std::array<Index, 3> corners{};
    };
    /// Nodes of a triangle and all that it is split into.
    struct Range {
        std::uint32_t first = 0, end = 0;
    };
    void add(const Bisection& bisection, const BisectionTriangle& triangle, int level);
    template <std::size_t count>
    std::uint32_t* emit(const std::uint8_t* active, const std::array<Range, count>& ranges, std::uint32_t first_vertex,
                        std::uint32_t* out) const;

    std::vector<Node<std::uint32_t>> nodes_;
    std::vector<Node<std::uint16_t>> short_nodes_;          ///< the same where its numbers fit: then nodes_ is empty
    std::vector<std::vector<std::array<Range, 2>>> cells_;  ///< by level, Morton order: each cell's two triangles
    std::array<Range, 4> halves_;                           ///< of the block's two triangles
    std::int32_t middle_ = 0;                               ///< where these are split
    std::uint32_t end_ = 0;
    std::size_t room_ = 0;
};

}  // namespace scree
