#include "runtime/lod/selection.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <unordered_map>
#include <unordered_set>

#include "common/mesh/tile_patterns.h"
#include "runtime/lod/cut.h"

namespace scree {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct TextureWish {
    TileId id;
    double priority = 0;
};

}  // namespace

struct Selector::Impl {
    explicit Impl(const Dataset& d) : dataset(d), plan(d), standing(d) {}

    const Dataset& dataset;
    Cut plan;      // what full residency would draw
    Cut standing;  // what residency allows
    Selection result;
    std::vector<LodView> views;
    std::unordered_map<TileId, double, TileIdHash> wishes;
    std::vector<TextureWish> sorted;
    std::unordered_set<TileId, TileIdHash> planned_textures;

    // The texture level at which a texel covers no more than the allowed pixels at the node's nearest point; not deeper
    // than the node's own page (a page is split for its texture) nor the pyramid.
    int texture_level(const CutNode& node, double texture_tau_px) const {
        const int deepest = std::min(node.id.level, dataset.texture_deepest_level);
        int level = 0;
        while (level < deepest && dataset.texel_m(level) > texture_tau_px * node.texel_per_px) ++level;
        return level;
    }

    bool has_deep_textures() const { return dataset.texture_deepest_level > dataset.lattice.deepest_level; }

    // Metres of texture a pixel covers at the nearest point of a part of a page; infinite when no view sees it.
    double texel_per_px(const CutNode& node, TilePart part) const {
        const Lattice& l = dataset.lattice;
        const double side = std::ldexp(static_cast<double>(l.tile_extent(node.id.level)), -part.level);
        const LatticePoint corner = l.corner(node.id);
        const double i = static_cast<double>(corner.i) + part.x * side,
                     j = static_cast<double>(corner.j) + part.y * side;
        const double east = std::min(i + side, static_cast<double>(l.cells_x)),
                     south = std::min(j + side, static_cast<double>(l.cells_y));
        if (east <= i || south <= j) return kInfinity;
        const Box box{{l.x_m(i), l.y_m(south), dataset.height_m(node.bounds.min_n)},
                      {l.x_m(east), l.y_m(j), dataset.height_m(node.bounds.max_n)}};
        double least = kInfinity;
        for (const LodView& view : views)
            if (view.frustum.may_see(box))
                least = std::min(least, std::max(distance_to_box(view.eye, box), view.near_m) / view.focal_px);
        return least;
    }

    // Visits the existing children of a part's texture that deserve to be resident.
    template <class Visit>
    void for_each_deep_child(const CutNode& node, TilePart part, double texture_tau_px, const Residency& residency,
                             const Visit& visit) const {
        const TileId texture{node.id.level + part.level, (node.id.x << part.level) + part.x,
                             (node.id.y << part.level) + part.y};
        if (texture.level >= dataset.texture_deepest_level || part.level >= dataset.lattice.tile_cells_log2 - 1) return;
        const std::uint8_t exists = residency.texture_children(texture);
        for (int q = 0; q < 4; ++q) {
            if ((exists >> q & 1) == 0) continue;
            const TilePart child{part.level + 1, 2 * part.x + (q & 1), 2 * part.y + (q >> 1)};
            const double need = dataset.texel_m(texture.level) / texel_per_px(node, child) / texture_tau_px;
            visit(child, child_of(texture, q), need);
        }
    }

    void wish_deep(const CutNode& node, TilePart part, double texture_tau_px, const Residency& residency) {
        for_each_deep_child(node, part, texture_tau_px, residency, [&](TilePart child, TileId id, double need) {
            if (!(need > 1)) return;
            wishes.try_emplace(id, need);
            wish_deep(node, child, texture_tau_px, residency);
        });
    }

