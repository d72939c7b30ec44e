#include "tests/runtime/lod/meshed_world.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "runtime/lod/page_measure.h"
#include "tests/runtime/lod/drawn_frame.h"
#include "tests/runtime/lod/selection_support.h"

namespace scree::test {

MeshedWorld::MeshedWorld(const TerrainShape& shape, HeightFunction height, const LodSettings& lod,
                         PresenceFunction present, std::int64_t pool_tiles)
    : pool_is_short_(pool_tiles > 0),
      terrain_(shape, std::move(height), std::move(present)),
      lod_(lod),
      residency_(terrain_),
      selector_(terrain_.dataset()),
      arena_(arena_of(terrain_)),
      patterns_(terrain_.lattice().tile_cells_log2) {
    residency_.add_all();
    if (lod.method == LodMethod::geomip) return;
    // One tile's worth in the pool for sixteen slots.
    const auto tiles = static_cast<std::int64_t>(terrain_.tiles().size());
    const std::int64_t slots = 16 * (pool_tiles > 0 ? pool_tiles : 2 * tiles);
    mesher_ = std::make_unique<PageMesher>(terrain_.dataset(), lod, std::max(slots, tiles));
    reload();
}

void MeshedWorld::reload() {
    const PageMeasure measure(terrain_.lattice().tile_cells_log2, lod_.metric);
    std::vector<VertexCost> costs(slot_vertex_count(terrain_.lattice().tile_cells_log2));
    for (const TileId id : terrain_.tiles()) {
        const std::int32_t slot = terrain_.index(id);
        measure.measure(terrain_.dataset(), id, terrain_.tile(id)->header, arena_.vertices(slot), costs);
        for (const VertexCost& cost : costs)
            EXPECT_TRUE(std::isfinite(cost.error_m) && std::isfinite(cost.radius_m) && cost.error_m >= 0);
        mesher_->put(slot, arena_.vertices(slot), costs);
    }
}

const Selection& MeshedWorld::draw(std::span<const Camera> views, double tau_px, double half_curvature) {
    SelectionSettings settings = with_tau(mesher_ ? kCutShare * tau_px : tau_px);
    settings.half_curvature = half_curvature;
    settings.morph = mesher_ == nullptr;
    settings.list_tiles = mesher_ != nullptr;
    drawn_ = &selector_.select(views, settings, residency_);
    if (mesher_) mesher_->mesh(views, {tau_px, half_curvature}, residency_, *drawn_);
    return *drawn_;
}

DrawnMesh MeshedWorld::mesh(std::size_t view) const {
    return drawn_mesh(terrain_.dataset(), patterns_, drawn_->draws[view], arena_, mesher_ ? &mesher_->pool() : nullptr);
}

std::string MeshedWorld::fault(const Camera& camera, std::size_t view, double tau_px, double half_curvature) const {
    const Selection& s = *drawn_;
    const double promise_px = lod_.promise_px(tau_px);
    for (const double px : {s.max_bound_px, s.mean_bound_px, s.tau_effective_px})
        if (!std::isfinite(px) || px < 0) return fmt::format("a bound of {} px", px);
    if ((s.budget_limited && !pool_is_short_) || !s.complete) return "limited or not complete";
    if (!s.budget_limited && s.max_bound_px > promise_px * (1 + 1e-12))
        return fmt::format("a bound of {} px is stated", s.max_bound_px);
    float worst_item_px = 0;
    for (const DrawList& list : s.draws)
        for (const DrawItem& item : list) worst_item_px = std::max(worst_item_px, item.bound_px);
    if (!s.draws.empty() && s.nodes > 0 && worst_item_px != static_cast<float>(s.max_bound_px))
        return fmt::format("tiles are {} px off, all together {} px", worst_item_px, s.max_bound_px);
    for (const DrawItem& item : s.draws[view])
        for (const float weight :
             {item.morph, item.edge_morph[0], item.edge_morph[1], item.edge_morph[2], item.edge_morph[3]})
            if (!(weight >= 0 && weight < 1)) return fmt::format("a weight of {}", weight);
    const DrawnFrame frame(terrain_, s.draws[view]);
    if (frame.cells_drawn_twice() > 0) return fmt::format("{} cells drawn twice", frame.cells_drawn_twice());
    if (const auto missed = frame.visible_cells_missed(camera, half_curvature); missed > 0)
        return fmt::format("{} cells seen but not drawn", missed);
    const DrawnMesh drawn = mesh(view);
    for (const LatticeVertex& v : drawn.corners)
        if (!std::isfinite(v.n)) return "a height that is no number";
    if (std::string leak = frame.leak(drawn); !leak.empty()) return leak;
    const double off_px = greatest_error_px(camera, drawn, half_curvature);
    if (!(off_px <= std::max(s.max_bound_px, 0.0) * (1 + 1e-9)))
        return fmt::format("{} px off, {} px stated", off_px, s.max_bound_px);
    return {};
}

// What a place without a present cell about it looks like is promised nothing.
bool MeshedWorld::is_data(std::int64_t i, std::int64_t j) const {
    return terrain_.present(i, j) || terrain_.present(i - 1, j) || terrain_.present(i, j - 1) ||
           terrain_.present(i - 1, j - 1);
}

double MeshedWorld::greatest_error_px(const Camera& camera, const DrawnMesh& mesh, double half_curvature) const {
    const Dataset& d = terrain_.dataset();
    const double error_px = camera.focal_px() * camera.off_axis_factor();
    const auto drop = [&](double i, double j) {
        const double x = d.lattice.x_m(i) - camera.eye.x, y = d.lattice.y_m(j) - camera.eye.y;
        return (x * x + y * y) * half_curvature;
    };
    // A morphed height is rounded to float.
    const double grain_m =
        mesher_ ? 0
                : std::max(std::abs(d.min_height_m - d.height_offset_m), std::abs(d.max_height_m - d.height_offset_m)) *
                      0x1p-23;
    double worst = 0;
    for (std::size_t t = 0; t < mesh.corners.size(); t += 3) {
        const LatticeVertex corners[] = {mesh.corners[t], mesh.corners[t + 1], mesh.corners[t + 2]};
        double z[3];
        for (int k = 0; k < 3; ++k)
            z[k] = d.height_m(static_cast<double>(corners[k].n)) - drop(corners[k].i, corners[k].j) -
                   static_cast<double>(corners[k].morph_reach_m2) * half_curvature;
        const auto side = [&](int k, std::int64_t i, std::int64_t j) {  // doubled area left of the side behind k
            const LatticeVertex &a = corners[(k + 1) % 3], &b = corners[(k + 2) % 3];
            return (j - a.j) * (b.i - a.i) * std::int64_t{-1} + (i - a.i) * std::int64_t{b.j - a.j};
        };
        const std::int64_t area = side(0, corners[0].i, corners[0].j);
        const auto [west, east] = std::minmax({corners[0].i, corners[1].i, corners[2].i});
        const auto [north, south] = std::minmax({corners[0].j, corners[1].j, corners[2].j});
        for (std::int64_t j = north; j <= south; ++j)
            for (std::int64_t i = west; i <= east; ++i) {
                const std::int64_t shares[] = {side(0, i, j), side(1, i, j), side(2, i, j)};
                if (std::any_of(shares, shares + 3, [&](std::int64_t share) { return share * area < 0; })) continue;
                if (!is_data(i, j)) continue;
                double drawn = 0;
                for (int k = 0; k < 3; ++k) drawn += static_cast<double>(shares[k]) * z[k];
                drawn /= static_cast<double>(area);
                const double truth = terrain_.height_m(i, j) - drop(static_cast<double>(i), static_cast<double>(j));
                // The sum of three products is rounded, the data is not.
                const double delta = std::abs(drawn - truth) - grain_m - 1e-15 * std::abs(truth);
                if (delta <= 1e-9 * d.height_quantum_m) continue;
                ++places_off_;
                const double h = std::hypot(d.lattice.x_m(static_cast<double>(i)) - camera.eye.x,
                                            d.lattice.y_m(static_cast<double>(j)) - camera.eye.y);
                const double p = std::hypot(h, truth - camera.eye.z), q = std::hypot(h, drawn - camera.eye.z);
                if (std::max(p, q) < camera.near_m || h == 0) continue;
                worst = std::max(worst, error_px * delta * h / (p * q));
            }
    }
    return worst;
}

}  // namespace scree::test
