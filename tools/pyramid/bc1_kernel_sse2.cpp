// BC1 kernel, 4 blocks side by side. SSE2 is part of every x86-64.
#include <emmintrin.h>

#include "tools/pyramid/bc1_kernel.h"

namespace scree {
namespace {

using Ints = __m128i;  // one 32-bit lane a block; as 16-bit halves: two texels of it
using Floats = __m128;

constexpr size_t kLanes = 4;

inline Ints splat(int value) { return _mm_set1_epi32(value); }
inline Floats splat(float value) { return _mm_set1_ps(value); }
inline Ints zero() { return _mm_setzero_si128(); }
inline Ints load(const uint8_t* p) { return _mm_loadu_si128(reinterpret_cast<const __m128i*>(p)); }
inline Ints first_of_16_bytes(Ints a) { return _mm_shuffle_epi32(a, 0); }
inline bool is_zero(Ints a) { return _mm_movemask_epi8(_mm_cmpeq_epi8(a, _mm_setzero_si128())) == 0xFFFF; }
inline Ints add16(Ints a, Ints b) { return _mm_add_epi16(a, b); }
inline Ints sub16(Ints a, Ints b) { return _mm_sub_epi16(a, b); }
inline Ints mul_low16(Ints a, Ints b) { return _mm_mullo_epi16(a, b); }
inline Ints add32(Ints a, Ints b) { return _mm_add_epi32(a, b); }
inline Ints min16(Ints a, Ints b) { return _mm_min_epi16(a, b); }
inline Ints max16(Ints a, Ints b) { return _mm_max_epi16(a, b); }
inline Ints mul_add_pairs(Ints a, Ints b) { return _mm_madd_epi16(a, b); }
inline Ints add_products(Ints sum, Ints a, Ints b) { return add32(sum, mul_add_pairs(a, b)); }
/// The product over 2^15, rounded to nearest: SSSE3's pmulhrsw.
inline Ints mul_round16(Ints a, Ints b) {
    const Ints low = _mm_mullo_epi16(a, b);
    const Ints high = _mm_mulhi_epi16(a, b);
    const Ints down = _mm_or_si128(_mm_slli_epi16(high, 1), _mm_srli_epi16(low, 15));
    return _mm_add_epi16(down, _mm_and_si128(_mm_srli_epi16(low, 14), _mm_set1_epi16(1)));
}
template <int kBits>
inline Ints shift_left16(Ints a) {
    return _mm_slli_epi16(a, kBits);
}
template <int kBits>
inline Ints shift_right16(Ints a) {
    return _mm_srli_epi16(a, kBits);
}
template <int kBits>
inline Ints shift_left32(Ints a) {
    return _mm_slli_epi32(a, kBits);
}
template <int kBits>
inline Ints shift_right32(Ints a) {
    return _mm_srli_epi32(a, kBits);
}
template <int kBits>
inline Ints shift_right_signed32(Ints a) {
    return _mm_srai_epi32(a, kBits);
}
template <int kBits>
inline Ints shift_right_signed16(Ints a) {
    return _mm_srai_epi16(a, kBits);
}
inline Floats to_floats(Ints a) { return _mm_cvtepi32_ps(a); }
inline Ints truncate(Floats a) { return _mm_cvttps_epi32(a); }
inline Floats minimum(Floats a, Floats b) { return _mm_min_ps(a, b); }
inline Floats maximum(Floats a, Floats b) { return _mm_max_ps(a, b); }
inline Floats magnitude(Floats a) { return _mm_andnot_ps(_mm_set1_ps(-0.0F), a); }
inline Floats square_root(Floats a) { return _mm_sqrt_ps(a); }

using Mask = __m128;
inline Mask less(Floats a, Floats b) { return _mm_cmplt_ps(a, b); }
inline Mask less32(Ints a, Ints b) { return _mm_castsi128_ps(_mm_cmplt_epi32(a, b)); }
inline Mask equal32(Ints a, Ints b) { return _mm_castsi128_ps(_mm_cmpeq_epi32(a, b)); }
inline Floats select(Mask m, Floats yes, Floats no) { return _mm_or_ps(_mm_and_ps(m, yes), _mm_andnot_ps(m, no)); }
inline Ints select(Mask m, Ints yes, Ints no) {
    return _mm_castps_si128(select(m, _mm_castsi128_ps(yes), _mm_castsi128_ps(no)));
}
inline unsigned lane_bits(Mask m) { return static_cast<unsigned>(_mm_movemask_ps(m)); }
/// Bit k stands for this block of the group.
constexpr uint8_t kBlockOfLane[kLanes] = {0, 1, 2, 3};

/// One pixel row of kLanes blocks to four vectors, one for each column.
inline void load_row(const uint8_t* row, Ints column[4]) {
    const Ints a = _mm_loadu_si128(reinterpret_cast<const __m128i*>(row));
    const Ints b = _mm_loadu_si128(reinterpret_cast<const __m128i*>(row + 16));
    const Ints c = _mm_loadu_si128(reinterpret_cast<const __m128i*>(row + 32));
    const Ints d = _mm_loadu_si128(reinterpret_cast<const __m128i*>(row + 48));
    const Ints ab_low = _mm_unpacklo_epi32(a, b);
    const Ints ab_high = _mm_unpackhi_epi32(a, b);
    const Ints cd_low = _mm_unpacklo_epi32(c, d);
    const Ints cd_high = _mm_unpackhi_epi32(c, d);
    column[0] = _mm_unpacklo_epi64(ab_low, cd_low);
    column[1] = _mm_unpackhi_epi64(ab_low, cd_low);
    column[2] = _mm_unpacklo_epi64(ab_high, cd_high);
    column[3] = _mm_unpackhi_epi64(ab_high, cd_high);
}

inline void store_blocks(uint8_t* out, Ints endpoints, Ints selectors) {
    _mm_storeu_si128(reinterpret_cast<__m128i*>(out), _mm_unpacklo_epi32(endpoints, selectors));
    _mm_storeu_si128(reinterpret_cast<__m128i*>(out + 16), _mm_unpackhi_epi32(endpoints, selectors));
}

#include "tools/pyramid/bc1_kernel_body.h"
#include "tools/pyramid/bc1_kernel_high_body.h"

}  // namespace

void bc1_kernel_sse2(const uint8_t* rgba, size_t row_bytes, size_t block_count, uint8_t* out) {
    encode_groups<encode_batch>(rgba, row_bytes, block_count, out);
}

void bc1_high_kernel_sse2(const uint8_t* rgba, size_t row_bytes, size_t block_count, uint8_t* out) {
    encode_groups<encode_high_batch>(rgba, row_bytes, block_count, out);
}

}  // namespace scree
