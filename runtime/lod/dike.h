// Dikes: the strips one cell wide between blocks that share nothing, zipped from whatever vertices the two sides drew,
// and the quads where four blocks meet. Sources: Ueng & Chuang (the dike); Scree lod, section 2 (zipper, C9; error of a
// strip, C10). Sides are lists of parameters: samples along the strip, 0 .. n. Pure functions; any thread.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "common/result.h"

namespace scree {

/// A triangle of a strip between sides A and B: its base joins vertices `base` and `base` + 1 of one side's list, its
/// apex is vertex `apex` of the other's.
struct ZipTriangle {
    bool on_b = false;  ///< the base lies on B
    std::int32_t base = 0;
    std::int32_t apex = 0;
    friend bool operator==(const ZipTriangle&, const ZipTriangle&) = default;
};

/// visit(on_b, base, apex) for every triangle, in order along the strip. Each edge of a side is a base once, each rung
/// is shared by two, and |A| + |B| - 2 triangles are all. Both lists rise strictly, with equal first and last, of two
/// vertices at least: not checked.
template <class Visit>
void walk_zipper(std::span<const std::int32_t> a, std::span<const std::int32_t> b, const Visit& visit) {
    std::size_t i = 0, j = 0;
    while (i + 1 < a.size() || j + 1 < b.size()) {
        const bool along_a = j + 1 == b.size() || (i + 1 < a.size() && a[i] + a[i + 1] <= b[j] + b[j + 1]);
        visit(!along_a, static_cast<std::int32_t>(along_a ? i : j), static_cast<std::int32_t>(along_a ? j : i));
        ++(along_a ? i : j);
    }
}

/// The same, checked. Errors: ErrorCode::input for a list of fewer than two, one that does not rise strictly, or lists
/// of different ends: triangles would be degenerate, reversed or missing.
Result<std::vector<ZipTriangle>> zip(std::span<const std::int32_t> a, std::span<const std::int32_t> b);

/// How a strip lies: A west and B east of it, parameters southward; or A north and B south, parameters eastward.
enum class DikeLie { between_west_and_east, between_north_and_south };

/// The base's first end, its second, and the apex, put in counter-clockwise order seen from above (x east, y north).
template <class Index>
std::array<Index, 3> counter_clockwise(DikeLie lie, bool on_b, Index first, Index second, Index apex) {
    const bool turn = on_b == (lie == DikeLie::between_west_and_east);
    return turn ? std::array<Index, 3>{second, first, apex} : std::array<Index, 3>{first, second, apex};
}

/// The two triangles of a corner quad, split from south-west to north-east as all full cells of strips are.
template <class Index>
std::array<std::array<Index, 3>, 2> corner_quad(Index north_west, Index north_east, Index south_west,
                                                Index south_east) {
    return {{{north_west, south_west, north_east}, {south_east, north_east, south_west}}};
}

/// Where a rung from A(ya) to B(yb) crosses an edge of the strip's full mesh, which are A(ja)-B(jb) with ja = jb or
/// ja = jb + 1: visit(t, ja, jb), 0 at A to 1 at B, ends apart.
template <class Visit>
void for_each_crossing(std::int32_t ya, std::int32_t yb, const Visit& visit) {
    if (ya == yb || ya == yb + 1) return;  // itself an edge of the full mesh
    const std::int32_t low = ya < yb ? ya : yb, high = ya < yb ? yb : ya;
    for (std::int32_t j = low + 1; j < high; ++j) visit(static_cast<double>(j - ya) / (yb - ya), j, j);
    for (std::int32_t j = low; j < high; ++j) {
        const double t = static_cast<double>(j + 1 - ya) / (yb - ya + 1);
        if (t > 0 && t < 1) visit(t, j + 1, j);
    }
}

/// How far the rung from A(ya) to B(yb) is above the full mesh at a crossing, metres; `a`, `b`: heights of all samples.
inline double crossing_error_m(std::span<const double> a, std::span<const double> b, std::int32_t ya, std::int32_t yb,
                               double t, std::int32_t ja, std::int32_t jb) {
    const auto at = [](std::span<const double> z, std::int32_t y) { return z[static_cast<std::size_t>(y)]; };
    return (1 - t) * (at(a, ya) - at(a, ja)) + t * (at(b, yb) - at(b, jb));
}

/// Estrip (Scree lod, C10's fix; only for the rungs that walk_zipper can draw): for each sample `mid` strictly between
/// the ends, the greatest error between the sides of any piece of the strip that spans mid's dyadic interval [mid - w,
/// mid + w], w its lowest bit, and has no vertex at mid on one side. Rounded up; 0 at the ends. Metres. `a`, `b`:
/// heights of the 2^k + 1 samples of each side.
void dike_errors(std::span<const double> a, std::span<const double> b, std::span<float> error_m);

/// w above: half of the length of mid's dyadic interval.
constexpr std::int32_t dyadic_half(std::int32_t mid) { return mid & -mid; }

}  // namespace scree
