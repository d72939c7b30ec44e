// Error kernels, 8 tiles or 4 vertices side by side.
#include <immintrin.h>

#include "common/mesh/error_kernels.h"

namespace scree {
namespace {

using Ints = __m256i;
using Shift = __m128i;
using Doubles = __m256d;

constexpr int kLanes = 8;
constexpr int kDoubles = 4;

inline Ints load(const int32_t* from) { return _mm256_loadu_si256(reinterpret_cast<const __m256i*>(from)); }
inline void store(int32_t* to, Ints a) { _mm256_storeu_si256(reinterpret_cast<__m256i*>(to), a); }
inline Ints zero() { return _mm256_setzero_si256(); }
inline Ints add(Ints a, Ints b) { return _mm256_add_epi32(a, b); }
inline Ints subtract(Ints a, Ints b) { return _mm256_sub_epi32(a, b); }
inline Ints both(Ints a, Ints b) { return _mm256_and_si256(a, b); }
inline Shift shift_by(int bits) { return _mm_cvtsi32_si128(bits); }
inline Ints shift_left(Ints a, Shift bits) { return _mm256_sll_epi32(a, bits); }
inline Ints half(Ints a) { return _mm256_srai_epi32(a, 1); }
inline Ints minimum(Ints a, Ints b) { return _mm256_min_epi32(a, b); }
inline Ints maximum(Ints a, Ints b) { return _mm256_max_epi32(a, b); }

inline Doubles splat(double a) { return _mm256_set1_pd(a); }
inline Doubles counting() { return _mm256_set_pd(3, 2, 1, 0); }
inline Doubles to_doubles(const int32_t* from) {
    return _mm256_cvtepi32_pd(_mm_loadu_si128(reinterpret_cast<const __m128i*>(from)));
}
inline void store(double* to, Doubles a) { _mm256_storeu_pd(to, a); }
inline Doubles add(Doubles a, Doubles b) { return _mm256_add_pd(a, b); }
inline Doubles subtract(Doubles a, Doubles b) { return _mm256_sub_pd(a, b); }
inline Doubles multiply(Doubles a, Doubles b) { return _mm256_mul_pd(a, b); }
inline Doubles minimum(Doubles a, Doubles b) { return _mm256_min_pd(a, b); }
inline Doubles maximum(Doubles a, Doubles b) { return _mm256_max_pd(a, b); }
inline Doubles zero_outside(Doubles a, Doubles at, Doubles first, Doubles last) {
    return _mm256_and_pd(a, _mm256_and_pd(_mm256_cmp_pd(at, first, _CMP_GE_OQ), _mm256_cmp_pd(at, last, _CMP_LE_OQ)));
}

#include "common/mesh/error_kernels_body.h"

}  // namespace

const ErrorKernels kErrorKernelsAvx2{leaf_errors_of, distance_from_plane};

}  // namespace scree
