// See-through pixels: where the background shows in a drawn picture although terrain lies behind it.
#pragma once

#include <cstdint>
#include <span>

#include "common/query/ground.h"
#include "runtime/view/camera.h"

namespace scree {

/// Pixels of `picture` (RGB8, top row first) that are pure magenta, with terrain drawn somewhere above them in their
/// column, and whose ray and the rays `tolerance_px` pixels above and below it all meet the finest surface: a
/// silhouette may be off by the promised error, a hole may not be at all. With curvature the ray is bent instead of the
/// earth. Errors: those of the store.
Result<std::int64_t> count_see_through(Ground& ground, const Camera& camera, double half_curvature, double tolerance_px,
                                       std::span<const std::uint8_t> picture);

}  // namespace scree
