// Height tiles to bytes and back (docs/store-format.md, "Height payload"). Lossless. Thread-safe.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/height_tile.h"
#include "common/result.h"

namespace scree {

enum class HeightCodec : int {
    raw = 0,   ///< 32-bit samples
    plane = 1  ///< plane predictor, zigzag, byte planes, Zstandard
};

struct NamedHeightCodec {
    HeightCodec codec;
    const char* name;    ///< as `scree build --height-codec` takes it
    int bytes_a_sample;  ///< what terrain stays below, for estimates
};
/// All of them by number, read from the one table (height_codec.cpp). What is to hold for each goes through this.
std::span<const NamedHeightCodec> height_codecs();
inline const NamedHeightCodec& named(HeightCodec codec) { return height_codecs()[static_cast<std::size_t>(codec)]; }

/// `codec` must be one of height_codecs(), `tile.samples` must hold (2^n + 1)^2 values within kMaxHeightUnits
/// (asserted: the builder made them).
std::vector<std::uint8_t> encode_height_tile(const HeightTile& tile, int tile_cells_log2, HeightCodec codec);

/// Errors: ErrorCode::store for any payload that is not exactly one well-formed tile: truncated, too long, counts or
/// heights out of range, non-finite errors, unknown codec. Nothing is allocated from an unchecked length.
Result<HeightTile> decode_height_tile(std::span<const std::uint8_t> payload, int tile_cells_log2, int codec);
/// The same into a tile whose buffers are reused; its content means nothing after an error.
Result<void> decode_height_tile(std::span<const std::uint8_t> payload, int tile_cells_log2, int codec,
                                HeightTile& tile);

/// What stands in a payload's first bytes, without decoding it; nullopt for fewer bytes.
struct HeightMarks {
    std::uint8_t child_mask = 0;
    bool some_absent = false;  ///< a leaf with absent cells
};
std::optional<HeightMarks> height_marks(std::span<const std::uint8_t> payload);

/// Says in a payload, of any codec, where textures end: at the tile itself, and at its children (bit q: child q; those
/// that are not stored are left out). False: it is too short to be a payload.
bool set_texture_ends(std::span<std::uint8_t> payload, bool own, std::uint8_t children);

}  // namespace scree
