#include "runtime/app/audit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <unordered_set>

#include "common/mesh/geometric_error.h"
#include "common/store/height_codec.h"
#include "runtime/app/drawn_tile.h"
#include "runtime/view/frustum.h"

namespace scree {
namespace {

constexpr double kFirstBinPx = 1e-6;
constexpr double kBinRatio = 1.004;

// Screen position in pixels of a point relative to the eye.
struct Projector {
    glm::dvec3 right, up, forward;
    double focal;
    explicit Projector(const Camera& c) : right(c.right()), up(c.up), forward(c.forward), focal(c.focal_px()) {}
    glm::dvec2 operator()(glm::dvec3 p) const {
        const double depth = glm::dot(p, forward);
        return focal / depth * glm::dvec2(glm::dot(p, right), glm::dot(p, up));
    }
};

// Compares true points with the drawn surface above or below them.
class Judge {
public:
    explicit Judge(const AuditedFrame& frame)
        : eye_(frame.camera.eye),
          half_curvature_(frame.half_curvature),
          px_per_m_at_1m_(frame.camera.focal_px() * frame.camera.off_axis_factor()),
          frustum_(frame.camera),
          project_(frame.camera) {}

    /// Pixels between a true point and the drawn one; (u, v): its place on the tile, finest cells. Nullopt where either
    /// is out of view.
    std::optional<double> error_px(glm::dvec3 truth, const DrawnTile& tile, double u, double v) const {
        truth = curved(truth);
        if (!frustum_.contains(truth)) return std::nullopt;
        const glm::dvec3 shown = tile.at(u, v);
        if (!frustum_.contains(shown + eye_)) return std::nullopt;
        return glm::length(project_(truth - eye_) - project_(shown));
    }
    void add(glm::dvec3 truth, const DrawnTile& tile, double u, double v, ErrorHistogram& errors) const {
        if (const auto px = error_px(truth, tile, u, v)) errors.add(*px);
    }
    /// Pixels that a metre of height at a point is seen as, at most.
    double px_per_m(glm::dvec3 point) const { return px_per_m_at_1m_ / glm::length(curved(point) - eye_); }

private:
    glm::dvec3 curved(glm::dvec3 point) const {
        const double dx = point.x - eye_.x, dy = point.y - eye_.y;
        point.z -= (dx * dx + dy * dy) * half_curvature_;
        return point;
    }

    glm::dvec3 eye_;
    double half_curvature_;
    double px_per_m_at_1m_;
    Frustum frustum_;
    Projector project_;
};

}  // namespace

void ErrorHistogram::add(double px) {
    if (std::isnan(px)) px = std::numeric_limits<double>::infinity();  // what cannot be measured is no small error
    ++count_;
    sum_ += px;
    max_ = std::max(max_, px);
    const double bin = px <= kFirstBinPx ? 0 : 1 + std::log(px / kFirstBinPx) / std::log(kBinRatio);
    ++bins_[bin < kBins - 1 ? static_cast<std::size_t>(bin) : static_cast<std::size_t>(kBins - 1)];
}

void ErrorHistogram::merge(const ErrorHistogram& other) {
    for (std::size_t k = 0; k < bins_.size(); ++k) bins_[k] += other.bins_[k];
    count_ += other.count_;
    sum_ += other.sum_;
    max_ = std::max(max_, other.max_);
}

double ErrorHistogram::quantile(double q) const {
    std::int64_t left = static_cast<std::int64_t>(std::ceil(q * static_cast<double>(count_)));
    for (std::size_t k = 0; k < bins_.size(); ++k) {
        left -= bins_[k];
        if (left <= 0 && k + 1 == bins_.size()) return max_;
        if (left <= 0) return k == 0 ? 0 : std::min(max_, kFirstBinPx * std::pow(kBinRatio, static_cast<double>(k)));
    }
    return max_;
}

namespace {

// Visits the leaves at or under a tile: the finest surface there.
template <class Visit>
Result<void> for_each_leaf(TileReader& reader, const Lattice& lattice, TileId id, const Visit& visit) {
    TileRow row;
    auto found = reader.read(TileKind::height, id, row);
    if (!found) return found.error();
    if (!*found) return {};
    const auto tile = decode_height_tile(row.payload, lattice.tile_cells_log2, row.codec);
    if (!tile) return tile.error();
    if (tile->header.is_leaf() || id.level >= lattice.deepest_level) return visit(id, *tile), Result<void>{};
    for (int q = 0; q < 4; ++q)
        if ((tile->header.child_mask >> q & 1) != 0)
            if (auto ok = for_each_leaf(reader, lattice, child_of(id, q), visit); !ok) return ok;
    return {};
}

}  // namespace

Result<void> audit_frame(const TileStore& store, TileReader& reader, const AuditedFrame& frame,
                         ErrorHistogram& errors) {
    const Dataset& d = store.dataset();
    const Lattice& l = d.lattice;
    const std::int64_t m = l.tile_cells();
    const Judge judge(frame);
    DrawnTile drawn(
        l, make_relative_frame(l, d.height_offset_m, d.height_quantum_m, frame.camera.eye, frame.half_curvature));
    for (const DrawItem& item : frame.draws) {
        drawn.set(item, frame.arena.vertices(item.height_slot));
        const LatticePoint corner = l.corner(item.tile);
        auto ok = for_each_leaf(reader, l, item.tile, [&](TileId id, const HeightTile& leaf) {
            const auto present = present_vertices(leaf.presence, l.tile_cells_log2);
            const LatticePoint first = l.corner(id);
            const std::int64_t step = l.step(id.level);
            for (std::int64_t r = 0; r <= m; ++r)
                for (std::int64_t c = 0; c <= m; ++c) {
                    const auto k = static_cast<std::size_t>(r * (m + 1) + c);
                    if (!present.empty() && present[k] == 0) continue;
                    const std::int64_t i = first.i + c * step, j = first.j + r * step;
                    const glm::dvec3 truth{l.x_m(static_cast<double>(i)), l.y_m(static_cast<double>(j)),
                                           d.height_m(leaf.samples[k])};
                    judge.add(truth, drawn, static_cast<double>(i - corner.i), static_cast<double>(j - corner.j),
                              errors);
                }
        });
        if (!ok) return ok;
    }
    return {};
}

namespace {

/// Columns of a source: with so much room for rounding a sample lies on a line of the lattice.
constexpr double kOnLine = 1e-6;

// Does the sample belong to a cell of four valid ones? Where it does not, nothing is drawn.
bool is_drawn(const SourceRaster& source, std::int64_t column, std::int64_t row) {
    const auto valid = [&](std::int64_t c, std::int64_t r) {
        return c >= 0 && r >= 0 && c < source.columns && r < source.rows && !std::isnan(source.at(c, r));
    };
    for (const int dx : {-1, 1})
        for (const int dy : {-1, 1})
            if (valid(column + dx, row) && valid(column, row + dy) && valid(column + dx, row + dy)) return true;
    return false;
}

// Which drawn tile a place belongs to: on a line between tiles to one of them, whichever are drawn.
class TileMap {
public:
    TileMap(const Lattice& lattice, const DrawList& draws) : lattice_(lattice) {
        for (const DrawItem& item : draws) drawn_.insert(item.tile);
    }
    bool owns(TileId tile, double i, double j, double slack_i, double slack_j) const {
        for (const std::int64_t cj : cells_at(j, slack_j))
            for (const std::int64_t ci : cells_at(i, slack_i))
                if (const auto found = over(ci, cj)) return *found == tile;
        return false;
    }

private:
    // The cell after a place and the one before: the same unless it is on the line between them.
    static std::array<std::int64_t, 2> cells_at(double at, double slack) {
        return {static_cast<std::int64_t>(std::floor(at + slack)), static_cast<std::int64_t>(std::floor(at - slack))};
    }
    std::optional<TileId> over(std::int64_t ci, std::int64_t cj) const {
        if (ci < 0 || cj < 0) return std::nullopt;
        const TileId finest{lattice_.deepest_level, ci >> lattice_.tile_cells_log2, cj >> lattice_.tile_cells_log2};
        for (int level = 0; level <= finest.level; ++level)
            if (const TileId id = ancestor_at(finest, level); drawn_.count(id) != 0) return id;
        return std::nullopt;
    }

