// Texels meet the heights: alpha where there are none, a tint where there is no imagery. All that is known of the
// heights comes from the stored tiles, so that neither resuming a build nor updating imagery opens a DEM.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <unordered_map>
#include <vector>

#include "common/dataset.h"
#include "common/height_tile.h"
#include "common/store/tile_store.h"
#include "tools/pyramid/height_index.h"
#include "tools/pyramid/tint.h"

namespace scree {

/// Reads a height tile's row; false: not stored. Any thread.
using HeightRowReader = std::function<Result<bool>(TileId id, TileRow& row)>;

class TexelGround {
public:
    /// For texels of one texture level. `dataset`: heights known. The index must outlive it.
    TexelGround(const Dataset& dataset, const Lattice& base, const HeightIndex& index, HeightRowReader read,
                int texture_level);
    ~TexelGround();

    /// Texels [column, column + columns) x [row, row + rows) of the level, RGBA in rows of `row_bytes`, alpha >= 128
    /// where there is imagery: afterwards opaque where there are heights, else 0. Rows in ascending order are cheapest.
    /// `opaque`: all of them are known to be. One call at a time; uses all threads.
    Result<void> finish(std::int64_t column, std::int64_t row, std::int64_t columns, std::int64_t rows,
                        std::uint8_t* rgba, std::int64_t row_bytes, bool opaque = false);
    /// Does a texel of the store's deepest level have its centre in a present cell, within a texture tile that lies
    /// deeper than the leaf there? Any thread.
    Result<bool> shows(TileId texture_tile) const;

private:
    struct Tile;
    using Rectangle = struct { std::int64_t column, row, columns, rows; };
    Result<void> finish_part(Tile& tile, TileId id, const Rectangle& part, std::uint8_t* rgba, std::int64_t row_bytes);
    Result<void> load(Tile& tile, TileId id) const;
    Result<void> load_leaves(Tile& tile, TileId id) const;
    bool any_present(const HeightTile& tile, TileId leaf, TileId id) const;
    bool leaf_present(const Tile& tile, TileId id, std::int64_t column, std::int64_t row) const;

    Dataset dataset_;
    Lattice base_;
    const HeightIndex& index_;
    HeightRowReader read_;
    Tint tint_;
    std::int64_t texels_a_cell_;
    std::unordered_map<std::int64_t, std::unique_ptr<Tile>> columns_;  // by tile column, the tile in use
};

}  // namespace scree
