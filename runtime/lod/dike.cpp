#include "runtime/lod/dike.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

namespace scree {
namespace {

Result<void> check_side(std::span<const std::int32_t> side, char name) {
    if (side.size() < 2)
        return Error{ErrorCode::input,
                     fmt::format("side {} of a dike has {} vertices: no strip joins fewer than 2", name, side.size())};
    for (std::size_t k = 1; k < side.size(); ++k)
        if (side[k] <= side[k - 1])
            return Error{ErrorCode::input,
                         fmt::format("side {} of a dike goes from {} to {}: its triangles would lie over one another",
                                     name, side[k - 1], side[k])};
    return {};
}

double rung_error(std::span<const double> a, std::span<const double> b, std::int32_t ya, std::int32_t yb) {
    double greatest = 0;
    for_each_crossing(ya, yb, [&](double t, std::int32_t ja, std::int32_t jb) {
        greatest = std::max(greatest, std::abs(crossing_error_m(a, b, ya, yb, t, ja, jb)));
    });
    return greatest;
}

float rounded_up(double value) {
    const auto f = static_cast<float>(value);
    return static_cast<double>(f) < value ? std::nextafter(f, std::numeric_limits<float>::infinity()) : f;
}

}  // namespace

Result<std::vector<ZipTriangle>> zip(std::span<const std::int32_t> a, std::span<const std::int32_t> b) {
    if (auto ok = check_side(a, 'A'); !ok) return ok.error();
    if (auto ok = check_side(b, 'B'); !ok) return ok.error();
    if (a.front() != b.front() || a.back() != b.back())
        return Error{ErrorCode::input,
                     fmt::format("the sides of a dike run from {} to {} and from {} to {}: a part would be open",
                                 a.front(), a.back(), b.front(), b.back())};
    std::vector<ZipTriangle> triangles;
    triangles.reserve(a.size() + b.size() - 2);
    walk_zipper(a, b, [&](bool on_b, std::int32_t base, std::int32_t apex) {
        triangles.push_back({on_b, base, apex});
    });
    return triangles;
}

void dike_errors(std::span<const double> a, std::span<const double> b, std::span<float> error_m) {
    assert(a.size() == b.size() && error_m.size() == a.size() && a.size() >= 2);
    const auto n = static_cast<std::int32_t>(a.size()) - 1;
    assert((n & (n - 1)) == 0);
    std::fill(error_m.begin(), error_m.end(), 0.0f);
    for (std::int32_t mid = 1; mid < n; ++mid) {
        const std::int32_t from = mid - dyadic_half(mid), to = mid + dyadic_half(mid);
        // All that the zipper draws there: where one side is a single edge and the other is split, it is split at mid,
        // and rungs go from each end of the edge to the other side's nearer half. Where neither is, one goes across.
        double greatest = rung_error(a, b, to, from);
        for (std::int32_t y = from; y <= to; ++y) {
            if (y <= mid) greatest = std::max({greatest, rung_error(a, b, from, y), rung_error(a, b, y, from)});
            if (y >= mid) greatest = std::max({greatest, rung_error(a, b, to, y), rung_error(a, b, y, to)});
        }
        error_m[static_cast<std::size_t>(mid)] = rounded_up(greatest);
    }
}

}  // namespace scree
