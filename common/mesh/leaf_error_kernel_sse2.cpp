// Kernel of leaf_errors, 4 tiles side by side.
#include <emmintrin.h>

#include "common/mesh/leaf_error_kernel.h"

namespace scree {
namespace {

using Ints = __m128i;
using Shift = __m128i;

constexpr int kLanes = 4;

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

#include "common/mesh/leaf_error_kernel_body.h"

}  // namespace

void leaf_error_kernel_sse2(const int32_t* samples, const int32_t* present, int tile_cells_log2, int32_t* worst) {
    run_kernel(samples, present, tile_cells_log2, worst);
}

}  // namespace scree
