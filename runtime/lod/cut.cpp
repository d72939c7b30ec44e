#include "runtime/lod/cut.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <limits>

#include "runtime/view/four_boxes.h"

namespace scree {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Before a page is split for its texture it must have become dense enough for its children: over this many levels a
/// doubling of the need.
constexpr double kTextureApproach = 4;

/// Less than 2^(-1 / kTextureApproach): a need below it asks nothing of a page yet.
constexpr double kNotYetApproaching = 0.84;

/// Pixels across the screen in a frame at which a change of shape is no longer seen.
constexpr double kBlur_px = 16;

int opposite(int direction) { return (direction + 2) % 4; }

TileId across(TileId id, int direction) {
    static constexpr std::array<std::array<int, 2>, 4> kStep{{{0, -1}, {1, 0}, {0, 1}, {-1, 0}}};
    id.x += kStep[static_cast<std::size_t>(direction)][0];
    id.y += kStep[static_cast<std::size_t>(direction)][1];
    return id;
}

/// Quadrant of `ancestor`, on the level below it, in which `id` lies.
std::size_t quadrant_towards(TileId id, int ancestor_level) {
    const int shift = id.level - ancestor_level - 1;
    return static_cast<std::size_t>((((id.y >> shift) & 1) << 1) | ((id.x >> shift) & 1));
}

/// The other child of the same parent across `direction`, or -1 where that leaves the parent.
int sibling(int quadrant, int direction) {
    static constexpr std::array<std::array<int, 4>, 4> kSibling{
        {{-1, 1, 2, -1}, {-1, -1, 3, 0}, {0, 3, -1, -1}, {1, -1, -1, 2}}};
    return kSibling[static_cast<std::size_t>(quadrant)][static_cast<std::size_t>(direction)];
}

/// The two quadrants that touch a side.
constexpr std::array<std::array<int, 2>, 4> kTouching{{{0, 1}, {1, 3}, {2, 3}, {0, 2}}};

double distance_to_centre(const glm::dvec3& point, const Box& box) {
    return glm::distance(point, 0.5 * (box.low + box.high));
}

}  // namespace

Cut::Cut(const Dataset& dataset)
    : dataset_(dataset),
      lattice_(dataset.lattice),
      east_m_(lattice_.x_m(static_cast<double>(lattice_.cells_x))),
      south_m_(lattice_.y_m(static_cast<double>(lattice_.cells_y))) {
    for (int level = 0; level <= lattice_.deepest_level; ++level) {
        side_m_.push_back(static_cast<double>(lattice_.tile_extent(level)) * lattice_.spacing_m);
        texel_m_.push_back(dataset.texel_m(level));
    }
}

Box Cut::box_of(const CutNode& node) const {
    const double side = side_m_[static_cast<std::size_t>(node.id.level)];
    return {{node.west_m, std::max(node.north_m - side, south_m_), dataset_.height_m(node.bounds->min_n)},
            {std::min(node.west_m + side, east_m_), node.north_m, dataset_.height_m(node.bounds->max_n)}};
}

// What the views that may see the parent see of the node, and how fine it has to be.
void Cut::measure(CutNode& node, std::uint32_t candidates, std::uint32_t inside) const {
    node.seen_by = node.inside = 0;
    node.metres_per_px = node.texel_per_px = kInfinity;
    if (candidates == 0) return;
    const Box flat = box_of(node);
    for (std::size_t v = 0; v < views_.size(); ++v) {
        const std::uint32_t bit = 1u << v;
        if ((candidates & bit) == 0) continue;
        const LodView& view = views_[v];
        const Box box = lowered_by_curvature(flat, view.eye, settings_.half_curvature);
        const Sight sight = (inside & bit) != 0 ? Sight::all : view.frustum.sight(box);
        if (sight == Sight::none) continue;
        node.seen_by |= bit;
        if (sight == Sight::all) node.inside |= bit;
        const double distance = std::max(distance_to_box(view.eye, box), view.near_m);
        const double error_m = settings_.metric == ErrorMetric::deboer
                                   ? std::max(distance_to_centre(view.eye, box), view.near_m) / view.focal_px
                                   : distance / view.error_px;
        node.metres_per_px = std::min(node.metres_per_px, error_m);
        node.texel_per_px = std::min(node.texel_per_px, distance / view.focal_px);
    }
}

