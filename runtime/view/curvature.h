// Earth curvature: a point is lowered by d^2 / 2R at a horizontal distance d from the eye (196 m at 50 km), which the
// paraboloid shares with the sphere to d^4 / 8R^3 (6 mm at 50 km).
#pragma once

#include <optional>
#include <string>

#include "common/dataset.h"
#include "runtime/view/camera.h"

namespace scree {

inline constexpr double kEarthRadius_m = 6'371'008.8;  ///< mean radius (IUGG)

enum class Curvature { automatic, on, off };

/// "auto", "on", "off".
std::optional<Curvature> curvature_from(const std::string& text);

/// 1 / (2 R), or 0 for a flat world. Automatic: on where it moves the dataset's furthest corner by more than a tenth of
/// a pixel.
double half_curvature(Curvature curvature, const Dataset& dataset, const Camera& camera);

}  // namespace scree
