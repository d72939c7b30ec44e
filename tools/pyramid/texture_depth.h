// TextureDepth: which texture tiles are refined where images of different resolution lie side by side: each deepens
// the tiles that it covers and no others (docs/decisions/0013-textures-end-where-their-images-do.md). Known from the
// files' headers alone. Rows of tiles hold runs, so that an image takes memory by its rows, not by its tiles.
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "common/lattice.h"

namespace scree {

class TextureDepth {
public:
    /// Tiles [begin, end) of a row.
    struct Run {
        std::int64_t begin = 0, end = 0;
        friend bool operator==(const Run&, const Run&) = default;
    };
    using Runs = std::vector<Run>;

    TextureDepth() = default;
    /// Tiles above `least_level` are refined wherever the data's extent reaches.
    TextureDepth(const Lattice& lattice, int texture_size_log2, int least_level);

    /// An image that asks for `level` covers the finest cells [west, east) x [north, south) (fractions allowed): tiles
    /// over them from the least level to the one above `level` are refined.
    void mark(double west, double north, double east, double south, int level);
    /// After all marks.
    void finish();

    // After finish(), from any thread:

    /// Of the deepest and of the coarsest tiles that are not refined; equal: the depth is the same everywhere.
    int deepest() const { return deepest_; }
    int coarsest() const { return coarsest_; }
    bool varies() const { return coarsest_ < deepest_; }
    bool refined(TileId id) const;
    /// Textures end at this address, or above it (docs/store-format.md, "Which tiles exist").
    bool ends(TileId id) const { return id.level < deepest_ && !refined(id); }

    /// Tiles of row `y` of `level` among columns [begin, end), in order: those that are refined; those that there are,
    /// which is under refined ones; and those that there are and are not refined.
    Runs refined_runs(int level, std::int64_t y, std::int64_t begin, std::int64_t end) const;
    Runs runs(int level, std::int64_t y, std::int64_t begin, std::int64_t end) const;
    Runs leaf_runs(int level, std::int64_t y, std::int64_t begin, std::int64_t end) const;
    /// The deepest level under tiles [begin, end) of a row.
    int deepest_under(int level, std::int64_t y, std::int64_t begin, std::int64_t end) const;
    /// Of the coarsest level, and it goes kSeedLevelsUp levels deeper somewhere: its pixels are stored as a seed.
    bool seeded(TileId id) const;

    /// Tiles that there are of a level over the data's extent.
    std::int64_t count(int level) const;
    std::int64_t columns(int level) const;
    std::int64_t rows(int level) const;

private:
    using Rows = std::map<std::int64_t, Runs>;
    double extent(int level) const;  // finest cells along a tile
    bool full(int level) const;

    Lattice lattice_;
    int size_log2_ = 8, least_ = 0, deepest_ = 0, coarsest_ = 0;
    std::map<int, Rows> refined_;  // by level; none above coarsest_
};

/// The parts of runs whose tiles `is_wanted` says yes to.
template <class Wanted>
TextureDepth::Runs runs_where(const TextureDepth::Runs& runs, const Wanted& is_wanted) {
    TextureDepth::Runs parts;
    for (const auto& [begin, end] : runs)
        for (std::int64_t x = begin; x < end; ++x) {
            if (!is_wanted(x)) continue;
            if (!parts.empty() && parts.back().end == x)
                ++parts.back().end;
            else
                parts.push_back({x, x + 1});
        }
    return parts;
}

}  // namespace scree
