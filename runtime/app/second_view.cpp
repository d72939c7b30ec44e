#include "runtime/app/second_view.h"

#include <algorithm>

namespace scree {

Result<Camera> view_from_above(const Camera& main, const Dataset& d, double ground_m, int width_px, int height_px) {
    const Lattice& l = d.lattice;
    const glm::dvec2 north_west{l.x_m(0), l.y_m(0)};
    const glm::dvec2 south_east{l.x_m(static_cast<double>(l.cells_x)), l.y_m(static_cast<double>(l.cells_y))};
    const double extent_m = std::max(south_east.x - north_west.x, north_west.y - south_east.y);
    const double above_ground_m = std::max(main.eye.z - ground_m, 1.0);
    glm::dvec2 over(main.eye);
    if (main.forward.z < 0) {
        const double reach_m = std::min(above_ground_m / -main.forward.z, 2 * extent_m);
        over += reach_m * glm::dvec2(main.forward);
    }
    over = {std::clamp(over.x, north_west.x, south_east.x), std::clamp(over.y, south_east.y, north_west.y)};
    const double above_m = std::clamp(6 * above_ground_m, 0.05 * extent_m, 1.5 * extent_m);
    return look_at({over.x, over.y, ground_m + above_m}, {over.x, over.y, ground_m}, 40, width_px, height_px);
}

}  // namespace scree
