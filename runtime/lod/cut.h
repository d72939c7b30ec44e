// Cut: the tree of pages that selection refines, and the continuous level at which each leaf is drawn. No policy about
// budgets or requests here; see selection.h. docs/lod-and-paging.md has the rules and why they suffice.
//
// Rules for two visible leaves that share an edge (Level: log2 of the stride drawn, continuous):
//     L_B <= L_A + 1                      one exponent apart at most; a thinned edge never moves further than its tile
//     L_A <= L_B  where A is the smaller page      the finer page is never the coarser mesh
// and a page is never drawn coarser than its parent would be as a leaf: pages hand over without a jump.
// The levels drawn are the greatest that satisfy these and the tolerance, so they do not depend on any order, and move
// continuously with the eye.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "common/dataset.h"
#include "runtime/lod/level.h"
#include "runtime/lod/lod_method.h"
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

/// At most this many views a selection: CutNode::seen_by has a bit each.
inline constexpr std::size_t kMaxViews = 32;

enum class Direction : int { north = 0, east = 1, south = 2, west = 3 };
inline constexpr std::array<Direction, 4> kDirections{Direction::north, Direction::east, Direction::south,
                                                      Direction::west};

/// What the rules between neighbours look at comes first: it fills one line of the cache.
struct alignas(64) CutNode {
    bool split = false;
    bool wants_geometry = false;  ///< its finest mesh is not good enough
    bool queued = false;
    bool refused = false;        ///< neighbours want it finer than it can be
    bool leaf = false;           ///< of the stored pyramid: nothing finer is there
    bool texture_ends = false;   ///< no texture below this address is stored
    bool textured = true;        ///< the texture of this address is stored
    std::int8_t page_level = 0;  ///< id.level
    std::uint32_t seen_by = 0;   ///< views that may see its box; without any it is neither refined nor drawn
    Level level = 0;             ///< drawn; of a split node: what it would be drawn at as a leaf
    Level floor = 0;             ///< least level that it can be drawn at in this cut
    std::array<std::int32_t, 4> neighbours{-1, -1, -1, -1};  ///< by Direction: a node as large or larger, or -1
    std::array<std::int32_t, 4> children{-1, -1, -1, -1};    ///< -1: does not exist, or the node is not split
    std::int32_t parent = -1;
    std::int32_t slot = kNotResident;  ///< of its height tile
    Level approach = -kOneLevel;       ///< log2 of texture_need where it may split the page, against kTextureApproach

    std::int32_t texture_slot = kNotResident;  ///< of the texture tile of the same address
    std::uint32_t inside = 0;                  ///< views that see all of its box
    Level judged = 0;                          ///< the coarsest level within the tolerances: what `level` falls from
    std::int32_t twin = -1;                    ///< the same page in the cut that this one was made beside, or -1
    TileId id;
    const HeightBounds* bounds = nullptr;
    double metres_per_px = 0;        ///< least over the views that see it of d / (f K): error allowed for one pixel; of
                                     ///< de Boer's metric d is the distance to its centre, and K 1
    double texel_per_px = 0;         ///< least over the views of d / f: metres of texture a pixel covers
    double west_m = 0, north_m = 0;  ///< its north-west corner
    double finest_error_m = 0;       ///< of its own densest mesh, thinned edges included
    double texture_need = 0;         ///< of its own texture over the tolerance, where finer textures exist
    double grows_from_s = -std::numeric_limits<double>::infinity();  ///< when it begins to leave its parent's shape
    Level released = kOneLevel;  ///< how far a split page whose children came late has let go of smaller neighbours
    double priority = 0;         ///< need of the parent when it was split

    bool visible() const { return seen_by != 0; }
};

struct CutSettings {
    double tau_px = 1;
    double texture_tau_px = 1;
    std::int64_t max_pages = 0;  ///< visible nodes, split ones included; the walk is given up beyond
    bool only_resident = false;  ///< true: split only where the visible children are resident
    double half_curvature = 0;   ///< 1 / (2 R), 1/m
    /// Seconds in which a page that came late grows out of its parent's shape by one level; 0: at once.
    double growth_s = 0;
    double moved_m = 0;  ///< by the eye from frame to frame: what moves across the screen so hides its growth
    ErrorMetric metric = ErrorMetric::guaranteed;  ///< or deboer
};

/// A box as it is seen over a curved earth: lowered by the least and the greatest drop within it.
inline Box lowered_by_curvature(Box box, const glm::dvec3& eye, double half_curvature) {
    if (!(half_curvature > 0)) return box;
    const double west = box.low.x - eye.x, east = box.high.x - eye.x, south = box.low.y - eye.y,
                 north = box.high.y - eye.y;
    const double near_x = std::clamp(0.0, west, east), near_y = std::clamp(0.0, south, north);
    const double far_x = std::max(-west, east), far_y = std::max(-south, north);
    box.low.z -= (far_x * far_x + far_y * far_y) * half_curvature;
    box.high.z -= (near_x * near_x + near_y * near_y) * half_curvature;
    return box;
}

class Cut {
public:
    explicit Cut(const Dataset& dataset);

    /// Makes the cut anew. False: more than max_pages would be needed; the cut is then unusable. `beside`: one just
    /// made of the same views and residency for the same tolerances: what it has measured is not measured again.
    bool refine(std::span<const LodView> views, const CutSettings& settings, const Residency& residency,
                const Cut* beside = nullptr);

