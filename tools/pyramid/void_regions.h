// VoidRegions: the 8-connected regions of a raster's samples without a height, found in one pass over its rows with
// memory for two rows (runs and union-find: Rosenfeld and Pfaltz 1966). A region is closed, and forgotten, at the first
// row without a sample of it. Voids and uncovered samples are labelled together: a region that touches the raster's
// border or holds an uncovered sample lies outside, and so do the voids in it; any other one is an interior void.
// Not thread-safe.
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "tools/pyramid/coverage.h"

namespace scree {

struct VoidRegion {
    /// Bounding box, all inclusive.
    std::int64_t west = std::numeric_limits<std::int64_t>::max(), east = -1;
    std::int64_t north = std::numeric_limits<std::int64_t>::max(), south = -1;
    std::int64_t first = 0;  ///< column of its first sample in row `north`
    std::int64_t voids = 0;  ///< samples, uncovered ones not counted
    bool outside = false;

    /// What solving it must see: the box and its rim.
    std::int64_t window_width() const { return east - west + 3; }
    std::int64_t window_height() const { return south - north + 3; }
};

class VoidRegions {
public:
    VoidRegions(std::int64_t width, std::int64_t height) : width_(width), height_(height) {}

    /// Row j, after row j - 1: values, NaN for voids, -infinity for uncovered samples. The regions that this row
    /// closes, in the order of their first samples in row j - 1; valid until the next call.
    std::span<const VoidRegion> add_row(std::int64_t j, std::span<const double> row);
    /// The same where all but some runs is uncovered: nothing else of the row is looked at.
    std::span<const VoidRegion> add_row(std::int64_t j, std::span<const double> row, const Coverage::Runs& covered);
    /// The same for a row whose every sample is valid, or for the end of the raster.
    std::span<const VoidRegion> add_valid_row();

private:
    struct Run {
        std::int64_t west, east;
        std::size_t region;  ///< in open_
    };
    std::size_t root_of(std::size_t region);
    void find_runs(std::int64_t j, std::span<const double> row, const Coverage::Runs& covered);
    void join_to_row_above();
    void keep_open();

    std::int64_t width_, height_;
    std::vector<Run> above_, runs_;
    std::vector<VoidRegion> open_, next_open_, closed_;
    std::vector<std::size_t> parent_, moved_to_;
};

}  // namespace scree
