#include "runtime/lod/page_mesher.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

#include "common/mesh/geometric_error.h"
#include "runtime/lod/block_selection.h"
#include "runtime/lod/cut.h"
#include "runtime/lod/edge_agreement.h"
#include "runtime/lod/page_measure.h"
#include "runtime/lod/reuse.h"
#include "runtime/lod/tile_vertices.h"
#include "runtime/lod/triangle_walk.h"
#include "runtime/lod/vertex_metric.h"

namespace scree {
namespace {

/// Rungs of block thresholds an octave: fewer cost triangles (6: 2 % more than 8), more are left sooner.
constexpr int kRungsPerOctave = 6;
/// Below, the threshold is 0: whatever has an error at all.
constexpr double kLeastThreshold_m = 1e-30;
/// Above every error: an eye may stand so far off that its distance is infinite.
constexpr double kGreatestThreshold_m = 1e30;
/// Where meshes do not fit into the pool the tolerance grows by eighths of an octave.
constexpr double kCoarsening = 1.0905077326652577;
constexpr int kMostCoarsening = 16;  ///< two octaves: about a quarter of the triangles
/// Eyes kept of a tile's last choice; with more views nothing is reused.
constexpr std::size_t kMostEyes = 4;
/// A height slot's share in the pool, of the 3 * 2 * m^2 indices of a tile with nothing dropped: what a sixth of them
/// comes to where half of the slots are drawn. So many tiles have room for all.
constexpr std::size_t kPoolShare = 12, kRoomyTiles = 64;

// Where the vertices of a mesh were chosen for.
struct Chosen {
    bool valid = false;
    std::int32_t geomip = -1;
    std::uint32_t edge_mask = 0;
    std::int32_t part_level = 0;
    std::uint32_t seen_by = 0;
    double least_m = 0, beyond_m = 0;  ///< block thresholds that it holds for: from the least, below the other
    double tau_px = 0, half_curvature = 0;
    std::array<double, kMostEyes> error_px{};
    std::array<glm::dvec3, kMostEyes> eyes{};
};

// What is kept of a height slot.
struct SlotState {
    Chosen chosen;
    bool made = false;   ///< `mesh` is of what was chosen last and of `drawn`
    bool whole = false;  ///< nothing is dropped: drawn by its pattern
    MeshRange mesh;
    std::vector<std::uint32_t> cell_starts;  ///< of its parts' cells in the mesh, Morton order, and the end
};

// A rung of the ladder of block thresholds.
struct Rung {
    double least_m = 0, beyond_m = 0;
};

}  // namespace

struct PageMesher::Impl {
    Impl(const Dataset& d, const LodSettings& settings, std::int64_t height_slots, MeshPool& meshes)
        : dataset(d),
          lod(settings),
          n(d.lattice.tile_cells_log2),
          m(1 << n),
          vertices(d, height_slots, settings.method == LodMethod::block_rsg),
          edges(d.lattice),
          walks{TriangleWalk(vertices.bisection({0, 0, 0})), TriangleWalk(vertices.bisection({0, 1, 0}))},
          states(static_cast<std::size_t>(height_slots)),
          chosen(states.size() * vertices.vertex_count()),
          borders(states.size() * 2 * edges.words()),
          set(vertices.vertex_count() + 1),
          pool(meshes),
          buffer(TriangleWalk::room(vertices.bisection({0, 0, 0}))) {
        for (int k = 0; k < kRungsPerOctave; ++k)
            rungs[static_cast<std::size_t>(k)] = std::exp2(k / double{kRungsPerOctave});
    }

