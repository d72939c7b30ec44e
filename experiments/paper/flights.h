// The flights of the paper's tables: 800 x 800 px, 40 degrees, over any raster. Pure functions.
#pragma once

#include <string>
#include <vector>

#include "runtime/lod/height_raster.h"
#include "runtime/view/camera.h"

namespace scree::paper {

/// A stretch of a round 0.16 of the raster's shorter side wide about its middle, 120 m above the highest peak (about
/// 1000 m up in the paper's region), swaying 20 degrees to either side, 8 degrees down.
std::vector<Camera> loop(const HeightRaster& raster, double step_m, int frames);
/// The same 60 degrees down, straight ahead.
std::vector<Camera> steep(const HeightRaster& raster, double step_m, int frames);
/// The same round 100 m above the highest ground near by, 2 degrees down.
std::vector<Camera> low(const HeightRaster& raster, double step_m, int frames);

}  // namespace scree::paper