// The same of four children at once, as box_of and measure have it.
void Cut::measure_children(const CutNode& parent, const HeightTileHeader& header, FourMeasured& out) const {
    const std::int64_t extent = lattice_.tile_extent(parent.id.level + 1);
    const double side = side_m_[static_cast<std::size_t>(parent.id.level + 1)];
    FourBoxes flat;
    for (std::size_t k = 0; k < 2; ++k) {
        const auto step = static_cast<std::int64_t>(k);
        out.west_m[k] = lattice_.x_m(static_cast<double>((2 * parent.id.x + step) * extent));
        out.north_m[k] = lattice_.y_m(static_cast<double>((2 * parent.id.y + step) * extent));
    }
    for (std::size_t q = 0; q < 4; ++q) {
        flat.west[q] = out.west_m[q & 1];
        flat.north[q] = out.north_m[q >> 1];
        flat.east[q] = std::min(flat.west[q] + side, east_m_);
        flat.south[q] = std::max(flat.north[q] - side, south_m_);
        flat.low[q] = dataset_.height_m(header.children[q].min_n);
        flat.high[q] = dataset_.height_m(header.children[q].max_n);
    }
    out.metres_per_px.fill(kInfinity);
    out.texel_per_px.fill(kInfinity);
    for (std::size_t v = 0; v < views_.size(); ++v) {
        const std::uint32_t bit = 1u << v;
        if ((parent.seen_by & bit) == 0) continue;
        const LodView& view = views_[v];
        const FourSeen seen =
            see_four(view.frustum, flat, settings_.half_curvature, view.near_m, (parent.inside & bit) != 0);
        for (std::size_t q = 0; q < 4; ++q) {
            if ((seen.none >> q & 1) != 0) continue;
            out.seen_by[q] |= bit;
            if ((seen.all >> q & 1) != 0) out.inside[q] |= bit;
            out.metres_per_px[q] = std::min(out.metres_per_px[q], seen.distance_m[q] / view.error_px);
            out.texel_per_px[q] = std::min(out.texel_per_px[q], seen.distance_m[q] / view.focal_px);
        }
    }
}

double Cut::error_m(const CutNode& node, int geomip) const {
    return static_cast<double>(node.bounds->error_n[static_cast<std::size_t>(geomip)]) * dataset_.height_quantum_m +
           curving_m_[static_cast<std::size_t>(minimum_exponent(node) + geomip)];
}

// The coarsest level within the tolerance. Between two levels the error is taken as linear in the weight: the surfaces
// are nested, so it is no larger (Scree lod, C15).
void Cut::judge(CutNode& node, double parent_error_m) const {
    const int finest = minimum_exponent(node);
    node.level = level_of(maximum_exponent(node));
    node.floor = level_of(finest);
    if (!node.visible()) return;
    if (settings_.metric == ErrorMetric::deboer) {
        judge_by_corrections(node);
        judge_texture(node);
        return;
    }
    const double allowed_m = settings_.tau_px * node.metres_per_px;
    double finer_m = error_m(node, 0);
    node.finest_error_m = finer_m;
    if (finer_m > allowed_m) {
        node.level = level_of(finest);
        node.wants_geometry = !node.leaf;
    } else {
        for (int geomip = 1; geomip < lattice_.tile_cells_log2; ++geomip) {
            const double exact_m = error_m(node, geomip);
            double coarser_m = std::max(exact_m, static_cast<double>(kErrorGrowth) * finer_m);
            // Never above the parent's at the same stride, so that a child is never held finer than its parent was.
            if (geomip == 1) coarser_m = std::min(coarser_m, std::max(exact_m, parent_error_m));
            if (coarser_m > allowed_m) {
                const double share = (allowed_m - finer_m) / (coarser_m - finer_m);
                node.level = level_of(finest + geomip - 1) + std::min(level_of_share(share), kOneLevel - 1);
                break;
            }
            finer_m = coarser_m;
        }
    }
    judge_texture(node);
}

void Cut::judge_texture(CutNode& node) const {
    if (node.texture_ends || node.id.level >= dataset_.texture_deepest_level) return;
    node.texture_need =
        texel_m_[static_cast<std::size_t>(node.id.level)] / node.texel_per_px / settings_.texture_tau_px;
    const bool parts = node.leaf;
    if (parts && node.texture_need <= 1) return;
    if (!parts && node.texture_need < kNotYetApproaching) return;
    const double doublings = std::min(std::log2(node.texture_need), 64.0);
    double limit = 0;
    if (!parts) {
        node.approach = level_of_share(std::clamp(kTextureApproach * doublings, -1.0, 1.0));
        limit = maximum_exponent(node) - 1 + kTextureApproach * std::max(0.0, -doublings);
    } else {
        // Textures deeper than the heights are drawn on parts of the page, each of one block of cells at least.
        const int deepest = std::min(dataset_.texture_deepest_level - node.id.level, lattice_.tile_cells_log2 - 1);
        limit = maximum_exponent(node) - std::clamp(doublings, 0.0, static_cast<double>(deepest));
    }
    if (limit < maximum_exponent(node)) node.level = std::min(node.level, level_of_share(limit));
    node.level = std::max(node.level, level_of(minimum_exponent(node)));
}

