#include "runtime/lod/page_mesher.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

#include "runtime/lod/block_selection.h"
#include "runtime/lod/cut.h"
#include "runtime/lod/page_measure.h"
#include "runtime/lod/reuse.h"
#include "runtime/lod/vertex_metric.h"

namespace scree {
namespace {

/// Floor c of the metric max(h, c r) / r^2: reuse straight above a tile for a few triangles more (Scree lod, T3).
constexpr double kMetricFloor = 0.3;
/// Rungs of block thresholds an octave: 8 cost 4 % of triangles on average; fewer cost more, more are left sooner.
constexpr double kRungsPerOctave = 8;
constexpr int kNoRung = std::numeric_limits<int>::min();
constexpr int kLeastRung = kNoRung + 1;  ///< threshold 0: whatever has an error at all
/// Above every error: an eye may stand so far off that its distance is infinite.
constexpr double kGreatestThreshold_m = 1e30;
/// Where meshes do not fit into the pool the tolerance grows by eighths of an octave.
constexpr double kCoarsening = 1.0905077326652577;
constexpr int kMostCoarsening = 16;  ///< two octaves: about a quarter of the triangles
/// Of a vertex's byte; 0: not asked about.
constexpr std::uint8_t kActive = 1, kRejected = 2;
/// Eyes kept of a tile's last choice; with more views nothing is reused.
constexpr std::size_t kMostEyes = 4;
/// A tile with more of its vertices than this has all of them: it is drawn by its pattern, which takes no memory.
constexpr double kWholeShare = 0.6;
/// A height slot's share in the pool, of the 3 * 2 * m^2 indices of a tile with nothing dropped: what a quarter of them
/// comes to where half of the slots are drawn. So many tiles have room for all.
constexpr std::size_t kPoolShare = 8, kRoomyTiles = 64;

// Sides by Direction: the place of the k-th sample along a side, and the neighbour's opposite side.
constexpr std::int32_t side_index(int side, int k, int m) {
    const int row = m + 1;
    switch (side) {
        case 0:
            return k;
        case 1:
            return k * row + m;
        case 2:
            return m * row + k;
        default:
            return k * row;
    }
}
constexpr int opposite(int side) { return (side + 2) % 4; }
TileId beside(TileId id, int side) {
    switch (side) {
        case 0:
            return {id.level, id.x, id.y - 1};
        case 1:
            return {id.level, id.x + 1, id.y};
        case 2:
            return {id.level, id.x, id.y + 1};
        default:
            return {id.level, id.x - 1, id.y};
    }
}

// What is known of a vertex, in 8 bytes: its height, and its cost rounded up to 8 significant bits.
struct VertexRecord {
    float height_n = 0;
    std::uint16_t error = 0, radius = 0;
};

std::uint16_t rounded_up(float value) {
    const auto bits = std::bit_cast<std::uint32_t>(value);
    return static_cast<std::uint16_t>((bits + 0xFFFFu) >> 16);
}
double value_of(std::uint16_t upper) {
    return static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(upper) << 16));
}

/// Which vertices of a tile's four sides are active, by Direction; bit k: the k-th sample.
struct Border {
    static constexpr std::size_t kWords = ((std::size_t{1} << kMaxTileCellsLog2) + 64) / 64;
    std::array<std::array<std::uint64_t, kWords>, 4> sides{};

    bool has(int side, int k) const {
        return (sides[static_cast<std::size_t>(side)][static_cast<std::size_t>(k) / 64] >> (k % 64) & 1) != 0;
    }
    void set(int side, int k) {
        sides[static_cast<std::size_t>(side)][static_cast<std::size_t>(k) / 64] |= std::uint64_t{1} << (k % 64);
    }
    friend bool operator==(const Border&, const Border&) = default;
};

// Where the vertices of a mesh were chosen for.
struct Chosen {
    bool valid = false;
    std::int32_t geomip = -1;
    std::uint32_t edge_mask = 0;
    std::int32_t part_level = 0;
    std::uint32_t seen_by = 0;
    int rung = kNoRung;
    double tau_px = 0, half_curvature = 0;
    std::array<double, kMostEyes> error_px{};
    std::array<glm::dvec3, kMostEyes> eyes{};
};

// What is kept of a height slot.
struct SlotState {
    Chosen chosen;
    Border own;          ///< of what was chosen
    Border drawn;        ///< with what neighbours added, of `mesh`
    bool made = false;   ///< `mesh` is of what was chosen last and of `drawn`
    bool whole = false;  ///< nothing is dropped: drawn by its pattern
    MeshRange mesh;
    std::vector<std::uint32_t> cell_starts;  ///< of its parts' cells in the mesh, Morton order, and the end
};

