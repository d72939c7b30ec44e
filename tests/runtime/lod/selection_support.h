// What the tests of selection share: comparing results, and the numbers of one drawn item computed anew.
#pragma once

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <tuple>
#include <vector>

#include "runtime/lod/selection.h"
#include "tests/runtime/lod/synthetic_terrain.h"

namespace scree::test {

inline constexpr SelectionSettings kPlenty{
    .tau_px = 1, .texture_tau_px = 1, .height_slots = 1 << 20, .texture_slots = 1 << 20};

inline SelectionSettings with_tau(double tau_px) {
    SelectionSettings settings = kPlenty;
    settings.tau_px = tau_px;
    return settings;
}

inline auto fields(const TexturePlacement& t) { return std::tuple(t.slot, t.scale, t.offset_u, t.offset_v); }

inline auto fields(const DrawItem& d) {
    return std::tuple(d.tile, d.height_slot, d.geomip, d.edge_mask, d.part.level, d.part.x, d.part.y, d.morph,
                      d.edge_morph, fields(d.texture), d.texture_share, fields(d.coarse_texture), d.neighbour_textures);
}

inline bool same_draws(const DrawList& a, const DrawList& b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                      [](const DrawItem& x, const DrawItem& y) { return fields(x) == fields(y); });
}

/// The same picture, whatever it took to choose it and whoever asks for more.
inline bool same_picture(const Selection& a, const Selection& b) {
    return std::equal(a.draws.begin(), a.draws.end(), b.draws.begin(), b.draws.end(), same_draws) &&
           std::equal(a.parts.begin(), a.parts.end(), b.parts.begin(), b.parts.end(), same_draws) &&
           std::tuple(a.max_bound_px, a.mean_bound_px, a.triangles, a.nodes) ==
               std::tuple(b.max_bound_px, b.mean_bound_px, b.triangles, b.nodes);
}

/// Everything but refine_steps, which says how long the search for what fits took.
inline bool same_selection(const Selection& a, const Selection& b) {
    const auto same_request = [](const TileRequest& x, const TileRequest& y) {
        return x.kind == y.kind && x.id == y.id && x.priority == y.priority && x.prefetch == y.prefetch;
    };
    return same_picture(a, b) &&
           std::equal(a.requests.begin(), a.requests.end(), b.requests.begin(), b.requests.end(), same_request) &&
           a.planned_heights == b.planned_heights && a.planned_textures == b.planned_textures &&
           std::tuple(a.tau_effective_px, a.texture_tau_effective_px, a.complete, a.growing, a.budget_limited) ==
               std::tuple(b.tau_effective_px, b.texture_tau_effective_px, b.complete, b.growing, b.budget_limited);
}

/// Tiles that full residency would keep, resident or requested.
inline std::vector<TileId> planned_tiles(const SyntheticTerrain& terrain, const Selection& s, TileKind kind) {
    const bool heights = kind == TileKind::height;
    std::vector<TileId> ids;
    for (const std::int32_t slot : heights ? s.planned_heights : s.planned_textures)
        ids.push_back((heights ? terrain.tiles() : terrain.textures()).at(static_cast<std::size_t>(slot)));
    for (const TileRequest& r : s.requests)
        if (r.kind == kind) ids.push_back(r.id);
    return ids;
}

/// Of a planet small enough that its curvature shows on so small a terrain: the far side drops by up to the extent.
inline double random_half_curvature(Random& random, const SyntheticTerrain& terrain) {
    const Lattice& l = terrain.lattice();
    const double extent_m = l.spacing_m * static_cast<double>(l.cells_x);
    return std::exp(uniform_real(random, -6, -1)) / extent_m;
}

