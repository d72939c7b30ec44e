// Turns rows of RGBA texels, north to south, into a texture pyramid in one pass: the tiles of levels root_level ..
// deepest_level under a rectangle of tiles of root_level. Every 4 x 4 block is encoded once: tiles have no gutter and
// the filter is a 2 x 2 box, so mip k of a tile is the block-aligned part of its ancestor k levels up, and is taken
// from there. Nothing outside the rectangle has a say in it (docs/resume-and-update.md, "Pieces"). Memory: BC1 blocks
// of one band of tiles a level and a few rows of texels.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "common/dataset.h"
#include "common/store/texture_codec.h"
#include "tools/pyramid/bc1_encoder.h"
#include "tools/pyramid/texture_depth.h"

namespace scree {

/// Takes finished rows; called by one thread at a time.
using TextureSink = std::function<Result<void>(TileId id, std::vector<std::uint8_t> payload)>;

struct TexturePyramidJob {
    Lattice lattice;  ///< of the dense part
    int texture_size_log2 = 8;
    int deepest_level = 0;
    int root_level = 0;
    TextureQuality quality = TextureQuality::normal;
    TextureCodec codec = TextureCodec::split;
    /// The rectangle, in tiles of root_level; cut to the data's extent.
    std::int64_t first_column = 0, first_row = 0, columns = kMaxCellsPerSide, rows = kMaxCellsPerSide;
    /// Tiles that are stored whatever they show, by address. Any thread.
    std::function<bool(TileId id)> stored;
    /// Tiles over which there are heights; others show nothing, and no work is done for them. Any thread. Null: all.
    std::function<bool(TileId id)> has_heights;
    /// Deeper than this level (the deepest of the dense heights) a tile is stored also where it shows anything.
    int shared_levels = 0;
    /// Which children of a tile of deepest_level are stored: 0 where that is the texture's depth. Any thread.
    std::function<std::uint8_t(TileId id)> children_below;
    /// Where the depth varies by place; all tiles above root_level are refined. Null: it ends at deepest_level.
    const TextureDepth* depth = nullptr;
    /// Makes pixels of the tiles of a level above deepest_level that are not refined: rows [row, row + rows) of the
    /// level, in rows of `columns` pixels from the rectangle's first column on. Others are left as they are.
    std::function<Result<void>(int level, std::int64_t row, std::int64_t rows, std::int64_t columns,
                               std::uint8_t* rgba)>
        leaves;
    /// Refined tiles of deepest_level, whose pixels are pushed, have been made with what lies below: is this one
    /// stored?
    std::function<bool(TileId id)> made_below;
    /// Does a tile that is not refined, above the textures' deepest level and deeper than shared_levels, show anything
    /// at that level? Null: there are none.
    std::function<Result<bool>(TileId id)> shows;
    TextureSink sink;
};

class TexturePyramid {
public:
    explicit TexturePyramid(TexturePyramidJob job);
    ~TexturePyramid();

    /// The rectangle in texels of the deepest level, padded to whole tiles.
    struct Extent {
        std::int64_t first_column = 0, first_row = 0, columns = 0, rows = 0;
    };
    Extent extent() const;
    /// Rows a push takes; divides the tile size.
    int rows_per_push() const;
    /// Two buffers for rows_per_push() rows of extent().columns * 4 bytes; the bytes of words. Fill one while the other
    /// is pushed.
    std::uint8_t* rows(int buffer);
    Result<void> push(int buffer);
    /// After all rows: completes the coarse levels.
    Result<std::int64_t> finish();  ///< tiles stored

    /// After finish(): the pixels of level root_level, in whole tiles, row-major.
    struct Seeds {
        std::int64_t columns = 0, rows = 0;  ///< pixels
        std::vector<std::uint8_t> rgba;
    };
    const Seeds& seeds() const;
    /// Was this tile of the rectangle stored?
    bool stored(TileId id) const;

    /// Bytes held for a rectangle so many texels wide.
    static std::int64_t bytes_needed(std::int64_t texels_wide, int texture_size_log2);
    /// Texels of level `level` over the data's extent, padded to whole tiles.
    static std::int64_t padded_texels(std::int64_t cells, const Lattice& lattice, int texture_size_log2, int level);

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace scree
