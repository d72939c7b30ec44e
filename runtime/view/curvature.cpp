#include "runtime/view/curvature.h"

#include <algorithm>
#include <cmath>

namespace scree {
namespace {

constexpr double kVisible_px = 0.1;

}  // namespace

std::optional<Curvature> curvature_from(const std::string& text) {
    if (text == "auto") return Curvature::automatic;
    if (text == "on") return Curvature::on;
    if (text == "off") return Curvature::off;
    return std::nullopt;
}

double half_curvature(Curvature curvature, const Dataset& dataset, const Camera& camera) {
    constexpr double kOn = 0.5 / kEarthRadius_m;
    if (curvature == Curvature::on) return kOn;
    if (curvature == Curvature::off) return 0;
    const Lattice& l = dataset.lattice;
    const double east =
        std::max(std::abs(l.x_m(0) - camera.eye.x), std::abs(l.x_m(static_cast<double>(l.cells_x)) - camera.eye.x));
    const double north =
        std::max(std::abs(l.y_m(0) - camera.eye.y), std::abs(l.y_m(static_cast<double>(l.cells_y)) - camera.eye.y));
    // A drop of d^2 / 2R is seen from d away.
    return camera.focal_px() * std::hypot(east, north) * kOn > kVisible_px ? kOn : 0;
}

}  // namespace scree