    // Parts of a page, each with the deepest texture it deserves and has. A part whose texture has no child there at
    // all shows nothing there: no present cell lies under it.
    void emit_parts(const CutNode& node, DrawItem item, double texture_tau_px, const Residency& residency,
                    bool only_planned, DrawList& out) const {
        const TilePart part = item.part;
        bool any = false;
        std::array<bool, 4> finer{}, exists{};
        std::array<TileId, 4> ids{};
        std::array<TilePart, 4> parts_of{};
        for_each_deep_child(node, part, texture_tau_px, residency, [&](TilePart child, TileId id, double need) {
            const auto q = static_cast<std::size_t>(quadrant_of(id));
            exists[q] = true;
            ids[q] = id;
            parts_of[q] = child;
            finer[q] = need > 1 && residency.texture(id) >= 0 && (!only_planned || planned_textures.contains(id));
            any = any || finer[q];
        });
        if (!any || part.level >= dataset.lattice.tile_cells_log2 - 1 - item.geomip) {
            out.push_back(item);
            return;
        }
        for (std::size_t q = 0; q < 4; ++q) {
            if (!exists[q]) continue;
            DrawItem child = item;
            child.part = parts_of[q];
            if (finer[q]) {
                child.texture_slot = residency.texture(ids[q]);
                child.texture_scale = static_cast<float>(1 << child.part.level);
                child.texture_offset_u = static_cast<float>(-child.part.x);
                child.texture_offset_v = static_cast<float>(-child.part.y);
                emit_parts(node, child, texture_tau_px, residency, only_planned, out);
            } else {
                out.push_back(child);
            }
        }
    }

    // Which texture tiles the plan deserves, coarse before fine, cut off where slots end. Ancestors are kept: they
    // stand in.
    void plan_textures(const SelectionSettings& settings, const Residency& residency) {
        wishes.clear();
        for (const CutNode& node : plan.nodes()) {
            if (node.split || !node.visible) continue;
            const int wanted = texture_level(node, settings.texture_tau_px);
            for (int level = wanted; level >= 0; --level) {
                const double need =
                    level == 0 ? kInfinity : dataset.texel_m(level - 1) / node.texel_per_px / settings.texture_tau_px;
                auto [it, inserted] = wishes.try_emplace(ancestor_at(node.id, level), need);
                if (!inserted) {
                    if (it->second >= need) break;  // the ancestors have been reached from as near before
                    it->second = need;
                }
            }
            if (has_deep_textures() && node.id.level == dataset.lattice.deepest_level && wanted == node.id.level)
                wish_deep(node, {}, settings.texture_tau_px, residency);
        }
        sorted.clear();
        for (const auto& [id, need] : wishes) sorted.push_back({id, need});
        // Roots are pinned and counted whether in view or not.
        std::sort(sorted.begin(), sorted.end(), [](const TextureWish& a, const TextureWish& b) {
            if (a.priority != b.priority) return a.priority > b.priority;
            return a.id < b.id;
        });
        const std::int64_t roots = dataset.lattice.root_rows * dataset.lattice.root_columns;
        std::int64_t left = settings.texture_slots - roots;
        planned_textures.clear();
        for (const TextureWish& wish : sorted) {
            if (wish.id.level > 0 && left-- <= 0) {
                result.budget_limited = true;
                break;
            }
            planned_textures.insert(wish.id);
            result.planned_textures.push_back(wish.id);
        }
    }

    // The texture a leaf is drawn with: the planned one when all is there, else the nearest resident ancestor.
    void assign_texture(const CutNode& node, double texture_tau_px, const Residency& residency, bool only_planned,
                        DrawItem& item) {
        int level = texture_level(node, texture_tau_px);
        for (; level > 0; --level) {
            const TileId id = ancestor_at(node.id, level);
            if (only_planned && !planned_textures.contains(id)) continue;
            item.texture_slot = residency.texture(id);
            if (item.texture_slot >= 0) break;
        }
        if (level == 0) item.texture_slot = residency.texture(ancestor_at(node.id, 0));
        const int up = node.id.level - level;
        const std::int64_t mask = (std::int64_t{1} << up) - 1;
        item.texture_scale = static_cast<float>(std::ldexp(1.0, -up));
        item.texture_offset_u = static_cast<float>(std::ldexp(static_cast<double>(node.id.x & mask), -up));
        item.texture_offset_v = static_cast<float>(std::ldexp(static_cast<double>(node.id.y & mask), -up));
        if (!planned_textures.contains(ancestor_at(node.id, level)))
            result.standing_in_textures.push_back(ancestor_at(node.id, level));
    }

