// Finds the samples of a source layer that lie in a rectangle of the plane: boxes of control cells, four by four, level
// by level; within a cell the samples' rectangle is halved, for a bilinear patch lies within the hull of its corners.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "runtime/app/source_samples.h"

namespace scree {

struct PlaneRect {
    double west = 0, south = 0, east = 0, north = 0;
};

/// Samples [column, column + columns) x [row, row + rows).
struct SampleRect {
    std::int64_t column = 0, row = 0, columns = 0, rows = 0;
};

class SourceIndex {
public:
    /// The layer must outlive it.
    explicit SourceIndex(const SourceLayer& layer);

    /// Calls visit with rectangles that hold every sample within `slack_m` of `where` once, and none twice. `inside`:
    /// all of its samples lie within `where`, by more than `slack_m`; else some may lie elsewhere. Samples without a
    /// place are in none. Any thread.
    using Visit = std::function<void(const SampleRect& samples, bool inside)>;
    void find(const PlaneRect& where, double slack_m, const Visit& visit) const;

private:
    struct Level {
        std::int64_t columns = 0, rows = 0;
        std::vector<PlaneRect> boxes;
    };
    struct Search;
    PlaneRect cell_box(std::int64_t column, std::int64_t row) const;
    void search(const Search& s, std::size_t level, std::int64_t column, std::int64_t row) const;
    void search_samples(const Search& s, const SampleRect& samples) const;

    const SourceLayer& layer_;
    std::int64_t cells_x_, cells_y_;
    std::vector<Level> levels_;  ///< of 4 x 4 cells, of 4 x 4 of those... up to one box
};

}  // namespace scree
