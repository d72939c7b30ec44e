// Seeds to bytes and back: the pixels of one texture tile, without loss (docs/store-format.md, "Seed payload").
// Thread-safe.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/result.h"

namespace scree {

/// Levels from the seeds to the deepest textures: 256 finest pixels to one of a seed.
inline constexpr int kSeedLevelsUp = 4;

enum class SeedCodec : int {
    left = 1  ///< channels apart, differences to the pixel before, Zstandard
};

/// `rgba`: rows of `size` pixels, `row_bytes` from one to the next. Transparent pixels keep no colour.
std::vector<std::uint8_t> encode_seed(const std::uint8_t* rgba, std::size_t row_bytes, int size);

/// Into `size` rows of `size` pixels. Errors: ErrorCode::store for any payload that is not exactly one seed.
Result<void> decode_seed(std::span<const std::uint8_t> payload, int codec, int size, std::uint8_t* rgba,
                         std::size_t row_bytes);

}  // namespace scree