// -1: no view sees it, and what is not seen is neither refined nor drawn nor anybody's neighbour.
std::int32_t Cut::add_node(TileId id, const Known& known, std::int32_t parent) {
    const auto every_view = static_cast<std::uint32_t>((std::uint64_t{1} << views_.size()) - 1);
    CutNode& node = nodes_.emplace_back();
    const CutNode* above = parent < 0 ? nullptr : &nodes_[static_cast<std::size_t>(parent)];
    node.id = id;
    node.bounds = known.bounds;
    const LatticePoint corner = lattice_.corner(id);
    node.west_m = lattice_.x_m(static_cast<double>(corner.i));
    node.north_m = lattice_.y_m(static_cast<double>(corner.j));
    measure(node, above == nullptr ? every_view : above->seen_by, above == nullptr ? 0 : above->inside);
    if (!node.visible()) {
        nodes_.pop_back();
        return -1;
    }
    learn(node, known);
    judge(node, above == nullptr ? kInfinity : above->finest_error_m);
    node.judged = node.level;
    return enter(parent);
}

void Cut::learn(CutNode& node, const Known& known) const {
    node.page_level = static_cast<std::int8_t>(node.id.level);
    node.bounds = known.bounds;
    node.slot = known.slot;
    node.texture_slot = known.texture_slot;
    node.leaf = known.leaf;
    node.texture_ends = known.texture_ends;
    node.textured = known.textured;
}

std::int32_t Cut::add_measured(std::int32_t index, std::size_t q, const FourMeasured& measured) {
    if (measured.seen_by[q] == 0) return -1;
    CutNode& node = nodes_.emplace_back();
    const CutNode& parent = nodes_[static_cast<std::size_t>(index)];
    node.id = child_of(parent.id, static_cast<int>(q));
    learn(node, known_child(parent, q));
    node.west_m = measured.west_m[q & 1];
    node.north_m = measured.north_m[q >> 1];
    node.seen_by = measured.seen_by[q];
    node.inside = measured.inside[q];
    node.metres_per_px = measured.metres_per_px[q];
    node.texel_per_px = measured.texel_per_px[q];
    judge(node, parent.finest_error_m);
    node.judged = node.level;
    fetch_ahead(node);
    return enter(index);
}

// What its splitting will read, a few pages from now.
void Cut::fetch_ahead(const CutNode& node) const {
    if (node.slot < 0 || (!node.wants_geometry && !(node.texture_need > 1))) return;
    const auto slot = static_cast<std::size_t>(node.slot);
    const auto* header = reinterpret_cast<const char*>(&residency_->heights.headers[slot]);
    for (std::size_t at = 0; at < sizeof(HeightTileHeader); at += 64) __builtin_prefetch(header + at);
    __builtin_prefetch(&residency_->heights.children[slot]);
    if (node.texture_slot >= 0)
        __builtin_prefetch(&residency_->textures.children[static_cast<std::size_t>(node.texture_slot)]);
}

// What the other cut has measured and judged, as it was before anything came of it.
std::int32_t Cut::add_twin(std::int32_t twin, std::int32_t parent) {
    if (twin < 0) return -1;
    CutNode& node = nodes_.emplace_back(beside_->nodes_[static_cast<std::size_t>(twin)]);
    node.twin = twin;
    node.split = node.queued = node.refused = false;
    node.level = node.judged;
    node.floor = level_of(minimum_exponent(node));
    node.neighbours = node.children = {-1, -1, -1, -1};
    node.grows_from_s = -kInfinity;
    node.released = kOneLevel;
    node.priority = 0;
    return enter(parent);
}

// The last node, under its parent.
std::int32_t Cut::enter(std::int32_t parent) {
    CutNode& node = nodes_.back();
    node.parent = parent;
    if (parent >= 0) node.level = std::min(node.level, nodes_[static_cast<std::size_t>(parent)].level);
    ++pages_;
    return static_cast<std::int32_t>(nodes_.size()) - 1;
}

