#include "runtime/lod/selection.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cmath>
#include <limits>

#include "common/mesh/tile_patterns.h"
#include "runtime/lod/cut.h"
#include "runtime/lod/texture_plan.h"

namespace scree {
namespace {

constexpr std::int64_t kNoLimit = std::numeric_limits<std::int64_t>::max();

/// Where slots bind, tolerances grow by eighths of an octave: steps too small to be seen.
constexpr int kCoarseningSteps = 8;
/// Of the slots, one in so many is not planned with: it is left for what shows that nothing finer fits. Always, or a
/// plan that takes the last few could not be told from one too large without more than all of them.
constexpr std::int64_t kReserve = 32;
constexpr int kMostCoarsening = 50 * kCoarseningSteps;
/// What a tolerance of 0 is taken for once slots bind.
constexpr double kLeastBoundTolerance = 1.0 / 1024;

double coarsened(double tolerance_px, int steps) {
    if (steps == 0) return tolerance_px;
    return std::max(tolerance_px, kLeastBoundTolerance) * std::exp2(static_cast<double>(steps) / kCoarseningSteps);
}

/// Least step, 0 .. kMostCoarsening, at which `fits`, which stays true once it is and is at the end. Looks near `hint`,
/// the last answer, first; the answer does not depend on it.
template <class Fits>
int least_step(int hint, const Fits& fits) {
    int low = -1, high = kMostCoarsening;  // does not fit, fits
    if (hint < kMostCoarsening && !fits(hint)) {
        low = hint;
        for (int stride = 1; low + stride < kMostCoarsening; stride *= 2) {
            if (fits(low + stride)) {
                high = low + stride;
                break;
            }
            low += stride;
        }
    } else {
        high = hint;
        for (int stride = 1; high > 0; stride *= 2) {
            const int finer = std::max(high - stride, 0);
            if (!fits(finer)) {
                low = finer;
                break;
            }
            high = finer;
        }
    }
    while (high - low > 1) {
        const int middle = low + (high - low) / 2;
        (fits(middle) ? high : low) = middle;
    }
    return high;
}

}  // namespace

struct Selector::Impl {
    explicit Impl(const Dataset& d) : dataset(d), plan(d), standing(d), textures(d) {}

    const Dataset& dataset;
    Cut plan;      // what full residency would draw once grown
    Cut standing;  // what residency and growth allow
    TexturePlan textures;
    Selection result;
    std::vector<LodView> views;
    int geometry_steps = 0, texture_steps = 0;  // of the last selection that slots limited: where to look first

    CutSettings cut_settings(const SelectionSettings& s, int geometry, int texture) const {
        return {coarsened(s.tau_px, geometry),
                coarsened(s.texture_tau_px, texture),
                s.height_slots,
                false,
                s.half_curvature,
                0,
                0,
                s.metric};
    }

    // Roots are always planned. Where every tile of the store has its slot nothing can be too large.
    std::int64_t without_reserve(std::int64_t slots, std::int64_t tiles) const {
        if (tiles > 0 && slots >= tiles) return slots;
        const std::int64_t roots = dataset.lattice.root_rows * dataset.lattice.root_columns;
        return std::max(slots - slots / kReserve, std::min(slots, roots));
    }

    // One plan at given coarsenings; whether it fits the slots.
    bool try_plan(const SelectionSettings& s, const Residency& residency, int geometry, int texture) {
        const CutSettings cut = cut_settings(s, geometry, texture);
        result.tau_effective_px = cut.tau_px;
        result.texture_tau_effective_px = cut.texture_tau_px;
        pages_fit_ = plan.refine(views, cut, residency);
        result.refine_steps += plan.steps();
        if (!pages_fit_) return false;
        return textures.wish(plan, views, cut, residency) <= s.texture_slots;
    }

    // The finest plan that fits: textures first, as they take most of the memory, then geometry.
    void make_plan(const SelectionSettings& all, const Residency& residency) {
        SelectionSettings s = all;
        s.height_slots = without_reserve(s.height_slots, dataset.height_tiles);
        s.texture_slots = without_reserve(s.texture_slots, dataset.texture_tiles);
        if (try_plan(s, residency, 0, 0)) return;
        result.budget_limited = true;
        texture_steps = least_step(texture_steps, [&](int t) { return try_plan(s, residency, kMostCoarsening, t); });
        if (texture_steps > 0) keep_proof(s, residency, kMostCoarsening, texture_steps - 1);
        geometry_steps = least_step(geometry_steps, [&](int g) { return try_plan(s, residency, g, texture_steps); });
        if (geometry_steps > 0) keep_proof(s, residency, geometry_steps - 1, texture_steps);
        try_plan(s, residency, geometry_steps, texture_steps);
    }

