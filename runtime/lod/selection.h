// Selection: which tiles to draw, how densely, and which to fetch. A pure function of (views, tile headers, residency,
// settings): no OpenGL, no thread, no clock of its own; the Selector object only keeps its buffers
// (docs/lod-and-paging.md).
//
// A cut through the height pyramid is refined from the roots where the promise asks for it; runtime/lod/cut.h has the
// rules that keep it balanced and continuous. Test: f K eps > tau max(d_box, near)   (Scree lod, section 5.1; f, K of
// runtime/view/camera.h).
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/dataset.h"
#include "runtime/lod/draw_list.h"
#include "runtime/lod/lod_method.h"
#include "runtime/paging/residency.h"
#include "runtime/paging/tile_request.h"
#include "runtime/view/camera.h"

namespace scree {

struct SelectionSettings {
    double tau_px = 1;  ///< screen-space error: smaller is truer and costs triangles (about 1/tau)
    double texture_tau_px =
        1;  ///< screen pixels a texel may cover: smaller is sharper and costs texture slots (1/tau^2)
    /// Tiles that can be kept, parents of what is drawn included; one in 32 is left for what shows that no finer plan
    /// fits.
    std::int64_t height_slots = 0;
    std::int64_t texture_slots = 0;
    double half_curvature = 0;  ///< 1 / (2 R) of the earth, 1/m; 0: flat
    bool morph = true;          ///< false: discrete levels
    /// Seconds in which what came late grows out of what stood in for it: a level of heights, a texture. 0: at once.
    double growth_s = 0;
    /// Metres that the eye has come from frame to frame lately: what races by need not grow.
    double moved_m = 0;
    /// deboer: pages and levels go by the distance to a tile's centre, no off-axis factor, and corrections from level
    /// to level; what is drawn is as whole as ever, and only the promise is gone. Needs Residency's corrections, or
    /// goes by what headers say of them. Anything else: guaranteed.
    ErrorMetric metric = ErrorMetric::guaranteed;
    Culling culling = Culling::box;  ///< corners: of the tiles to draw, those without a corner in view are left out
    bool list_tiles = false;         ///< fill Selection::tiles
    bool plan_only = false;          ///< what to want is all that is asked: nothing is chosen to draw

    friend bool operator==(const SelectionSettings&, const SelectionSettings&) = default;
};

/// A tile that is drawn in any view, for what thins it.
struct DrawnTile {
    TileId id;
    std::int32_t height_slot = 0;
    std::int32_t geomip = 0;
    std::uint32_t edge_mask = 0;
    std::uint32_t seen_by = 0;  ///< views that draw it
    /// Least over those of d / (f K), d the distance to its box: an error of so many metres is seen as a pixel at most.
    double metres_per_px = 0;
    /// In Selection::tiles, the one beside its north, east, south and west edge where that is as large or larger, else
    /// -1: smaller ones name it.
    std::array<std::int32_t, 4> beside{-1, -1, -1, -1};
};

struct Selection {
    std::vector<DrawList> draws;   ///< one list a view, an item a tile
    std::vector<DrawnTile> tiles;  ///< where the settings ask for them
    /// The same for the renderer, tiles under deep textures in parts. Empty where the store has none: draw `draws`.
    std::vector<DrawList> parts;
    std::vector<TileRequest> requests;  ///< most urgent first; nothing that could not be kept
    /// Slots of resident tiles that full residency would keep, parents before children: never to be evicted.
    std::vector<std::int32_t> planned_heights, planned_textures;
    /// Slots of tiles drawn or needed by what is drawn, planned or not: evict last.
    std::vector<std::int32_t> standing_heights, standing_textures;
    /// No drawn point is further from the finest surface on screen: the promise where the metric is the guaranteed one,
    /// and true of any.
    double max_bound_px = 0;
    double mean_bound_px = 0;     ///< over the tiles drawn, weighted by the share of the screen they may cover
    double tau_effective_px = 0;  ///< the tolerance that the slots allow: settings.tau_px unless they bind
    double texture_tau_effective_px = 0;
    bool complete = false;        ///< everything planned is resident and drawn
    bool growing = false;         ///< late tiles are still on their way out of their parents' shape
    bool budget_limited = false;  ///< slots bound before tau did
    std::int64_t triangles = 0;   ///< over all views
    std::int64_t nodes = 0;       ///< drawn in any view
    /// Tiles drawn, in any view, in place of finer ones or with coarser textures than planned, because those are
    /// missing.
    std::int64_t stand_ins = 0;
    std::int64_t culled = 0;  ///< tiles left out by Culling::corners though their box is in view, over all views
    std::int64_t refine_steps = 0;

    const DrawList& to_render(std::size_t view) const { return parts.empty() ? draws[view] : parts[view]; }
};

class Selector {
public:
    explicit Selector(const Dataset& dataset);
    ~Selector();
    Selector(Selector&&) noexcept;

    /// The result is valid until the next call. A root that is not resident is taken for one that is not stored: the
    /// pager pins them. At most kMaxViews views.
    Selection& select(std::span<const Camera> views, const SelectionSettings& settings, const Residency& residency);

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace scree