// A tile drawn in this frame.
struct Drawn {
    const DrawItem* item = nullptr;
    std::int32_t slot = 0;
    std::uint32_t seen_by = 0;
    std::int32_t part_level = 0;  ///< the finest part that it is drawn in
    Box box;
    std::int64_t views = 0;
    Border border;  ///< own, and what neighbours add
};

// Two tiles that share an edge or a part of one: `fine` is the smaller page or one as large.
struct Link {
    std::int32_t fine = 0, coarse = 0;
    std::int32_t side = 0;  ///< of `fine`
    bool same_size = true;
    std::int32_t fine_step = 0, coarse_first = 0, coarse_step = 0, count = 0;  ///< shared vertices; else unused
};

// Tiles of a frame by name: open addressing, kept from frame to frame.
class TileIndex {
public:
    void reset(std::size_t tiles) {
        std::size_t size = 64;
        while (size < 2 * tiles) size *= 2;
        if (slots_.size() < size) slots_.resize(size);
        std::fill(slots_.begin(), slots_.end(), std::pair{TileId{}, -1});
    }
    void add(TileId id, std::int32_t index) {
        std::size_t at = place(id);
        while (slots_[at].second >= 0) at = (at + 1) & (slots_.size() - 1);
        slots_[at] = {id, index};
    }
    std::int32_t find(TileId id) const {
        for (std::size_t at = place(id); slots_[at].second >= 0; at = (at + 1) & (slots_.size() - 1))
            if (slots_[at].first == id) return slots_[at].second;
        return -1;
    }

private:
    std::size_t place(TileId id) const { return TileIdHash{}(id) & (slots_.size() - 1); }
    std::vector<std::pair<TileId, std::int32_t>> slots_;
};

// One view on one tile: the sight of its vertices.
struct TileSight {
    double west = 0, north = 0;  ///< of the eye from the tile's corner, samples; south positive
    double spacing_m = 1, eye_z = 0;
    double error_px = 0, tau_px = 1, half_curvature = 0;
};

}  // namespace

struct PageMesher::Impl {
    Impl(const Dataset& d, const LodSettings& settings, std::int64_t height_slots, MeshPool& meshes)
        : dataset(d),
          lod(settings),
          n(d.lattice.tile_cells_log2),
          m(1 << n),
          vertices(slot_vertex_count(n)),
          bisections{Bisection(n, false), Bisection(n, true)},
          states(static_cast<std::size_t>(height_slots)),
          records(states.size() * vertices),
          chosen(states.size() * vertices),
          added(4 * static_cast<std::size_t>(m + 1)),
          set(vertices),
          pool(meshes),
          buffer(most_indices(bisections[0])) {
        columns.resize(vertices);
        rows.resize(vertices);
        half_bases.resize(static_cast<std::size_t>(2 * n) + 1);
        for (std::size_t v = 0; v < vertices; ++v) {
            columns[v] = static_cast<double>(static_cast<int>(v) % (m + 1));
            rows[v] = static_cast<double>(static_cast<int>(v) / (m + 1));
        }
        // Half a hypotenuse of level k, squared, in samples: m^2 / 2 for the tile, half of that a level.
        for (int level = 1; level <= 2 * n; ++level)
            half_bases[static_cast<std::size_t>(level)] = 0.5 * m * m / std::exp2(level - 1);
        words = (static_cast<std::size_t>(m) + 64) / 64;
        // What a border vertex depends on is the same in even and odd tiles: the tile's own centre has only corners.
        for (int side = 0; side < 4; ++side)
            for (int k = 0; k <= m; ++k) {
                std::fill(set.begin(), set.end(), std::uint8_t{0});
                add_closed(bisections[0], side_index(side, k, m), set.data());
                added[static_cast<std::size_t>(side * (m + 1) + k)] = border_of(set.data());
            }
    }

    const Dataset dataset;  // a copy: the store may be updated under it
    LodSettings lod;
    int n, m;
    std::size_t vertices;
    std::array<Bisection, 2> bisections;
    std::vector<SlotState> states;
    // By slot, an entry a vertex.
    std::vector<VertexRecord> records;
    std::vector<std::uint8_t> chosen;  ///< 1: selected for the tile's own sake
    /// By side and place: the border vertices that come with a border vertex, itself among them.
    std::vector<Border> added;
    std::size_t words = 1;          ///< of a side's bits
    std::vector<std::uint8_t> set;  ///< a buffer: of one tile
    MeshPool& pool;
    std::vector<std::uint32_t> buffer;
    std::vector<double> columns, rows, half_bases;
    MeshCounters counters;
    // Of the frame.
    std::vector<Drawn> tiles;
    std::vector<std::int32_t> tile_of_slot;
    TileIndex index;
    std::vector<Link> links;
    std::vector<std::int32_t> first_link, links_of;
    std::vector<std::int32_t> queue;
    std::vector<std::uint8_t> queued;