    // What is known of the plan that is too fine by a step: were its pages lost, it would seem to fit, be asked for,
    // and be given up again, for ever.
    void keep_proof(const SelectionSettings& s, const Residency& residency, int geometry, int texture) {
        try_plan(s, residency, geometry, texture);
        for (const CutNode& node : plan.nodes())
            if (node.split) result.standing_heights.push_back(node.slot);
        missing_.assign(plan.nodes().size(), false);
        if (pages_fit_ && residency.has_textures)
            textures.hand_over(plan, result.standing_textures, result.requests, missing_);
        result.requests.clear();
    }

    void request_missing(const SelectionSettings& settings, const Residency& residency) {
        double youngest_s = -std::numeric_limits<double>::infinity();
        missing_.assign(plan.nodes().size(), false);
        for (std::size_t k = 0; k < plan.nodes().size(); ++k) {
            const CutNode& node = plan.nodes()[k];
            if (!node.visible()) continue;
            if (node.slot >= 0) {
                result.planned_heights.push_back(node.slot);
                youngest_s = std::max(youngest_s, residency.heights.arrived_s[static_cast<std::size_t>(node.slot)]);
            } else if (node.slot == kNotResident) {
                result.complete = false;
                result.requests.push_back({TileKind::height, node.id, node.priority});
                missing_[k] = true;
            }
        }
        const bool heights_complete = result.complete;
        if (residency.has_textures) {
            textures.hand_over(plan, result.planned_textures, result.requests, missing_);
            result.complete = result.requests.empty();
        }
        std::sort(result.requests.begin(), result.requests.end(), [](const TileRequest& a, const TileRequest& b) {
            if (a.priority != b.priority) return a.priority > b.priority;
            if (a.kind != b.kind) return a.kind < b.kind;
            return a.id < b.id;
        });
        // A chain of late pages grows level by level.
        const double grown_s = youngest_s + settings.growth_s * (dataset.lattice.deepest_level + 1);
        use_standing_ = !heights_complete || residency.now_s < grown_s;
    }

    // Which of the tiles drawn lie beside one another, as the cut knows it.
    void link_tiles(Cut& cut) {
        for (std::size_t t = 0; t < result.tiles.size(); ++t)
            for (int d = 0; d < 4; ++d) {
                const std::int32_t beside = cut.drawn_beside(node_of_tile_[t], d);
                if (beside >= 0)
                    result.tiles[t].beside[static_cast<std::size_t>(d)] =
                        tile_of_node_[static_cast<std::size_t>(beside)];
            }
    }

    // The pages of the plan at or under which something is asked for: a tile drawn there stands in for it. What is
    // drawn and no page of the plan has nothing to wait for.
    void note_missing() {
        if (result.complete) return;
        for (std::size_t k = plan.nodes().size(); k-- > 0;)
            if (const std::int32_t parent = plan.nodes()[k].parent; parent >= 0 && missing_[k])
                missing_[static_cast<std::size_t>(parent)] = true;
    }

    bool stands_in(const Cut& cut, std::size_t k) const {
        if (result.complete) return false;
        const std::int32_t page = &cut == &plan ? static_cast<std::int32_t>(k) : cut.nodes()[k].twin;
        return page >= 0 && missing_[static_cast<std::size_t>(page)];
    }

    void emit(Cut& cut, const SelectionSettings& settings) {
        const int n = dataset.lattice.tile_cells_log2;
        const auto& nodes = cut.nodes();
        double weights = 0;
        if (settings.list_tiles) tile_of_node_.assign(nodes.size(), -1);
        for (std::size_t k = 0; k < nodes.size(); ++k) {
            const CutNode& node = nodes[k];
            if (node.split || !node.visible()) continue;
            const std::uint32_t shown = shown_in(cut, node, settings.culling);
            if (shown == 0) continue;
            Cut::Drawn drawn = cut.drawn(static_cast<std::int32_t>(k));
            if (!settings.morph) {
                drawn.morph = 0;
                drawn.edge_morph = {};
            }
            DrawItem item;
            item.tile = node.id;
            item.height_slot = node.slot;
            item.geomip = drawn.exponent - cut.minimum_exponent(node);
            item.edge_mask = drawn.edge_mask;
            item.morph = drawn.morph;
            item.edge_morph = drawn.edge_morph;
            const bool sharp = textures.place(cut, static_cast<std::int32_t>(k), settings.growth_s, item);
            if (!sharp || stands_in(cut, k)) ++result.stand_ins;
            ++result.nodes;
            const double bound_px = cut.drawn_error_m(node, drawn) / cut.certain_metres_per_px(node);
            item.bound_px = static_cast<float>(bound_px);
            result.max_bound_px = std::max(result.max_bound_px, bound_px);
            const double weight = screen_share(node);
            result.mean_bound_px += weight * bound_px;
            weights += weight;
            if (settings.list_tiles) {
                tile_of_node_[k] = static_cast<std::int32_t>(result.tiles.size());
                node_of_tile_.push_back(static_cast<std::int32_t>(k));
                result.tiles.push_back({node.id,
                                        node.slot,
                                        item.geomip,
                                        item.edge_mask,
                                        shown,
                                        cut.certain_metres_per_px(node),
                                        {-1, -1, -1, -1}});
            }
            const std::uint32_t triangles = pattern_triangles(n, item.geomip, item.edge_mask);
            for (std::size_t v = 0; v < views.size(); ++v) {
                if ((shown >> v & 1) == 0) continue;
                result.draws[v].push_back(item);
                if (!result.parts.empty())
                    textures.emit_parts(cut, static_cast<std::int32_t>(k), item, result.parts[v]);
                result.triangles += triangles;
            }
        }
        if (settings.list_tiles) link_tiles(cut);
        if (weights > 0) result.mean_bound_px /= weights;
        result.growing = cut.growing() || textures.fading();
    }

