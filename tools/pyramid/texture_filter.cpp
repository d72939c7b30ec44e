#include "tools/pyramid/texture_filter.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "tools/pyramid/texture_filter_kernel.h"

namespace scree {
namespace {

// Linear intensity in 0..65535 x 1/4: four texels sum below 2^18 / 4. 14 bits resolve the darkest sRGB step (1/3294)
// five times over and keep the way back a table of 16 K entries.
constexpr std::uint32_t kLinearOne = (1u << kLinearBits) - 1;

FilterTables made_tables() {
    FilterTables t{};
    for (std::size_t v = 0; v < 256; ++v) {
        const double s = static_cast<double>(v) / 255;
        const double linear = s <= 0.04045 ? s / 12.92 : std::pow((s + 0.055) / 1.055, 2.4);
        t.to_linear[v] = static_cast<std::uint16_t>(std::lround(linear * kLinearOne));
        t.linear_low[v] = static_cast<std::uint8_t>(t.to_linear[v]);
        t.linear_high[v] = static_cast<std::uint8_t>(t.to_linear[v] >> 8);
    }
    // The nearest sRGB value by linear distance: decided on integers, so no rounding of pow can reach the output.
    std::size_t v = 0;
    for (std::size_t linear = 0; linear <= kLinearOne; ++linear) {
        while (v < 255 && 2 * linear >= static_cast<std::size_t>(t.to_linear[v]) + t.to_linear[v + 1]) ++v;
        t.to_srgb[linear] = static_cast<std::uint8_t>(v);
    }
    return t;
}

}  // namespace

const FilterTables& filter_tables() {
    static const FilterTables instance = made_tables();
    return instance;
}

bool filter_row_avx2_runs_here() { return __builtin_cpu_supports("avx2") != 0; }
bool filter_row_avx512_runs_here() {
    return __builtin_cpu_supports("avx512bw") != 0 && __builtin_cpu_supports("avx512vbmi") != 0;
}

void filter_row_scalar(const FilterTables& t, const std::uint8_t* upper, const std::uint8_t* lower, std::int64_t count,
                       std::uint8_t* out) {
    for (std::int64_t k = 0; k < count; ++k) {
        const std::uint8_t* a = upper + 8 * k;
        const std::uint8_t* b = lower + 8 * k;
        std::uint8_t* o = out + 4 * k;
        const std::uint32_t alpha = std::uint32_t{a[3]} + a[7] + b[3] + b[7];
        if (alpha == 4 * 255) {
            for (int c = 0; c < 3; ++c)
                o[c] = t.to_srgb[(std::uint32_t{t.to_linear[a[c]]} + t.to_linear[a[4 + c]] + t.to_linear[b[c]] +
                                  t.to_linear[b[4 + c]] + 2) >>
                                 2];
        } else if (alpha == 0) {
            o[0] = o[1] = o[2] = 0;
        } else {
            for (int c = 0; c < 3; ++c) {
                const std::uint32_t sum =
                    std::uint32_t{t.to_linear[a[c]]} * a[3] + std::uint32_t{t.to_linear[a[4 + c]]} * a[7] +
                    std::uint32_t{t.to_linear[b[c]]} * b[3] + std::uint32_t{t.to_linear[b[4 + c]]} * b[7];
                o[c] = t.to_srgb[std::min(kLinearOne, (sum + alpha / 2) / alpha)];
            }
        }
        o[3] = static_cast<std::uint8_t>((alpha + 2) >> 2);
    }
}

void downsample_rgba_row(const std::uint8_t* upper, const std::uint8_t* lower, std::int64_t count, std::uint8_t* out) {
    static FilterRow* const filter = filter_row_avx512_runs_here() ? filter_row_avx512
                                     : filter_row_avx2_runs_here() ? filter_row_avx2
                                                                   : filter_row_scalar;
    filter(filter_tables(), upper, lower, count, out);
}

}  // namespace scree