    const Dataset dataset;  // a copy: the store may be updated under it
    LodSettings lod;
    int n, m;
    TileVertices vertices;
    EdgeAgreement edges;
    std::array<TriangleWalk, 2> walks;  ///< of even and odd tiles
    std::array<double, kRungsPerOctave> rungs{};
    std::vector<SlotState> states;
    std::vector<std::uint8_t> chosen;    ///< by slot, an entry a vertex: selected for the tile's own sake
    std::vector<std::uint64_t> borders;  ///< by slot: of what was chosen; with what neighbours added, of its mesh
    std::vector<std::uint8_t> set;       ///< a buffer: of one tile, and a vertex that never is
    MeshPool& pool;
    std::vector<std::uint32_t> buffer;
    MeshCounters counters;
    std::array<double, kMaxViews> scale_px{};      ///< of the frame, by view: f K
    std::span<const DrawnTile> tiles;              ///< of the frame
    const Residency* residency = nullptr;          ///< of the frame
    std::vector<std::int32_t> part_level_of_slot;  ///< the finest part that a tile is drawn in; empty: all are whole

    SlotState& state_of(const DrawnTile& tile) { return states[static_cast<std::size_t>(tile.height_slot)]; }
    const SlotState& state_of(const DrawnTile& tile) const {
        return states[static_cast<std::size_t>(tile.height_slot)];
    }
    std::uint8_t* chosen_of(const DrawnTile& tile) {
        return chosen.data() + static_cast<std::size_t>(tile.height_slot) * vertices.vertex_count();
    }
    TileBorder own_border(const DrawnTile& tile) {
        return borders.data() + static_cast<std::size_t>(tile.height_slot) * 2 * edges.words();
    }
    TileBorder drawn_border(const DrawnTile& tile) { return own_border(tile) + edges.words(); }
    std::int32_t part_level_of(const DrawnTile& tile) const {
        return part_level_of_slot.empty() ? 0 : part_level_of_slot[static_cast<std::size_t>(tile.height_slot)];
    }

    void put(std::int32_t slot, std::span<const SlotVertex> from, std::span<const VertexCost> costs) {
        vertices.put(slot, from, costs);
        states[static_cast<std::size_t>(slot)] = {};
    }

    // --- the frame's tiles ---

    void gather(const Residency& resident, const Selection& selection) {
        tiles = selection.tiles;
        residency = &resident;
        edges.link(tiles);
        if (selection.parts.empty()) {
            part_level_of_slot.clear();
            return;
        }
        part_level_of_slot.assign(states.size(), 0);
        for (const DrawList& list : selection.parts)
            for (const DrawItem& item : list) {
                std::int32_t& level = part_level_of_slot[static_cast<std::size_t>(item.height_slot)];
                level = std::max(level, item.part.level);
            }
    }

    const HeightTileHeader& header_of(const DrawnTile& tile) const {
        return residency->heights.headers[static_cast<std::size_t>(tile.height_slot)];
    }

    TileShape shape_of(const DrawnTile& tile, double half_curvature) const {
        return {tile.height_slot, tile.id, tile.geomip, tile.edge_mask,
                half_curvature > 0 ? base_error_m(header_of(tile)) : 0};
    }

    float base_error_m(const HeightTileHeader& header) const {
        const std::array<double, 4> base_m = base_errors_m(dataset, header);
        return round_up_to_float(*std::max_element(base_m.begin(), base_m.end()));
    }

    Box own_box(const DrawnTile& tile) const {
        const Lattice& l = dataset.lattice;
        const HeightBounds& bounds = header_of(tile).own;
        const LatticePoint corner = l.corner(tile.id);
        const auto west = static_cast<double>(corner.i), north = static_cast<double>(corner.j),
                   extent = static_cast<double>(l.tile_extent(tile.id.level));
        return {{l.x_m(west), l.y_m(north + extent), dataset.height_m(bounds.min_n)},
                {l.x_m(west + extent), l.y_m(north), dataset.height_m(bounds.max_n)}};
    }

    // With all that the curvature lowers it by, for any of the views.
    Box box_of(const DrawnTile& tile, std::span<const Camera> views, double half_curvature) const {
        const Box box = own_box(tile);
        Box low = box;
        if (half_curvature > 0)
            for (const Camera& view : views)
                low.low.z = std::min(low.low.z, lowered_by_curvature(box, view.eye, half_curvature).low.z);
        return low;
    }

