#include "tools/pyramid/texture_depth.h"

#include <algorithm>
#include <cmath>

#include "common/store/seed_codec.h"

namespace scree {
namespace {

using Run = TextureDepth::Run;
using Runs = TextureDepth::Runs;

// An image's border may stand off a tile's by rounding: so much of a texel is no reason to refine what lies beyond.
constexpr double kTexelSlack = 1.0 / 1024;

void join(Runs& runs) {
    std::sort(runs.begin(), runs.end(), [](const Run& a, const Run& b) { return a.begin < b.begin; });
    Runs joined;
    for (const Run& run : runs) {
        if (!joined.empty() && run.begin <= joined.back().end)
            joined.back().end = std::max(joined.back().end, run.end);
        else
            joined.push_back(run);
    }
    runs = std::move(joined);
}

Runs cut(const Runs& runs, std::int64_t begin, std::int64_t end) {
    Runs inside;
    auto run = std::partition_point(runs.begin(), runs.end(), [&](const Run& r) { return r.end <= begin; });
    for (; run != runs.end() && run->begin < end; ++run)
        inside.push_back({std::max(run->begin, begin), std::min(run->end, end)});
    return inside;
}

}  // namespace

TextureDepth::TextureDepth(const Lattice& lattice, int texture_size_log2, int least_level)
    : lattice_(lattice),
      size_log2_(texture_size_log2),
      least_(least_level),
      deepest_(least_level),
      coarsest_(least_level) {}

double TextureDepth::extent(int level) const {
    return std::ldexp(1.0, lattice_.deepest_level - level + lattice_.tile_cells_log2);
}

std::int64_t TextureDepth::columns(int level) const {
    return static_cast<std::int64_t>(std::ceil(static_cast<double>(lattice_.cells_x) / extent(level)));
}

std::int64_t TextureDepth::rows(int level) const {
    return static_cast<std::int64_t>(std::ceil(static_cast<double>(lattice_.cells_y) / extent(level)));
}

void TextureDepth::mark(double west, double north, double east, double south, int level) {
    if (level <= least_ || west >= static_cast<double>(lattice_.cells_x) ||
        north >= static_cast<double>(lattice_.cells_y))
        return;
    const double slack = kTexelSlack * std::ldexp(extent(level), -size_log2_), side = extent(level - 1);
    const auto clip = [](double v, std::int64_t count) {
        return static_cast<std::int64_t>(std::clamp(v, 0.0, static_cast<double>(count)));
    };
    const std::int64_t x0 = clip(std::floor((west + slack) / side), columns(level - 1)),
                       x1 = clip(std::ceil((east - slack) / side), columns(level - 1)),
                       y0 = clip(std::floor((north + slack) / side), rows(level - 1)),
                       y1 = clip(std::ceil((south - slack) / side), rows(level - 1));
    if (x0 >= x1 || y0 >= y1) return;
    deepest_ = std::max(deepest_, level);
    Rows& marked = refined_[level - 1];
    for (std::int64_t y = y0; y < y1; ++y) {
        Runs& runs = marked[y];
        if (!runs.empty() && x0 <= runs.back().end && x1 >= runs.back().begin)
            runs.back() = {std::min(x0, runs.back().begin), std::max(x1, runs.back().end)};
        else
            runs.push_back({x0, x1});
    }
}

void TextureDepth::finish() {
    for (int level = deepest_ - 1; level >= least_; --level) {
        for (auto& [y, runs] : refined_[level]) {
            join(runs);
            if (level == least_) continue;
            Runs& above = refined_[level - 1][y >> 1];
            for (const Run& run : runs) above.push_back({run.begin >> 1, (run.end + 1) >> 1});
        }
    }
    coarsest_ = least_;
    while (coarsest_ < deepest_ && full(coarsest_)) refined_.erase(coarsest_++);
}

bool TextureDepth::full(int level) const {
    const Rows& marked = refined_.at(level);
    const std::int64_t wide = columns(level);
    return static_cast<std::int64_t>(marked.size()) == rows(level) &&
           std::all_of(marked.begin(), marked.end(), [&](const auto& row) {
               return row.second.size() == 1 && row.second[0].begin == 0 && row.second[0].end == wide;
           });
}

Runs TextureDepth::refined_runs(int level, std::int64_t y, std::int64_t begin, std::int64_t end) const {
    if (level >= deepest_) return {};
    begin = std::max<std::int64_t>(begin, 0);
    end = std::min(end, columns(level));
    if (begin >= end || y < 0 || y >= rows(level)) return {};
    if (level < coarsest_) return {{begin, end}};
    const Rows& marked = refined_.at(level);
    const auto row = marked.find(y);
    return row == marked.end() ? Runs{} : cut(row->second, begin, end);
}

bool TextureDepth::refined(TileId id) const { return !refined_runs(id.level, id.y, id.x, id.x + 1).empty(); }

Runs TextureDepth::runs(int level, std::int64_t y, std::int64_t begin, std::int64_t end) const {
    begin = std::max<std::int64_t>(begin, 0);
    end = std::min(end, columns(level));
    if (begin >= end || y < 0 || y >= rows(level)) return {};
    if (level <= coarsest_) return {{begin, end}};
    Runs there;
    for (const Run& parents : refined_runs(level - 1, y >> 1, begin >> 1, (end + 1) >> 1))
        there.push_back({std::max(2 * parents.begin, begin), std::min(2 * parents.end, end)});
    return there;
}

Runs TextureDepth::leaf_runs(int level, std::int64_t y, std::int64_t begin, std::int64_t end) const {
    Runs leaves;
    for (const Run& there : runs(level, y, begin, end)) {
        std::int64_t from = there.begin;
        for (const Run& inner : refined_runs(level, y, there.begin, there.end)) {
            if (inner.begin > from) leaves.push_back({from, inner.begin});
            from = inner.end;
        }
        if (there.end > from) leaves.push_back({from, there.end});
    }
    return leaves;
}

int TextureDepth::deepest_under(int level, std::int64_t y, std::int64_t begin, std::int64_t end) const {
    if (level < coarsest_) return deepest_;
    for (int below = deepest_ - 1; below >= level; --below) {
        const int down = below - level;
        const Rows& marked = refined_.at(below);
        for (auto row = marked.lower_bound(y << down); row != marked.end() && row->first < (y + 1) << down; ++row)
            if (!cut(row->second, begin << down, end << down).empty()) return below + 1;
    }
    return level;
}

bool TextureDepth::seeded(TileId id) const {
    return varies() && id.level == coarsest_ &&
           deepest_under(id.level, id.y, id.x, id.x + 1) >= coarsest_ + kSeedLevelsUp;
}

std::int64_t TextureDepth::count(int level) const {
    if (level <= coarsest_) return columns(level) * rows(level);
    if (level > deepest_) return 0;
    std::int64_t tiles = 0;
    for (const auto& [y, marked] : refined_.at(level - 1))
        for (const std::int64_t child : {2 * y, 2 * y + 1})
            for (const Run& run : runs(level, child, 0, columns(level))) tiles += run.end - run.begin;
    return tiles;
}

}  // namespace scree