    const Bisection& bisection_of(TileId id) const { return bisections[static_cast<std::size_t>((id.x + id.y) & 1)]; }
    std::size_t at(std::int32_t slot) const { return static_cast<std::size_t>(slot) * vertices; }

    Border border_of(const std::uint8_t* active) const {
        Border border;
        for (int side = 0; side < 4; ++side)
            for (int k = 0; k <= m; ++k)
                if (active[side_index(side, k, m)] == kActive) border.set(side, k);
        return border;
    }

    void put(std::int32_t slot, std::span<const SlotVertex> from, std::span<const VertexCost> cost) {
        assert(from.size() == vertices && cost.size() == vertices);
        VertexRecord* to = records.data() + at(slot);
        for (std::size_t k = 0; k < vertices; ++k)
            to[k] = {from[k].height_n, rounded_up(cost[k].error_m), rounded_up(cost[k].radius_m)};
        states[static_cast<std::size_t>(slot)] = {};
    }

    // --- the frame's tiles -------------------------------------------------------------------------------------

    void gather(std::span<const Camera> views, double half_curvature, const Residency& residency,
                const Selection& selection) {
        tiles.clear();
        tile_of_slot.assign(states.size(), -1);
        for (std::size_t v = 0; v < selection.draws.size(); ++v)
            for (const DrawItem& item : selection.draws[v]) {
                std::int32_t& tile = tile_of_slot[static_cast<std::size_t>(item.height_slot)];
                if (tile < 0) {
                    tile = static_cast<std::int32_t>(tiles.size());
                    tiles.push_back({});
                    Drawn& drawn = tiles.back();
                    drawn.item = &item;
                    drawn.slot = item.height_slot;
                    const auto& header = residency.heights.headers[static_cast<std::size_t>(item.height_slot)];
                    drawn.box = box_of(item.tile, header.own);
                }
                tiles[static_cast<std::size_t>(tile)].seen_by |= 1u << v;
                ++tiles[static_cast<std::size_t>(tile)].views;
            }
        for (const DrawList& list : selection.parts)
            for (const DrawItem& item : list) {
                Drawn& tile = tiles[static_cast<std::size_t>(tile_of_slot[static_cast<std::size_t>(item.height_slot)])];
                tile.part_level = std::max(tile.part_level, item.part.level);
            }
        if (half_curvature > 0 && !views.empty())
            for (Drawn& tile : tiles) {
                Box low = tile.box;
                for (const Camera& view : views) {
                    const Box lowered = lowered_by_curvature(tile.box, view.eye, half_curvature);
                    low.low.z = std::min(low.low.z, lowered.low.z);
                }
                tile.box = low;
            }
    }

    Box box_of(TileId id, const HeightBounds& bounds) const {
        const Lattice& l = dataset.lattice;
        const LatticePoint corner = l.corner(id);
        const auto west = static_cast<double>(corner.i), north = static_cast<double>(corner.j),
                   extent = static_cast<double>(l.tile_extent(id.level));
        return {{l.x_m(west), l.y_m(north + extent), dataset.height_m(bounds.min_n)},
                {l.x_m(west + extent), l.y_m(north), dataset.height_m(bounds.max_n)}};
    }

    // --- the choice of a tile's own vertices -------------------------------------------------------------------

    // Vertices that the tile may be drawn with: not below its stride, not those that thinned edges lack.
    bool may_have(const DrawItem& item, std::int32_t v, int level) const {
        const int finest = 2 * (n - item.geomip);
        if (level > finest) return false;
        if (item.edge_mask == 0 || level != finest) return true;
        const int i = v % (m + 1), j = v / (m + 1);
        return !(((item.edge_mask & kEdgeNorth) != 0 && j == 0) || ((item.edge_mask & kEdgeEast) != 0 && i == m) ||
                 ((item.edge_mask & kEdgeSouth) != 0 && j == m) || ((item.edge_mask & kEdgeWest) != 0 && i == 0));
    }

