// BC1 (DXT1) encoder: 4x4 RGBA blocks to 8 bytes, little-endian as S3TC defines them. Deterministic: the same pixels
// give the same bytes on every x86-64.
#pragma once

#include <cstddef>
#include <cstdint>

namespace scree {

/// high: endpoints are searched for, at a fifteenth of the speed; as near as libsquish's cluster fit comes, or nearer.
enum class TextureQuality { normal, high };

/// Encodes the four pixel rows starting at `rgba` (8-bit R,G,B,A; `row_bytes` from one row to the next) as
/// `block_count` neighbouring 4x4 blocks into out[8*block_count].
///
/// Alpha below 128 is transparent: such a block uses BC1's three-colour mode with index 3 for its transparent texels,
/// and its endpoints are fitted to the opaque ones alone. A block with no transparent texel always decodes with alpha
/// 255 (four-colour mode, or three-colour mode without index 3). An all-transparent block has one fixed encoding. The
/// colour of transparent texels does not influence the output. Thread-safe.
void encode_bc1_row(const std::uint8_t* rgba, std::size_t row_bytes, std::size_t block_count, std::uint8_t* out,
                    TextureQuality quality = TextureQuality::normal);

}  // namespace scree