    // --- the choice of a tile's own vertices ---

    // The rung of what a tile may err by.
    Rung rung_of(double threshold_m) const {
        if (!(threshold_m >= kLeastThreshold_m)) return {0, kLeastThreshold_m};
        if (threshold_m >= kGreatestThreshold_m) return {kGreatestThreshold_m, std::numeric_limits<double>::infinity()};
        int exponent = 0;
        const double part = 2 * std::frexp(threshold_m, &exponent);  // 1 .. 2
        std::size_t k = rungs.size() - 1;
        while (part < rungs[k]) --k;
        return {std::ldexp(rungs[k], exponent - 1),
                k + 1 < rungs.size() ? std::ldexp(rungs[k + 1], exponent - 1) : std::ldexp(1, exponent)};
    }

    // What a tile may err by, metres a pixel of tolerance: 1 / (f K m), m how large a unit of height looks at most from
    // anywhere in its box, which holds what is drawn and what is true: h / r^2 (Scree lod, C1). Straight below an eye
    // and far above or below it heights hardly show.
    double allowed_m_per_px(const DrawnTile& tile, std::span<const Camera> views, double half_curvature) const {
        double least = std::numeric_limits<double>::infinity();
        for (std::size_t v = 0; v < views.size(); ++v) {
            if ((tile.seen_by >> v & 1) == 0) continue;
            const Camera& view = views[v];
            const Box box = lowered_by_curvature(own_box(tile), view.eye, half_curvature);
            const double seen = greatest_box_magnification(view.eye, box);
            if (std::isnan(seen)) return 0;
            // Nothing nearer than the near plane is seen.
            least = std::min(least, 1 / (scale_px[v] * std::min(seen, 1 / view.near_m)));
        }
        return least;
    }

    bool same_shape(const Chosen& c, const DrawnTile& tile, const MeshSettings& s) const {
        return c.valid && c.geomip == tile.geomip && c.edge_mask == tile.edge_mask &&
               c.part_level == part_level_of(tile) && c.half_curvature == s.half_curvature;
    }

    bool may_reuse(const Chosen& c, const DrawnTile& tile, std::span<const Camera> views, const MeshSettings& s) const {
        if (lod.reuse == ReuseTest::off || !same_shape(c, tile, s) || views.size() > kMostEyes) return false;
        if (c.tau_px != s.tau_px || (tile.seen_by & ~c.seen_by) != 0) return false;
        const Box box = box_of(tile, views, s.half_curvature);
        for (std::size_t v = 0; v < views.size(); ++v) {
            if ((tile.seen_by >> v & 1) == 0) continue;
            if (scale_px[v] > c.error_px[v] || !may_reuse(c.eyes[v], tile, box, views[v], s)) return false;
        }
        return true;
    }

    bool may_reuse(const glm::dvec3& then, const DrawnTile& tile, const Box& box, const Camera& view,
                   const MeshSettings& s) const {
        if (lod.reuse == ReuseTest::paper)
            return reuse_p1(then, view.eye, corners_of(tile, box), box, view.focal_px(), lod.s_px, s.tau_px);
        const EyeToBox before = eye_to_box(then, box), after = eye_to_box(view.eye, box);
        double moved_m = glm::length(view.eye - then);
        // Relative to the eye, a point over a curved earth moves by more than the eye does.
        if (s.half_curvature > 0) {
            const double furthest_m =
                std::max(before.level_m, after.level_m) + std::hypot(box.high.x - box.low.x, box.high.y - box.low.y);
            moved_m *= 1 + (2 * furthest_m + moved_m) * s.half_curvature;
        }
        return reuse_exact(before, after, moved_m, kMetricFloor, {s.tau_px, lod.s_px});
    }

