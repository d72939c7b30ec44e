#include "runtime/app/audit.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/mesh/drawn_surface.h"
#include "common/mesh/geometric_error.h"
#include "common/store/height_codec.h"
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

Result<void> audit_frame(const TileStore& store, TileReader& reader, const Camera& camera, const DrawList& draws,
                         const CpuArena& arena, ErrorHistogram& errors) {
    const Dataset& d = store.dataset();
    const Lattice& l = d.lattice;
    const int n = l.tile_cells_log2;
    const std::int64_t m = l.tile_cells();
    const Frustum frustum(camera);
    const Projector project(camera);
    TileRow row;
    for (const DrawItem& item : draws) {
        const auto drawn = arena.heights(item.height_slot);
        const LatticePoint corner = l.corner(item.tile);
        const std::int64_t step = l.step(item.tile.level);
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
                        if (!frustum.contains(truth)) continue;
                        const ExactHeight z =
                            drawn_height(drawn, n, {item.geomip, item.edge_mask}, i - corner.i, j - corner.j, step);
                        if (z.numerator == z.denominator * tile->samples[k]) {
                            errors.add(0);
                            continue;
                        }
                        const glm::dvec3 shown{truth.x, truth.y, d.height_m(z.quanta())};
                        if (!frustum.contains(shown)) continue;
                        errors.add(glm::length(project(truth - camera.eye) - project(shown - camera.eye)));
                    }
            }
    }
    return {};
}

}  // namespace scree
