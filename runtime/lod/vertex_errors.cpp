#include "runtime/lod/vertex_errors.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

namespace scree {
namespace {

float rounded_up(double value) {
    const auto f = static_cast<float>(value);
    return static_cast<double>(f) < value ? std::nextafter(f, std::numeric_limits<float>::infinity()) : f;
}

struct Place {
    double x = 0, y = 0, z = 0;
};

class Block {
public:
    Block(const Bisection& bisection, std::span<const double> z, double spacing_m)
        : row_(bisection.row()), z_(z), spacing_m_(spacing_m) {}
    Place place(std::int32_t v) const {
        return {spacing_m_ * (v % row_), spacing_m_ * (v / row_), z_[static_cast<std::size_t>(v)]};
    }
    double distance(std::int32_t v, std::int32_t w) const {
        const Place a = place(v), b = place(w);
        const double dx = a.x - b.x, dy = a.y - b.y, dz = a.z - b.z;
        return std::sqrt(dx * dx + dy * dy + dz * dz);
    }

private:
    int row_;
    std::span<const double> z_;
    double spacing_m_;
};

// Greatest distance of the vertices in a triangle from its plane. The lattice points of a right-angled isosceles
// triangle are visited line by line, parallel to its hypotenuse where that lies along an axis, else along a leg.
class TriangleError {
public:
    TriangleError(const Bisection& bisection, std::span<const double> z) : row_(bisection.row()), z_(z) {}

    double operator()(const BisectionTriangle& t) const {
        const int il = t.left % row_, ir = t.right % row_;
        const int jl = t.left / row_, jr = t.right / row_;
        if (il == ir || jl == jr) return along_hypotenuse(t);
        return along_legs(t);
    }

private:
    double z(std::int32_t v) const { return z_[static_cast<std::size_t>(v)]; }

    // Legs of `steps` samples along the axes.
    double along_legs(const BisectionTriangle& t) const {
        const std::int32_t to_left = t.left - t.apex, to_right = t.right - t.apex;
        const int steps = std::abs(to_left) % row_ == 0 ? std::abs(to_left) / row_ : std::abs(to_left);
        const std::int32_t du = to_left / steps, dv = to_right / steps;
        const double za = z(t.apex), gu = (z(t.left) - za) / steps, gv = (z(t.right) - za) / steps;
        double greatest = 0;
        for (int u = 0; u <= steps; ++u)
            for (int v = 0; v <= steps - u; ++v)
                greatest = std::max(greatest, std::abs(z(t.apex + u * du + v * dv) - (za + u * gu + v * gv)));
        return greatest;
    }

    // The hypotenuse is 2 `steps` samples along an axis, the apex `steps` to its side.
    double along_hypotenuse(const BisectionTriangle& t) const {
        const std::int32_t middle = t.middle(), along = t.right - middle, aside = t.apex - middle;
        const int steps = std::abs(along) % row_ == 0 ? std::abs(along) / row_ : std::abs(along);
        const std::int32_t du = along / steps, dv = aside / steps;
        const double zm = (z(t.left) + z(t.right)) / 2, gu = (z(t.right) - z(t.left)) / (2 * steps),
                     gv = (z(t.apex) - zm) / steps;
        double greatest = 0;
        for (int v = 0; v <= steps; ++v)
            for (int u = v - steps; u <= steps - v; ++u)
                greatest = std::max(greatest, std::abs(z(middle + u * du + v * dv) - (zm + u * gu + v * gv)));
        return greatest;
    }

    int row_;
    std::span<const double> z_;
};

}  // namespace

void local_corrections(const Bisection& bisection, std::span<const double> z, std::span<float> delta) {
    assert(z.size() == bisection.vertex_count() && delta.size() == z.size());
    std::fill(delta.begin(), delta.end(), 0.0f);
    for (const std::int32_t v : bisection.coarse_to_fine()) {
        const auto [a, b] = bisection.vertex(v).ends;
        const double between = (z[static_cast<std::size_t>(a)] + z[static_cast<std::size_t>(b)]) / 2;
        delta[static_cast<std::size_t>(v)] = static_cast<float>(std::abs(z[static_cast<std::size_t>(v)] - between));
    }
}

void dropped_errors(const Bisection& bisection, std::span<const double> z, std::span<float> error) {
    assert(z.size() == bisection.vertex_count() && error.size() == z.size());
    std::fill(error.begin(), error.end(), 0.0f);
    const TriangleError error_of(bisection, z);
    for (const std::int32_t v : bisection.coarse_to_fine()) {
        const BisectionVertex& vertex = bisection.vertex(v);
        double greatest = 0;
        for (const std::int32_t apex : vertex.parents)
            if (apex >= 0) greatest = std::max(greatest, error_of({apex, vertex.ends[0], vertex.ends[1]}));
        error[static_cast<std::size_t>(v)] = rounded_up(greatest);
    }
}

void diamond_radii(const Bisection& bisection, std::span<const double> z, double spacing_m, double reach_m,
                   std::span<float> radius) {
    assert(z.size() == bisection.vertex_count() && radius.size() == z.size());
    std::fill(radius.begin(), radius.end(), 0.0f);
    const Block block(bisection, z, spacing_m);
    for (const std::int32_t v : bisection.coarse_to_fine()) {
        const BisectionVertex& vertex = bisection.vertex(v);
        double greatest = 0;
        for (const std::int32_t w : {vertex.ends[0], vertex.ends[1], vertex.parents[0], vertex.parents[1]})
            if (w >= 0) greatest = std::max(greatest, block.distance(v, w));
        radius[static_cast<std::size_t>(v)] = rounded_up(greatest + reach_m);
    }
}

void saturate(const Bisection& bisection, std::span<const double> z, double spacing_m, std::span<float> error,
              std::span<float> radius) {
    const Block block(bisection, z, spacing_m);
    const auto order = bisection.coarse_to_fine();
    for (std::size_t k = order.size(); k-- > 0;) {
        const std::int32_t v = order[k];
        double greatest = error[static_cast<std::size_t>(v)], reach = radius[static_cast<std::size_t>(v)];
        for (const std::int32_t child : bisection.vertex(v).children) {
            if (child < 0) break;
            const auto c = static_cast<std::size_t>(child);
            greatest = std::max(greatest, static_cast<double>(error[c]));
            reach = std::max(reach, block.distance(v, child) + static_cast<double>(radius[c]));
        }
        error[static_cast<std::size_t>(v)] = rounded_up(greatest);
        radius[static_cast<std::size_t>(v)] = rounded_up(reach);
    }
}

}  // namespace scree
