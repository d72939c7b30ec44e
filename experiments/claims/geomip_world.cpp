#include "experiments/claims/geomip_world.h"

#include <algorithm>
#include <cmath>

#include "common/mesh/drawn_surface.h"
#include "common/mesh/tile_patterns.h"

namespace scree {
namespace {

/// Height of a block drawn as two triangles, at cell corner (u, v) of its m cells.
double two_triangles(const std::vector<std::int32_t>& z, int m, int u, int v) {
    const auto at = [&](int i, int j) { return static_cast<double>(z[static_cast<std::size_t>(j * (m + 1) + i)]); };
    const double x = static_cast<double>(u) / m, y = static_cast<double>(v) / m;
    if (x >= y) return at(0, 0) + x * (at(m, 0) - at(0, 0)) + y * (at(m, m) - at(m, 0));
    return at(0, 0) + y * (at(0, m) - at(0, 0)) + x * (at(m, m) - at(0, m));
}

}  // namespace

GeomipWorld::GeomipWorld(const Terrain& terrain, int cells_log2)
    : terrain_(terrain),
      n_(cells_log2),
      columns_((terrain.columns - 1) >> cells_log2),
      rows_((terrain.rows - 1) >> cells_log2) {
    const int m = 1 << n_;
    for (int y = 0; y < rows_; ++y)
        for (int x = 0; x < columns_; ++x) {
            GeomipBlock block;
            block.i = x * m;
            block.j = y * m;
            block.heights_n = block_heights(terrain, block.i, block.j, n_);
            const auto [low, high] = std::minmax_element(block.heights_n.begin(), block.heights_n.end());
            const glm::dvec3 corner = terrain.place(block.i, block.j);
            const double side = terrain.spacing_m * m;
            block.box = {{corner.x, corner.y - side, terrain.quantum_m * *low},
                         {corner.x + side, corner.y, terrain.quantum_m * *high}};
            measure(block);
            blocks_.push_back(std::move(block));
        }
}

void GeomipWorld::measure(GeomipBlock& block) const {
    const int m = 1 << n_;
    const auto greatest = [&](int stride, const auto& height) {
        double worst = 0;
        for (int v = 0; v <= m; v += stride)
            for (int u = 0; u <= m; u += stride) {
                const double z = block.heights_n[static_cast<std::size_t>(v * (m + 1) + u)];
                worst = std::max(worst, std::abs(z - height(u, v)));
            }
        return worst * terrain_.quantum_m;
    };
    for (int level = 0; level <= n_; ++level) {
        const auto k = static_cast<std::size_t>(level);
        const auto whole = [&](int u, int v) {
            return level < n_ ? drawn_height(block.heights_n, n_, {level, 0}, u, v, 1).quanta()
                              : two_triangles(block.heights_n, m, u, v);
        };
        block.error[k] = greatest(1, whole);
        block.step[k] = level > 0 ? greatest(1 << (level - 1), whole) : 0;
        block.bands[k] = block.error[k];
        // A fan of eight triangles round each second vertex: what one edge does another does not change.
        for (unsigned edge = 1; level < n_ && edge < kEdgeMaskCount; edge *= 2)
            block.bands[k] = std::max(block.bands[k], greatest(1, [&](int u, int v) {
                                          return drawn_height(block.heights_n, n_, {level, edge}, u, v, 1).quanta();
                                      }));
    }
}

std::vector<double> GeomipWorld::distances(const GeomipBlock& block, const Camera& camera,
                                           const GeomipMetric& metric) const {
    const double f = camera.focal_px() * (metric.off_axis ? camera.off_axis_factor() : 1);
    const auto& deltas = metric.delta == GeomipMetric::Delta::error  ? block.error
                         : metric.delta == GeomipMetric::Delta::step ? block.step
                                                                     : block.bands;
    std::vector<double> out;
    double greatest = 0;
    for (int level = 0; level < n_; ++level) {
        const double delta = deltas[static_cast<std::size_t>(level)];
        // Level 0 is taken for exact by all that do not count bands. De Boer takes each level by itself.
        if (level > 0 || metric.delta == GeomipMetric::Delta::bands) greatest = std::max(greatest, delta);
        out.push_back(f * (metric.delta == GeomipMetric::Delta::step ? delta : greatest) / metric.tau_px);
    }
    return out;
}

glm::dvec3 GeomipWorld::place(const GeomipBlock& block, int u, int v) const {
    return terrain_.place(block.i + u, block.j + v);
}

double GeomipWorld::error_on_axis_px(const GeomipBlock& block, const GeomipDrawn& drawn, const glm::dvec3& eye,
                                     double focal_px) const {
    const int m = 1 << n_;
    double worst = 0;
    for (int v = 0; v <= m; ++v)
        for (int u = 0; u <= m; ++u) {
            const glm::dvec3 truth = place(block, u, v), d = truth - eye;
            const double shown =
                terrain_.quantum_m * drawn_height(block.heights_n, n_, {drawn.level, drawn.thinned}, u, v, 1).quanta();
            const double h2 = d.x * d.x + d.y * d.y, below = shown - eye.z;
            const double r = std::sqrt(h2 + d.z * d.z), r_shown = std::sqrt(h2 + below * below);
            worst = std::max(worst, focal_px * std::abs(shown - truth.z) * std::sqrt(h2) / (r * r_shown));
        }
    return worst;
}

std::vector<GeomipDrawn> GeomipWorld::select(const Camera& camera, const GeomipMetric& metric) const {
    std::vector<GeomipDrawn> drawn;
    for (const GeomipBlock& block : blocks_) {
        GeomipDrawn d;
        d.distance_m = metric.to_box ? distance_to_box(camera.eye, block.box)
                                     : glm::distance(camera.eye, 0.5 * (block.box.low + block.box.high));
        const auto passed = distances(block, camera, metric);
        for (int level = 1; level < n_; ++level)
            if (d.distance_m > passed[static_cast<std::size_t>(level)]) d.level = level;
        drawn.push_back(d);
    }
    const auto across = [&](int x, int y, int side) -> const GeomipDrawn* {
        static constexpr std::array<std::array<int, 2>, 4> kStep{{{0, -1}, {1, 0}, {0, 1}, {-1, 0}}};
        const auto [dx, dy] = kStep[static_cast<std::size_t>(side)];
        if (x + dx < 0 || y + dy < 0 || x + dx >= columns_ || y + dy >= rows_) return nullptr;
        return &drawn[index(x + dx, y + dy)];
    };
    for (bool changed = true; changed;) {
        changed = false;
        for (int y = 0; y < rows_; ++y)
            for (int x = 0; x < columns_; ++x)
                for (int side = 0; side < 4; ++side)
                    if (const GeomipDrawn* other = across(x, y, side);
                        other != nullptr && drawn[index(x, y)].level > other->level + 1) {
                        drawn[index(x, y)].level = other->level + 1;
                        changed = true;
                    }
    }
    for (int y = 0; y < rows_; ++y)
        for (int x = 0; x < columns_; ++x)
            for (int side = 0; side < 4; ++side)
                if (const GeomipDrawn* other = across(x, y, side);
                    other != nullptr && other->level > drawn[index(x, y)].level)
                    drawn[index(x, y)].thinned |= 1u << side;
    return drawn;
}

void GeomipWorld::judge(const GeomipBlock& block, const GeomipDrawn& drawn, const Camera& camera,
                        PixelErrors& errors) const {
    const Frustum frustum(camera);
    if (!frustum.may_see(block.box)) return;
    const int m = 1 << n_;
    for (int v = 0; v <= m; ++v)
        for (int u = 0; u <= m; ++u) {
            const glm::dvec3 truth = place(block, u, v);
            glm::dvec3 shown = truth;
            shown.z =
                terrain_.quantum_m * drawn_height(block.heights_n, n_, {drawn.level, drawn.thinned}, u, v, 1).quanta();
            if (frustum.contains(truth) && frustum.contains(shown))
                errors.add(screen_distance_px(camera, truth, shown));
        }
}

std::int64_t GeomipWorld::triangles(const GeomipDrawn& drawn) const {
    return pattern_triangles(n_, drawn.level, drawn.thinned);
}

}  // namespace scree
