// The insides of geometric_error.cpp, compiled once for each instruction set. All are exact, so all give the same
// values.
//
// The kernel sources include nothing but this file, the intrinsics and their own body. A std inline function in them
// would be emitted with AVX instructions under a name that the linker may pick for the whole program.
#pragma once

#include <stdint.h>

namespace scree {

/// Tiles side by side in the lanes of vectors: every lane does the same work whatever its heights are.
inline constexpr int kLeafErrorTiles = 16;
/// Heights times 2^n stay below 2^30, so differences of two fit 32 bits; larger tiles are for the plain path.
inline constexpr int kMaxLeafErrorLog2 = 6;

/// `samples` and `present`: (2^n + 1)^2 vertices, row-major, of kLeafErrorTiles tiles each; present 0 or -1, or nullptr
/// where every vertex of every tile is. Writes the error of geomip level g of tile t, in 2^-(g + 1) quanta and without
/// regard to other levels, to worst[g * kLeafErrorTiles + t].
using LeafErrorKernel = void(const int32_t* samples, const int32_t* present, int tile_cells_log2, int32_t* worst);

/// A plane over a tile's vertices in units of 1 / scale quanta, and the part of the tile where it is looked at: all of
/// it, or a triangle on one side of a diagonal, which belongs to it.
struct TilePlane {
    double at_corner, per_column, per_row;  ///< integers below 2^53, as are all values over the tile
    enum Part { whole, south_west, north_east, north_west, south_east } part;
};

/// Greatest |scale * z - plane| over the vertices of that part. Tiles of at least 2^kMinPlaneLog2 cells a side.
using PlaneDistanceKernel = double(const int32_t* samples, int tile_cells_log2, double scale, const TilePlane& plane);
inline constexpr int kMinPlaneLog2 = 3;

struct ErrorKernels {
    LeafErrorKernel* leaf_errors;
    PlaneDistanceKernel* plane_distance;
};

/// The caller checks that the processor has the instruction set.
extern const ErrorKernels kErrorKernelsSse2;
extern const ErrorKernels kErrorKernelsAvx2;
extern const ErrorKernels kErrorKernelsAvx512;  // AVX-512 F

/// The fastest that this processor runs.
const ErrorKernels& best_error_kernels();

}  // namespace scree
