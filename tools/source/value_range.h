// The range of many values at once: what rows of heights are asked most often.
#pragma once

#include <emmintrin.h>

#include <algorithm>
#include <cstddef>
#include <limits>
#include <span>

namespace scree {

/// Over the values that are no NaN; low > high where there are none.
template <class T>
struct ValueRange {
    T low = std::numeric_limits<T>::infinity(), high = -std::numeric_limits<T>::infinity();
    bool all_finite = true;
};

namespace value_range_detail {

// Vectors of SSE2, which every x86-64 has. Their minimum and maximum give the second operand where one is NaN.
struct Floats {
    using Value = float;
    using Vector = __m128;
    static constexpr std::size_t kLanes = 4;
    static Vector load(const float* from) { return _mm_loadu_ps(from); }
    static void store(float* to, Vector a) { _mm_storeu_ps(to, a); }
    static Vector splat(float a) { return _mm_set1_ps(a); }
    static Vector minimum(Vector a, Vector b) { return _mm_min_ps(a, b); }
    static Vector maximum(Vector a, Vector b) { return _mm_max_ps(a, b); }
    static Vector magnitude(Vector a) { return _mm_andnot_ps(_mm_set1_ps(-0.0F), a); }
    static Vector not_at_most(Vector a, Vector b) { return _mm_cmpnle_ps(a, b); }
    static Vector either(Vector a, Vector b) { return _mm_or_ps(a, b); }
    static bool any(Vector mask) { return _mm_movemask_ps(mask) != 0; }
};
struct Doubles {
    using Value = double;
    using Vector = __m128d;
    static constexpr std::size_t kLanes = 2;
    static Vector load(const double* from) { return _mm_loadu_pd(from); }
    static void store(double* to, Vector a) { _mm_storeu_pd(to, a); }
    static Vector splat(double a) { return _mm_set1_pd(a); }
    static Vector minimum(Vector a, Vector b) { return _mm_min_pd(a, b); }
    static Vector maximum(Vector a, Vector b) { return _mm_max_pd(a, b); }
    static Vector magnitude(Vector a) { return _mm_andnot_pd(_mm_set1_pd(-0.0), a); }
    static Vector not_at_most(Vector a, Vector b) { return _mm_cmpnle_pd(a, b); }
    static Vector either(Vector a, Vector b) { return _mm_or_pd(a, b); }
    static bool any(Vector mask) { return _mm_movemask_pd(mask) != 0; }
};

// Two vectors at a time: a minimum takes four cycles, and two are under way at once.
template <class V>
ValueRange<typename V::Value> range_of(std::span<const typename V::Value> values) {
    using T = typename V::Value;
    constexpr std::size_t kStep = 2 * V::kLanes;
    constexpr T kGreatest = std::numeric_limits<T>::max();
    ValueRange<T> range;
    auto low = V::splat(range.low), low2 = low, high = V::splat(range.high), high2 = high, odd = V::splat(0);
    const auto greatest = V::splat(kGreatest);
    const std::size_t whole = values.size() / kStep * kStep;
    for (std::size_t i = 0; i < whole; i += kStep) {
        const auto a = V::load(values.data() + i), b = V::load(values.data() + i + V::kLanes);
        low = V::minimum(a, low);
        high = V::maximum(a, high);
        low2 = V::minimum(b, low2);
        high2 = V::maximum(b, high2);
        odd = V::either(odd, V::not_at_most(V::magnitude(a), greatest));
        odd = V::either(odd, V::not_at_most(V::magnitude(b), greatest));
    }
    range.all_finite = !V::any(odd);
    T lows[V::kLanes], highs[V::kLanes];
    V::store(lows, V::minimum(low, low2));
    V::store(highs, V::maximum(high, high2));
    range.low = *std::min_element(lows, lows + V::kLanes);
    range.high = *std::max_element(highs, highs + V::kLanes);
    for (const T v : values.subspan(whole)) {
        range.low = v < range.low ? v : range.low;
        range.high = v > range.high ? v : range.high;
        range.all_finite = range.all_finite && v >= -kGreatest && v <= kGreatest;
    }
    return range;
}

}  // namespace value_range_detail

inline ValueRange<float> range_of_values(std::span<const float> values) {
    return value_range_detail::range_of<value_range_detail::Floats>(values);
}
inline ValueRange<double> range_of_values(std::span<const double> values) {
    return value_range_detail::range_of<value_range_detail::Doubles>(values);
}

}  // namespace scree
