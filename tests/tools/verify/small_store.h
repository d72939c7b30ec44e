// Builds small consistent stores by brute force, the definitions spelled out: every error over all 16 masks at every
// finest vertex by drawn_height, every texel over one raster of a whole texture level. Depths may vary by place. Tests
// damage the parts before they are written.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "common/dataset.h"
#include "common/height_tile.h"
#include "common/texture_tile.h"

namespace scree::test {

struct SmallTerrain {
    std::int64_t cells_x = 16, cells_y = 16;
    int tile_cells_log2 = 2;
    int texture_size_log2 = 4;
    int texture_deepest_level = 2;
    int amplitude = 1000;
    int present_percent = 100;  ///< of 4 x 4 patches and, a little, of single cells
    std::uint64_t seed = 1;
    bool varying = false;  ///< depths of heights and textures at random
    bool graded = true;
};

struct SmallStore {
    Dataset dataset;
    std::map<TileId, HeightTile> heights;
    std::map<TileId, TextureTile> textures;

    /// Hands every tile's bounds to its parent's copy, after a test changed them.
    void copy_bounds_to_parents();
    /// Hands every tile's own bounds up as a builder would: ranges from samples and children; errors left alone.
    void recompute_ranges();
    /// Writes the store; codecs alternate from row to row.
    void write(const std::string& path) const;
};

SmallStore make_small_store(const SmallTerrain& terrain);

}  // namespace scree::test
