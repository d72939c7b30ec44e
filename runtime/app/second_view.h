// The second view of a window: from above, north up, on what the first one looks at. Pure.
#pragma once

#include "common/dataset.h"
#include "runtime/view/camera.h"

namespace scree {

/// Straight down on what the eye looks at, or stands over where that is beyond the data. `ground_m`: as drawn, under
/// the eye. Errors: those of look_at().
Result<Camera> view_from_above(const Camera& main, const Dataset& dataset, double ground_m, int width_px,
                               int height_px);

}  // namespace scree