// The nodes must have room for them, so that the parent stays where it is.
void Cut::add_children(std::int32_t index, const HeightTileHeader& header, std::array<std::int32_t, 4>& children) {
    const CutNode& parent = nodes_[static_cast<std::size_t>(index)];
    const CutNode* twin = parent.twin >= 0 ? &beside_->nodes_[static_cast<std::size_t>(parent.twin)] : nullptr;
    if (twin != nullptr && !twin->split) twin = nullptr;
    const bool one_by_one = settings_.metric == ErrorMetric::deboer;
    FourMeasured measured;
    if (twin == nullptr && !one_by_one) measure_children(parent, header, measured);
    for (std::size_t q = 0; q < 4; ++q) {
        if ((header.child_mask >> q & 1) == 0) continue;
        if (twin != nullptr)
            children[q] = add_twin(twin->children[q], index);
        else if (one_by_one)
            children[q] = add_node(child_of(parent.id, static_cast<int>(q)), known_child(parent, q), index);
        else
            children[q] = add_measured(index, q, measured);
    }
}

Cut::Known Cut::known_root(std::size_t root) const {
    const std::int32_t slot = residency_->heights.roots[root];
    const HeightTileHeader& header = residency_->heights.headers[static_cast<std::size_t>(slot)];
    const std::int32_t texture = residency_->textures.roots.empty() ? kNotResident : residency_->textures.roots[root];
    return {&header.own, slot, texture, header.is_leaf(), header.texture_ends, true};
}

Cut::Known Cut::known_child(const CutNode& parent, std::size_t quadrant) const {
    const auto slot = static_cast<std::size_t>(parent.slot);
    const HeightTileHeader& header = residency_->heights.headers[slot];
    Known child{&header.children[quadrant], residency_->heights.children[slot][quadrant]};
    child.leaf = parent.page_level + 1 == lattice_.deepest_level || (header.leaf_mask >> quadrant & 1) != 0;
    child.textured = !parent.texture_ends && parent.page_level < dataset_.texture_deepest_level;
    child.texture_ends = parent.texture_ends || (header.texture_end_mask >> quadrant & 1) != 0;
    if (child.textured && parent.texture_slot >= 0)
        child.texture_slot = residency_->textures.children[static_cast<std::size_t>(parent.texture_slot)][quadrant];
    return child;
}

void Cut::add_roots() {
    const std::vector<std::int32_t>& slots = residency_->heights.roots;
    roots_.assign(slots.size(), -1);
    pages_ = std::count_if(slots.begin(), slots.end(), [](std::int32_t slot) { return slot >= 0; });
    for (std::size_t k = 0; k < slots.size(); ++k) {
        if (slots[k] < 0) continue;  // a root without any present cell is not stored
        const TileId id{0, static_cast<std::int64_t>(k) % lattice_.root_columns,
                        static_cast<std::int64_t>(k) / lattice_.root_columns};
        roots_[k] = beside_ != nullptr ? add_twin(beside_->roots_[k], -1) : add_node(id, known_root(k), -1);
        if (roots_[k] >= 0) --pages_;  // pinned: counted whether in view or not
    }
    for (const std::int32_t root : roots_) {
        if (root < 0) continue;
        CutNode& node = nodes_[static_cast<std::size_t>(root)];
        for (int d = 0; d < 4; ++d) {
            const TileId other = across(node.id, d);
            if (lattice_.contains(other))
                node.neighbours[static_cast<std::size_t>(d)] =
                    roots_[static_cast<std::size_t>(other.y * lattice_.root_columns + other.x)];
        }
    }
}

// The node across one side, as large as this one or larger; a larger one that is split is the one that lacks the page
// across. Links are brought up to date as they are used: a child starts with its parent's.
inline std::int32_t Cut::neighbour(std::int32_t index, int direction) {
    const CutNode& node = nodes_[static_cast<std::size_t>(index)];
    const std::int32_t link = node.neighbours[static_cast<std::size_t>(direction)];
    if (link < 0) return link;
    const CutNode& other = nodes_[static_cast<std::size_t>(link)];
    return !other.split || other.page_level >= node.page_level ? link : descend(index, direction);
}

std::int32_t Cut::descend(std::int32_t index, int direction) {
    CutNode& node = nodes_[static_cast<std::size_t>(index)];
    std::int32_t& link = node.neighbours[static_cast<std::size_t>(direction)];
    const TileId beyond = across(node.id, direction);
    for (;;) {
        const CutNode& other = nodes_[static_cast<std::size_t>(link)];
        if (!other.split || other.page_level >= node.page_level) break;
        const std::int32_t child = other.children[quadrant_towards(beyond, other.page_level)];
        if (child < 0) break;
        link = child;
    }
    return link;
}

template <class Visit>
void Cut::for_each_leaf_on(std::int32_t index, int side, const Visit& visit) const {
    const CutNode& node = nodes_[static_cast<std::size_t>(index)];
    if (!node.split) {
        if (node.visible()) visit(index);
        return;
    }
    for (const int q : kTouching[static_cast<std::size_t>(side)])
        if (const std::int32_t child = node.children[static_cast<std::size_t>(q)]; child >= 0)
            for_each_leaf_on(child, side, visit);
}