    /// Parents come before their children.
    const std::vector<CutNode>& nodes() const { return nodes_; }
    std::int64_t pages() const { return pages_; }
    std::int64_t steps() const { return steps_; }
    /// Some page is still growing: the picture will change though nothing moves.
    bool growing() const { return growing_; }

    Box box_of(const CutNode& node) const;
    int minimum_exponent(const CutNode& node) const { return lattice_.deepest_level - node.id.level; }
    int maximum_exponent(const CutNode& node) const { return minimum_exponent(node) + lattice_.tile_cells_log2 - 1; }

    /// How a visible leaf is drawn.
    struct Drawn {
        int exponent = 0;
        unsigned edge_mask = 0;
        float morph = 0;
        std::array<float, 4> edge_morph{};
    };
    Drawn drawn(std::int32_t leaf);
    /// The visible leaf beside it that is as large or larger, or -1. `direction`: north, east, south, west.
    std::int32_t drawn_beside(std::int32_t leaf, int direction);
    /// Greatest error of a leaf drawn so, metres.
    double drawn_error_m(const CutNode& leaf, const Drawn& drawn) const;
    /// node.metres_per_px of the guaranteed metric, whichever the cut was made by.
    double certain_metres_per_px(const CutNode& node) const;
    /// One of its four corners is in the frustum, taken half-way between its lowest and highest heights (Ke et al.).
    bool corner_in_view(const CutNode& node, const LodView& view) const;

private:
    std::int32_t neighbour(std::int32_t node, int direction);
    std::int32_t descend(std::int32_t node, int direction);
    template <class Visit>
    void for_each_leaf_on(std::int32_t node, int side, const Visit& visit) const;
    template <class Visit>
    void for_each_neighbour(std::int32_t leaf, int direction, const Visit& visit);

    /// What a node's parent knows of it.
    struct Known {
        const HeightBounds* bounds = nullptr;
        std::int32_t slot = kNotResident, texture_slot = kNotResident;
        bool leaf = false, texture_ends = false, textured = true;
    };
    /// What the views see of the four quadrants of a page, whether they exist or not.
    struct FourMeasured {
        std::array<std::uint32_t, 4> seen_by{}, inside{};
        std::array<double, 4> metres_per_px{}, texel_per_px{};
        std::array<double, 2> west_m{}, north_m{};  ///< by column, by row
    };
    Known known_root(std::size_t root) const;
    Known known_child(const CutNode& parent, std::size_t quadrant) const;
    std::int32_t add_node(TileId id, const Known& known, std::int32_t parent);
    std::int32_t add_twin(std::int32_t twin, std::int32_t parent);
    std::int32_t add_measured(std::int32_t parent, std::size_t quadrant, const FourMeasured& measured);
    void add_children(std::int32_t parent, const HeightTileHeader& header, std::array<std::int32_t, 4>& children);
    void learn(CutNode& node, const Known& known) const;
    std::int32_t enter(std::int32_t parent);
    void fetch_ahead(const CutNode& node) const;
    void measure(CutNode& node, std::uint32_t candidates, std::uint32_t inside) const;
    void measure_children(const CutNode& parent, const HeightTileHeader& header, FourMeasured& out) const;
    void judge(CutNode& node, double parent_error_m) const;
    void judge_by_corrections(CutNode& node) const;
    void judge_texture(CutNode& node) const;
    double error_m(const CutNode& node, int geomip) const;
    double correction_m(const CutNode& node, int geomip) const;
    double correction_below_n(const CutNode& node) const;
    void add_roots();
    void consider_from(std::size_t first);
    bool try_split(std::int32_t node);
    void grow(std::int32_t parent);
    void settle_levels();
    Level allowance(const CutNode& node, const CutNode& beside) const;
    Level limit_beside(const CutNode& node) const;
    Level edge_limit(const CutNode& node) const;
    bool is_unknown(const CutNode& node) const;
    static bool is_open(const CutNode& node, int side);
    static bool is_bare(const CutNode& node, int side);
    void constrain_neighbours(std::int32_t node);
    bool lower(std::int32_t node, Level limit);
    void lower_relatives(std::int32_t node, Level limit);
    void lower_descendants(std::int32_t node, Level limit);
    void raise_to_floors();
    void hold(TileId id);
    void enqueue(std::int32_t node);

    const Dataset& dataset_;
    const Lattice lattice_;
    const double east_m_, south_m_;  ///< where the data ends
    std::vector<double> side_m_;     ///< by level: of a page
    std::vector<double> texel_m_;    ///< by level
    std::vector<double> curving_m_;  ///< by exponent: what a flat triangle of that stride misses of the curvature
    std::span<const LodView> views_;
    CutSettings settings_;
    const Residency* residency_ = nullptr;
    const Cut* beside_ = nullptr;
    std::vector<CutNode> nodes_;
    std::vector<std::int32_t> roots_;
    std::vector<std::int32_t> queue_;
    std::int64_t pages_ = 0, steps_ = 0;
    bool needs_floors_ = false;
    bool growing_ = false;
    std::vector<TileId> held_;  ///< not to be split in this cut
};

}  // namespace scree
