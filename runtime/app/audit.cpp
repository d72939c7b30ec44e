#include "runtime/app/audit.h"

#include <algorithm>
#include <cmath>
#include <limits>

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
          frustum_(frame.camera),
          project_(frame.camera) {}

    /// (u, v): the point's place on the tile, finest cells.
    void add(glm::dvec3 truth, const DrawnTile& tile, double u, double v, ErrorHistogram& errors) const {
        const double dx = truth.x - eye_.x, dy = truth.y - eye_.y;
        truth.z -= (dx * dx + dy * dy) * half_curvature_;
        if (!frustum_.contains(truth)) return;
        const glm::dvec3 shown = tile.at(u, v);
        if (!frustum_.contains(shown + eye_)) return;
        errors.add(glm::length(project_(truth - eye_) - project_(shown)));
    }

private:
    glm::dvec3 eye_;
    double half_curvature_;
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

Result<void> audit_frame(const TileStore& store, TileReader& reader, const AuditedFrame& frame,
                         ErrorHistogram& errors) {
    const Dataset& d = store.dataset();
    const Lattice& l = d.lattice;
    const int n = l.tile_cells_log2;
    const std::int64_t m = l.tile_cells();
    const Judge judge(frame);
    DrawnTile drawn(
        l, make_relative_frame(l, d.height_offset_m, d.height_quantum_m, frame.camera.eye, frame.half_curvature));
    TileRow row;
    for (const DrawItem& item : frame.draws) {
        drawn.set(item, frame.arena.vertices(item.height_slot));
        const LatticePoint corner = l.corner(item.tile);
        const int up = l.deepest_level - item.tile.level;
        for (std::int64_t y = item.tile.y << up; y < (item.tile.y + 1) << up; ++y)
            for (std::int64_t x = item.tile.x << up; x < (item.tile.x + 1) << up; ++x) {
                const TileId id{l.deepest_level, x, y};
                if (x * m >= l.cells_x || y * m >= l.cells_y) continue;
                auto found = reader.read(TileKind::height, id, row);
                if (!found) return found.error();
                if (!*found) continue;
                auto tile = decode_height_tile(row.payload, n, row.codec);
                if (!tile) return tile.error();
                const auto present = present_vertices(tile->presence, n);
                for (std::int64_t r = 0; r <= m; ++r)
                    for (std::int64_t c = 0; c <= m; ++c) {
                        const auto k = static_cast<std::size_t>(r * (m + 1) + c);
                        if (!present.empty() && present[k] == 0) continue;
                        const std::int64_t i = x * m + c, j = y * m + r;
                        const glm::dvec3 truth{l.x_m(static_cast<double>(i)), l.y_m(static_cast<double>(j)),
                                               d.height_m(tile->samples[k])};
                        judge.add(truth, drawn, static_cast<double>(i - corner.i), static_cast<double>(j - corner.j),
                                  errors);
                    }
            }
    }
    return {};
}

}  // namespace scree