template <class Visit>
void Cut::for_each_neighbour(std::int32_t leaf, int direction, const Visit& visit) {
    const std::int32_t other = neighbour(leaf, direction);
    if (other < 0) return;
    const CutNode& beside = nodes_[static_cast<std::size_t>(other)];
    if (beside.split && beside.page_level < nodes_[static_cast<std::size_t>(leaf)].page_level) return;
    for_each_leaf_on(other, opposite(direction), visit);
}

bool Cut::try_split(std::int32_t index) {
    {
        const CutNode& node = nodes_[static_cast<std::size_t>(index)];
        if (node.slot < 0) return false;
        if (std::find(held_.begin(), held_.end(), node.id) != held_.end()) return false;
        // Still so coarse that its children could not be drawn like it.
        if (node.floor > level_of(maximum_exponent(node) - 1)) {
            needs_floors_ = growing_ = true;
            return false;
        }
        // Next to a page that can only be drawn too coarsely for the children there is nothing to be gained.
        const int coarsest_beside = node.id.level + 1 - lattice_.tile_cells_log2;
        for (int d = 0; d < 4 && coarsest_beside > 0; ++d)
            for (;;) {
                const std::int32_t other = neighbour(index, d);
                if (other < 0) break;
                const CutNode& beside = nodes_[static_cast<std::size_t>(other)];
                if (!beside.visible() || beside.split || beside.id.level >= coarsest_beside) break;
                if (!try_split(other)) return false;
            }
    }
    // References into the nodes stay good while their children are added.
    if (nodes_.capacity() < nodes_.size() + 4) nodes_.reserve(2 * nodes_.size() + 64);
    const CutNode& parent = nodes_[static_cast<std::size_t>(index)];
    const HeightTileHeader& header = residency_->heights.headers[static_cast<std::size_t>(parent.slot)];
    if (header.is_leaf()) return false;
    const std::size_t first = nodes_.size();
    const std::int64_t pages_before = pages_;
    std::array<std::int32_t, 4> children{-1, -1, -1, -1};
    add_children(index, header, children);
    for (const std::int32_t k : children) {
        if (k < 0 || nodes_[static_cast<std::size_t>(k)].slot >= 0) continue;
        if (settings_.only_resident || nodes_[static_cast<std::size_t>(k)].slot == kUnavailable) {
            nodes_.resize(first);
            pages_ = pages_before;
            return false;
        }
    }
    const double priority =
        std::max({1.0, parent.texture_need, parent.finest_error_m / (settings_.tau_px * parent.metres_per_px)});
    for (int q = 0; q < 4; ++q) {
        const std::int32_t index_of_child = children[static_cast<std::size_t>(q)];
        if (index_of_child < 0) continue;
        CutNode& child = nodes_[static_cast<std::size_t>(index_of_child)];
        child.priority = std::isnan(priority) ? kInfinity : priority;
        for (int d = 0; d < 4; ++d) {
            const int beside = sibling(q, d);
            child.neighbours[static_cast<std::size_t>(d)] = beside < 0 ? parent.neighbours[static_cast<std::size_t>(d)]
                                                                       : children[static_cast<std::size_t>(beside)];
        }
    }
    CutNode& self = nodes_[static_cast<std::size_t>(index)];
    self.split = true;
    self.children = children;
    ++steps_;
    if (settings_.growth_s > 0) grow(index);
    return true;
}

// A page that came late starts from its parent's finest shape: the youngest of the visible children sets the pace. What
// came while its parent was still growing waits for that, so that no level is taken in less than its time.
void Cut::grow(std::int32_t index) {
    CutNode& parent = nodes_[static_cast<std::size_t>(index)];
    const Level parents_finest = level_of(minimum_exponent(parent));
    // The nearer it is to where nobody could follow it with his eyes, the quicker.
    const double parallax_px = settings_.moved_m / parent.texel_per_px;
    const double growth_s = settings_.growth_s * std::max(0.0, 1 - parallax_px / kBlur_px);
    double from_s = parent.grows_from_s + growth_s;
    for (const std::int32_t child : parent.children) {
        if (child < 0) continue;
        const CutNode& node = nodes_[static_cast<std::size_t>(child)];
        if (node.visible() && node.slot >= 0)
            from_s = std::max(from_s, residency_->heights.arrived_s[static_cast<std::size_t>(node.slot)]);
    }
    for (const std::int32_t child : parent.children)
        if (child >= 0) nodes_[static_cast<std::size_t>(child)].grows_from_s = from_s;
    const double levels = growth_s > 0 ? std::max((residency_->now_s - from_s) / growth_s, 0.0) : kInfinity;
    if (!(levels < 1)) return;
    parent.released = level_of_share(levels);
    growing_ = growing_ || parent.approach > 0;
    Level floor = parents_finest - level_of_share(levels);
    if (parent.floor > parents_finest) floor = std::max(floor, parent.floor);
    for (const std::int32_t child : parent.children) {
        if (child < 0) continue;
        CutNode& node = nodes_[static_cast<std::size_t>(child)];
        node.floor = std::max(node.floor, floor);
        if (node.level >= node.floor) continue;
        // Neighbours keep to what is drawn, not to what it will be.
        node.level = node.floor;
        needs_floors_ = growing_ = true;
    }
}

