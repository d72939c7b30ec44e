#include "tools/pyramid/void_regions.h"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

namespace scree {
namespace {

constexpr std::size_t kNowhere = std::numeric_limits<std::size_t>::max();

void join(VoidRegion& into, const VoidRegion& other) {
    if (std::tie(other.north, other.first) < std::tie(into.north, into.first)) into.first = other.first;
    into.west = std::min(into.west, other.west);
    into.east = std::max(into.east, other.east);
    into.north = std::min(into.north, other.north);
    into.south = std::max(into.south, other.south);
    into.voids += other.voids;
    into.outside |= other.outside;
}

}  // namespace

std::size_t VoidRegions::root_of(std::size_t region) {
    while (parent_[region] != region) region = parent_[region] = parent_[parent_[region]];
    return region;
}

// Every run begins as a region of its own, behind those that the row above left open.
void VoidRegions::find_runs(std::int64_t j, std::span<const double> row, const Coverage::Runs& covered) {
    runs_.clear();
    std::int64_t i = 0;
    VoidRegion region;
    const auto begin = [&] {
        region = {};
        region.west = region.first = i;
        region.north = region.south = j;
    };
    const auto end = [&] {
        region.east = i - 1;
        region.outside |= j == 0 || j == height_ - 1 || region.west == 0 || i == width_;
        runs_.push_back({region.west, region.east, open_.size()});
        parent_.push_back(open_.size());
        open_.push_back(region);
    };
    bool open = false;
    const auto pass_gap = [&](std::int64_t to) {
        if (i >= to) return;
        if (!open) begin();
        open = region.outside = true;
        i = to;
    };
    for (const Coverage::Run& part : covered) {
        pass_gap(part.begin);
        while (i < part.end) {
            const double v = row[static_cast<std::size_t>(i)];
            if (std::isfinite(v)) {
                if (open) end();
                open = false;
                ++i;
                continue;
            }
            if (!open) begin();
            open = true;
            if (std::isnan(v))
                ++region.voids;
            else
                region.outside = true;
            ++i;
        }
    }
    pass_gap(width_);
    if (open) end();
}

void VoidRegions::join_to_row_above() {
    auto upper = above_.begin();
    for (const Run& run : runs_) {
        while (upper != above_.end() && upper->east < run.west - 1) ++upper;
        for (auto touching = upper; touching != above_.end() && touching->west <= run.east + 1; ++touching) {
            const std::size_t a = root_of(touching->region), b = root_of(run.region);
            if (a == b) continue;
            const auto [root, other] = std::minmax(a, b);
            join(open_[root], open_[other]);
            parent_[other] = root;
        }
    }
}

// Regions without a run in this row are closed; the others move to the front, in the order of their first runs.
void VoidRegions::keep_open() {
    moved_to_.assign(open_.size(), kNowhere);
    next_open_.clear();
    for (Run& run : runs_) {
        const std::size_t root = root_of(run.region);
        if (moved_to_[root] == kNowhere) {
            moved_to_[root] = next_open_.size();
            next_open_.push_back(open_[root]);
        }
        run.region = moved_to_[root];
    }
    closed_.clear();
    for (std::size_t region = 0; region < open_.size(); ++region)
        if (parent_[region] == region && moved_to_[region] == kNowhere) closed_.push_back(open_[region]);
    std::swap(open_, next_open_);
    std::swap(above_, runs_);
    parent_.resize(open_.size());
    for (std::size_t region = 0; region < open_.size(); ++region) parent_[region] = region;
}

std::span<const VoidRegion> VoidRegions::add_row(std::int64_t j, std::span<const double> row) {
    return add_row(j, row, {{0, width_}});
}

std::span<const VoidRegion> VoidRegions::add_row(std::int64_t j, std::span<const double> row,
                                                 const Coverage::Runs& covered) {
    find_runs(j, row, covered);
    join_to_row_above();
    keep_open();
    return closed_;
}

std::span<const VoidRegion> VoidRegions::add_valid_row() {
    runs_.clear();
    keep_open();
    return closed_;
}

}  // namespace scree