    template <class Selects>
    void refine(const Bisection& b, const DrawItem& item, const BisectionTriangle& t, int level, std::uint8_t* active,
                const Selects& selects) {
        if (level > 2 * (n - item.geomip)) return;
        const std::int32_t v = t.middle();
        if (active[v] == kRejected) return;
        if (active[v] == 0) {
            if (!may_have(item, v, level) || !selects(v, level)) {
                active[v] = kRejected;
                return;
            }
            active[v] = kActive;
        }
        refine(b, item, t.left_half(), level + 1, active, selects);
        refine(b, item, t.right_half(), level + 1, active, selects);
    }

    void start_set(const Bisection& b, std::uint8_t* active) const {
        std::memset(active, 0, vertices);
        for (const int j : {0, m})
            for (const int i : {0, m}) active[b.index(i, j)] = 1;
    }

    TileSight sight_of(const Drawn& tile, const Camera& view, const MeshSettings& s) const {
        const Lattice& l = dataset.lattice;
        const TileId id = tile.item->tile;
        const LatticePoint corner = l.corner(id);
        TileSight sight;
        sight.spacing_m = l.spacing_m * static_cast<double>(l.step(id.level));
        sight.west = (view.eye.x - l.x_m(static_cast<double>(corner.i))) / sight.spacing_m;
        sight.north = (l.y_m(static_cast<double>(corner.j)) - view.eye.y) / sight.spacing_m;
        sight.eye_z = view.eye.z;
        sight.error_px = view.focal_px() * (lod.metric == ErrorMetric::uc ? 1 : view.off_axis_factor());
        sight.tau_px = s.tau_px;
        sight.half_curvature = s.half_curvature;
        return sight;
    }

    VertexSight<double> see(const TileSight& s, std::size_t slot_at, std::int32_t v) const {
        const auto k = static_cast<std::size_t>(v);
        const double dx = columns[k] - s.west, dy = rows[k] - s.north;
        const double h2 = (dx * dx + dy * dy) * s.spacing_m * s.spacing_m;
        const double z = dataset.height_offset_m +
                         static_cast<double>(records[slot_at + k].height_n) * dataset.height_quantum_m -
                         h2 * s.half_curvature;
        const double dz = z - s.eye_z;
        return {h2, dz * dz};
    }

    // N*K, with what flat triangles miss of the earth's curvature: no more than
    // half of it at the middle of a hypotenuse 2 l long, l^2 / 2R.
    bool guaranteed(const TileSight& s, std::size_t slot_at, std::int32_t v, int level) const {
        const VertexRecord& record = records[slot_at + static_cast<std::size_t>(v)];
        const double bulge = half_bases[static_cast<std::size_t>(level)] * s.spacing_m * s.spacing_m * s.half_curvature;
        const double error_m = value_of(record.error) + bulge;
        if (!(error_m > 0)) return false;
        const VertexSight<double> sight = see(s, slot_at, v);
        double radius = value_of(record.radius);
        // Curvature lowers the ball's points by other amounts than its centre.
        if (s.half_curvature > 0) radius *= 1 + (2 * std::sqrt(sight.h2) + radius) * s.half_curvature;
        return guaranteed_selects(s.error_px * error_m, radius, kMetricFloor, s.tau_px, sight);
    }

    void choose_guaranteed(const Drawn& tile, std::span<const TileSight> sights, std::uint8_t* active) {
        const Bisection& b = bisection_of(tile.item->tile);
        const std::size_t slot_at = at(tile.slot);
        for (const BisectionTriangle& root : b.roots())
            refine(b, *tile.item, root, 1, active, [&](std::int32_t v, int level) {
                return std::any_of(sights.begin(), sights.end(),
                                   [&](const TileSight& s) { return guaranteed(s, slot_at, v, level); });
            });
    }

    // Ueng & Chuang: active and lock, finest first. What is locked is what an active child has marked.
    void choose_uc(const Drawn& tile, std::span<const TileSight> sights, std::uint8_t* active) {
        const Bisection& b = bisection_of(tile.item->tile);
        const std::size_t slot_at = at(tile.slot);
        const auto order = b.coarse_to_fine();
        for (std::size_t k = order.size(); k-- > 0;) {
            const std::int32_t v = order[k];
            const BisectionVertex& vertex = b.vertex(v);
            if (!may_have(*tile.item, v, vertex.level)) continue;
            const double delta = value_of(records[slot_at + static_cast<std::size_t>(v)].error);
            const bool want = active[v] != 0 || std::any_of(sights.begin(), sights.end(), [&](const TileSight& s) {
                                  return uc_selects(s.error_px * delta, s.tau_px, see(s, slot_at, v));
                              });
            if (!want) continue;
            active[v] = 1;
            for (const std::int32_t parent : vertex.parents)
                if (parent >= 0) active[parent] = 1;
        }
    }

