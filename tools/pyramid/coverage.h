// Coverage: which tiles of the dense part any file may reach, where they are few: a mosaic of places far apart. What
// lies between is neither spooled, filled, quantised nor drawn on. Known from the files' boxes; immutable.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "common/lattice.h"

namespace scree {

class Coverage {
public:
    /// Tiles [begin, end) of a row; of samples likewise.
    struct Run {
        std::int64_t begin = 0, end = 0;
    };
    using Runs = std::vector<Run>;
    struct Box {
        double west, north, east, south;  ///< samples of the dense part, fractions allowed
    };

    /// Everything.
    Coverage() = default;
    /// Files lie in these boxes; everything where that is half of the lattice or more.
    Coverage(const Lattice& base, std::span<const Box> files);

    bool everything() const { return levels_.empty(); }
    /// Not of everything: tiles of a row of tiles, in order and apart.
    const Runs& tiles(int level, std::int64_t y) const;
    /// Rows of tiles of a level that have some.
    const std::map<std::int64_t, Runs>& rows(int level) const { return levels_[static_cast<std::size_t>(level)]; }
    /// Samples of row j that files may reach; all of a tile's, its borders included.
    Runs samples(std::int64_t j) const;
    /// May a file reach a sample of this rectangle?
    bool reaches(std::int64_t i, std::int64_t j, std::int64_t columns, std::int64_t rows) const;
    /// Of a level of the lattice `base`; of everything too.
    static double tile_count(const Coverage& coverage, const Lattice& base, int level);

private:
    Lattice lattice_;
    std::vector<std::map<std::int64_t, Runs>> levels_;
};

}  // namespace scree
