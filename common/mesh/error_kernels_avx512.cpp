// Error kernels, 16 tiles or 8 vertices side by side.
#include <immintrin.h>

#include "common/mesh/error_kernels.h"

namespace scree {
namespace {

using Ints = __m512i;
using Shift = __m128i;
using Doubles = __m512d;

constexpr int kLanes = 16;
constexpr int kDoubles = 8;

inline Ints load(const int32_t* from) { return _mm512_loadu_si512(from); }
inline void store(int32_t* to, Ints a) { _mm512_storeu_si512(to, a); }
inline Ints zero() { return _mm512_setzero_si512(); }
inline Ints add(Ints a, Ints b) { return _mm512_add_epi32(a, b); }
inline Ints subtract(Ints a, Ints b) { return _mm512_sub_epi32(a, b); }
inline Ints both(Ints a, Ints b) { return _mm512_and_si512(a, b); }
inline Shift shift_by(int bits) { return _mm_cvtsi32_si128(bits); }
inline Ints shift_left(Ints a, Shift bits) { return _mm512_sll_epi32(a, bits); }
inline Ints half(Ints a) { return _mm512_srai_epi32(a, 1); }
inline Ints minimum(Ints a, Ints b) { return _mm512_min_epi32(a, b); }
inline Ints maximum(Ints a, Ints b) { return _mm512_max_epi32(a, b); }

inline Doubles splat(double a) { return _mm512_set1_pd(a); }
inline Doubles counting() { return _mm512_set_pd(7, 6, 5, 4, 3, 2, 1, 0); }
inline Doubles to_doubles(const int32_t* from) {
    return _mm512_cvtepi32_pd(_mm256_loadu_si256(reinterpret_cast<const __m256i*>(from)));
}
inline void store(double* to, Doubles a) { _mm512_storeu_pd(to, a); }
inline Doubles add(Doubles a, Doubles b) { return _mm512_add_pd(a, b); }
inline Doubles subtract(Doubles a, Doubles b) { return _mm512_sub_pd(a, b); }
inline Doubles multiply(Doubles a, Doubles b) { return _mm512_mul_pd(a, b); }
inline Doubles minimum(Doubles a, Doubles b) { return _mm512_min_pd(a, b); }
inline Doubles maximum(Doubles a, Doubles b) { return _mm512_max_pd(a, b); }
inline Doubles zero_outside(Doubles a, Doubles at, Doubles first, Doubles last) {
    const __mmask8 inside = _mm512_cmp_pd_mask(at, first, _CMP_GE_OQ) & _mm512_cmp_pd_mask(at, last, _CMP_LE_OQ);
    return _mm512_maskz_mov_pd(inside, a);
}

#include "common/mesh/error_kernels_body.h"

}  // namespace

const ErrorKernels kErrorKernelsAvx512{leaf_errors_of, distance_from_plane};

}  // namespace scree