    std::array<glm::dvec3, 4> corners_of(const DrawnTile& tile, const Box& box) const {
        const auto z = [&](int side, int k) { return vertices.height_m(tile.height_slot, side_vertex(side, k, m)); };
        return {{{box.low.x, box.high.y, z(0, 0)},
                 {box.high.x, box.high.y, z(0, m)},
                 {box.low.x, box.low.y, z(2, 0)},
                 {box.high.x, box.low.y, z(2, m)}}};
    }

    // Parts of a tile are drawn apart: the lines between them must be edges.
    void add_parts(const DrawnTile& tile, std::uint8_t* active) const {
        const Bisection& b = vertices.bisection(tile.id);
        const int level = part_level_of(tile), stride = m >> level;
        for (int j = 0; level > 0 && j <= m; j += stride)
            for (int i = 0; i <= m; i += stride) add_closed(b, b.index(i, j), active);
    }

    void choose(const DrawnTile& tile, std::span<const Camera> views, const MeshSettings& s) {
        SlotState& state = state_of(tile);
        Chosen& c = state.chosen;
        const double threshold_m =
            lod.method == LodMethod::block_rsg ? s.tau_px * allowed_m_per_px(tile, views, s.half_curvature) : 0;
        if (lod.method == LodMethod::block_rsg) {
            if (threshold_m >= c.least_m && threshold_m < c.beyond_m && same_shape(c, tile, s)) return;
        } else if (may_reuse(c, tile, views, s)) {
            return;
        }
        ++counters.chosen;
        std::uint8_t* active = chosen_of(tile);
        const TileShape shape = shape_of(tile, s.half_curvature);
        Rung rung;
        if (lod.method == LodMethod::block_rsg) {
            rung = rung_of(threshold_m);
            vertices.choose(shape, rung.least_m, s.half_curvature, active);
        } else {
            choose_each(tile, shape, views, s, active);
        }
        state.whole = vertices.complete_if_dense(shape, active);
        add_parts(tile, active);
        edges.border_of(active, own_border(tile));
        state.made = false;
        c = {true,
             tile.geomip,
             tile.edge_mask,
             part_level_of(tile),
             tile.seen_by,
             rung.least_m,
             rung.beyond_m,
             s.tau_px,
             s.half_curvature,
             {},
             {}};
        for (std::size_t v = 0; v < std::min(views.size(), kMostEyes); ++v) {
            c.eyes[v] = views[v].eye;
            c.error_px[v] = scale_px[v];
        }
    }

    void choose_each(const DrawnTile& tile, const TileShape& shape, std::span<const Camera> views,
                     const MeshSettings& s, std::uint8_t* active) {
        const bool paper = lod.metric == ErrorMetric::uc;
        std::array<VertexEye, kMaxViews> eyes;
        std::size_t count = 0;
        for (std::size_t v = 0; v < views.size(); ++v)
            if ((tile.seen_by >> v & 1) != 0)
                eyes[count++] = {views[v].eye, views[v].focal_px() * (paper ? 1 : views[v].off_axis_factor())};
        vertices.choose(shape, std::span(eyes.data(), count), s.tau_px, s.half_curvature, paper, active);
    }

    // --- triangles ---

    // Cell by cell of its parts, in Morton order.
    void emit(std::size_t t) {
        const DrawnTile& tile = tiles[t];
        const int part_level = part_level_of(tile);
        SlotState& state = state_of(tile);
        std::memcpy(set.data(), chosen_of(tile), vertices.vertex_count());
        edges.add_border(vertices.bisection(tile.id), edges.border(t), own_border(tile), set.data());
        const TriangleWalk& walk = walks[static_cast<std::size_t>((tile.id.x + tile.id.y) & 1)];
        std::uint32_t* out = buffer.data();
        state.cell_starts.clear();
        if (part_level == 0) {
            out = walk.emit(set.data(), 0, out);
        } else {
            for (int code = 0; code < 1 << (2 * part_level); ++code) {
                state.cell_starts.push_back(static_cast<std::uint32_t>(out - buffer.data()));
                out = walk.emit_cell(set.data(), part_level, code, out);
            }
            state.cell_starts.push_back(static_cast<std::uint32_t>(out - buffer.data()));
        }
        state.mesh = pool.put(std::span(buffer.data(), static_cast<std::size_t>(out - buffer.data())));
        std::copy_n(edges.border(t), edges.words(), drawn_border(tile));
        state.made = true;
        ++counters.remade;
    }