// Splits what asks for it, from node `first` on, children after their parents.
void Cut::consider_from(std::size_t first) {
    for (std::size_t k = first; k < nodes_.size() && pages_ <= settings_.max_pages; ++k) {
        const CutNode& node = nodes_[k];
        if (!node.visible() || node.split) continue;
        if (node.wants_geometry || (node.texture_need > 1 && !node.leaf)) try_split(static_cast<std::int32_t>(k));
    }
}

bool Cut::refine(std::span<const LodView> views, const CutSettings& settings, const Residency& residency,
                 const Cut* beside) {
    assert(views.size() <= kMaxViews);
    beside_ = beside;
    views_ = views;
    settings_ = settings;
    residency_ = &residency;
    // Between the ends of a triangle's longest side, 2 s where an edge is thinned, a plane stands off the paraboloid by
    // (2 s)^2 / 8 R.
    curving_m_.resize(static_cast<std::size_t>(lattice_.deepest_level + lattice_.tile_cells_log2));
    for (std::size_t exponent = 0; exponent < curving_m_.size(); ++exponent) {
        const double stride_m = std::ldexp(lattice_.spacing_m, static_cast<int>(exponent));
        curving_m_[exponent] = stride_m * stride_m * settings.half_curvature;
    }
    steps_ = 0;
    held_.clear();
    for (;;) {
        nodes_.clear();
        queue_.clear();
        pages_ = 0;
        needs_floors_ = growing_ = false;
        const std::size_t held = held_.size();
        add_roots();
        consider_from(0);
        if (pages_ > settings_.max_pages) return false;
        settle_levels();
        if (pages_ > settings_.max_pages) return false;
        if (needs_floors_) raise_to_floors();
        if (held_.size() == held) return true;
        // Pages that were split too far for neighbours which must stay coarse are left whole.
    }
}

void Cut::enqueue(std::int32_t index) {
    CutNode& node = nodes_[static_cast<std::size_t>(index)];
    if (node.queued || !node.visible()) return;
    node.queued = true;
    queue_.push_back(index);
}

void Cut::settle_levels() {
    for (std::size_t k = 0; k < nodes_.size(); ++k) enqueue(static_cast<std::int32_t>(k));
    for (std::size_t head = 0; head < queue_.size() && pages_ <= settings_.max_pages; ++head) {
        nodes_[static_cast<std::size_t>(queue_[head])].queued = false;
        constrain_neighbours(queue_[head]);
    }
    queue_.clear();
}

// How far above its neighbour of the same size a page may be: a level, but where one of them is split for its texture
// and the other is not, or is about to be, its children would not be allowed above the neighbour at all.
Level Cut::allowance(const CutNode& node, const CutNode& beside) const {
    if (node.approach <= -kOneLevel) return kOneLevel;
    return std::max({-node.approach, beside.approach, Level{0}});
}

// How coarse a smaller page may be: no coarser than a leaf; less and less bound to what was one as its need has grown,
// and as what came late to take its place has.
Level Cut::limit_beside(const CutNode& node) const {
    if (!node.split || node.approach <= 0) return node.level;
    return node.level + std::min(node.approach, node.released);
}

// How coarse an edge may be. The finest surface is only inexact where its edges move: they may move no further than its
// tolerance allows. (A coarser leaf beside it keeps its stride all the same.)
Level Cut::edge_limit(const CutNode& node) const {
    const Level limit = node.level + kOneLevel;
    if (!node.leaf) return limit;
    const double allowed_m = settings_.tau_px * node.metres_per_px;
    if (!(allowed_m < node.finest_error_m)) return limit;
    return std::min(limit, level_of(minimum_exponent(node)) + level_of_share(allowed_m / node.finest_error_m));
}

