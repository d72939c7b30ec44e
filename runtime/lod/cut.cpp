#include "runtime/lod/cut.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

namespace scree {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

}  // namespace

Cut::Cut(const Dataset& dataset) : dataset_(dataset), lattice_(dataset.lattice) {}

Box Cut::box_of(const CutNode& node) const {
    const std::int64_t extent = lattice_.tile_extent(node.id.level);
    const LatticePoint corner = lattice_.corner(node.id);
    const auto east = static_cast<double>(std::min(corner.i + extent, lattice_.cells_x));
    const auto south = static_cast<double>(std::min(corner.j + extent, lattice_.cells_y));
    return {{lattice_.x_m(static_cast<double>(corner.i)), lattice_.y_m(south), dataset_.height_m(node.bounds.min_n)},
            {lattice_.x_m(east), lattice_.y_m(static_cast<double>(corner.j)), dataset_.height_m(node.bounds.max_n)}};
}

void Cut::measure(CutNode& node) const {
    const Box box = box_of(node);
    node.visible = false;
    node.metres_per_px = node.texel_per_px = kInfinity;
    for (const LodView& view : views_) {
        if (!view.frustum.may_see(box)) continue;
        node.visible = true;
        const double distance = std::max(distance_to_box(view.eye, box), view.near_m);
        node.metres_per_px = std::min(node.metres_per_px, distance / view.error_px);
        node.texel_per_px = std::min(node.texel_per_px, distance / view.focal_px);
    }
}

// The existing node at `id`, or the unsplit ancestor that stands there; -1 where there is nothing.
std::int32_t Cut::find(TileId id) const {
    if (!lattice_.contains(id)) return -1;
    std::int32_t index =
        roots_[static_cast<std::size_t>((id.y >> id.level) * lattice_.root_columns + (id.x >> id.level))];
    for (int level = 1; level <= id.level && index >= 0; ++level) {
        const CutNode& node = nodes_[static_cast<std::size_t>(index)];
        if (!node.split) return index;
        const int shift = id.level - level;
        index = node.children[static_cast<std::size_t>((((id.y >> shift) & 1) << 1) | ((id.x >> shift) & 1))];
    }
    return index;
}

std::int32_t Cut::add_node(TileId id, const HeightBounds& bounds, std::int32_t parent, const Residency& residency) {
    CutNode node;
    node.id = id;
    node.bounds = bounds;
    node.parent = parent;
    measure(node);
    if (node.visible || parent < 0) {
        const ResidentHeight resident = residency.height(id);
        node.header = resident.header;
        node.slot = resident.slot;
        ++pages_;
    }
    nodes_.push_back(node);
    return static_cast<std::int32_t>(nodes_.size()) - 1;
}

double Cut::error_need(const CutNode& node, double error_m) const {
    if (!(error_m > 0)) return 0;
    const double px = error_m / node.metres_per_px;
    return settings_.tau_px > 0 ? px / settings_.tau_px : kInfinity;
}

double Cut::drawn_error_m(std::int32_t leaf) const {
    const CutNode& node = nodes_[static_cast<std::size_t>(leaf)];
    if (node.exponent == 0 && edge_mask(leaf) == 0) return 0;
    const int geomip = node.exponent - minimum_exponent(node);
    return static_cast<double>(node.bounds.error_n[static_cast<std::size_t>(geomip)]) * dataset_.height_quantum_m;
}

double Cut::geometry_need(std::int32_t index) const {
    const CutNode& node = nodes_[static_cast<std::size_t>(index)];
    const int geomip = node.exponent - minimum_exponent(node);
    // With thinned edges allowed for: a neighbour may be coarser when all is done.
    return error_need(
        node, static_cast<double>(node.bounds.error_n[static_cast<std::size_t>(geomip)]) * dataset_.height_quantum_m);
}

double Cut::texture_need(const CutNode& node) const {
    if (node.id.level >= dataset_.texture_deepest_level) return 0;
    const double need = dataset_.texel_m(node.id.level) / node.texel_per_px / settings_.texture_tau_px;
    if (node.id.level < lattice_.deepest_level || !(need > 1)) return need;
    // Textures deeper than the heights are drawn on parts of the page, each of one block of cells at least.
    int part_level = 0;
    const int finest = std::min(dataset_.texture_deepest_level - node.id.level, lattice_.tile_cells_log2 - 1);
    while (part_level < finest && std::ldexp(need, -part_level) > 1) ++part_level;
    return node.exponent > lattice_.tile_cells_log2 - 1 - part_level ? need : 0;
}

