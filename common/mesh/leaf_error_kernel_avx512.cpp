// Kernel of leaf_errors, 16 tiles side by side.
#include <immintrin.h>

#include "common/mesh/leaf_error_kernel.h"

namespace scree {
namespace {

using Ints = __m512i;
using Shift = __m128i;

constexpr int kLanes = 16;

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

#include "common/mesh/leaf_error_kernel_body.h"

}  // namespace

void leaf_error_kernel_avx512(const int32_t* samples, const int32_t* present, int tile_cells_log2, int32_t* worst) {
    run_kernel(samples, present, tile_cells_log2, worst);
}

}  // namespace scree