// A page that a plan would split once it is there holds nobody coarse meanwhile: what a plan holds only
// grows with what is known.
bool Cut::is_unknown(const CutNode& node) const { return !settings_.only_resident && node.slot == kNotResident; }

// Has a split page nothing of its own on part of a side, because it is absent or out of view? There it goes on to speak
// for itself.
bool Cut::is_open(const CutNode& node, int side) {
    return std::any_of(kTouching[static_cast<std::size_t>(side)].begin(),
                       kTouching[static_cast<std::size_t>(side)].end(),
                       [&](int q) { return node.children[static_cast<std::size_t>(q)] < 0; });
}

// Has it nothing at all there?
bool Cut::is_bare(const CutNode& node, int side) {
    return std::all_of(kTouching[static_cast<std::size_t>(side)].begin(),
                       kTouching[static_cast<std::size_t>(side)].end(),
                       [&](int q) { return node.children[static_cast<std::size_t>(q)] < 0; });
}

// Applies the rules between a page and those beside it, both ways. A split page stands for what it would be drawn at as
// a leaf: what has been asked of its neighbours for its sake is still asked once it is split, or they would jump.
void Cut::constrain_neighbours(std::int32_t index) {
    lower_relatives(index, nodes_[static_cast<std::size_t>(index)].level);
    const CutNode& start = nodes_[static_cast<std::size_t>(index)];
    const Level level = start.level;
    const bool leaf = !start.split;
    const Level limit = edge_limit(start);
    Level own_limit = level;
    const int page_level = start.page_level;
    // Anything may move in memory when a page is split: nodes are named by their index.
    const auto at = [&](std::int32_t k) -> CutNode& { return nodes_[static_cast<std::size_t>(k)]; };
    for (int d = 0; d < 4; ++d) {
        for (;;) {
            const std::int32_t other = neighbour(index, d);
            if (other < 0) break;
            if (at(other).page_level < page_level) {
                own_limit = std::min(own_limit, limit_beside(at(other)));
                const bool asks = leaf || is_open(at(index), d);
                if (asks && at(other).level > limit && lower(other, limit)) continue;
                break;
            }
            own_limit = std::min(own_limit, at(other).level + allowance(at(index), at(other)));
            if (const std::int32_t above = at(other).parent; above >= 0 && above != at(index).parent)
                own_limit = std::min(own_limit, limit_beside(at(above)));
            const Level theirs = level + allowance(at(other), at(index));
            if (at(other).level > theirs) lower(other, theirs);
            if (at(other).split) {
                const Level children_limit = limit_beside(at(index));
                for (const int q : kTouching[static_cast<std::size_t>(opposite(d))])
                    if (const std::int32_t child = at(other).children[static_cast<std::size_t>(q)];
                        child >= 0 && at(child).level > children_limit)
                        lower(child, children_limit);
                if (leaf)
                    for_each_leaf_on(other, opposite(d), [&](std::int32_t smaller) {
                        own_limit = std::min(own_limit, at(smaller).level + kOneLevel);
                    });
                break;
            }
            if (leaf && at(other).level > limit && lower(other, limit)) continue;
            break;
        }
        if (leaf && nodes_[static_cast<std::size_t>(index)].split) return;
    }
    if (own_limit < nodes_[static_cast<std::size_t>(index)].level) lower(index, own_limit);
}

// Brings a leaf down to a level, by splitting it where its own mesh cannot be that fine. True if something changed.
bool Cut::lower(std::int32_t index, Level limit) {
    CutNode& node = nodes_[static_cast<std::size_t>(index)];
    const Level finest = node.floor;
    bool changed = false;
    if (node.level > std::max(limit, finest)) {
        const Level lowered = std::max(limit, finest);
        lower_descendants(index, lowered);
        lower_relatives(index, lowered);
        changed = true;
    }
    if (limit >= finest || nodes_[static_cast<std::size_t>(index)].split) return changed;
    const std::size_t first = nodes_.size();
    const bool growing = finest > level_of(minimum_exponent(node));
    if (is_unknown(node)) return changed;
    if (growing || node.leaf || !try_split(index)) {
        needs_floors_ = nodes_[static_cast<std::size_t>(index)].refused = true;
        return changed;
    }
    consider_from(first);
    for (std::size_t k = first; k < nodes_.size(); ++k) enqueue(static_cast<std::int32_t>(k));
    return true;
}

// No leaf is drawn coarser than an ancestor would be in its place, and that is no coarser than any leaf under it.
void Cut::lower_relatives(std::int32_t index, Level limit) {
    for (std::int32_t above = nodes_[static_cast<std::size_t>(index)].parent; above >= 0;
         above = nodes_[static_cast<std::size_t>(above)].parent) {
        const CutNode& node = nodes_[static_cast<std::size_t>(above)];
        const Level lowered = std::max(limit, node.floor);
        if (node.level <= lowered) return;
        lower_descendants(above, lowered);
    }
}

