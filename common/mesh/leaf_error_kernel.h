// The inside of leaf_errors for several tiles at once: tiles side by side in the lanes of a vector, so that every lane
// does the same work whatever its heights are. Compiled once for each instruction set; integers, so all kernels give
// the same values.
//
// The kernel sources include nothing but this file, the intrinsics and their own body. A std inline function in them
// would be emitted with AVX instructions under a name that the linker may pick for the whole program.
#pragma once

#include <stdint.h>

namespace scree {

/// Tiles side by side.
inline constexpr int kLeafErrorTiles = 16;
/// Heights times 2^n stay below 2^30, so differences of two fit 32 bits; larger tiles are for the plain path.
inline constexpr int kMaxLeafErrorLog2 = 6;

/// `samples` and `present`: (2^n + 1)^2 vertices, row-major, of kLeafErrorTiles tiles each; present 0 or -1, or nullptr
/// where every vertex of every tile is. Writes the error of geomip level g of tile t, in 2^-(g + 1) quanta and without
/// regard to other levels, to worst[g * kLeafErrorTiles + t].
using LeafErrorKernel = void(const int32_t* samples, const int32_t* present, int tile_cells_log2, int32_t* worst);

/// The caller checks that the processor has the instruction set.
LeafErrorKernel leaf_error_kernel_sse2;
LeafErrorKernel leaf_error_kernel_avx2;
LeafErrorKernel leaf_error_kernel_avx512;  // AVX-512 F

/// The fastest kernel that this processor runs.
LeafErrorKernel* best_leaf_error_kernel();

}  // namespace scree
