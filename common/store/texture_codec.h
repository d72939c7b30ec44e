// Texture tiles to bytes and back (docs/store-format.md, "Texture payload"). Lossless. Thread-safe.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/result.h"
#include "common/texture_tile.h"

namespace scree {

enum class TextureCodec : int {
    raw = 0,   ///< BC1 blocks as they are
    split = 1  ///< endpoints and selectors apart, byte planes of the endpoints, Zstandard
};

struct NamedTextureCodec {
    TextureCodec codec;
    const char* name;  ///< as `scree build --texture-codec` takes it
};
/// All of them by number.
std::span<const NamedTextureCodec> texture_codecs();

std::vector<std::uint8_t> encode_texture_tile(const TextureTile& tile, int texture_size_log2, TextureCodec codec);

/// Errors: ErrorCode::store for any payload that is not exactly one well-formed tile.
Result<TextureTile> decode_texture_tile(std::span<const std::uint8_t> payload, int texture_size_log2, int codec);
/// The same into a tile whose buffer is reused; its content means nothing after an error.
Result<void> decode_texture_tile(std::span<const std::uint8_t> payload, int texture_size_log2, int codec,
                                 TextureTile& tile);

}  // namespace scree
