#include "tools/pyramid/height_quantizer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/height_tile.h"

namespace scree {
namespace {

constexpr double kDefaultQuantum = 1.0 / 64;
constexpr double kGreatestHeight = 1e7;

bool fits(const HeightQuantizer& q, double low_m, double high_m) {
    return std::abs((low_m - q.height_offset_m) / q.quantum_m) <= kMaxHeightUnits - 1 &&
           std::abs((high_m - q.height_offset_m) / q.quantum_m) <= kMaxHeightUnits - 1;
}

}  // namespace

std::int32_t HeightQuantizer::quantize(double raw) const {
    const double n = std::nearbyint((metres(raw) - height_offset_m) / quantum_m);
    return static_cast<std::int32_t>(std::clamp<double>(n, -kMaxHeightUnits, kMaxHeightUnits));
}

double HeightQuantizer::error_m(double raw) const {
    return std::abs(metres(raw) - (height_offset_m + quantize(raw) * quantum_m));
}

Result<HeightQuantizer> choose_quantizer(const QuantizerInput& in) {
    HeightQuantizer q{in.scale, in.offset_m, in.offset_m, 1};
    const double low = q.metres(in.min_raw), high = q.metres(in.max_raw);
    if (!(std::abs(low) <= kGreatestHeight && std::abs(high) <= kGreatestHeight))
        return Error{
            ErrorCode::input,
            fmt::format("heights reach from {} to {} m, beyond 1e7 m: an undeclared nodata value, or the wrong "
                        "--height-scale",
                        low, high)};
    if (in.quantum_m) {
        q.quantum_m = *in.quantum_m;
        if (!fits(q, low, high))
            q.height_offset_m +=
                std::nearbyint((low + high) / 2 / q.quantum_m - in.offset_m / q.quantum_m) * q.quantum_m;
        if (!fits(q, low, high))
            return Error{ErrorCode::usage,
                         fmt::format("--height-quantum {} m cannot hold heights from {} to {} m in 23 bits",
                                     *in.quantum_m, low, high)};
        return q;
    }
    q.quantum_m = in.integer_source ? in.scale : kDefaultQuantum;
    if (!in.integer_source) q.height_offset_m = 0;
    while (!fits(q, low, high)) {
        HeightQuantizer centred = q;
        centred.height_offset_m += std::nearbyint(((low + high) / 2 - q.height_offset_m) / q.quantum_m) * q.quantum_m;
        if (fits(centred, low, high)) return centred;
        q.quantum_m *= 2;
    }
    return q;
}

}  // namespace scree
