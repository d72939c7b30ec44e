// Cut: the tree of nodes that selection refines, and the steps that keep it balanced. Used by Selector and by the tests
// of balance; no policy here beyond "largest need first".
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "common/dataset.h"
#include "runtime/paging/residency.h"
#include "runtime/view/camera.h"
#include "runtime/view/frustum.h"

namespace scree {

/// A camera with what every test needs computed once.
struct LodView {
    explicit LodView(const Camera& camera)
        : frustum(camera),
          eye(camera.eye),
          focal_px(camera.focal_px()),
          error_px(camera.focal_px() * camera.off_axis_factor()),
          near_m(camera.near_m) {}
    Frustum frustum;
    glm::dvec3 eye;
    double focal_px;
    double error_px;  ///< f K: pixels of a metre of error at a metre's distance, at most
    double near_m;
};

enum class Direction : int { north = 0, east = 1, south = 2, west = 3 };
inline constexpr std::array<Direction, 4> kDirections{Direction::north, Direction::east, Direction::south,
                                                      Direction::west};

struct CutNode {
    TileId id;
    HeightBounds bounds;
    const HeightTileHeader* header = nullptr;  ///< null while the tile is not resident
    std::int32_t slot = -1;
    std::int32_t parent = -1;
    std::array<std::int32_t, 4> children{-1, -1, -1, -1};  ///< -1: does not exist, or the node is not split
    std::int32_t exponent = 0;                             ///< log2 of the stride drawn, in finest cells
    bool split = false;
    bool visible = false;      ///< in any view; invisible nodes are never refined or drawn
    bool blocked = false;      ///< a step failed; it would fail again
    double metres_per_px = 0;  ///< smallest over the views that see it of d / (f K): error allowed for one pixel
    double texel_per_px = 0;   ///< smallest over the views of d / f: metres of texture a pixel covers
    double priority = 0;       ///< need of the parent when it was split
};

struct CutSettings {
    double tau_px = 1;
    double texture_tau_px = 1;
    std::int64_t max_pages = 0;  ///< visible nodes, split ones included
    bool only_resident = false;  ///< true: split only where the visible children are resident
};

class Cut {
public:
    explicit Cut(const Dataset& dataset);

    /// Starts from the roots and refines until nothing is needed or possible.
    void refine(std::span<const LodView> views, const CutSettings& settings, const Residency& residency);

    const std::vector<CutNode>& nodes() const { return nodes_; }
    bool page_limited() const { return page_limited_; }
    std::int64_t pages() const { return pages_; }
    std::int64_t steps() const { return steps_; }

    Box box_of(const CutNode& node) const;
    /// Error of a leaf as drawn: 0 for the finest surface with no thinned edge.
    double drawn_error_m(std::int32_t leaf) const;
    /// Edges of a visible leaf at which a neighbour is drawn at twice its stride.
    unsigned edge_mask(std::int32_t leaf) const;
    /// Visits the visible leaves across one side of a leaf.
    template <class Visit>
    void for_each_neighbour(std::int32_t leaf, Direction direction, const Visit& visit) const;
    int minimum_exponent(const CutNode& node) const { return lattice_.deepest_level - node.id.level; }
    int maximum_exponent(const CutNode& node) const { return minimum_exponent(node) + lattice_.tile_cells_log2 - 1; }

private:
    struct HeapEntry {
        double need;
        std::int32_t node;
        std::int32_t exponent;  ///< entries of an older state are skipped
    };
    std::int32_t find(TileId id) const;
    template <class Visit>
    void visit_side(std::int32_t node, Direction side, const Visit& visit) const;
    std::int32_t add_node(TileId id, const HeightBounds& bounds, std::int32_t parent, const Residency& residency);
    void measure(CutNode& node) const;
    double error_need(const CutNode& node, double error_m) const;
    double geometry_need(std::int32_t node) const;
    double texture_need(const CutNode& node) const;
    void push(std::int32_t node);
    bool step(std::int32_t node);
    bool may_split_now(std::int32_t node) const;
    bool try_reduce(std::int32_t node);
    bool try_split(std::int32_t node, double priority);
    bool lower_towards(std::int32_t neighbour, int exponent);
    bool refine_thinned_neighbours(std::int32_t node);

    const Dataset& dataset_;
    const Lattice lattice_;
    std::span<const LodView> views_;
    CutSettings settings_;
    const Residency* residency_ = nullptr;
    std::vector<CutNode> nodes_;
    std::vector<std::int32_t> roots_;
    std::vector<HeapEntry> heap_;
    std::int64_t pages_ = 0, steps_ = 0;
    bool page_limited_ = false;
};

template <class Visit>
void Cut::visit_side(std::int32_t index, Direction side, const Visit& visit) const {
    const CutNode& node = nodes_[static_cast<std::size_t>(index)];
    if (!node.split) {
        if (node.visible) visit(index);
        return;
    }
    // The two children that touch `side` of the node.
    static constexpr std::array<std::array<int, 2>, 4> kTouching{{{0, 1}, {1, 3}, {2, 3}, {0, 2}}};
    for (const int q : kTouching[static_cast<std::size_t>(side)])
        if (const std::int32_t child = node.children[static_cast<std::size_t>(q)]; child >= 0)
            visit_side(child, side, visit);
}

template <class Visit>
void Cut::for_each_neighbour(std::int32_t leaf, Direction direction, const Visit& visit) const {
    TileId id = nodes_[static_cast<std::size_t>(leaf)].id;
    switch (direction) {
        case Direction::north:
            --id.y;
            break;
        case Direction::east:
            ++id.x;
            break;
        case Direction::south:
            ++id.y;
            break;
        case Direction::west:
            --id.x;
            break;
    }
    const std::int32_t found = find(id);
    if (found < 0) return;
    const auto opposite = static_cast<Direction>((static_cast<int>(direction) + 2) % 4);
    visit_side(found, opposite, visit);
}

}  // namespace scree