void Cut::lower_descendants(std::int32_t index, Level limit) {
    CutNode& node = nodes_[static_cast<std::size_t>(index)];
    if (node.level <= std::max(limit, node.floor)) return;
    node.level = std::max(limit, node.floor);
    enqueue(index);
    for (const std::int32_t child : node.children)
        if (child >= 0) lower_descendants(child, limit);
}

// Where a page cannot be as fine as its neighbours want, or is still growing, the finer side stays coarse.
void Cut::raise_to_floors() {
    // All others found their neighbours as coarse as they need them.
    for (std::size_t k = 0; k < nodes_.size(); ++k) {
        const CutNode& node = nodes_[k];
        const bool coarse = node.refused || node.floor > level_of(minimum_exponent(node));
        if (coarse && !node.split && !is_unknown(node)) enqueue(static_cast<std::int32_t>(k));
    }
    for (std::size_t head = 0; head < queue_.size(); ++head) {
        const std::int32_t index = queue_[head];
        CutNode& node = nodes_[static_cast<std::size_t>(index)];
        node.queued = false;
        const Level floor = node.floor;
        const int own_level = node.id.level;
        for (int d = 0; d < 4; ++d)
            for_each_neighbour(index, d, [&](std::int32_t other) {
                CutNode& beside = nodes_[static_cast<std::size_t>(other)];
                Level least = beside.id.level < own_level ? floor : floor - kOneLevel;
                if (const Level coarsest = level_of(maximum_exponent(beside)); least > coarsest) {
                    if (beside.parent >= 0) hold(nodes_[static_cast<std::size_t>(beside.parent)].id);
                    least = coarsest;
                }
                if (beside.floor >= least) return;
                beside.floor = least;
                enqueue(other);
            });
    }
    queue_.clear();
    for (CutNode& node : nodes_)
        if (!node.split) node.level = std::max(node.level, node.floor);
}

void Cut::hold(TileId id) {
    if (std::find(held_.begin(), held_.end(), id) == held_.end()) held_.push_back(id);
}

Cut::Drawn Cut::drawn(std::int32_t index) {
    const CutNode& node = nodes_[static_cast<std::size_t>(index)];
    Drawn drawn;
    drawn.exponent = exponent_of(node.level);
    drawn.morph = morph_of(node.level);
    for (int d = 0; d < 4; ++d) {
        float& weight = drawn.edge_morph[static_cast<std::size_t>(d)];
        weight = drawn.morph;
        const std::int32_t other = neighbour(index, d);
        if (other < 0) continue;
        const CutNode& beside = nodes_[static_cast<std::size_t>(other)];
        // A smaller page is the finer mesh: this leaf's level rules.
        if (beside.split && beside.page_level == node.page_level && !is_bare(beside, opposite(d))) continue;
        // Towards what a split page lacks, an edge keeps to what that was drawn at while it was whole.
        const Level edge = beside.split ? std::min(beside.level, edge_limit(node)) : beside.level;
        if (!beside.visible() || edge <= node.level) continue;
        weight = morph_of(edge);
        if (exponent_of(edge) > drawn.exponent) drawn.edge_mask |= 1u << d;
    }
    return drawn;
}

std::int32_t Cut::drawn_beside(std::int32_t leaf, int direction) {
    const std::int32_t other = neighbour(leaf, direction);
    if (other < 0) return -1;
    const CutNode& beside = nodes_[static_cast<std::size_t>(other)];
    return beside.split || !beside.visible() ? -1 : other;
}

double Cut::drawn_error_m(const CutNode& leaf, const Drawn& drawn) const {
    const int geomip = drawn.exponent - minimum_exponent(leaf);
    const double thinned_m = error_m(leaf, geomip);
    const double coarser_m = geomip + 1 < lattice_.tile_cells_log2 ? error_m(leaf, geomip + 1) : thinned_m;
    const double inner = drawn.morph;
    if (!leaf.leaf || geomip > 0 || drawn.edge_mask != 0) return (1 - inner) * thinned_m + inner * coarser_m;
    // The finest surface is exact but for what has moved; an edge that moves further than the tile is half thinned.
    const double edge =
        std::max(inner, static_cast<double>(*std::max_element(drawn.edge_morph.begin(), drawn.edge_morph.end())));
    return inner * coarser_m + (edge - inner) * thinned_m;
}

}  // namespace scree