    // False: they do not all fit.
    bool make_meshes() {
        if (make_missing()) return true;
        // New ones have overwritten some that are still needed.
        pool.clear();
        return make_missing();
    }

    bool make_missing() {
        for (std::size_t t = 0; t < tiles.size(); ++t)
            if (!is_made(t)) emit(t);
        for (std::size_t t = 0; t < tiles.size(); ++t)
            if (!is_made(t)) return false;
        return true;
    }

    bool is_made(std::size_t t) {
        const SlotState& state = state_of(tiles[t]);
        if (state.whole) return true;
        return state.made && edges.same(drawn_border(tiles[t]), edges.border(t)) && pool.holds(state.mesh);
    }

    void hand_over(Selection& selection, double promise_px) {
        const auto least_px = static_cast<float>(promise_px);
        for (DrawList& list : selection.draws)
            for (DrawItem& item : list) {
                item.mesh = mesh_of(item);
                item.bound_px = std::max(item.bound_px, least_px);
            }
        for (DrawList& list : selection.parts)
            for (DrawItem& item : list) {
                item.mesh = part_of(item);
                item.bound_px = std::max(item.bound_px, least_px);
            }
        selection.triangles = 0;
        for (const DrawnTile& tile : tiles) selection.triangles += std::popcount(tile.seen_by) * triangles_of(tile);
        counters.triangles = selection.triangles;
    }

    MeshRange mesh_of(const DrawItem& item) const {
        const SlotState& state = states[static_cast<std::size_t>(item.height_slot)];
        return state.whole ? MeshRange{} : state.mesh;
    }

    std::int64_t triangles_of(const DrawnTile& tile) const {
        const SlotState& state = state_of(tile);
        return state.whole ? pattern_triangles(n, tile.geomip, tile.edge_mask) : state.mesh.count / 3;
    }

    // The cells of a part stand together.
    MeshRange part_of(const DrawItem& item) const {
        const SlotState& state = states[static_cast<std::size_t>(item.height_slot)];
        if (state.whole || state.cell_starts.empty()) return mesh_of(item);
        const int finer = std::countr_zero(state.cell_starts.size() - 1) / 2 - item.part.level;
        std::size_t first = 0;
        for (int bit = item.part.level; bit-- > 0;)
            first = first << 2 | static_cast<std::size_t>(item.part.y >> bit & 1) << 1 |
                    static_cast<std::size_t>(item.part.x >> bit & 1);
        const std::size_t end = (first + 1) << (2 * finer);
        first <<= 2 * finer;
        return state.mesh.section(state.cell_starts[first], state.cell_starts[end] - state.cell_starts[first]);
    }

    void mesh(std::span<const Camera> views, const MeshSettings& settings, const Residency& resident,
              Selection& selection) {
        counters = {};
        MeshSettings s = settings;
        // Where the budget holds the cut coarse, finer vertices within its tiles would not be seen for what they are.
        s.tau_px = std::max(s.tau_px, selection.tau_effective_px / kCutShare);
        gather(resident, selection);
        counters.tiles = static_cast<std::int64_t>(tiles.size());
        const double asked_px = s.tau_px;
        bool fits = choose_and_make(views, s);
        for (int step = 0; !fits && step < kMostCoarsening; ++step) {
            s.tau_px = std::max(s.tau_px, 1.0 / 1024) * kCoarsening;
            fits = choose_and_make(views, s);
        }
        if (!fits) {
            // Eyes in the balls of high peaks want all vertices at any tolerance. Patterns need no pool and keep what
            // was asked; the selection says already how many triangles they are and how far off.
            selection.tau_effective_px = asked_px;
            counters.triangles = selection.triangles;
            return;
        }
        selection.budget_limited = selection.budget_limited || s.tau_px > asked_px;
        const double promise_px = lod.promise_px(s.tau_px);
        hand_over(selection, promise_px);
        selection.tau_effective_px = s.tau_px;
        selection.max_bound_px = std::max(selection.max_bound_px, promise_px);
        selection.mean_bound_px = std::max(selection.mean_bound_px, promise_px);
    }

