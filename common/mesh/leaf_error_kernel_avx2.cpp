// Kernel of leaf_errors, 8 tiles side by side.
#include <immintrin.h>

#include "common/mesh/leaf_error_kernel.h"

namespace scree {
namespace {

using Ints = __m256i;
using Shift = __m128i;

constexpr int kLanes = 8;

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

#include "common/mesh/leaf_error_kernel_body.h"

}  // namespace

void leaf_error_kernel_avx2(const int32_t* samples, const int32_t* present, int tile_cells_log2, int32_t* worst) {
    run_kernel(samples, present, tile_cells_log2, worst);
}

}  // namespace scree
