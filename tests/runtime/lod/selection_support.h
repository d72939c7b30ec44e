// What the tests of selection share: comparing results, and the numbers of one drawn item computed anew.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>

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

inline auto fields(const DrawItem& d) {
    return std::tuple(d.tile, d.height_slot, d.texture_slot, d.geomip, d.edge_mask, d.part.level, d.part.x, d.part.y,
                      d.texture_scale, d.texture_offset_u, d.texture_offset_v);
}

inline bool same_draws(const DrawList& a, const DrawList& b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                      [](const DrawItem& x, const DrawItem& y) { return fields(x) == fields(y); });
}

inline bool same_selection(const Selection& a, const Selection& b) {
    const auto same_request = [](const TileRequest& x, const TileRequest& y) {
        return x.kind == y.kind && x.id == y.id && x.priority == y.priority;
    };
    return std::equal(a.draws.begin(), a.draws.end(), b.draws.begin(), b.draws.end(), same_draws) &&
           std::equal(a.parts.begin(), a.parts.end(), b.parts.begin(), b.parts.end(), same_draws) &&
           std::equal(a.requests.begin(), a.requests.end(), b.requests.begin(), b.requests.end(), same_request) &&
           a.planned_heights == b.planned_heights && a.planned_textures == b.planned_textures &&
           a.standing_in == b.standing_in && a.standing_in_textures == b.standing_in_textures &&
           std::tuple(a.max_bound_px, a.complete, a.budget_limited, a.triangles, a.nodes, a.refine_steps) ==
               std::tuple(b.max_bound_px, b.complete, b.budget_limited, b.triangles, b.nodes, b.refine_steps);
}

/// f K eps / max(d, near) of one drawn item, from the numbers of the camera alone.
inline double bound_px(const SyntheticTerrain& terrain, const Camera& camera, const DrawItem& item) {
    const int exponent = terrain.lattice().deepest_level - item.tile.level + item.geomip;
    if (exponent == 0 && item.edge_mask == 0) return 0;
    const double ty = std::tan(camera.fov_deg * std::numbers::pi / 360), tx = ty * camera.width_px / camera.height_px;
    const double focal = camera.height_px / (2 * ty), factor = 1 + tx * tx + ty * ty;
    const Box box = terrain.box_of(item.tile);
    glm::dvec3 gap(0);
    for (int k = 0; k < 3; ++k) gap[k] = std::max({0.0, box.low[k] - camera.eye[k], camera.eye[k] - box.high[k]});
    const double distance = std::max(std::sqrt(gap.x * gap.x + gap.y * gap.y + gap.z * gap.z), camera.near_m);
    const HeightBounds& own = terrain.tile(item.tile)->header.own;
    return focal * factor * own.error_n[static_cast<std::size_t>(item.geomip)] * terrain.dataset().height_quantum_m /
           distance;
}

}  // namespace scree::test
