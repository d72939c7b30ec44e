// Lines over the picture of a stage, as segments. Pure.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "runtime/render/line_renderer.h"
#include "runtime/view/camera.h"
#include "runtime/view/frustum.h"

namespace scree {

using Rgba = std::array<std::uint8_t, 4>;

void add_box(const Box& box, const Rgba& rgba, std::vector<LineSegment>& lines);
/// The edges of what a camera sees, as far as `reach_m`, and the frame of its picture there and at a quarter of it.
void add_frustum(const Camera& camera, double reach_m, const Rgba& rgba, std::vector<LineSegment>& lines);
/// As the curvature of the earth round an eye lowers them; long ones are cut, for they bend.
std::vector<LineSegment> lowered(std::span<const LineSegment> lines, const glm::dvec3& eye, double half_curvature);
/// Where a picture's pixel looks, unit length; pixels from the top left.
glm::dvec3 ray_through(const Camera& camera, const glm::dvec2& at_px);

}  // namespace scree
