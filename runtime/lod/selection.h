// Selection: which tiles to draw, how densely, and which to fetch. A pure function of (views, tile headers, residency,
// settings): no OpenGL, no thread, no clock; the Selector object only keeps its buffers (docs/lod-and-paging.md).
//
// A cut through the height pyramid is refined greedily, largest projected error first, from the roots at their
// coarsest. Page (which tile) and density (which geomip level inside it) are compared as absolute strides; every step
// keeps the cut balanced: across an edge strides differ by at most 2 : 1 and the finer page is never the coarser mesh.
// Test: f K eps > tau max(d_box, near)   (Scree lod, section 5.1; f, K of runtime/view/camera.h).
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/dataset.h"
#include "runtime/lod/draw_list.h"
#include "runtime/paging/residency.h"
#include "runtime/paging/tile_request.h"
#include "runtime/view/camera.h"

namespace scree {

struct SelectionSettings {
    double tau_px = 1;  ///< screen-space error: smaller is truer and costs triangles (about 1/tau)
    double texture_tau_px =
        1;  ///< screen pixels a texel may cover: smaller is sharper and costs texture slots (1/tau^2)
    std::int64_t height_slots = 0;  ///< tiles that can be kept, parents of what is drawn included
    std::int64_t texture_slots = 0;
};

struct Selection {
    std::vector<DrawList> draws;  ///< one list a view, an item a tile
    /// The same for the renderer, tiles under deep textures in parts. Empty where the store has none: draw `draws`.
    std::vector<DrawList> parts;
    std::vector<TileRequest> requests;    ///< most urgent first; nothing that could not be kept
    std::vector<TileId> planned_heights;  ///< what full residency would keep, ancestors included: never to be evicted
    std::vector<TileId> planned_textures;
    std::vector<TileId> standing_in;  ///< height tiles drawn or needed by what is drawn, planned or not: evict last
    std::vector<TileId> standing_in_textures;
    double max_bound_px = 0;      ///< the promise: no drawn point is further from the finest surface on screen
    bool complete = false;        ///< everything planned is resident and drawn
    bool budget_limited = false;  ///< slots bound before tau did
    std::int64_t triangles = 0;   ///< over all views
    std::int64_t nodes = 0;       ///< drawn in any view
    std::int64_t refine_steps = 0;

    const DrawList& to_render(std::size_t view) const { return parts.empty() ? draws[view] : parts[view]; }
};

class Selector {
public:
    explicit Selector(const Dataset& dataset);
    ~Selector();
    Selector(Selector&&) noexcept;

    /// The result is valid until the next call. A root that is not resident is taken for one that is
    /// not stored: the pager pins them.
    const Selection& select(std::span<const Camera> views, const SelectionSettings& settings,
                            const Residency& residency);

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace scree