/// Every tile came at some time in the last second, as far as the clock, and takes some time to grow.
inline void arrive_at_random(Random& random, const SyntheticTerrain& terrain, FakeResidency& residency,
                             SelectionSettings& settings) {
    settings.growth_s = uniform_real(random, 0.1, 2);
    residency.set_now(100);
    for (const TileId id : terrain.tiles())
        if (uniform(random, 0, 3) > 0) residency.set_arrived(id, uniform_real(random, 99, 100));
    for (const TileId id : terrain.textures())
        if (uniform(random, 0, 3) > 0) residency.set_texture_arrived(id, uniform_real(random, 99, 100));
}

/// Exponent of the stride in which an item is drawn, in finest cells.
inline int exponent_of_item(const Lattice& lattice, const DrawItem& item) {
    return lattice.deepest_level - item.tile.level + item.geomip;
}

/// Six square views from one eye that leave nothing out.
inline std::vector<Camera> views_all_round(glm::dvec3 eye, int side_px = 600) {
    std::vector<Camera> views;
    for (const glm::dvec3 to : {glm::dvec3(1, 0, 0), glm::dvec3(-1, 0, 0), glm::dvec3(0, 1, 0), glm::dvec3(0, -1, 0),
                                glm::dvec3(1e-3, 0, 1), glm::dvec3(1e-3, 0, -1)}) {
        auto camera = look_at(eye, eye + 100.0 * to, 100, side_px, side_px);
        EXPECT_TRUE(camera.ok());
        views.push_back(*camera);
    }
    return views;
}

/// What all views draw together, each tile once.
inline DrawList drawn_together(const Selection& s) {
    std::map<TileId, DrawItem> items;
    for (const DrawList& list : s.draws)
        for (const DrawItem& item : list) items.try_emplace(item.tile, item);
    DrawList all;
    for (const auto& [tile, item] : items) all.push_back(item);
    return all;
}

/// The promise for one drawn item, from the numbers of the camera alone: f K eps / max(d, near), eps between the errors
/// of two strides as the weights say.
inline double bound_px(const SyntheticTerrain& terrain, const Camera& camera, const DrawItem& item,
                       double half_curvature = 0) {
    const Lattice& l = terrain.lattice();
    const HeightBounds& own = terrain.tile(item.tile)->header.own;
    const auto error_m = [&](int geomip) {
        const double stride_m = l.spacing_m * static_cast<double>(l.step(item.tile.level) << geomip);
        return own.error_n[static_cast<std::size_t>(geomip)] * terrain.dataset().height_quantum_m +
               stride_m * stride_m * half_curvature;
    };
    const double drawn = error_m(item.geomip), coarser = error_m(std::min(item.geomip + 1, l.tile_cells_log2 - 1));
    const double inner = item.morph;
    double eps = (1 - inner) * drawn + inner * coarser;
    if (item.geomip == 0 && terrain.is_leaf(item.tile) && item.edge_mask == 0) {
        // The finest surface is exact; only an edge that has moved further than the rest is on its way to thinned.
        double edge = inner;
        for (const float weight : item.edge_morph) edge = std::max(edge, static_cast<double>(weight));
        eps = inner * coarser + (edge - inner) * drawn;
    }
    const double ty = std::tan(camera.fov_deg * std::numbers::pi / 360), tx = ty * camera.width_px / camera.height_px;
    const double focal = camera.height_px / (2 * ty), factor = 1 + tx * tx + ty * ty;
    Box box = terrain.box_of(item.tile);
    double nearest = 0, furthest = 0;
    for (int k = 0; k < 2; ++k) {
        const double low = box.low[k] - camera.eye[k], high = box.high[k] - camera.eye[k];
        const double gap = std::max({0.0, low, -high}), reach = std::max(std::abs(low), std::abs(high));
        nearest += gap * gap;
        furthest += reach * reach;
    }
    box.low.z -= furthest * half_curvature;
    box.high.z -= nearest * half_curvature;
    const double gap_z = std::max({0.0, box.low.z - camera.eye.z, camera.eye.z - box.high.z});
    return focal * factor * eps / std::max(std::sqrt(nearest + gap_z * gap_z), camera.near_m);
}

}  // namespace scree::test
