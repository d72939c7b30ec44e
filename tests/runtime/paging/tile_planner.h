// TilePlanner: the least of a selection, to try the pager without one: a greedy quadtree refinement round a point, as
// far as the slots go. What it plans when everything is resident depends on the point and the slots alone.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <queue>
#include <tuple>
#include <vector>

#include "common/dataset.h"
#include "runtime/paging/memory_plan.h"
#include "runtime/paging/pager.h"

namespace scree::test {

struct TilePlan {
    std::array<std::vector<std::int32_t>, 2> planned, standing;  ///< by kind
    std::vector<TileRequest> requests;
    std::vector<std::tuple<TileKind, TileId, std::int32_t>> resident;  ///< of what is planned: kind, tile, slot
    bool complete = true;

    Pager::Wishes wishes() const { return {planned[0], planned[1], standing[0], standing[1], requests}; }
};

class TilePlanner {
public:
    /// Tiles are split while their extent is more than `detail` of their distance.
    TilePlanner(const Dataset& dataset, const MemoryPlan& memory, double detail, bool prefetch = false)
        : dataset_(dataset), slots_{memory.height_slots, memory.texture_slots}, detail_(detail), prefetch_(prefetch) {}

    /// Takes the memory that any plan needs, so that a measurement of the pager's does not count it.
    void take_memory() {
        const auto tiles = static_cast<std::size_t>(slots_[0] + slots_[1]);
        plan_.resident.resize(tiles);
        plan_.requests.resize(4 * tiles);
        nodes_.resize(tiles);
        for (auto* lists : {&plan_.planned, &plan_.standing})
            for (auto& list : *lists) list.resize(tiles);
    }

    /// `i`, `j`: the point, in finest cells. Allocates nothing new for a plan no larger than an earlier one.
    const TilePlan& plan(const Residency& residency, double i, double j) {
        plan_.requests.clear();
        plan_.resident.clear();
        plan_.complete = true;
        plan_one(TileKind::height, residency, i, j);
        if (residency.has_textures) plan_one(TileKind::texture, residency, i, j);
        std::sort(plan_.requests.begin(), plan_.requests.end(), [](const TileRequest& a, const TileRequest& b) {
            return std::tuple(a.prefetch, -a.priority, a.kind, a.id) <
                   std::tuple(b.prefetch, -b.priority, b.kind, b.id);
        });
        return plan_;
    }

private:
    struct Node {
        double need;
        TileId id;
        std::int32_t slot;
        bool operator<(const Node& o) const { return std::tie(need, o.id) < std::tie(o.need, id); }
    };

    double need(TileId id, double i, double j) const {
        const double extent = std::ldexp(static_cast<double>(dataset_.lattice.tile_extent(0)), -id.level);
        const auto gap = [&](double low, double at) { return std::max({0.0, low - at, at - low - extent}); };
        const double x = gap(static_cast<double>(id.x) * extent, i), y = gap(static_cast<double>(id.y) * extent, j);
        return extent / std::max(std::hypot(x, y), 0.5) / detail_;
    }

    void add(TileKind kind, TileId id, std::int32_t slot, double i, double j) {
        plan_.planned[static_cast<std::size_t>(kind)].push_back(slot);
        plan_.resident.emplace_back(kind, id, slot);
        nodes_.push_back({need(id, i, j), id, slot});
        std::push_heap(nodes_.begin(), nodes_.end());
    }

    void plan_one(TileKind kind, const Residency& residency, double i, double j) {
        const ResidentPages& pages = residency.of(kind);
        const auto k = static_cast<std::size_t>(kind);
        plan_.planned[k].clear();
        plan_.standing[k].clear();
        nodes_.clear();
        for (std::size_t root = 0; root < pages.roots.size(); ++root) {
            const auto at = static_cast<std::int64_t>(root), columns = dataset_.lattice.root_columns;
            if (pages.roots[root] >= 0) add(kind, {0, at % columns, at / columns}, pages.roots[root], i, j);
        }
        auto left = slots_[k] - static_cast<std::int64_t>(nodes_.size());
        while (!nodes_.empty()) {
            std::pop_heap(nodes_.begin(), nodes_.end());
            const Node node = nodes_.back();
            nodes_.pop_back();
            const auto& children = pages.children[static_cast<std::size_t>(node.slot)];
            const unsigned mask = pages.headers[static_cast<std::size_t>(node.slot)].child_mask;
            std::int64_t wanted = 0;
            for (std::size_t q = 0; q < 4; ++q) wanted += (mask >> q & 1u) != 0 && children[q] != kUnavailable ? 1 : 0;
            const bool ahead = node.need <= 1 && prefetch_ && node.need > 0.5;
            const bool split = node.need > 1 && wanted <= left;
            if (split) left -= wanted;
            for (std::size_t q = 0; q < 4; ++q) {
                if ((mask >> q & 1u) == 0 || children[q] == kUnavailable) continue;
                const TileId child = child_of(node.id, static_cast<int>(q));
                if (children[q] >= 0 && split) add(kind, child, children[q], i, j);
                if (children[q] >= 0 && !split) plan_.standing[k].push_back(children[q]);
                if (children[q] >= 0 || (!split && !ahead)) continue;
                plan_.requests.push_back({kind, child, node.need, !split});
                plan_.complete = plan_.complete && !split;
            }
        }
    }

    const Dataset& dataset_;
    std::array<std::int64_t, 2> slots_;
    double detail_;
    bool prefetch_;
    std::vector<Node> nodes_;
    TilePlan plan_;
};

/// A few slots more than the roots need.
inline MemoryPlan tiny_plan(Random& random, const SyntheticTerrain& terrain) {
    const std::int64_t roots = terrain.lattice().root_rows * terrain.lattice().root_columns;
    return {roots + uniform(random, 4, 40), roots + uniform(random, 0, 40), uniform(random, 1, 6), 0};
}

}  // namespace scree::test
