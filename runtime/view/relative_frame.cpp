#include "runtime/view/relative_frame.h"

#include <algorithm>
#include <cmath>

#include "common/height_tile.h"

namespace scree {

glm::vec3 RelativeFrame::position(std::int32_t i, std::int32_t j, float height_n, float morph_reach_m2) const {
    const float x = static_cast<float>(i - i0) * spacing_m - fraction_m.x;
    const float y = static_cast<float>(j0 - j) * spacing_m - fraction_m.y;
    const float z = (height_n - static_cast<float>(n0)) * quantum_m - fraction_m.z;
    return {x, y, z - (x * x + y * y + morph_reach_m2) * half_curvature};
}

float RelativeFrame::morph_reach_m2(VertexMorph morph, std::int64_t step) const {
    const float side_m = static_cast<float>(step) * spacing_m;
    return morph.weight * (morph.reach_squared * (side_m * side_m));
}

RelativeFrame make_relative_frame(const Lattice& lattice, double height_offset_m, double height_quantum_m,
                                  glm::dvec3 eye, double half_curvature) {
    const auto nearest = [](double value, double low, double high) {
        return static_cast<std::int32_t>(std::lround(std::clamp(value, low, high)));
    };
    RelativeFrame frame;
    frame.spacing_m = static_cast<float>(lattice.spacing_m);
    frame.quantum_m = static_cast<float>(height_quantum_m);
    frame.i0 = nearest(lattice.i_of(eye.x), 0, static_cast<double>(lattice.cells_x));
    frame.j0 = nearest(lattice.j_of(eye.y), 0, static_cast<double>(lattice.cells_y));
    frame.n0 = nearest((eye.z - height_offset_m) / height_quantum_m, -kMaxHeightUnits, kMaxHeightUnits);
    frame.fraction_m = {static_cast<float>(eye.x - lattice.x_m(frame.i0)),
                        static_cast<float>(eye.y - lattice.y_m(frame.j0)),
                        static_cast<float>(eye.z - (height_offset_m + frame.n0 * height_quantum_m))};
    frame.half_curvature = static_cast<float>(half_curvature);
    return frame;
}

}  // namespace scree
