// RelativeFrame: how lattice integers become camera-relative float positions, bit-identically from both sides of a tile
// edge and in GLSL (runtime/render/shaders/terrain_position.glsl holds the same lines):
//     x = float(i - i0) * spacing - frac_x      one integer subtraction, one multiplication, one subtraction
// (i0, j0, n0) is the lattice point nearest the eye, clamped to the dataset; frac is what is left of the eye, in
// metres. Earth curvature lowers a point by the square of its horizontal distance over twice the radius.
#pragma once

#include <cstdint>

#include <glm/glm.hpp>

#include "common/lattice.h"
#include "common/mesh/morphed_vertex.h"

namespace scree {

struct RelativeFrame {
    std::int32_t i0 = 0, j0 = 0, n0 = 0;
    float spacing_m = 1, quantum_m = 1;
    glm::vec3 fraction_m{0, 0, 0};  ///< eye minus the lattice point's position (x east, y north, z up)

    float half_curvature = 0;  ///< 1 / (2 R); 0: the world is flat

    /// The position of lattice vertex (i, j) at n quanta relative to the eye, as the vertex shader computes it:
    /// z is lowered by (x^2 + y^2 + morph_reach_m2) * half_curvature. morph_reach_m2: VertexMorph's weight times its
    /// squared reach in metres, so that a vertex that has moved wholly lies on the middle of its neighbours' line.
    glm::vec3 position(std::int32_t i, std::int32_t j, float height_n, float morph_reach_m2 = 0) const;
    /// What `position` wants to know of a vertex of a tile whose samples are `step` finest cells apart. A tile of twice
    /// the step counts half as many samples: everything scales by powers of two, so both come to the same bits.
    float morph_reach_m2(VertexMorph morph, std::int64_t step) const;
};

RelativeFrame make_relative_frame(const Lattice& lattice, double height_offset_m, double height_quantum_m,
                                  glm::dvec3 eye, double half_curvature = 0);

}  // namespace scree
