#include "runtime/view/four_boxes.h"

#include <cmath>
#include <cstring>

namespace scree {
namespace {

// Two registers of SSE2, or one of AVX2: the operations are the same, and so are the bits.
using Four = double __attribute__((vector_size(32)));
using FourBits = long long __attribute__((vector_size(32)));

[[gnu::always_inline]] inline void load(Four& to, const std::array<double, 4>& from) {
    std::memcpy(&to, from.data(), sizeof to);
}

// As std::max: of equals, or where either is no number, the first.
[[gnu::always_inline]] inline void raise_to(Four& a, const Four& b) { a = a < b ? b : a; }

[[gnu::always_inline]] inline unsigned bits_of(const FourBits& lanes) {
    unsigned bits = 0;
    for (int k = 0; k < 4; ++k) bits |= lanes[k] != 0 ? 1u << k : 0;
    return bits;
}

[[gnu::always_inline]] inline void see(const Frustum& frustum, const FourBoxes& boxes, double half_curvature,
                                       double near_m, bool inside, FourSeen& out) {
    const glm::dvec3 eye = frustum.eye();
    const Four zero{};
    Four west, east, south, north, low, high;
    load(west, boxes.west);
    load(east, boxes.east);
    load(south, boxes.south);
    load(north, boxes.north);
    load(low, boxes.low);
    load(high, boxes.high);
    if (half_curvature > 0) {
        const Four x0 = west - eye.x, x1 = east - eye.x, y0 = south - eye.y, y1 = north - eye.y;
        const Four near_x = zero < x0 ? x0 : (x1 < zero ? x1 : zero), near_y = zero < y0 ? y0 : (y1 < zero ? y1 : zero);
        Four far_x = -x0, far_y = -y0;
        raise_to(far_x, x1);
        raise_to(far_y, y1);
        low -= (far_x * far_x + far_y * far_y) * half_curvature;
        high -= (near_x * near_x + near_y * near_y) * half_curvature;
    }
    out.none = 0;
    out.all = 15;
    if (!inside) {
        const Four x = 0.5 * (west + east) - eye.x, y = 0.5 * (south + north) - eye.y, z = 0.5 * (low + high) - eye.z;
        const Four half_x = 0.5 * (east - west), half_y = 0.5 * (north - south), half_z = 0.5 * (high - low);
        FourBits seen = ~FourBits{}, all = ~FourBits{};
        for (int plane = 0; plane < Frustum::kPlanes; ++plane) {
            const glm::dvec3 n = frustum.normal(plane), reach = frustum.reach(plane);
            Four depth = n.x * x + n.y * y + n.z * z;
            if (plane == 0) depth -= frustum.near_m();
            const Four span = reach.x * half_x + reach.y * half_y + reach.z * half_z;
            seen &= depth + span >= zero;
            all &= depth >= span;
        }
        out.none = ~bits_of(seen) & 15u;
        out.all = bits_of(all) & ~out.none;
    }
    Four gap_x = west - eye.x, gap_y = south - eye.y, gap_z = low - eye.z;
    raise_to(gap_x, zero);
    raise_to(gap_x, eye.x - east);
    raise_to(gap_y, zero);
    raise_to(gap_y, eye.y - north);
    raise_to(gap_z, zero);
    raise_to(gap_z, eye.z - high);
    const Four squares = gap_x * gap_x + gap_y * gap_y + gap_z * gap_z;
    for (std::size_t k = 0; k < 4; ++k) out.distance_m[k] = std::max(std::sqrt(squares[static_cast<int>(k)]), near_m);
}

void see_sse2(const Frustum& f, const FourBoxes& b, double c, double n, bool i, FourSeen& out) {
    see(f, b, c, n, i, out);
}

#if defined(__x86_64__)
[[gnu::target("avx2")]] void see_avx2(const Frustum& f, const FourBoxes& b, double c, double n, bool i, FourSeen& out) {
    see(f, b, c, n, i, out);
}
#endif

using See = void (*)(const Frustum&, const FourBoxes&, double, double, bool, FourSeen&);

See best() {
#if defined(__x86_64__)
    if (__builtin_cpu_supports("avx2")) return see_avx2;
#endif
    return see_sse2;
}

}  // namespace

FourSeen see_four(const Frustum& frustum, const FourBoxes& boxes, double half_curvature, double near_m, bool inside) {
    static const See kSee = best();
    FourSeen out;
    kSee(frustum, boxes, half_curvature, near_m, inside, out);
    return out;
}

}  // namespace scree