    void choose_block(const Drawn& tile, double threshold_m, double half_curvature, std::uint8_t* active) {
        const Bisection& b = bisection_of(tile.item->tile);
        const std::size_t slot_at = at(tile.slot);
        const double spacing_m =
            dataset.lattice.spacing_m * static_cast<double>(dataset.lattice.step(tile.item->tile.level));
        const double bulge = spacing_m * spacing_m * half_curvature;
        for (const BisectionTriangle& root : b.roots())
            refine(b, *tile.item, root, 1, active, [&](std::int32_t v, int level) {
                return value_of(records[slot_at + static_cast<std::size_t>(v)].error) +
                           bulge * half_bases[static_cast<std::size_t>(level)] >
                       threshold_m;
            });
    }

    // The rung of a tile: what it may err by, over the views that see it.
    int rung_of(const Drawn& tile, std::span<const Camera> views, double tau_px) const {
        double threshold_m = std::numeric_limits<double>::infinity();
        for (std::size_t v = 0; v < views.size(); ++v) {
            if ((tile.seen_by >> v & 1) == 0) continue;
            const Camera& view = views[v];
            const double distance_m = std::max(distance_to_box(view.eye, tile.box), view.near_m);
            threshold_m = std::min(threshold_m, tau_px * distance_m / (view.focal_px() * view.off_axis_factor()));
        }
        threshold_m = std::min(threshold_m, kGreatestThreshold_m);
        if (!(threshold_m > 0)) return kLeastRung;
        return static_cast<int>(std::floor(kRungsPerOctave * std::log2(threshold_m)));
    }
    static double threshold_of(int rung) { return rung == kLeastRung ? 0 : std::exp2(rung / kRungsPerOctave); }

    bool same_shape(const Chosen& c, const Drawn& tile, const MeshSettings& s) const {
        return c.valid && c.geomip == tile.item->geomip && c.edge_mask == tile.item->edge_mask &&
               c.part_level == tile.part_level && c.half_curvature == s.half_curvature;
    }

    bool may_reuse(const Chosen& c, const Drawn& tile, std::span<const Camera> views, const MeshSettings& s) const {
        if (lod.reuse == ReuseTest::off || !same_shape(c, tile, s) || views.size() > kMostEyes) return false;
        if (c.tau_px != s.tau_px || (tile.seen_by & ~c.seen_by) != 0) return false;
        for (std::size_t v = 0; v < views.size(); ++v) {
            if ((tile.seen_by >> v & 1) == 0) continue;
            if (!may_reuse(c.eyes[v], c.error_px[v], tile, views[v], s)) return false;
        }
        return true;
    }

    bool may_reuse(const glm::dvec3& then, double error_px, const Drawn& tile, const Camera& view,
                   const MeshSettings& s) const {
        const double now_px = view.focal_px() * view.off_axis_factor();
        if (now_px > error_px) return false;
        if (lod.reuse == ReuseTest::paper)
            return reuse_p1(then, view.eye, corners_of(tile), tile.box, view.focal_px(), lod.s_px, s.tau_px);
        const EyeToBox before = eye_to_box(then, tile.box), after = eye_to_box(view.eye, tile.box);
        double moved_m = glm::length(view.eye - then);
        // Relative to the eye, a point over a curved earth moves by more than the eye does.
        if (s.half_curvature > 0) {
            const double furthest_m = std::max(before.level_m, after.level_m) +
                                      std::hypot(tile.box.high.x - tile.box.low.x, tile.box.high.y - tile.box.low.y);
            moved_m *= 1 + (2 * furthest_m + moved_m) * s.half_curvature;
        }
        return reuse_exact(before, after, moved_m, kMetricFloor, {s.tau_px, lod.s_px});
    }

    std::array<glm::dvec3, 4> corners_of(const Drawn& tile) const {
        const auto z = [&](int i, int j) {
            return dataset.height_offset_m +
                   dataset.height_quantum_m *
                       static_cast<double>(records[at(tile.slot) + static_cast<std::size_t>(j * (m + 1) + i)].height_n);
        };
        const Box& box = tile.box;
        return {{{box.low.x, box.high.y, z(0, 0)},
                 {box.high.x, box.high.y, z(m, 0)},
                 {box.low.x, box.low.y, z(0, m)},
                 {box.high.x, box.low.y, z(m, m)}}};
    }

