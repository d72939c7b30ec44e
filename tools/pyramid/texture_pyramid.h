// Turns rows of RGBA texels, north to south, into the texture pyramid in one pass. Every 4 x 4 block is encoded once:
// tiles have no gutter and the filter is a 2 x 2 box, so mip k of a tile is the block-aligned part of its ancestor k
// levels up, and is taken from there. Memory: BC1 blocks of one band of tiles a level and a few rows of texels.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>

#include "common/dataset.h"
#include "common/store/sqlite_store.h"
#include "tools/pyramid/deep_branch.h"
#include "tools/pyramid/tile_set.h"

namespace scree {

struct TexturePyramidJob {
    SqliteStoreWriter* writer = nullptr;
    Lattice lattice;
    int texture_size_log2 = 8;
    int deepest_level = 0;
    const TileSet* height_tiles = nullptr;  ///< decides which tiles of shared levels exist
    const DeepPresence* deep = nullptr;     ///< the same for deeper ones, besides what is opaque
};

class TexturePyramid {
public:
    explicit TexturePyramid(const TexturePyramidJob& job);
    ~TexturePyramid();

    /// Texels a row: the data's extent padded to whole tiles.
    static std::int64_t width_of(const Lattice& lattice, int texture_size_log2, int deepest_level);
    std::int64_t width() const;
    /// Rows to push: the data's extent padded to whole tiles.
    std::int64_t height() const;
    /// Rows a push takes; divides the tile size.
    int rows_per_push() const;
    /// The buffer for the next rows_per_push() rows, width() * 4 bytes each. Fill it, then push().
    std::uint8_t* rows();
    Result<void> push();
    /// After all rows: completes the coarse levels.
    Result<std::int64_t> finish();  ///< tiles written

    static std::int64_t bytes_needed(const Lattice& lattice, int texture_size_log2, int deepest_level);

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace scree