    bool choose_and_make(std::span<const Camera> views, const MeshSettings& s) {
        for (std::size_t v = 0; v < views.size(); ++v) scale_px[v] = views[v].focal_px() * views[v].off_axis_factor();
        for (const DrawnTile& tile : tiles) choose(tile, views, s);
        for (std::size_t t = 0; t < tiles.size(); ++t)
            std::copy_n(own_border(tiles[t]), edges.words(), edges.border(t));
        edges.agree();
        return make_meshes();
    }
};

namespace {

/// The pool stands here and, shorter where a tile's vertices can be numbered so, in the renderer.
std::size_t index_bytes(const Dataset& dataset) {
    return sizeof(std::uint32_t) + (slot_vertex_count(dataset.lattice.tile_cells_log2) <= 65536
                                        ? sizeof(std::uint16_t)
                                        : sizeof(std::uint32_t));
}

std::size_t most_indices(const Dataset& dataset) {
    const std::size_t cells = std::size_t{1} << dataset.lattice.tile_cells_log2;
    return 6 * cells * cells;
}

MeshPool pool_of(const Dataset& dataset, std::int64_t height_slots) {
    const std::size_t most = most_indices(dataset);
    const auto slots = static_cast<std::size_t>(height_slots);
    return MeshPool(std::max(slots * most / kPoolShare, std::min(slots, kRoomyTiles) * most), most);
}

}  // namespace

PageMesher::PageMesher(const Dataset& dataset, const LodSettings& lod, std::int64_t height_slots)
    : pool_(pool_of(dataset, height_slots)), impl_(std::make_unique<Impl>(dataset, lod, height_slots, pool_)) {}

void PageMesher::renew(const Dataset& dataset, std::int64_t height_slots) {
    pool_ = pool_of(dataset, height_slots);
    impl_ = std::make_unique<Impl>(dataset, impl_->lod, height_slots, pool_);
}

PageMesher::~PageMesher() = default;

void PageMesher::put(std::int32_t slot, std::span<const SlotVertex> vertices, std::span<const VertexCost> costs) {
    impl_->put(slot, vertices, costs);
}

void PageMesher::mesh(std::span<const Camera> views, const MeshSettings& settings, const Residency& residency,
                      Selection& selection) {
    impl_->mesh(views, settings, residency, selection);
}

const MeshCounters& PageMesher::counters() const { return impl_->counters; }

std::int64_t PageMesher::slot_cost(const Dataset& dataset, const LodSettings& lod) {
    const std::size_t vertices = slot_vertex_count(dataset.lattice.tile_cells_log2);
    // What was chosen and what is drawn has a border each, beside that of the frame.
    return TileVertices::slot_cost(dataset, lod.method == LodMethod::block_rsg) +
           3 * EdgeAgreement::slot_cost(dataset.lattice) +
           static_cast<std::int64_t>(vertices + most_indices(dataset) / kPoolShare * index_bytes(dataset) +
                                     sizeof(SlotState) + sizeof(DrawnTile));
}

std::int64_t PageMesher::fixed_cost(const Dataset& dataset) {
    return static_cast<std::int64_t>(kRoomyTiles * most_indices(dataset) * index_bytes(dataset));
}

}  // namespace scree