    bool complete_if_dense(const DrawItem& item, std::uint8_t* active) const {
        std::size_t count = 0;
        for (std::size_t v = 0; v < vertices; ++v) count += active[v];
        const int side = (m >> item.geomip) + 1;
        if (static_cast<double>(count) <= kWholeShare * side * side) return false;
        const Bisection& b = bisection_of(item.tile);
        for (const std::int32_t v : b.coarse_to_fine())
            if (may_have(item, v, b.vertex(v).level)) active[v] = kActive;
        return true;
    }

    // Parts of a tile are drawn apart: the lines between them must be edges.
    void add_parts(const Bisection& b, int part_level, std::uint8_t* active) const {
        const int stride = m >> part_level;
        for (int j = 0; part_level > 0 && j <= m; j += stride)
            for (int i = 0; i <= m; i += stride) add_closed(b, b.index(i, j), active);
    }

    void choose(Drawn& tile, std::span<const Camera> views, const MeshSettings& s) {
        Chosen& c = states[static_cast<std::size_t>(tile.slot)].chosen;
        int rung = kNoRung;
        if (lod.method == LodMethod::block_rsg) {
            rung = rung_of(tile, views, s.tau_px);
            if (rung == c.rung && same_shape(c, tile, s)) return;
        } else if (may_reuse(c, tile, views, s)) {
            return;
        }
        ++counters.chosen;
        std::uint8_t* active = chosen.data() + at(tile.slot);
        const Bisection& b = bisection_of(tile.item->tile);
        start_set(b, active);
        if (lod.method == LodMethod::block_rsg) {
            choose_block(tile, threshold_of(rung), s.half_curvature, active);
        } else {
            std::array<TileSight, kMaxViews> sights;
            std::size_t count = 0;
            for (std::size_t v = 0; v < views.size(); ++v)
                if ((tile.seen_by >> v & 1) != 0) sights[count++] = sight_of(tile, views[v], s);
            const std::span used(sights.data(), count);
            if (lod.metric == ErrorMetric::uc)
                choose_uc(tile, used, active);
            else
                choose_guaranteed(tile, used, active);
        }
        for (std::size_t v = 0; v < vertices; ++v) active[v] &= kActive;
        SlotState& state = states[static_cast<std::size_t>(tile.slot)];
        state.whole = complete_if_dense(*tile.item, active);
        add_parts(b, tile.part_level, active);
        state.own = border_of(active);
        state.made = false;
        c = {true,
             tile.item->geomip,
             tile.item->edge_mask,
             tile.part_level,
             tile.seen_by,
             rung,
             s.tau_px,
             s.half_curvature,
             {},
             {}};
        for (std::size_t v = 0; v < std::min(views.size(), kMostEyes); ++v) {
            c.eyes[v] = views[v].eye;
            c.error_px[v] = views[v].focal_px() * views[v].off_axis_factor();
        }
    }

    // --- shared edges ------------------------------------------------------------------------------------------

    void link_tiles() {
        index.reset(tiles.size());
        for (std::size_t t = 0; t < tiles.size(); ++t) index.add(tiles[t].item->tile, static_cast<std::int32_t>(t));
        links.clear();
        for (std::size_t t = 0; t < tiles.size(); ++t)
            for (int side = 0; side < 4; ++side) link(static_cast<std::int32_t>(t), side);
        first_link.assign(tiles.size() + 1, 0);
        for (const Link& l : links) {
            ++first_link[static_cast<std::size_t>(l.fine) + 1];
            ++first_link[static_cast<std::size_t>(l.coarse) + 1];
        }
        for (std::size_t t = 0; t < tiles.size(); ++t) first_link[t + 1] += first_link[t];
        links_of.resize(2 * links.size());
        queue.assign(first_link.begin(), first_link.end());
        for (std::size_t k = 0; k < links.size(); ++k)
            for (const std::int32_t t : {links[k].fine, links[k].coarse})
                links_of[static_cast<std::size_t>(queue[static_cast<std::size_t>(t)]++)] = static_cast<std::int32_t>(k);
    }

