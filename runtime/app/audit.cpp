#include "runtime/app/audit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <unordered_set>

#include "common/mesh/geometric_error.h"
#include "runtime/app/drawn_tile.h"
#include "runtime/app/leaf_walk.h"
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
    ++bins_[bin_of(px)];
}

std::size_t ErrorHistogram::bin_of(double px) {
    const double bin = px <= kFirstBinPx ? 0 : 1 + std::log(px / kFirstBinPx) / std::log(kBinRatio);
    return bin < kBins - 1 ? static_cast<std::size_t>(bin) : static_cast<std::size_t>(kBins - 1);
}

std::int64_t ErrorHistogram::count_within(double px) const {
    if (px >= max_) return count_;
    std::int64_t count = 0;
    for (std::size_t k = 0; k <= bin_of(px); ++k) count += bins_[k];
    return count;
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

Result<void> audit_frame(const TileStore& store, TileReader& reader, const AuditedFrame& frame,
                         ErrorHistogram& errors) {
    const Dataset& d = store.dataset();
    const Lattice& l = d.lattice;
    const std::int64_t m = l.tile_cells();
    const Judge judge(frame);
    DrawnTile drawn(
        l, make_relative_frame(l, d.height_offset_m, d.height_quantum_m, frame.camera.eye, frame.half_curvature));
    for (const DrawItem& item : frame.draws) {
        if (auto set = drawn.set(item, frame.arena.vertices(item.height_slot), frame.meshes); !set) return set;
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

// Which drawn tile a place belongs to: on a line between tiles to one of them, whichever are drawn.
class TileMap {
public:
    TileMap(const Lattice& lattice, const DrawList& draws) : lattice_(lattice) {
        for (const DrawItem& item : draws) drawn_.insert(item.tile);
    }
    bool owns(TileId tile, double i, double j, double slack) const {
        for (const std::int64_t cj : cells_at(j, slack))
            for (const std::int64_t ci : cells_at(i, slack))
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

}  // namespace

Result<void> audit_against(const Dataset& d, const SourceJudge& source, const AuditedFrame& frame, double stated_m,
                           ErrorHistogram& errors, double& excess_px) {
    const Lattice& l = d.lattice;
    const Judge judge(frame);
    const TileMap tiles(l, frame.draws);
    const SourceLayer& layer = source.layer();
    const double slack = source.slack_m() / l.spacing_m;
    DrawnTile drawn(
        l, make_relative_frame(l, d.height_offset_m, d.height_quantum_m, frame.camera.eye, frame.half_curvature));
    for (const DrawItem& item : frame.draws) {
        if (auto set = drawn.set(item, frame.arena.vertices(item.height_slot), frame.meshes); !set) return set;
        const LatticePoint corner = l.corner(item.tile);
        const std::int64_t extent = l.tile_extent(item.tile.level);
        const auto last = static_cast<double>(extent);
        const double west = static_cast<double>(corner.i), north = static_cast<double>(corner.j);
        const PlaneRect where{l.x_m(west), l.y_m(static_cast<double>(std::min(corner.j + extent, l.cells_y))),
                              l.x_m(static_cast<double>(std::min(corner.i + extent, l.cells_x))), l.y_m(north)};
        source.index().find(where, source.slack_m(), [&](const SampleRect& samples, bool inside) {
            for (std::int64_t row = samples.row; row < samples.row + samples.rows; ++row)
                for (std::int64_t column = samples.column; column < samples.column + samples.columns; ++column) {
                    if (!source.judged(column, row)) continue;
                    const double height_m = layer.at(column, row);
                    if (std::isnan(height_m)) continue;
                    const SourcePoint at = layer.position(static_cast<double>(column), static_cast<double>(row));
                    const double i = l.i_of(at.x), j = l.j_of(at.y);
                    if (!inside && !tiles.owns(item.tile, i, j, slack)) continue;
                    const glm::dvec3 truth{at.x, at.y, height_m};
                    const auto px =
                        judge.error_px(truth, drawn, std::clamp(i - west, 0.0, last), std::clamp(j - north, 0.0, last));
                    if (!px) continue;
                    errors.add(*px);
                    excess_px = std::max(excess_px, *px - stated_m * judge.px_per_m(truth));
                }
        });
    }
    return {};
}

}  // namespace scree
