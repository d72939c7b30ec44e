// Texture filter, eight texels of the coarser level at a time: intensities are looked up by gathers, which take as many
// words at once as scalar code does one after the other.
#include <immintrin.h>

#include "tools/pyramid/texture_filter_kernel.h"

namespace scree {
namespace {

constexpr int64_t kTexels = 8;

/// One channel of eight texels, as intensities. Gathers read words: the upper half is another entry's.
template <int kShift>
inline __m256i linear(const FilterTables& tables, __m256i texels) {
    const __m256i values = _mm256_and_si256(_mm256_srli_epi32(texels, kShift), _mm256_set1_epi32(0xFF));
    const __m256i found = _mm256_i32gather_epi32(reinterpret_cast<const int*>(tables.to_linear), values, 2);
    return _mm256_and_si256(found, _mm256_set1_epi32(0xFFFF));
}

/// Of the even and the odd texels of two rows: the mean's sRGB value, in its byte.
template <int kShift>
inline __m256i channel(const FilterTables& tables, const __m256i (&texels)[4]) {
    __m256i sum = _mm256_set1_epi32(2);
    for (const __m256i& t : texels) {
        sum = _mm256_add_epi32(sum, linear<kShift>(tables, t));
    }
    const __m256i mean = _mm256_srli_epi32(sum, 2);
    const __m256i found = _mm256_i32gather_epi32(reinterpret_cast<const int*>(tables.to_srgb), mean, 1);
    return _mm256_slli_epi32(_mm256_and_si256(found, _mm256_set1_epi32(0xFF)), kShift);
}

inline __m256i load(const uint8_t* from) { return _mm256_loadu_si256(reinterpret_cast<const __m256i*>(from)); }

}  // namespace

void filter_row_avx2(const FilterTables& tables, const uint8_t* upper, const uint8_t* lower, int64_t count,
                     uint8_t* out) {
    const __m256i alpha = _mm256_set1_epi32(static_cast<int>(0xFF000000U));
    int64_t k = 0;
    for (; k + kTexels <= count; k += kTexels) {
        const __m256i a = load(upper + 8 * k);
        const __m256i b = load(upper + 8 * k + 32);
        const __m256i c = load(lower + 8 * k);
        const __m256i d = load(lower + 8 * k + 32);
        const __m256i all = _mm256_and_si256(_mm256_and_si256(a, b), _mm256_and_si256(c, d));
        const __m256i any = _mm256_or_si256(_mm256_or_si256(a, b), _mm256_or_si256(c, d));
        if (_mm256_testc_si256(all, alpha) != 0) {
            const auto even = [](__m256i p, __m256i q) {
                return _mm256_castps_si256(_mm256_shuffle_ps(_mm256_castsi256_ps(p), _mm256_castsi256_ps(q), 0x88));
            };
            const auto odd = [](__m256i p, __m256i q) {
                return _mm256_castps_si256(_mm256_shuffle_ps(_mm256_castsi256_ps(p), _mm256_castsi256_ps(q), 0xDD));
            };
            const __m256i texels[4] = {even(a, b), odd(a, b), even(c, d), odd(c, d)};
            const __m256i colour =
                _mm256_or_si256(_mm256_or_si256(channel<0>(tables, texels), channel<8>(tables, texels)),
                                _mm256_or_si256(channel<16>(tables, texels), alpha));
            // The shuffles mixed halves: pairs stand as 0, 2, 1, 3.
            _mm256_storeu_si256(reinterpret_cast<__m256i*>(out + 4 * k), _mm256_permute4x64_epi64(colour, 0xD8));
        } else if (_mm256_testz_si256(any, alpha) != 0) {
            _mm256_storeu_si256(reinterpret_cast<__m256i*>(out + 4 * k), _mm256_setzero_si256());
        } else {
            filter_row_scalar(tables, upper + 8 * k, lower + 8 * k, kTexels, out + 4 * k);
        }
    }
    filter_row_scalar(tables, upper + 8 * k, lower + 8 * k, count - k, out + 4 * k);
}

}  // namespace scree
