// Coverage: does the drawn frame cover every present cell in view, once?
#pragma once

#include <cstdint>

#include "common/dataset.h"
#include "runtime/lod/draw_list.h"
#include "runtime/paging/residency.h"
#include "runtime/view/camera.h"

namespace scree {

/// Finest cells in view that no drawn node covers, or two do. Walks from the roots by child-exists bits, independent of
/// how the draw list came about. An upper figure: cells of a node are counted whole.
std::int64_t count_holes(const Dataset& dataset, const Residency& residency, const Camera& camera,
                         const DrawList& draws, double half_curvature = 0);

}  // namespace scree