    const Lattice& lattice_;
    std::unordered_set<TileId, TileIdHash> drawn_;
};

/// Samples of a source along one axis: first and one past the last of those between two places, both included, given
/// in columns.
struct Range {
    std::int64_t first, end;
    Range(double from, double to, std::int64_t count)
        : first(static_cast<std::int64_t>(std::clamp(std::ceil(from - kOnLine), 0.0, static_cast<double>(count)))),
          end(static_cast<std::int64_t>(std::clamp(std::floor(to + kOnLine) + 1, 0.0, static_cast<double>(count)))) {}
};

}  // namespace

void audit_against(const Dataset& d, const SourceRaster& source, const AuditedFrame& frame, double stated_m,
                   ErrorHistogram& errors, double& excess_px) {
    const Lattice& l = d.lattice;
    const Judge judge(frame);
    const TileMap tiles(l, frame.draws);
    const double slack_i = kOnLine * source.dx / l.spacing_m, slack_j = kOnLine * source.dy / l.spacing_m;
    DrawnTile drawn(
        l, make_relative_frame(l, d.height_offset_m, d.height_quantum_m, frame.camera.eye, frame.half_curvature));
    const auto column_at = [&](std::int64_t i) { return (l.x_m(static_cast<double>(i)) - source.x0) / source.dx; };
    const auto row_at = [&](std::int64_t j) { return (source.y0 - l.y_m(static_cast<double>(j))) / source.dy; };
    for (const DrawItem& item : frame.draws) {
        drawn.set(item, frame.arena.vertices(item.height_slot));
        const LatticePoint corner = l.corner(item.tile);
        const std::int64_t extent = l.tile_extent(item.tile.level);
        const auto last = static_cast<double>(extent);
        const Range columns(column_at(corner.i), column_at(std::min(corner.i + extent, l.cells_x)), source.columns);
        const Range rows(row_at(corner.j), row_at(std::min(corner.j + extent, l.cells_y)), source.rows);
        for (std::int64_t row = rows.first; row < rows.end; ++row)
            for (std::int64_t column = columns.first; column < columns.end; ++column) {
                const double height_m = source.at(column, row);
                if (std::isnan(height_m) || !is_drawn(source, column, row)) continue;
                const glm::dvec3 truth{source.x0 + static_cast<double>(column) * source.dx,
                                       source.y0 - static_cast<double>(row) * source.dy, height_m};
                const double i = l.i_of(truth.x), j = l.j_of(truth.y);
                // Only a tile's last lines may be another's.
                if ((row + 1 == rows.end || column + 1 == columns.end) &&
                    !tiles.owns(item.tile, i, j, slack_i, slack_j))
                    continue;
                const double u = std::clamp(i - static_cast<double>(corner.i), 0.0, last);
                const double v = std::clamp(j - static_cast<double>(corner.j), 0.0, last);
                const auto px = judge.error_px(truth, drawn, u, v);
                if (!px) continue;
                errors.add(*px);
                excess_px = std::max(excess_px, *px - stated_m * judge.px_per_m(truth));
            }
    }
}

}  // namespace scree
