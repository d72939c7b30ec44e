// RelativeFrame: how lattice integers become camera-relative float positions, bit-identically from both sides of a tile
// edge and in GLSL (runtime/render/shaders/terrain_position.glsl holds the same three lines):
//     x = float(i - i0) * spacing - frac_x      one integer subtraction, one multiplication, one subtraction
// (i0, j0, n0) is the lattice point nearest the eye, clamped to the dataset; frac is what is left of the eye, in
// metres.
#pragma once

#include <cstdint>

#include <glm/glm.hpp>

#include "common/lattice.h"

namespace scree {

struct RelativeFrame {
    std::int32_t i0 = 0, j0 = 0, n0 = 0;
    float spacing_m = 1, quantum_m = 1;
    glm::vec3 fraction_m{0, 0, 0};  ///< eye minus the lattice point's position (x east, y north, z up)

    /// The position of lattice vertex (i, j) at n quanta relative to the eye, as the vertex shader computes it.
    glm::vec3 position(std::int32_t i, std::int32_t j, float height_n) const;
};

RelativeFrame make_relative_frame(const Lattice& lattice, double height_offset_m, double height_quantum_m,
                                  glm::dvec3 eye);

}  // namespace scree
