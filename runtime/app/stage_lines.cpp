#include "runtime/app/stage_lines.h"

#include <algorithm>
#include <cmath>

namespace scree {
namespace {

// A chord of so much lies 0.03 m below the arc.
constexpr double kLongestChord_m = 1250;
constexpr int kMostChords = 64;

glm::dvec3 corner_of(const Box& box, int corner) {
    return {(corner & 1) != 0 ? box.high.x : box.low.x, (corner & 2) != 0 ? box.high.y : box.low.y,
            (corner & 4) != 0 ? box.high.z : box.low.z};
}

glm::dvec3 lowered(glm::dvec3 point, const glm::dvec3& eye, double half_curvature) {
    const double x = point.x - eye.x, y = point.y - eye.y;
    point.z -= (x * x + y * y) * half_curvature;
    return point;
}

std::array<glm::dvec3, 4> picture_frame(const Camera& camera, double distance_m) {
    std::array<glm::dvec3, 4> corners;
    const double w = camera.width_px, h = camera.height_px;
    const std::array<glm::dvec2, 4> pixels{{{0, 0}, {w, 0}, {w, h}, {0, h}}};
    for (std::size_t k = 0; k < 4; ++k) {
        const glm::dvec3 ray = ray_through(camera, pixels[k]);
        corners[k] = camera.eye + ray * (distance_m / glm::dot(ray, camera.forward));
    }
    return corners;
}

}  // namespace

void add_box(const Box& box, const Rgba& rgba, std::vector<LineSegment>& lines) {
    for (int corner = 0; corner < 8; ++corner)
        for (const int axis : {1, 2, 4})
            if ((corner & axis) == 0) lines.push_back({corner_of(box, corner), corner_of(box, corner | axis), rgba});
}

void add_frustum(const Camera& camera, double reach_m, const Rgba& rgba, std::vector<LineSegment>& lines) {
    const auto far = picture_frame(camera, reach_m), near = picture_frame(camera, reach_m / 4);
    for (std::size_t k = 0; k < 4; ++k) {
        lines.push_back({camera.eye, far[k], rgba});
        lines.push_back({far[k], far[(k + 1) % 4], rgba});
        lines.push_back({near[k], near[(k + 1) % 4], rgba});
    }
}

std::vector<LineSegment> lowered(std::span<const LineSegment> lines, const glm::dvec3& eye, double half_curvature) {
    if (half_curvature == 0) return {lines.begin(), lines.end()};
    std::vector<LineSegment> bent;
    for (const LineSegment& line : lines) {
        const double length_m = glm::length(glm::dvec2(line.to - line.from));
        const int chords = std::clamp(static_cast<int>(std::ceil(length_m / kLongestChord_m)), 1, kMostChords);
        for (int k = 0; k < chords; ++k) {
            const glm::dvec3 from = glm::mix(line.from, line.to, static_cast<double>(k) / chords),
                             to = glm::mix(line.from, line.to, (k + 1.0) / chords);
            bent.push_back({lowered(from, eye, half_curvature), lowered(to, eye, half_curvature), line.rgba});
        }
    }
    return bent;
}

glm::dvec3 ray_through(const Camera& camera, const glm::dvec2& at_px) {
    const double x = 2 * at_px.x / camera.width_px - 1, y = 1 - 2 * at_px.y / camera.height_px;
    return glm::normalize(camera.forward + camera.right() * (x * camera.tan_half_x()) +
                          camera.up * (y * camera.tan_half_y()));
}

}  // namespace scree
