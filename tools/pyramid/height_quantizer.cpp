#include "tools/pyramid/height_quantizer.h"

#include <emmintrin.h>
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

// Doubles below 2^51 plus this have no bits left for a fraction: the sum is rounded, to even where halfway, as
// nearbyint does.
constexpr double kRounder = 6755399441055744.0;  // 1.5 * 2^52

// The same steps as HeightQuantizer::quantize and error_m, two values at a time.
class PairQuantizer {
public:
    explicit PairQuantizer(const HeightQuantizer& q)
        : scale_(_mm_set1_pd(q.scale)),
          offset_(_mm_set1_pd(q.offset_m)),
          height_offset_(_mm_set1_pd(q.height_offset_m)),
          quantum_(_mm_set1_pd(q.quantum_m)),
          inverse_(_mm_set1_pd(1 / q.quantum_m)) {
        int exponent = 0;
        // Powers of two, whose inverse is exact.
        exact_inverse_ = std::frexp(q.quantum_m, &exponent) == 0.5 && std::abs(exponent) < 1000;
    }

    void add(__m128d raw, std::int32_t* out) {
        const __m128d metres = _mm_add_pd(_mm_mul_pd(raw, scale_), offset_);
        const __m128d above = _mm_sub_pd(metres, height_offset_);
        __m128d n = exact_inverse_ ? _mm_mul_pd(above, inverse_) : _mm_div_pd(above, quantum_);
        n = _mm_min_pd(_mm_max_pd(n, _mm_set1_pd(-kMaxHeightUnits)), _mm_set1_pd(kMaxHeightUnits));
        n = _mm_sub_pd(_mm_add_pd(n, _mm_set1_pd(kRounder)), _mm_set1_pd(kRounder));
        low_ = _mm_min_pd(low_, n);
        high_ = _mm_max_pd(high_, n);
        const __m128d error = _mm_sub_pd(metres, _mm_add_pd(height_offset_, _mm_mul_pd(n, quantum_)));
        worst_ = _mm_max_pd(worst_, _mm_andnot_pd(_mm_set1_pd(-0.0), error));
        _mm_storel_epi64(reinterpret_cast<__m128i*>(out), _mm_cvttpd_epi32(n));
    }

    QuantizedRange range() const {
        return {static_cast<std::int32_t>(lesser(low_)), static_cast<std::int32_t>(greater(high_)), greater(worst_)};
    }

private:
    static double lesser(__m128d a) { return std::min(_mm_cvtsd_f64(a), _mm_cvtsd_f64(_mm_unpackhi_pd(a, a))); }
    static double greater(__m128d a) { return std::max(_mm_cvtsd_f64(a), _mm_cvtsd_f64(_mm_unpackhi_pd(a, a))); }

    __m128d scale_, offset_, height_offset_, quantum_, inverse_;
    bool exact_inverse_ = false;
    __m128d low_ = _mm_set1_pd(kMaxHeightUnits), high_ = _mm_set1_pd(-kMaxHeightUnits), worst_ = _mm_setzero_pd();
};

__m128d load_pair(const double* from) { return _mm_loadu_pd(from); }
__m128d load_pair(const float* from) {
    return _mm_cvtps_pd(_mm_castsi128_ps(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(from))));
}

template <class T>
QuantizedRange quantize_all(const HeightQuantizer& q, std::span<const T> raw, std::span<const std::uint8_t> valid,
                            std::span<std::int32_t> out) {
    PairQuantizer pairs(q);
    const std::size_t whole = raw.size() / 2 * 2;
    for (std::size_t i = 0; i < whole; i += 2) pairs.add(load_pair(raw.data() + i), out.data() + i);
    QuantizedRange range;
    if (valid.empty() && whole > 0) range = pairs.range();
    const auto include = [&](std::size_t i) {
        const auto value = static_cast<double>(raw[i]);
        range.include({out[i], out[i], q.error_m(value)});
    };
    if (whole < raw.size()) out[whole] = q.quantize(static_cast<double>(raw[whole]));
    if (valid.empty() && whole < raw.size()) include(whole);
    for (std::size_t i = 0; i < valid.size(); ++i)
        if (valid[i] != 0) include(i);
    return range;
}

}  // namespace

void QuantizedRange::include(const QuantizedRange& other) {
    min_n = std::min(min_n, other.min_n);
    max_n = std::max(max_n, other.max_n);
    worst_error_m = std::max(worst_error_m, other.worst_error_m);
}

QuantizedRange HeightQuantizer::quantize(std::span<const float> raw, std::span<const std::uint8_t> valid,
                                         std::span<std::int32_t> out) const {
    return quantize_all(*this, raw, valid, out);
}
QuantizedRange HeightQuantizer::quantize(std::span<const double> raw, std::span<const std::uint8_t> valid,
                                         std::span<std::int32_t> out) const {
    return quantize_all(*this, raw, valid, out);
}

std::int32_t HeightQuantizer::quantize(double raw) const {
    // The clamp may come before the rounding: its ends are integers.
    const double n = std::clamp<double>((metres(raw) - height_offset_m) / quantum_m, -kMaxHeightUnits, kMaxHeightUnits);
    return static_cast<std::int32_t>(n + kRounder - kRounder);
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