    // The views that draw a tile. Only tiles that are to be drawn are culled by corners: of a large page none may be in
    // view though all of its middle is, and the whole terrain would be lost with a root.
    std::uint32_t shown_in(const Cut& cut, const CutNode& node, Culling culling) {
        if (culling == Culling::box) return node.seen_by;
        std::uint32_t shown = node.seen_by;
        for (std::size_t v = 0; v < views.size(); ++v)
            if ((shown >> v & 1) != 0 && !cut.corner_in_view(node, views[v])) shown &= ~(1u << v);
        result.culled += std::popcount(node.seen_by & ~shown);
        return shown;
    }

    // At most so many pixels of the screen, by its nearest point.
    double screen_share(const CutNode& node) const {
        const double side_px = static_cast<double>(dataset.lattice.tile_extent(node.id.level)) *
                               dataset.lattice.spacing_m / node.texel_per_px;
        return std::min(side_px * side_px, 1e6);
    }

    void clear(std::size_t view_count) {
        Selection& r = result;
        r.draws.resize(view_count);
        for (DrawList& list : r.draws) list.clear();
        if (textures.deeper_than_heights()) r.parts.resize(view_count);
        for (DrawList& list : r.parts) list.clear();
        for (auto* list : {&r.planned_heights, &r.planned_textures, &r.standing_heights, &r.standing_textures})
            list->clear();
        r.requests.clear();
        r.tiles.clear();
        node_of_tile_.clear();
        r.max_bound_px = r.mean_bound_px = 0;
        r.complete = true;
        r.growing = r.budget_limited = false;
        r.triangles = r.nodes = r.stand_ins = r.culled = r.refine_steps = 0;
    }

    void select(const SelectionSettings& settings, const Residency& residency) {
        make_plan(settings, residency);
        request_missing(settings, residency);
        if (settings.plan_only) return;
        note_missing();
        if (!use_standing_) {
            // What is planned is what is drawn; textures that are still to come are stood in for.
            emit(plan, settings);
            textures.used(result.standing_textures);
            return;
        }
        CutSettings cut = cut_settings(settings, 0, 0);
        cut.tau_px = result.tau_effective_px;
        cut.texture_tau_px = result.texture_tau_effective_px;
        cut.max_pages = kNoLimit;
        cut.only_resident = true;
        cut.growth_s = settings.growth_s;
        cut.moved_m = settings.moved_m;
        standing.refine(views, cut, residency, &plan);
        result.refine_steps += standing.steps();
        for (const CutNode& node : standing.nodes())
            if (node.visible()) result.standing_heights.push_back(node.slot);
        textures.wish(standing, views, cut, residency);
        emit(standing, settings);
        textures.used(result.standing_textures);
    }

private:
    std::vector<bool> missing_;  // by page of the plan
    bool use_standing_ = false;
    bool pages_fit_ = false;
    std::vector<std::int32_t> tile_of_node_, node_of_tile_;
};

Selector::Selector(const Dataset& dataset) : impl_(std::make_unique<Impl>(dataset)) {}
Selector::~Selector() = default;
Selector::Selector(Selector&&) noexcept = default;

Selection& Selector::select(std::span<const Camera> cameras, const SelectionSettings& settings,
                            const Residency& residency) {
    assert(cameras.size() <= kMaxViews);
    Impl& s = *impl_;
    s.clear(cameras.size());
    s.views.clear();
    for (const Camera& camera : cameras) s.views.emplace_back(camera);
    s.select(settings, residency);
    return s.result;
}

}  // namespace scree
