// Four boxes seen by one eye at once, as the children of a page are: box by box the same bits as lowered_by_curvature,
// Frustum::sight and distance_to_box give one at a time, for a third of the time. Pure function.
#pragma once

#include <array>

#include "runtime/view/frustum.h"

namespace scree {

/// Metres, by box.
struct alignas(32) FourBoxes {
    std::array<double, 4> west{}, east{}, south{}, north{}, low{}, high{};
};

struct alignas(32) FourSeen {
    std::array<double, 4> distance_m{};  ///< to the box, lowered by the curvature, near_m at least
    unsigned none = 0;                   ///< bit k: no point of box k is in view
    unsigned all = 0;                    ///< bit k: every point of it is
};

/// `inside`: all of every box is known to be in view, so none is tested. `half_curvature`: 1 / (2 R), 1/m; 0: flat.
FourSeen see_four(const Frustum& frustum, const FourBoxes& boxes, double half_curvature, double near_m, bool inside);

}  // namespace scree
