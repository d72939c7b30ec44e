// BC1 kernel, 8 blocks side by side.
#include <immintrin.h>

#include "tools/pyramid/bc1_kernel.h"

namespace scree {
namespace {

using Ints = __m256i;  // one 32-bit lane a block; as 16-bit halves: two texels of it
using Floats = __m256;

constexpr size_t kLanes = 8;

inline Ints splat(int value) { return _mm256_set1_epi32(value); }
inline Floats splat(float value) { return _mm256_set1_ps(value); }
inline Ints zero() { return _mm256_setzero_si256(); }
inline Ints load(const uint8_t* p) { return _mm256_loadu_si256(reinterpret_cast<const __m256i*>(p)); }
inline Ints first_of_16_bytes(Ints a) { return _mm256_shuffle_epi32(a, 0); }
inline bool is_zero(Ints a) { return _mm256_testz_si256(a, a) != 0; }
inline Ints add16(Ints a, Ints b) { return _mm256_add_epi16(a, b); }
inline Ints sub16(Ints a, Ints b) { return _mm256_sub_epi16(a, b); }
inline Ints mul_low16(Ints a, Ints b) { return _mm256_mullo_epi16(a, b); }
inline Ints add32(Ints a, Ints b) { return _mm256_add_epi32(a, b); }
inline Ints min16(Ints a, Ints b) { return _mm256_min_epi16(a, b); }
inline Ints max16(Ints a, Ints b) { return _mm256_max_epi16(a, b); }
inline Ints mul_add_pairs(Ints a, Ints b) { return _mm256_madd_epi16(a, b); }
inline Ints add_products(Ints sum, Ints a, Ints b) { return add32(sum, mul_add_pairs(a, b)); }
inline Ints mul_round16(Ints a, Ints b) { return _mm256_mulhrs_epi16(a, b); }
template <int kBits>
inline Ints shift_left16(Ints a) {
    return _mm256_slli_epi16(a, kBits);
}
template <int kBits>
inline Ints shift_right16(Ints a) {
    return _mm256_srli_epi16(a, kBits);
}
template <int kBits>
inline Ints shift_left32(Ints a) {
    return _mm256_slli_epi32(a, kBits);
}
template <int kBits>
inline Ints shift_right32(Ints a) {
    return _mm256_srli_epi32(a, kBits);
}
template <int kBits>
inline Ints shift_right_signed32(Ints a) {
    return _mm256_srai_epi32(a, kBits);
}
template <int kBits>
inline Ints shift_right_signed16(Ints a) {
    return _mm256_srai_epi16(a, kBits);
}
inline Floats to_floats(Ints a) { return _mm256_cvtepi32_ps(a); }
inline Ints truncate(Floats a) { return _mm256_cvttps_epi32(a); }
inline Floats minimum(Floats a, Floats b) { return _mm256_min_ps(a, b); }
inline Floats maximum(Floats a, Floats b) { return _mm256_max_ps(a, b); }
inline Floats magnitude(Floats a) { return _mm256_andnot_ps(_mm256_set1_ps(-0.0F), a); }
inline Floats square_root(Floats a) { return _mm256_sqrt_ps(a); }

using Mask = __m256;
inline Mask less(Floats a, Floats b) { return _mm256_cmp_ps(a, b, _CMP_LT_OQ); }
inline Mask less32(Ints a, Ints b) { return _mm256_castsi256_ps(_mm256_cmpgt_epi32(b, a)); }
inline Mask equal32(Ints a, Ints b) { return _mm256_castsi256_ps(_mm256_cmpeq_epi32(a, b)); }
inline Floats select(Mask m, Floats yes, Floats no) { return _mm256_blendv_ps(no, yes, m); }
inline Ints select(Mask m, Ints yes, Ints no) {
    return _mm256_castps_si256(select(m, _mm256_castsi256_ps(yes), _mm256_castsi256_ps(no)));
}
inline unsigned lane_bits(Mask m) { return static_cast<unsigned>(_mm256_movemask_ps(m)); }
/// The 4x4 transposes work within 128-bit halves, which hold the even and the odd blocks.
constexpr uint8_t kBlockOfLane[kLanes] = {0, 2, 4, 6, 1, 3, 5, 7};

/// One pixel row of kLanes blocks to four vectors, one for each column.
inline void load_row(const uint8_t* row, Ints column[4]) {
    const Ints a = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(row));
    const Ints b = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(row + 32));
    const Ints c = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(row + 64));
    const Ints d = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(row + 96));
    const Ints ab_low = _mm256_unpacklo_epi32(a, b);
    const Ints ab_high = _mm256_unpackhi_epi32(a, b);
    const Ints cd_low = _mm256_unpacklo_epi32(c, d);
    const Ints cd_high = _mm256_unpackhi_epi32(c, d);
    column[0] = _mm256_unpacklo_epi64(ab_low, cd_low);
    column[1] = _mm256_unpackhi_epi64(ab_low, cd_low);
    column[2] = _mm256_unpacklo_epi64(ab_high, cd_high);
    column[3] = _mm256_unpackhi_epi64(ab_high, cd_high);
}

inline void store_blocks(uint8_t* out, Ints endpoints, Ints selectors) {
    const Ints low = _mm256_unpacklo_epi32(endpoints, selectors);   // blocks 0 2 | 1 3
    const Ints high = _mm256_unpackhi_epi32(endpoints, selectors);  // blocks 4 6 | 5 7
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(out), _mm256_permute4x64_epi64(low, 0xD8));
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(out + 32), _mm256_permute4x64_epi64(high, 0xD8));
}

#include "tools/pyramid/bc1_kernel_body.h"
#include "tools/pyramid/bc1_kernel_high_body.h"

}  // namespace

void bc1_kernel_avx2(const uint8_t* rgba, size_t row_bytes, size_t block_count, uint8_t* out) {
    encode_groups<encode_batch>(rgba, row_bytes, block_count, out);
}

void bc1_high_kernel_avx2(const uint8_t* rgba, size_t row_bytes, size_t block_count, uint8_t* out) {
    encode_groups<encode_high_batch>(rgba, row_bytes, block_count, out);
}

}  // namespace scree
