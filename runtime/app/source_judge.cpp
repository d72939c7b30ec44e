#include "runtime/app/source_judge.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "runtime/app/leaf_walk.h"

namespace scree {
namespace {

constexpr double kOnLine = 1e-6;   // finest cells: so near a line a sample is on it
constexpr double kOnPoint = 1e-3;  // finest cells: so near a point a sample was copied to it

// How many columns and rows lie within a square of the plane around a sample, to each side.
struct Reach {
    double columns = 0, rows = 0;
};

void widen(Reach& reach, const SourcePoint& origin, const SourcePoint& along_columns, const SourcePoint& along_rows,
           double columns, double rows, double metres) {
    const double cx = (along_columns.x - origin.x) / columns, cy = (along_columns.y - origin.y) / columns;
    const double rx = (along_rows.x - origin.x) / rows, ry = (along_rows.y - origin.y) / rows;
    const double area = std::abs(cx * ry - cy * rx);
    if (!(area > 0)) return;  // no place, or no area
    reach.columns = std::max(reach.columns, metres * (std::abs(rx) + std::abs(ry)) / area);
    reach.rows = std::max(reach.rows, metres * (std::abs(cx) + std::abs(cy)) / area);
}

Reach greatest_reach(const SourceLayer& l, double metres) {
    Reach reach;
    for (std::int64_t r = 0; r + 1 < l.control_rows(); ++r)
        for (std::int64_t c = 0; c + 1 < l.control_columns(); ++c) {
            const SourcePoint nw = l.control(c, r), ne = l.control(c + 1, r), sw = l.control(c, r + 1),
                              se = l.control(c + 1, r + 1);
            const auto columns = static_cast<double>(l.control_column(c + 1) - l.control_column(c)),
                       rows = static_cast<double>(l.control_row(r + 1) - l.control_row(r));
            widen(reach, nw, ne, sw, columns, rows, metres);
            widen(reach, se, sw, ne, columns, rows, metres);
        }
    return reach;
}

std::int64_t neighbours(double reach, std::int64_t most) {
    // What is linear in a control cell is not quite so beyond it.
    return static_cast<std::int64_t>(std::min(std::ceil(0.5 + 1.01 * reach), static_cast<double>(most)));
}

double farthest_m(const Lattice& l) {
    return std::max({std::abs(l.x_m(0)), std::abs(l.x_m(static_cast<double>(l.cells_x))), std::abs(l.y_m(0)),
                     std::abs(l.y_m(static_cast<double>(l.cells_y)))});
}

}  // namespace

SourceJudge::SourceJudge(const Dataset& dataset, const SourceLayer& layer)
    : layer_(&layer),
      index_(layer),
      slack_m_(std::max(kOnLine * dataset.lattice.spacing_m,
                        8 * std::numeric_limits<double>::epsilon() * farthest_m(dataset.lattice))),
      judged_(static_cast<std::size_t>((layer.columns * layer.rows + 63) / 64)) {}

Result<SourceJudge> SourceJudge::make(const Dataset& dataset, TileReader& reader, const SourceLayer& layer) {
    SourceJudge judge(dataset, layer);
    const Lattice& l = dataset.lattice;
    if (judge.on_lattice(dataset))
        judge.choose_copied();
    else
        judge.choose_resampled(l.spacing_m * static_cast<double>(l.step(dataset.least_leaf_level())));
    if (auto ok = judge.look_under(dataset, reader); !ok) return ok.error();
    return judge;
}

bool SourceJudge::on_lattice(const Dataset& dataset) const {
    const Lattice& l = dataset.lattice;
    if (dataset.least_leaf_level() != l.deepest_level || layer_->control_columns() != 2 || layer_->control_rows() != 2)
        return false;
    const auto whole = [](double v) { return std::abs(v - std::nearbyint(v)) <= kOnPoint; };
    const SourcePoint first = layer_->control(0, 0), last = layer_->control(1, 1);
    for (const SourcePoint& p : {first, last, layer_->control(1, 0), layer_->control(0, 1)})
        if (!whole(l.i_of(p.x)) || !whole(l.j_of(p.y))) return false;
    const auto same = [](double span, std::int64_t steps) {
        return std::abs(std::abs(span) - static_cast<double>(steps)) <= kOnPoint;
    };
    const SourcePoint east = layer_->control(1, 0);
    return same(l.i_of(east.x) - l.i_of(first.x), layer_->columns - 1) &&
           same(l.j_of(last.y) - l.j_of(first.y), layer_->rows - 1) && same(l.j_of(east.y) - l.j_of(first.y), 0);
}

void SourceJudge::choose_copied() {
    for (std::int64_t row = 0; row + 1 < layer_->rows; ++row)
        for (std::int64_t column = 0; column + 1 < layer_->columns; ++column)
            if (layer_->covered(column, row) && layer_->covered(column + 1, row) && layer_->covered(column, row + 1) &&
                layer_->covered(column + 1, row + 1))
                for (const std::int64_t r : {row, row + 1})
                    for (const std::int64_t c : {column, column + 1}) set(judged_, c, r);
}

void SourceJudge::choose_resampled(double cell_m) {
    const Reach reach = greatest_reach(*layer_, cell_m);
    const std::int64_t columns = neighbours(reach.columns, layer_->columns),
                       rows = neighbours(reach.rows, layer_->rows);
    // Rows, up to this one, in which all columns around have terrain.
    std::vector<std::int64_t> above(static_cast<std::size_t>(layer_->columns), 0);
    for (std::int64_t row = 0; row < layer_->rows; ++row) {
        std::int64_t run = 0;
        for (std::int64_t column = 0; column < layer_->columns; ++column) {
            run = layer_->covered(column, row) ? run + 1 : 0;
            const std::int64_t middle = column - columns;
            if (middle < 0) continue;
            std::int64_t& count = above[static_cast<std::size_t>(middle)];
            count = run > 2 * columns ? count + 1 : 0;
            if (count > 2 * rows) set(judged_, middle, row - rows);
        }
    }
}

Result<void> SourceJudge::look_under(const Dataset& dataset, TileReader& reader) {
    const Lattice& l = dataset.lattice;
    Bits drawn(judged_.size());
    for (std::int64_t y = 0; y < l.root_rows; ++y)
        for (std::int64_t x = 0; x < l.root_columns; ++x) {
            auto ok = for_each_leaf(reader, l, {0, x, y}, [&](TileId id, const HeightTile& leaf) {
                look_under(l, id, leaf.presence, drawn);
            });
            if (!ok) return ok;
        }
    for (std::size_t k = 0; k < judged_.size(); ++k) {
        not_drawn_ += std::popcount(judged_[k] & ~drawn[k]);
        judged_[k] &= drawn[k];
    }
    return {};
}

void SourceJudge::look_under(const Lattice& l, TileId id, const std::vector<std::uint8_t>& presence, Bits& drawn) {
    const LatticePoint corner = l.corner(id);
    const std::int64_t extent = l.tile_extent(id.level), m = l.tile_cells();
    const double step = static_cast<double>(l.step(id.level)), slack = slack_m_ / (l.spacing_m * step);
    const auto east = static_cast<double>(std::min(corner.i + extent, l.cells_x)),
               south = static_cast<double>(std::min(corner.j + extent, l.cells_y));
    const PlaneRect where{l.x_m(static_cast<double>(corner.i)), l.y_m(south), l.x_m(east),
                          l.y_m(static_cast<double>(corner.j))};
    // In the leaf's cells.
    const double end_u = (east - static_cast<double>(corner.i)) / step,
                 end_v = (south - static_cast<double>(corner.j)) / step;
    const auto present = [&](double u, double v) {
        if (!(u >= 0 && v >= 0 && u < end_u && v < end_v)) return false;
        return presence.empty() ||
               presence[static_cast<std::size_t>(static_cast<std::int64_t>(v) * m + static_cast<std::int64_t>(u))] != 0;
    };
    index_.find(where, slack_m_, [&](const SampleRect& samples, bool inside) {
        for (std::int64_t row = samples.row; row < samples.row + samples.rows; ++row)
            for (std::int64_t column = samples.column; column < samples.column + samples.columns; ++column) {
                if (!judged(column, row)) continue;
                if (inside && presence.empty()) {
                    set(drawn, column, row);
                    continue;
                }
                const SourcePoint at = layer_->position(static_cast<double>(column), static_cast<double>(row));
                const double u = (l.i_of(at.x) - static_cast<double>(corner.i)) / step,
                             v = (l.j_of(at.y) - static_cast<double>(corner.j)) / step;
                if (present(u + slack, v + slack) || present(u - slack, v + slack) || present(u + slack, v - slack) ||
                    present(u - slack, v - slack))
                    set(drawn, column, row);
            }
    });
}

}  // namespace scree