void Cut::push(std::int32_t index) {
    const CutNode& node = nodes_[static_cast<std::size_t>(index)];
    if (!node.visible || node.split || node.blocked) return;
    const double need = std::max(geometry_need(index), texture_need(node));
    if (!(need > 1)) return;
    heap_.push_back({need, index, node.exponent});
    std::push_heap(heap_.begin(), heap_.end(), [](const HeapEntry& a, const HeapEntry& b) {
        return a.need != b.need ? a.need < b.need : a.node > b.node;
    });
}

void Cut::refine(std::span<const LodView> views, const CutSettings& settings, const Residency& residency) {
    views_ = views;
    settings_ = settings;
    residency_ = &residency;
    nodes_.clear();
    heap_.clear();
    roots_.assign(static_cast<std::size_t>(lattice_.root_rows * lattice_.root_columns), -1);
    pages_ = steps_ = 0;
    page_limited_ = false;
    for (std::int64_t y = 0; y < lattice_.root_rows; ++y)
        for (std::int64_t x = 0; x < lattice_.root_columns; ++x) {
            const TileId id{0, x, y};
            const ResidentHeight resident = residency.height(id);
            if (resident.header == nullptr) continue;  // a root without any present cell is not stored
            const std::int32_t index = add_node(id, resident.header->own, -1, residency);
            nodes_.back().exponent = maximum_exponent(nodes_.back());
            roots_[static_cast<std::size_t>(y * lattice_.root_columns + x)] = index;
        }
    const auto root_count = static_cast<std::int32_t>(nodes_.size());
    for (std::int32_t index = 0; index < root_count; ++index) push(index);
    while (!heap_.empty()) {
        std::pop_heap(heap_.begin(), heap_.end(), [](const HeapEntry& a, const HeapEntry& b) {
            return a.need != b.need ? a.need < b.need : a.node > b.node;
        });
        const HeapEntry entry = heap_.back();
        heap_.pop_back();
        CutNode& node = nodes_[static_cast<std::size_t>(entry.node)];
        if (node.split || node.blocked || node.exponent != entry.exponent) continue;
        ++steps_;
        if (!step(entry.node)) nodes_[static_cast<std::size_t>(entry.node)].blocked = true;
    }
}

bool Cut::step(std::int32_t index) {
    const CutNode& node = nodes_[static_cast<std::size_t>(index)];
    const double geometry = geometry_need(index), texture = texture_need(node);
    if (geometry > 1) {
        if (node.exponent > minimum_exponent(node)) return try_reduce(index);
        if (node.id.level < lattice_.deepest_level) return try_split(index, std::max(geometry, texture));
        return refine_thinned_neighbours(index) && texture <= 1;
    }
    if (node.id.level == lattice_.deepest_level || !may_split_now(index)) return try_reduce(index);
    return try_split(index, texture);
}

// A split hands the stride over to the children, which are finer pages: it must not pass what they can draw, nor the
// stride of a neighbour that is then the coarser page.
bool Cut::may_split_now(std::int32_t index) const {
    const CutNode& node = nodes_[static_cast<std::size_t>(index)];
    if (node.exponent == minimum_exponent(node)) return true;
    if (node.exponent > maximum_exponent(node) - 1) return false;
    bool allowed = true;
    for (const Direction direction : kDirections)
        for_each_neighbour(index, direction, [&](std::int32_t other) {
            const CutNode& neighbour = nodes_[static_cast<std::size_t>(other)];
            if (neighbour.id.level <= node.id.level && neighbour.exponent < node.exponent) allowed = false;
        });
    return allowed;
}