    void emit(const Cut& cut, std::span<const Camera> cameras, const SelectionSettings& settings,
              const Residency& residency, bool only_planned) {
        const int n = dataset.lattice.tile_cells_log2;
        const auto& nodes = cut.nodes();
        for (std::size_t k = 0; k < nodes.size(); ++k) {
            const CutNode& node = nodes[k];
            if (node.split || !node.visible) continue;
            const auto leaf = static_cast<std::int32_t>(k);
            DrawItem item;
            item.tile = node.id;
            item.height_slot = node.slot;
            item.geomip = node.exponent - cut.minimum_exponent(node);
            item.edge_mask = cut.edge_mask(leaf);
            assign_texture(node, settings.texture_tau_px, residency, only_planned, item);
            ++result.nodes;
            result.max_bound_px = std::max(result.max_bound_px, cut.drawn_error_m(leaf) / node.metres_per_px);
            const Box box = cut.box_of(node);
            for (std::size_t v = 0; v < cameras.size(); ++v) {
                if (!views[v].frustum.may_see(box)) continue;
                result.draws[v].push_back(item);
                if (!result.parts.empty()) {
                    if (node.id.level == dataset.lattice.deepest_level && item.texture_scale == 1)
                        emit_parts(node, item, settings.texture_tau_px, residency, only_planned, result.parts[v]);
                    else
                        result.parts[v].push_back(item);
                }
                result.triangles += pattern_triangles(n, item.geomip, item.edge_mask);
            }
        }
    }

    void request_missing(const Residency& residency) {
        for (const CutNode& node : plan.nodes()) {
            if (!node.visible) continue;
            result.planned_heights.push_back(node.id);
            if (node.header != nullptr) continue;
            result.complete = false;
            result.requests.push_back({TileKind::height, node.id, node.priority});
        }
        for (const TextureWish& wish : sorted) {
            if (!planned_textures.contains(wish.id)) break;
            if (residency.texture(wish.id) >= 0 || residency.unavailable_texture(wish.id)) continue;
            result.complete = false;
            result.requests.push_back({TileKind::texture, wish.id, wish.priority});
        }
        std::sort(result.requests.begin(), result.requests.end(), [](const TileRequest& a, const TileRequest& b) {
            if (a.priority != b.priority) return a.priority > b.priority;
            if (a.kind != b.kind) return a.kind < b.kind;
            return a.id < b.id;
        });
    }
};

Selector::Selector(const Dataset& dataset) : impl_(std::make_unique<Impl>(dataset)) {}
Selector::~Selector() = default;
Selector::Selector(Selector&&) noexcept = default;

const Selection& Selector::select(std::span<const Camera> cameras, const SelectionSettings& settings,
                                  const Residency& residency) {
    Impl& s = *impl_;
    Selection& r = s.result;
    r.draws.resize(cameras.size());
    for (DrawList& list : r.draws) list.clear();
    if (s.has_deep_textures()) r.parts.resize(cameras.size());
    for (DrawList& list : r.parts) list.clear();
    for (auto* list : {&r.planned_heights, &r.planned_textures, &r.standing_in, &r.standing_in_textures}) list->clear();
    r.requests.clear();
    r.max_bound_px = 0;
    r.complete = true;
    r.budget_limited = false;
    r.triangles = r.nodes = 0;
    s.views.clear();
    for (const Camera& camera : cameras) s.views.emplace_back(camera);

    s.plan.refine(s.views, {settings.tau_px, settings.texture_tau_px, settings.height_slots, false}, residency);
    r.refine_steps = s.plan.steps();
    r.budget_limited = s.plan.page_limited();
    s.plan_textures(settings, residency);
    s.request_missing(residency);
    const bool heights_complete = std::none_of(r.requests.begin(), r.requests.end(),
                                               [](const TileRequest& q) { return q.kind == TileKind::height; });
    if (heights_complete) {
        s.emit(s.plan, cameras, settings, residency, r.complete);
        return r;
    }
    s.standing.refine(
        s.views, {settings.tau_px, settings.texture_tau_px, std::numeric_limits<std::int64_t>::max(), true}, residency);
    r.refine_steps += s.standing.steps();
    for (const CutNode& node : s.standing.nodes())
        if (node.visible) r.standing_in.push_back(node.id);
    s.emit(s.standing, cameras, settings, residency, false);
    return r;
}

}  // namespace scree
