// The inside of the BC1 encoder: one vector kernel, compiled once for each instruction set, and the scalar path for the
// blocks that the kernel leaves aside. All kernels give identical bytes.
//
// The kernel sources include nothing but this file, the intrinsics and their own body. A std inline function in them
// would be emitted with AVX instructions under a name that the linker may pick for the whole program.
#pragma once

#include <stddef.h>
#include <stdint.h>

namespace scree {

enum class TextureQuality;

/// Encodes `block_count` neighbouring blocks, a multiple of kBc1GroupBlocks. Arguments as for encode_bc1_row.
using Bc1Kernel = void(const uint8_t* rgba, size_t row_bytes, size_t block_count, uint8_t* out);

/// Blocks side by side in the widest kernel; narrower ones divide it.
inline constexpr size_t kBc1GroupBlocks = 16;

/// The caller checks that the processor has the instruction set.
Bc1Kernel bc1_kernel_sse2;
Bc1Kernel bc1_kernel_avx2;
Bc1Kernel bc1_kernel_avx512;  // AVX-512 F, BW and VNNI
Bc1Kernel bc1_high_kernel_sse2;
Bc1Kernel bc1_high_kernel_avx2;
Bc1Kernel bc1_high_kernel_avx512;

bool bc1_kernel_avx512_runs_here();

/// The fastest kernel of this quality that this processor runs.
Bc1Kernel* best_bc1_kernel(TextureQuality quality);

/// encode_bc1_row with the kernel given: whole groups directly, the rest through a padded copy.
void encode_bc1_row_with(Bc1Kernel* kernel, const uint8_t* rgba, size_t row_bytes, size_t block_count, uint8_t* out);

inline constexpr uint8_t kBc1Transparent[8] = {0, 0, 0, 0, 0xFF, 0xFF, 0xFF, 0xFF};

/// An opaque block of one colour (R, G, B in levels), as near to it as BC1 comes. 8 bytes to `out`.
void encode_bc1_solid_block(const int colour[3], uint8_t* out);

/// A block whose opaque texels their rounded mean represents best, some of them or all transparent. 8 bytes to `out`.
void encode_bc1_plain_block(const uint8_t* rgba, size_t row_bytes, uint8_t* out);

}  // namespace scree