// Halves the stride of a leaf after its neighbours have been brought within the balance of the result.
bool Cut::try_reduce(std::int32_t index) {
    const int exponent = nodes_[static_cast<std::size_t>(index)].exponent;
    const int level = nodes_[static_cast<std::size_t>(index)].id.level;
    if (exponent <= minimum_exponent(nodes_[static_cast<std::size_t>(index)])) return false;
    for (const Direction direction : kDirections) {
        for (;;) {
            std::int32_t offender = -1;
            int allowed = 0;
            for_each_neighbour(index, direction, [&](std::int32_t other) {
                const CutNode& neighbour = nodes_[static_cast<std::size_t>(other)];
                const int limit = neighbour.id.level > level ? exponent - 1 : exponent;
                if (offender < 0 && neighbour.exponent > limit) {
                    offender = other;
                    allowed = limit;
                }
            });
            if (offender < 0) break;
            if (!lower_towards(offender, allowed)) return false;
        }
        // Lowering a neighbour may in turn have split or lowered this node: then there is nothing left to do here.
        const CutNode& self = nodes_[static_cast<std::size_t>(index)];
        if (self.split || self.exponent != exponent) return true;
    }
    CutNode& self = nodes_[static_cast<std::size_t>(index)];
    self.exponent = exponent - 1;
    self.blocked = false;
    push(index);
    return true;
}

// One step of a neighbour towards `exponent`: denser if its page can be, else a finer page.
bool Cut::lower_towards(std::int32_t index, int exponent) {
    const CutNode& node = nodes_[static_cast<std::size_t>(index)];
    assert(node.exponent > exponent);
    (void)exponent;
    if (node.exponent > minimum_exponent(node)) return try_reduce(index);
    return try_split(index, std::max({1.0, geometry_need(index), texture_need(node)}));
}

bool Cut::try_split(std::int32_t index, double priority) {
    const CutNode before = nodes_[static_cast<std::size_t>(index)];
    if (before.header == nullptr || before.header->child_mask == 0) return false;
    assert(before.exponent <= maximum_exponent(before) - 1);
    const auto first = static_cast<std::int32_t>(nodes_.size());
    const std::int64_t pages_before = pages_;
    std::array<std::int32_t, 4> children{-1, -1, -1, -1};
    bool possible = true;
    for (int q = 0; q < 4 && possible; ++q) {
        if ((before.header->child_mask >> q & 1) == 0) continue;
        const TileId id = child_of(before.id, q);
        const std::int32_t child =
            add_node(id, before.header->children[static_cast<std::size_t>(q)], index, *residency_);
        CutNode& node = nodes_[static_cast<std::size_t>(child)];
        node.exponent = before.exponent;
        node.priority = priority;
        children[static_cast<std::size_t>(q)] = child;
        if (!node.visible || node.header != nullptr) continue;
        if (settings_.only_resident || residency_->unavailable_height(id)) possible = false;
    }
    if (possible && pages_ > settings_.max_pages) {
        possible = false;
        page_limited_ = true;
    }
    if (!possible) {
        nodes_.resize(static_cast<std::size_t>(first));
        pages_ = pages_before;
        return false;
    }
    CutNode& self = nodes_[static_cast<std::size_t>(index)];
    self.split = true;
    self.children = children;
    for (const std::int32_t child : children)
        if (child >= 0) push(child);
    return true;
}

// The finest surface is only inexact where an edge is thinned for a coarser neighbour: that neighbour has to follow.
bool Cut::refine_thinned_neighbours(std::int32_t index) {
    if (nodes_[static_cast<std::size_t>(index)].exponent != 0) return false;
    bool all = true;
    for (const Direction direction : kDirections)
        for (;;) {
            std::int32_t offender = -1;
            for_each_neighbour(index, direction, [&](std::int32_t other) {
                if (nodes_[static_cast<std::size_t>(other)].exponent > 0) offender = other;
            });
            if (offender < 0) break;
            if (!lower_towards(offender, 0)) {
                all = false;
                break;
            }
        }
    return all;
}

unsigned Cut::edge_mask(std::int32_t leaf) const {
    const CutNode& node = nodes_[static_cast<std::size_t>(leaf)];
    unsigned mask = 0;
    for (const Direction direction : kDirections)
        for_each_neighbour(leaf, direction, [&](std::int32_t other) {
            if (nodes_[static_cast<std::size_t>(other)].exponent > node.exponent)
                mask |= 1u << static_cast<int>(direction);
        });
    return mask;
}

}  // namespace scree
