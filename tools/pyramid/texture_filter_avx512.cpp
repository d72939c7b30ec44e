// Texture filter, 16 texels of the coarser level at a time.
#include <immintrin.h>

#include "tools/pyramid/texture_filter_kernel.h"

namespace scree {
namespace {

constexpr int64_t kTexels = 16;
constexpr __mmask64 kAlphaBytes = 0x8888888888888888U;
constexpr __mmask16 kColours = 0x7777;

/// 256 bytes, 64 to a vector.
struct ByteTable {
    __m512i quarter[4];

    explicit ByteTable(const uint8_t* bytes) {
        for (int k = 0; k < 4; ++k) {
            quarter[k] = _mm512_loadu_si512(bytes + 64 * k);
        }
    }
};

struct Quarters {
    __mmask64 second, third, fourth;
};

inline Quarters quarters_of(__m512i bytes) {
    const __mmask64 upper = _mm512_movepi8_mask(bytes);
    const __mmask64 odd = _mm512_movepi8_mask(_mm512_slli_epi16(bytes, 1));
    return {odd & ~upper, upper & ~odd, upper & odd};
}

/// vpermb takes the low six bits of each index.
inline __m512i looked_up(const ByteTable& table, __m512i bytes, const Quarters& quarters) {
    __m512i found = _mm512_permutexvar_epi8(bytes, table.quarter[0]);
    found = _mm512_mask_permutexvar_epi8(found, quarters.second, bytes, table.quarter[1]);
    found = _mm512_mask_permutexvar_epi8(found, quarters.third, bytes, table.quarter[2]);
    return _mm512_mask_permutexvar_epi8(found, quarters.fourth, bytes, table.quarter[3]);
}

/// 16 texels as 16-bit linear intensities, alpha as it is: texels 0 and 1 of each four in `first`, 2 and 3 in `second`.
struct Linear {
    __m512i first, second;
};

inline Linear linear(const ByteTable& low, const ByteTable& high, __m512i texels) {
    const Quarters quarters = quarters_of(texels);
    const __m512i low_bytes = _mm512_mask_mov_epi8(looked_up(low, texels, quarters), kAlphaBytes, texels);
    const __m512i high_bytes = _mm512_maskz_mov_epi8(~kAlphaBytes, looked_up(high, texels, quarters));
    return {_mm512_unpacklo_epi8(low_bytes, high_bytes), _mm512_unpackhi_epi8(low_bytes, high_bytes)};
}

/// 8 texels: their rounded means as 16-bit values.
inline __m512i means(const ByteTable& low, const ByteTable& high, __m512i upper, __m512i lower) {
    const Linear a = linear(low, high, upper);
    const Linear b = linear(low, high, lower);
    const __m512i first = _mm512_add_epi16(a.first, b.first);
    const __m512i second = _mm512_add_epi16(a.second, b.second);
    const __m512i sum =
        _mm512_add_epi16(_mm512_unpacklo_epi64(first, second), _mm512_unpackhi_epi64(first, second));  // < 2^16 - 2
    return _mm512_srli_epi16(_mm512_add_epi16(sum, _mm512_set1_epi16(2)), 2);
}

/// Four texels to sRGB.
inline void store_srgb(const FilterTables& tables, __m256i mean, uint8_t* out) {
    const __m512i index = _mm512_cvtepu16_epi32(mean);
    const __m512i found = _mm512_mask_i32gather_epi32(index, kColours, index, tables.to_srgb, 1);
    _mm_storeu_si128(reinterpret_cast<__m128i*>(out), _mm512_cvtepi32_epi8(found));
}

}  // namespace

void filter_row_avx512(const FilterTables& tables, const uint8_t* upper, const uint8_t* lower, int64_t count,
                       uint8_t* out) {
    const ByteTable low(tables.linear_low);
    const ByteTable high(tables.linear_high);
    int64_t k = 0;
    for (; k + kTexels <= count; k += kTexels) {
        const __m512i a = _mm512_loadu_si512(upper + 8 * k);
        const __m512i b = _mm512_loadu_si512(upper + 8 * k + 64);
        const __m512i c = _mm512_loadu_si512(lower + 8 * k);
        const __m512i d = _mm512_loadu_si512(lower + 8 * k + 64);
        const __m512i all = _mm512_and_si512(_mm512_and_si512(a, b), _mm512_and_si512(c, d));
        const __m512i any = _mm512_or_si512(_mm512_or_si512(a, b), _mm512_or_si512(c, d));
        if (_mm512_mask_cmpneq_epi8_mask(kAlphaBytes, all, _mm512_set1_epi8(-1)) == 0) {
            const __m512i left = means(low, high, a, c);
            const __m512i right = means(low, high, b, d);
            store_srgb(tables, _mm512_castsi512_si256(left), out + 4 * k);
            store_srgb(tables, _mm512_extracti64x4_epi64(left, 1), out + 4 * k + 16);
            store_srgb(tables, _mm512_castsi512_si256(right), out + 4 * k + 32);
            store_srgb(tables, _mm512_extracti64x4_epi64(right, 1), out + 4 * k + 48);
        } else if (_mm512_mask_test_epi8_mask(kAlphaBytes, any, any) == 0) {
            _mm512_storeu_si512(out + 4 * k, _mm512_setzero_si512());
        } else {
            filter_row_scalar(tables, upper + 8 * k, lower + 8 * k, kTexels, out + 4 * k);
        }
    }
    filter_row_scalar(tables, upper + 8 * k, lower + 8 * k, count - k, out + 4 * k);
}

}  // namespace scree
