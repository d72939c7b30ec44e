// Rays of a picture of the curved earth. The picture lowers a point at horizontal distance d from the eye by d^2 / 2R
// (runtime/view/curvature.h); on the flat map, where the ground is stored, the same ray rises by as much.
#pragma once

#include <optional>

#include <glm/glm.hpp>

#include "common/query/ground.h"

namespace scree {

/// The first point of the ray on the finest stored surface, on the flat map, metres. The bent ray is followed by chords
/// that leave it by 5e-6 rad at most, seen from the eye: 1/200 px in a window of 800 rows. `direction` of any length;
/// `half_curvature`: 1 / (2 R), 1/m; 0 or less: flat. Errors: those of cast_ray.
Result<std::optional<glm::dvec3>> cast_curved_ray(Ground& ground, const glm::dvec3& eye, const glm::dvec3& direction,
                                                  double half_curvature);

}  // namespace scree
