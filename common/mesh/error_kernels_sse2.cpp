// Error kernels, 4 tiles or 2 vertices side by side.
#include <emmintrin.h>

#include "common/mesh/error_kernels.h"

namespace scree {
namespace {

using Ints = __m128i;
using Shift = __m128i;
using Doubles = __m128d;

constexpr int kLanes = 4;
constexpr int kDoubles = 2;

inline Ints load(const int32_t* from) { return _mm_loadu_si128(reinterpret_cast<const __m128i*>(from)); }
inline void store(int32_t* to, Ints a) { _mm_storeu_si128(reinterpret_cast<__m128i*>(to), a); }
inline Ints zero() { return _mm_setzero_si128(); }
inline Ints add(Ints a, Ints b) { return _mm_add_epi32(a, b); }
inline Ints subtract(Ints a, Ints b) { return _mm_sub_epi32(a, b); }
inline Ints both(Ints a, Ints b) { return _mm_and_si128(a, b); }
inline Shift shift_by(int bits) { return _mm_cvtsi32_si128(bits); }
inline Ints shift_left(Ints a, Shift bits) { return _mm_sll_epi32(a, bits); }
inline Ints half(Ints a) { return _mm_srai_epi32(a, 1); }
inline Ints choose(Ints mask, Ints a, Ints b) {
    return _mm_or_si128(_mm_and_si128(mask, a), _mm_andnot_si128(mask, b));
}
inline Ints minimum(Ints a, Ints b) { return choose(_mm_cmpgt_epi32(b, a), a, b); }
inline Ints maximum(Ints a, Ints b) { return choose(_mm_cmpgt_epi32(a, b), a, b); }

inline Doubles splat(double a) { return _mm_set1_pd(a); }
inline Doubles counting() { return _mm_set_pd(1, 0); }
inline Doubles to_doubles(const int32_t* from) {
    return _mm_cvtepi32_pd(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(from)));
}
inline void store(double* to, Doubles a) { _mm_storeu_pd(to, a); }
inline Doubles add(Doubles a, Doubles b) { return _mm_add_pd(a, b); }
inline Doubles subtract(Doubles a, Doubles b) { return _mm_sub_pd(a, b); }
inline Doubles multiply(Doubles a, Doubles b) { return _mm_mul_pd(a, b); }
inline Doubles minimum(Doubles a, Doubles b) { return _mm_min_pd(a, b); }
inline Doubles maximum(Doubles a, Doubles b) { return _mm_max_pd(a, b); }
inline Doubles zero_outside(Doubles a, Doubles at, Doubles first, Doubles last) {
    return _mm_and_pd(a, _mm_and_pd(_mm_cmpge_pd(at, first), _mm_cmple_pd(at, last)));
}

#include "common/mesh/error_kernels_body.h"

}  // namespace

const ErrorKernels kErrorKernelsSse2{leaf_errors_of, distance_from_plane};

}  // namespace scree
