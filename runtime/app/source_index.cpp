#include "runtime/app/source_index.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace scree {
namespace {

constexpr std::int64_t kFan = 4;          // boxes a side in the box above
constexpr std::int64_t kFewSamples = 64;  // which are handed over without looking closer

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr PlaneRect kNowhere{kInfinity, kInfinity, -kInfinity, -kInfinity};

// A patch with a corner without a place has none: its samples have none either.
void add(PlaneRect& box, const SourcePoint& p) {
    box.west = std::min(box.west, p.x);
    box.east = std::max(box.east, p.x);
    box.south = std::min(box.south, p.y);
    box.north = std::max(box.north, p.y);
}
bool has_place(const SourcePoint& p) { return !std::isnan(p.x) && !std::isnan(p.y); }

PlaneRect box_of(const SourcePoint& a, const SourcePoint& b, const SourcePoint& c, const SourcePoint& d) {
    PlaneRect box = kNowhere;
    if (!has_place(a) || !has_place(b) || !has_place(c) || !has_place(d)) return box;
    for (const SourcePoint& p : {a, b, c, d}) add(box, p);
    return box;
}

bool meets(const PlaneRect& a, const PlaneRect& b, double slack) {
    return a.west <= b.east + slack && a.east >= b.west - slack && a.south <= b.north + slack &&
           a.north >= b.south - slack;
}
bool lies_within(const PlaneRect& inner, const PlaneRect& outer, double slack) {
    return inner.west > outer.west + slack && inner.east < outer.east - slack && inner.south > outer.south + slack &&
           inner.north < outer.north - slack;
}

}  // namespace

struct SourceIndex::Search {
    const PlaneRect& where;
    double slack_m;
    const Visit& visit;
};

SourceIndex::SourceIndex(const SourceLayer& layer)
    : layer_(layer), cells_x_(layer.control_columns() - 1), cells_y_(layer.control_rows() - 1) {
    std::int64_t below_x = cells_x_, below_y = cells_y_;
    do {
        Level level{(below_x + kFan - 1) / kFan, (below_y + kFan - 1) / kFan, {}};
        level.boxes.assign(static_cast<std::size_t>(level.columns * level.rows), kNowhere);
        for (std::int64_t y = 0; y < below_y; ++y)
            for (std::int64_t x = 0; x < below_x; ++x) {
                const PlaneRect inner =
                    levels_.empty() ? cell_box(x, y) : levels_.back().boxes[static_cast<std::size_t>(y * below_x + x)];
                PlaneRect& outer = level.boxes[static_cast<std::size_t>(y / kFan * level.columns + x / kFan)];
                outer = {std::min(outer.west, inner.west), std::min(outer.south, inner.south),
                         std::max(outer.east, inner.east), std::max(outer.north, inner.north)};
            }
        below_x = level.columns;
        below_y = level.rows;
        levels_.push_back(std::move(level));
    } while (below_x * below_y > 1);
}

PlaneRect SourceIndex::cell_box(std::int64_t column, std::int64_t row) const {
    return box_of(layer_.control(column, row), layer_.control(column + 1, row), layer_.control(column, row + 1),
                  layer_.control(column + 1, row + 1));
}

void SourceIndex::find(const PlaneRect& where, double slack_m, const Visit& visit) const {
    search({where, slack_m, visit}, levels_.size(), 0, 0);
}

// `level` 0: control cells.
void SourceIndex::search(const Search& s, std::size_t level, std::int64_t column, std::int64_t row) const {
    if (level == 0) {
        if (!meets(cell_box(column, row), s.where, s.slack_m)) return;
        // A line between cells belongs to the one after it, the last lines to the last cells.
        const std::int64_t left = layer_.control_column(column), top = layer_.control_row(row);
        const std::int64_t right = layer_.control_column(column + 1) + (column + 1 == cells_x_ ? 1 : 0),
                           bottom = layer_.control_row(row + 1) + (row + 1 == cells_y_ ? 1 : 0);
        return search_samples(s, {left, top, right - left, bottom - top});
    }
    const Level& here = levels_[level - 1];
    if (!meets(here.boxes[static_cast<std::size_t>(row * here.columns + column)], s.where, s.slack_m)) return;
    const std::int64_t below_x = level == 1 ? cells_x_ : levels_[level - 2].columns,
                       below_y = level == 1 ? cells_y_ : levels_[level - 2].rows;
    for (std::int64_t y = row * kFan; y < std::min((row + 1) * kFan, below_y); ++y)
        for (std::int64_t x = column * kFan; x < std::min((column + 1) * kFan, below_x); ++x)
            search(s, level - 1, x, y);
}

void SourceIndex::search_samples(const Search& s, const SampleRect& samples) const {
    const auto left = static_cast<double>(samples.column), top = static_cast<double>(samples.row);
    const double right = left + static_cast<double>(samples.columns - 1),
                 bottom = top + static_cast<double>(samples.rows - 1);
    const PlaneRect box = box_of(layer_.position(left, top), layer_.position(right, top), layer_.position(left, bottom),
                                 layer_.position(right, bottom));
    // Twice: what rounds the corners may round the samples otherwise.
    if (!meets(box, s.where, 2 * s.slack_m)) return;
    const bool inside = lies_within(box, s.where, 2 * s.slack_m);
    if (inside || samples.columns * samples.rows <= kFewSamples) return s.visit(samples, inside);
    SampleRect first = samples, second = samples;
    if (samples.columns >= samples.rows) {
        first.columns = samples.columns / 2;
        second.column += first.columns;
        second.columns -= first.columns;
    } else {
        first.rows = samples.rows / 2;
        second.row += first.rows;
        second.rows -= first.rows;
    }
    search_samples(s, first);
    search_samples(s, second);
}

}  // namespace scree
