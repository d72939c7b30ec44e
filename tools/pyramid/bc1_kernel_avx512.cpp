// BC1 kernel, 16 blocks side by side (AVX-512 F and BW).
#include <immintrin.h>

#include "tools/pyramid/bc1_kernel.h"

namespace scree {
namespace {

using Ints = __m512i;  // one 32-bit lane a block; as 16-bit halves: two texels of it
using Floats = __m512;

constexpr size_t kLanes = 16;

inline Ints splat(int value) { return _mm512_set1_epi32(value); }
inline Floats splat(float value) { return _mm512_set1_ps(value); }
inline Ints zero() { return _mm512_setzero_si512(); }
inline Ints load(const uint8_t* p) { return _mm512_loadu_si512(p); }
inline Ints first_of_16_bytes(Ints a) { return _mm512_shuffle_epi32(a, _MM_PERM_AAAA); }
inline bool is_zero(Ints a) { return _mm512_test_epi32_mask(a, a) == 0; }
inline Ints add16(Ints a, Ints b) { return _mm512_add_epi16(a, b); }
inline Ints sub16(Ints a, Ints b) { return _mm512_sub_epi16(a, b); }
inline Ints mul_low16(Ints a, Ints b) { return _mm512_mullo_epi16(a, b); }
inline Ints add32(Ints a, Ints b) { return _mm512_add_epi32(a, b); }
inline Ints min16(Ints a, Ints b) { return _mm512_min_epi16(a, b); }
inline Ints max16(Ints a, Ints b) { return _mm512_max_epi16(a, b); }
inline Ints mul_add_pairs(Ints a, Ints b) { return _mm512_madd_epi16(a, b); }
inline Ints add_products(Ints sum, Ints a, Ints b) { return _mm512_dpwssd_epi32(sum, a, b); }
inline Ints mul_round16(Ints a, Ints b) { return _mm512_mulhrs_epi16(a, b); }
template <int kBits>
inline Ints shift_left16(Ints a) {
    return _mm512_slli_epi16(a, kBits);
}
template <int kBits>
inline Ints shift_right16(Ints a) {
    return _mm512_srli_epi16(a, kBits);
}
template <int kBits>
inline Ints shift_left32(Ints a) {
    return _mm512_slli_epi32(a, kBits);
}
template <int kBits>
inline Ints shift_right32(Ints a) {
    return _mm512_srli_epi32(a, kBits);
}
template <int kBits>
inline Ints shift_right_signed32(Ints a) {
    return _mm512_srai_epi32(a, kBits);
}
template <int kBits>
inline Ints shift_right_signed16(Ints a) {
    return _mm512_srai_epi16(a, kBits);
}
inline Floats to_floats(Ints a) { return _mm512_cvtepi32_ps(a); }
inline Ints truncate(Floats a) { return _mm512_cvttps_epi32(a); }
inline Floats minimum(Floats a, Floats b) { return _mm512_min_ps(a, b); }
inline Floats maximum(Floats a, Floats b) { return _mm512_max_ps(a, b); }
inline Floats magnitude(Floats a) { return _mm512_abs_ps(a); }
inline Floats square_root(Floats a) { return _mm512_sqrt_ps(a); }

using Mask = __mmask16;
inline Mask less(Floats a, Floats b) { return _mm512_cmp_ps_mask(a, b, _CMP_LT_OQ); }
inline Mask less32(Ints a, Ints b) { return _mm512_cmplt_epi32_mask(a, b); }
inline Mask equal32(Ints a, Ints b) { return _mm512_cmpeq_epi32_mask(a, b); }
inline Floats select(Mask m, Floats yes, Floats no) { return _mm512_mask_blend_ps(m, no, yes); }
inline Ints select(Mask m, Ints yes, Ints no) { return _mm512_mask_blend_epi32(m, no, yes); }
inline unsigned lane_bits(Mask m) { return m; }
/// The 4x4 transposes work within 128-bit quarters.
constexpr uint8_t kBlockOfLane[kLanes] = {0, 4, 8, 12, 1, 5, 9, 13, 2, 6, 10, 14, 3, 7, 11, 15};

/// One pixel row of kLanes blocks to four vectors, one for each column.
inline void load_row(const uint8_t* row, Ints column[4]) {
    const Ints a = _mm512_loadu_si512(row);
    const Ints b = _mm512_loadu_si512(row + 64);
    const Ints c = _mm512_loadu_si512(row + 128);
    const Ints d = _mm512_loadu_si512(row + 192);
    const Ints ab_low = _mm512_unpacklo_epi32(a, b);
    const Ints ab_high = _mm512_unpackhi_epi32(a, b);
    const Ints cd_low = _mm512_unpacklo_epi32(c, d);
    const Ints cd_high = _mm512_unpackhi_epi32(c, d);
    column[0] = _mm512_unpacklo_epi64(ab_low, cd_low);
    column[1] = _mm512_unpackhi_epi64(ab_low, cd_low);
    column[2] = _mm512_unpacklo_epi64(ab_high, cd_high);
    column[3] = _mm512_unpackhi_epi64(ab_high, cd_high);
}

inline void store_blocks(uint8_t* out, Ints endpoints, Ints selectors) {
    const Ints low = _mm512_unpacklo_epi32(endpoints, selectors);   // blocks 0 4 | 1 5 | 2 6 | 3 7
    const Ints high = _mm512_unpackhi_epi32(endpoints, selectors);  // blocks 8 12 | 9 13 | 10 14 | 11 15
    const Ints even_then_odd = _mm512_setr_epi64(0, 2, 4, 6, 1, 3, 5, 7);
    _mm512_storeu_si512(out, _mm512_permutexvar_epi64(even_then_odd, low));
    _mm512_storeu_si512(out + 64, _mm512_permutexvar_epi64(even_then_odd, high));
}

#include "tools/pyramid/bc1_kernel_body.h"
#include "tools/pyramid/bc1_kernel_high_body.h"

}  // namespace

void bc1_kernel_avx512(const uint8_t* rgba, size_t row_bytes, size_t block_count, uint8_t* out) {
    encode_groups<encode_batch>(rgba, row_bytes, block_count, out);
}

void bc1_high_kernel_avx512(const uint8_t* rgba, size_t row_bytes, size_t block_count, uint8_t* out) {
    encode_groups<encode_high_batch>(rgba, row_bytes, block_count, out);
}

}  // namespace scree
