// Builds the height pyramid in one pass over the spool, band by band from north to south: deepest tiles as their rows
// arrive, coarser tiles as soon as their last row is known. Memory: one band of (m+1) rows a level, about twice the
// finest.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <span>

#include "common/dataset.h"
#include "common/store/height_codec.h"
#include "tools/pyramid/deep_branch.h"
#include "tools/pyramid/height_index.h"
#include "tools/pyramid/height_quantizer.h"
#include "tools/pyramid/height_spool.h"
#include "tools/pyramid/texture_depth.h"
#include "tools/pyramid/tile_writer.h"

namespace scree {

struct HeightPyramidJob {
    HeightSpool* spool = nullptr;
    TileWriter* writer = nullptr;
    Lattice lattice;
    HeightQuantizer quantizer;
    std::function<bool(std::int64_t rows_done)> on_rows;  ///< returns false to stop
    /// Where finer data goes on below the lattice's deepest level: which tiles do, and the points of the lattice
    /// `finest`, whose cells are this one's divided. Null: nowhere.
    const DeepTree* deep_tree = nullptr;
    const DeepHeights* deep_heights = nullptr;
    Lattice finest{};
    HeightCodec codec = HeightCodec::plane;
    const TextureDepth* textures = nullptr;  ///< tiles say where these end. Null: of no consequence
    const Coverage* coverage = nullptr;      ///< of a sparse spool; else null
    HeightIndex* index = nullptr;            ///< notes every tile; null: nobody wants to know
};

struct HeightPyramidResult {
    std::int64_t tile_count = 0;
    std::int64_t present_cells = 0;
    int coarsest_leaf_level = kMaxLevel;
    std::int32_t min_n = 0, max_n = 0;  ///< over valid samples
    double worst_quantum_error_m = 0;   ///< over valid samples
};

/// Bytes that build_height_pyramid holds.
std::int64_t height_pyramid_bytes(const Lattice& lattice, HeightCodec codec);

Result<HeightPyramidResult> build_height_pyramid(const HeightPyramidJob& job);

/// Of a height tile's payload.
void say_where_textures_end(std::span<std::uint8_t> payload, TileId id, const TextureDepth& textures);

}  // namespace scree