    // Each pair once: from the smaller page, or towards east and south.
    void link(std::int32_t t, int side) {
        const DrawItem& item = *tiles[static_cast<std::size_t>(t)].item;
        TileId other = beside(item.tile, side);
        if (!dataset.lattice.contains(other)) return;
        std::int32_t found = index.find(other);
        if (found >= 0 && (side == 0 || side == 3)) return;
        while (found < 0 && other.level > 0) {
            other = parent_of(other);
            found = index.find(other);
        }
        if (found < 0) return;
        const DrawItem& coarse = *tiles[static_cast<std::size_t>(found)].item;
        const Lattice& l = dataset.lattice;
        const auto edge_stride = [&](const DrawItem& of, int its_side) {
            return l.step(of.tile.level) << (of.geomip + static_cast<int>(of.edge_mask >> its_side & 1u));
        };
        const std::int64_t stride = std::max(edge_stride(item, side), edge_stride(coarse, opposite(side)));
        const std::int64_t fine_step = l.step(item.tile.level), coarse_step = l.step(coarse.tile.level);
        const LatticePoint a = l.corner(item.tile), c = l.corner(coarse.tile);
        const bool along_i = side == 0 || side == 2;
        const std::int64_t offset = along_i ? a.i - c.i : a.j - c.j;
        Link link;
        link.fine = t;
        link.coarse = found;
        link.side = side;
        link.same_size = other.level == item.tile.level;
        link.fine_step = static_cast<std::int32_t>(stride / fine_step);
        link.coarse_first = static_cast<std::int32_t>(offset / coarse_step);
        link.coarse_step = static_cast<std::int32_t>(stride / coarse_step);
        link.count = static_cast<std::int32_t>(l.tile_extent(item.tile.level) / stride) + 1;
        links.push_back(link);
    }

    void enqueue(std::int32_t t) {
        if (queued[static_cast<std::size_t>(t)] != 0) return;
        queued[static_cast<std::size_t>(t)] = 1;
        queue.push_back(t);
    }

    // A vertex comes with what it depends on, which may lie on the tile's other sides.
    void add(std::int32_t t, int side, int k) {
        const Border& more = added[static_cast<std::size_t>(side * (m + 1) + k)];
        Border& border = tiles[static_cast<std::size_t>(t)].border;
        for (std::size_t i = 0; i < 4; ++i)
            for (std::size_t w = 0; w < words; ++w) border.sides[i][w] |= more.sides[i][w];
        enqueue(t);
    }

    // What one of two draws on their edge the other draws as well.
    void exchange(const Link& l) {
        Border &fine = tiles[static_cast<std::size_t>(l.fine)].border,
               &coarse = tiles[static_cast<std::size_t>(l.coarse)].border;
        const int other = opposite(l.side);
        if (!l.same_size) {
            for (int k = 0; k < l.count; ++k) {
                const int a = k * l.fine_step, b = l.coarse_first + k * l.coarse_step;
                if (fine.has(l.side, a) == coarse.has(other, b)) continue;
                if (fine.has(l.side, a))
                    add(l.coarse, other, b);
                else
                    add(l.fine, l.side, a);
            }
            return;
        }
        for (std::size_t w = 0; w < words; ++w) {
            std::uint64_t apart =
                fine.sides[static_cast<std::size_t>(l.side)][w] ^ coarse.sides[static_cast<std::size_t>(other)][w];
            for (; apart != 0; apart &= apart - 1) {
                const int k = static_cast<int>(64 * w) + std::countr_zero(apart);
                if (fine.has(l.side, k))
                    add(l.coarse, other, k);
                else
                    add(l.fine, l.side, k);
            }
        }
    }

    void agree() {
        for (Drawn& tile : tiles) tile.border = states[static_cast<std::size_t>(tile.slot)].own;
        queue.clear();
        queued.assign(tiles.size(), 0);
        for (const Link& l : links) exchange(l);
        for (std::size_t k = 0; k < queue.size(); ++k) {
            const auto t = static_cast<std::size_t>(queue[k]);
            queued[t] = 0;
            for (std::int32_t i = first_link[t]; i < first_link[t + 1]; ++i)
                exchange(links[static_cast<std::size_t>(links_of[static_cast<std::size_t>(i)])]);
        }
    }

    // --- triangles ---------------------------------------------------------------------------------------------

    // The tile's own vertices with those of its border, into `set`.
    void assemble(const Drawn& tile) {
        std::memcpy(set.data(), chosen.data() + at(tile.slot), vertices);
        const Bisection& b = bisection_of(tile.item->tile);
        const Border& own = states[static_cast<std::size_t>(tile.slot)].own;
        for (std::size_t side = 0; side < 4; ++side)
            for (std::size_t w = 0; w < words; ++w)
                for (std::uint64_t more = tile.border.sides[side][w] & ~own.sides[side][w]; more != 0;
                     more &= more - 1) {
                    const int k = static_cast<int>(64 * w) + std::countr_zero(more);
                    add_closed(b, side_index(static_cast<int>(side), k, m), set.data());
                }
    }

