#include "runtime/app/see_through.h"

#include <algorithm>
#include <cmath>

namespace scree {
namespace {

/// Over so many metres a ray is taken as straight: the earth bends by 2 cm.
constexpr double kStraight_m = 1000;

bool is_magenta(const std::uint8_t* p) { return p[0] == 255 && p[1] == 0 && p[2] == 255; }

class RayTest {
public:
    RayTest(Ground& ground, const Camera& camera, double half_curvature)
        : ground_(ground), camera_(camera), half_curvature_(half_curvature) {
        const Lattice& l = ground.dataset().lattice;
        const double width = static_cast<double>(l.cells_x) * l.spacing_m,
                     depth = static_cast<double>(l.cells_y) * l.spacing_m;
        const glm::dvec2 middle{l.x_m(0) + width / 2, l.y_m(0) - depth / 2};
        reach_m_ = glm::length(middle - glm::dvec2(camera.eye)) + std::hypot(width, depth);
        below_m_ = std::max(0.0, camera.eye.z - ground.dataset().min_height_m);
    }

    // Does the ray through a point of the picture, in pixels from its top left corner, meet the ground?
    Result<bool> meets(double x_px, double y_px) const {
        const double across = (2 * x_px / camera_.width_px - 1) * camera_.tan_half_x();
        const double up = (1 - 2 * y_px / camera_.height_px) * camera_.tan_half_y();
        const glm::dvec3 direction = glm::normalize(camera_.forward + across * camera_.right() + up * camera_.up);
        const double level = glm::length(glm::dvec2(direction));
        if (half_curvature_ <= 0 || level < 1e-6) return hits(camera_.eye, direction, 2 * reach_m_ + below_m_);
        // On a flat earth the same ray rises by d^2 / 2R.
        const auto at = [&](double t) {
            const double d = t * level;
            return camera_.eye + t * direction + glm::dvec3(0, 0, d * d * half_curvature_);
        };
        for (double t = 0; t * level < reach_m_; t += kStraight_m / level) {
            const glm::dvec3 from = at(t), to = at(t + kStraight_m / level);
            auto hit = hits(from, to - from, glm::length(to - from));
            if (!hit || *hit) return hit;
        }
        return false;
    }

private:
    Result<bool> hits(glm::dvec3 from, glm::dvec3 direction, double distance_m) const {
        auto hit = ground_.cast_ray({from.x, from.y, from.z}, {direction.x, direction.y, direction.z}, distance_m);
        if (!hit) return hit.error();
        return hit->has_value();
    }

    Ground& ground_;
    const Camera& camera_;
    double half_curvature_;
    double reach_m_ = 0;  ///< furthest that terrain is from the eye, in plan
    double below_m_ = 0;  ///< and in height, below it
};

}  // namespace

Result<std::int64_t> count_see_through(Ground& ground, const Camera& camera, double half_curvature, double tolerance_px,
                                       std::span<const std::uint8_t> picture) {
    const RayTest ray(ground, camera, half_curvature);
    const auto width = static_cast<std::size_t>(camera.width_px), height = static_cast<std::size_t>(camera.height_px);
    std::int64_t count = 0;
    for (std::size_t x = 0; x < width; ++x) {
        bool below = false;
        for (std::size_t y = 0; y < height; ++y) {
            if (!is_magenta(&picture[3 * (y * width + x)])) {
                below = true;
                continue;
            }
            if (!below) continue;
            bool behind = true;
            for (const double offset : {0.0, -tolerance_px, tolerance_px}) {
                auto met = ray.meets(static_cast<double>(x) + 0.5, static_cast<double>(y) + 0.5 + offset);
                if (!met) return met.error();
                behind = behind && *met;
                if (!behind) break;
            }
            count += behind ? 1 : 0;
        }
    }
    return count;
}

}  // namespace scree
