// The inside of the texture filter: a scalar row, one by gathers (AVX2), and one for processors that look up 64 bytes
// at once (AVX-512 VBMI). All give identical bytes. The kernel source includes nothing but this file and the intrinsics
// (see bc1_kernel.h for the reason).
#pragma once

#include <stddef.h>
#include <stdint.h>

namespace scree {

inline constexpr int kLinearBits = 14;

struct FilterTables {
    uint16_t to_linear[256 + 1];  ///< four bytes can be read at each entry
    uint8_t linear_low[256];      ///< the same by bytes
    uint8_t linear_high[256];
    uint8_t to_srgb[(1 << kLinearBits) + 3];  ///< four bytes can be read at each entry
};

using FilterRow = void(const FilterTables& tables, const uint8_t* upper, const uint8_t* lower, int64_t count,
                       uint8_t* out);

FilterRow filter_row_scalar;
/// Requires AVX2.
FilterRow filter_row_avx2;
/// Requires AVX-512 F, BW and VBMI.
FilterRow filter_row_avx512;

bool filter_row_avx2_runs_here();
bool filter_row_avx512_runs_here();
const FilterTables& filter_tables();

}  // namespace scree