    // Cell by cell of its parts, in Morton order.
    void emit(const Drawn& tile) {
        assemble(tile);
        const Bisection& b = bisection_of(tile.item->tile);
        SlotState& state = states[static_cast<std::size_t>(tile.slot)];
        std::uint32_t* out = buffer.data();
        state.cell_starts.clear();
        for_each_cell(tile.part_level, [&](int x, int y) {
            if (tile.part_level > 0) state.cell_starts.push_back(static_cast<std::uint32_t>(out - buffer.data()));
            for (const BisectionTriangle& root : b.roots(n - tile.part_level, x, y))
                out = emit_triangles(b, set.data(), root, 2 * tile.part_level + 1, out);
        });
        const auto count = static_cast<std::size_t>(out - buffer.data());
        if (tile.part_level > 0) state.cell_starts.push_back(static_cast<std::uint32_t>(count));
        state.mesh = pool.put(std::span(buffer.data(), count));
        state.drawn = tile.border;
        state.made = true;
        ++counters.remade;
    }

    template <class Visit>
    static void for_each_cell(int level, const Visit& visit) {
        for (int code = 0; code < 1 << (2 * level); ++code) {
            int x = 0, y = 0;
            for (int bit = 0; bit < level; ++bit) {
                x |= (code >> (2 * bit) & 1) << bit;
                y |= (code >> (2 * bit + 1) & 1) << bit;
            }
            visit(x, y);
        }
    }

    // False: they do not all fit.
    bool make_meshes() {
        if (make_missing()) return true;
        // New ones have overwritten some that are still needed.
        pool.clear();
        return make_missing();
    }

    bool make_missing() {
        for (const Drawn& tile : tiles)
            if (!is_made(tile)) emit(tile);
        return std::all_of(tiles.begin(), tiles.end(), [&](const Drawn& tile) { return is_made(tile); });
    }

    bool is_made(const Drawn& tile) const {
        const SlotState& state = states[static_cast<std::size_t>(tile.slot)];
        if (state.whole) return true;
        return state.made && state.drawn == tile.border && pool.holds(state.mesh);
    }

    void hand_over(Selection& selection) {
        for (DrawList& list : selection.draws)
            for (DrawItem& item : list) item.mesh = mesh_of(item);
        for (DrawList& list : selection.parts)
            for (DrawItem& item : list) item.mesh = part_of(item);
        selection.triangles = 0;
        for (const Drawn& tile : tiles) selection.triangles += tile.views * triangles_of(tile);
        counters.triangles = selection.triangles;
    }

    MeshRange mesh_of(const DrawItem& item) const {
        const SlotState& state = states[static_cast<std::size_t>(item.height_slot)];
        return state.whole ? MeshRange{} : state.mesh;
    }

    std::int64_t triangles_of(const Drawn& tile) const {
        const SlotState& state = states[static_cast<std::size_t>(tile.slot)];
        return state.whole ? pattern_triangles(n, tile.item->geomip, tile.item->edge_mask) : state.mesh.count / 3;
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

    void mesh(std::span<const Camera> views, const MeshSettings& settings, const Residency& residency,
              Selection& selection) {
        counters = {};
        MeshSettings s = settings;
        // Where the budget holds the cut coarse, finer vertices within its tiles would not be seen for what they are.
        s.tau_px = std::max(s.tau_px, selection.tau_effective_px / kCutShare);
        gather(views, s.half_curvature, residency, selection);
        counters.tiles = static_cast<std::int64_t>(tiles.size());
        link_tiles();
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
        hand_over(selection);
        selection.tau_effective_px = s.tau_px;
        selection.max_bound_px = std::max(selection.max_bound_px, lod.promise_px(s.tau_px));
        selection.mean_bound_px = std::max(selection.mean_bound_px, lod.promise_px(s.tau_px));
    }

    bool choose_and_make(std::span<const Camera> views, const MeshSettings& s) {
        for (Drawn& tile : tiles) choose(tile, views, s);
        agree();
        return make_meshes();
    }
};

namespace {

/// The pool stands here and, shorter, in the renderer.
constexpr std::size_t kIndexBytes = 2 * sizeof(std::uint32_t);

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

std::int64_t PageMesher::slot_cost(const Dataset& dataset) {
    const std::size_t vertices = slot_vertex_count(dataset.lattice.tile_cells_log2);
    return static_cast<std::int64_t>(vertices * (sizeof(VertexRecord) + 1) +
                                     most_indices(dataset) / kPoolShare * kIndexBytes + sizeof(SlotState) +
                                     sizeof(Drawn) + 6 * sizeof(Link));
}

std::int64_t PageMesher::fixed_cost(const Dataset& dataset) {
    return static_cast<std::int64_t>(kRoomyTiles * most_indices(dataset) * kIndexBytes);
}

}  // namespace scree
