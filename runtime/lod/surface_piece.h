// SurfacePiece: triangles that a renderer keeps until they change.
#pragma once

#include <cstdint>
#include <span>

namespace scree {

struct SurfacePiece {
    std::uint32_t place = 0;                 ///< which piece it is: it has room of its own
    std::uint32_t version = 0;               ///< not 0; another than the last one: its triangles are other ones
    std::span<const std::uint32_t> indices;  ///< three vertices a triangle, counter-clockwise from above
    bool at_end = false;                     ///< reaches into the band of the EdgeField
};

}  // namespace scree
