#include "runtime/lod/texture_plan.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace scree {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// A texel that covers this much of a pixel somewhere on a page may be seen across its tile's border.
constexpr double kMagnifiedPx = 0.75;

TileId texture_of(const CutNode& node, TilePart part) {
    return {node.id.level + part.level, (node.id.x << part.level) + part.x, (node.id.y << part.level) + part.y};
}

/// How the texture `up` levels above a page lies on it.
TexturePlacement placement(TileId page, int up, std::int32_t slot) {
    const std::int64_t side = std::int64_t{1} << up;
    const double scale = 1.0 / static_cast<double>(side);  // a power of two: exact
    return {slot, static_cast<float>(scale), static_cast<float>(static_cast<double>(page.x & (side - 1)) * scale),
            static_cast<float>(static_cast<double>(page.y & (side - 1)) * scale)};
}

}  // namespace

/// A part of a deepest page and the texture of exactly its extent.
struct TexturePlan::Part {
    TilePart part;
    std::int32_t slot = kNotResident;
    double need = 0;
};

TexturePlan::TexturePlan(const Dataset& dataset) : dataset_(dataset) {
    for (int level = 0; level <= std::max(dataset.texture_deepest_level, dataset.lattice.deepest_level); ++level)
        texel_m_.push_back(dataset.texel_m(level));
}

// Levels from a leaf's own texture, or the pyramid's deepest above it, up to the coarsest that is sharp enough.
int TexturePlan::wanted_steps_up(const CutNode& node) const {
    int level = std::min(node.id.level, dataset_.texture_deepest_level);
    const double allowed_m = settings_.texture_tau_px * node.texel_per_px;
    while (level > 0 && texel_m(level - 1) <= allowed_m) --level;
    return node.id.level - level;
}

std::int64_t TexturePlan::wish(const Cut& cut, std::span<const LodView> views, const CutSettings& settings,
                               const Residency& residency) {
    views_ = views;
    settings_ = settings;
    residency_ = &residency;
    deep_.clear();
    used_.clear();
    fading_ = false;
    const auto& nodes = cut.nodes();
    needs_.assign(nodes.size(), 0);
    wanted_.assign(residency.textures.headers.size(), false);
    beside_.resize(residency.textures.headers.size());
    ++wishes_;
    std::int64_t count = dataset_.lattice.root_rows * dataset_.lattice.root_columns;
    // Each page by its own nearest point: what a page wants its ancestors want the more, and nothing depends on how far
    // the pages below it are known.
    for (std::size_t k = 0; k < nodes.size(); ++k) {
        const CutNode& node = nodes[k];
        const int level = node.id.level;
        if (!node.textured) continue;
        const double need = level == 0 ? kInfinity : texel_m(level - 1) / node.texel_per_px / settings_.texture_tau_px;
        if (!(need > 1)) continue;
        needs_[k] = need;
        if (level > 0) ++count;
        mark_wanted(node.texture_slot);
        if (node.leaf && !node.split && deeper_than_heights())
            wish_deep(node, k, {{}, node.texture_slot, node.texture_need});
    }
    return count + static_cast<std::int64_t>(deep_.size());
}

void TexturePlan::hand_over(const Cut& cut, std::vector<std::int32_t>& planned, std::vector<TileRequest>& requests,
                            std::vector<bool>& missing) const {
    const auto take = [&](TileId id, std::int32_t slot, double need, std::size_t node) {
        if (slot >= 0) {
            planned.push_back(slot);
        } else if (slot == kNotResident) {
            requests.push_back({TileKind::texture, id, need});
            missing[node] = true;
        }
    };
    for (std::size_t k = 0; k < needs_.size(); ++k)
        if (needs_[k] > 0) take(cut.nodes()[k].id, cut.nodes()[k].texture_slot, needs_[k], k);
    for (const DeepWish& wish : deep_) take(wish.id, wish.slot, wish.need, wish.node);
}

void TexturePlan::used(std::vector<std::int32_t>& slots) const {
    slots.insert(slots.end(), used_.begin(), used_.end());
}

bool TexturePlan::place(const Cut& cut, std::int32_t leaf, double fade_s, DrawItem& item) {
    const auto& nodes = cut.nodes();
    const CutNode& own = nodes[static_cast<std::size_t>(leaf)];
    const auto rise = [&](std::int32_t& index) {
        index = nodes[static_cast<std::size_t>(index)].parent;
        return index >= 0;
    };
    const auto resident = [&](std::int32_t& index) {
        while (index >= 0 && nodes[static_cast<std::size_t>(index)].texture_slot < 0) rise(index);
        return index >= 0;
    };
    const auto placed = [&](std::int32_t index) {
        const CutNode& node = nodes[static_cast<std::size_t>(index)];
        used_.push_back(node.texture_slot);
        return placement(own.id, own.id.level - node.id.level, node.texture_slot);
    };
    item.texture.slot = -1;
    std::int32_t index = leaf;
    for (int step = wanted_steps_up(own); step > 0; --step) rise(index);
    // Where textures end above, the last of them is all that can be wanted.
    while (index >= 0 && !nodes[static_cast<std::size_t>(index)].textured) rise(index);
    const bool sharp =
        !residency_->has_textures || index < 0 || nodes[static_cast<std::size_t>(index)].texture_slot != kNotResident;
    if (!resident(index)) return sharp;
    item.texture = placed(index);
    const CutNode& chosen = nodes[static_cast<std::size_t>(index)];
    add_neighbours(chosen.id, texel_m(chosen.id.level) / own.texel_per_px, item);
    const double age_s =
        residency_->now_s - residency_->textures.arrived_s[static_cast<std::size_t>(item.texture.slot)];
    if (!(age_s < fade_s) || !rise(index) || !resident(index)) return sharp;
    item.texture_share = static_cast<float>(std::max(age_s / fade_s, 0.0));
    item.coarse_texture = placed(index);
    fading_ = true;
    return sharp;
}

// Only what is wanted counts: a settled picture does not depend on what else happens to be in memory.
std::int32_t TexturePlan::wanted_slot_at(TileId id) const {
    const Lattice& l = dataset_.lattice;
    if (!l.contains(id)) return kNotResident;
    const TileId root = ancestor_at(id, 0);
    std::int32_t slot = residency_->textures.roots[static_cast<std::size_t>(root.y * l.root_columns + root.x)];
    for (int level = 1; level <= id.level && slot >= 0; ++level)
        slot = residency_->textures.children[static_cast<std::size_t>(slot)]
                                            [static_cast<std::size_t>(quadrant_of(ancestor_at(id, level)))];
    return slot >= 0 && wanted_[static_cast<std::size_t>(slot)] ? slot : kNotResident;
}

void TexturePlan::mark_wanted(std::int32_t slot) {
    if (slot >= 0) wanted_[static_cast<std::size_t>(slot)] = true;
}

std::int32_t TexturePlan::wanted_beside(std::int32_t slot, TileId texture, TextureSide side) {
    static constexpr std::array<std::array<int, 2>, 8> kSteps{
        {{-1, -1}, {0, -1}, {1, -1}, {-1, 0}, {1, 0}, {-1, 1}, {0, 1}, {1, 1}}};
    Beside& beside = beside_[static_cast<std::size_t>(slot)];
    if (beside.asked_in != wishes_) {
        beside.asked_in = wishes_;
        beside.known = 0;
    }
    if ((beside.known >> side & 1) == 0) {
        beside.known |= 1u << side;
        beside.slots[side] = wanted_slot_at({texture.level, texture.x + kSteps[side][0], texture.y + kSteps[side][1]});
    }
    return beside.slots[side];
}

// Across which borders of its texture a page that shows it large must be filtered.
void TexturePlan::add_neighbours(TileId texture, double texel_px, DrawItem& item) {
    if (!(texel_px > kMagnifiedPx)) return;
    const TexturePlacement& t = item.texture;
    const bool west = t.offset_u <= 0, east = t.offset_u + t.scale >= 1;
    const bool north = t.offset_v <= 0, south = t.offset_v + t.scale >= 1;
    const auto look = [&](bool touches, TextureSide side) {
        if (touches) item.neighbour_textures[side] = wanted_beside(t.slot, texture, side);
    };
    look(north && west, kSideNorthWest);
    look(north, kSideNorth);
    look(north && east, kSideNorthEast);
    look(west, kSideWest);
    look(east, kSideEast);
    look(south && west, kSideSouthWest);
    look(south, kSideSouth);
    look(south && east, kSideSouthEast);
}

// Metres of texture a pixel covers at the nearest point of a part of a page; infinite when no view sees it.
double TexturePlan::texel_per_px(const CutNode& node, TilePart part) const {
    const Lattice& l = dataset_.lattice;
    const double side = std::ldexp(static_cast<double>(l.tile_extent(node.id.level)), -part.level);
    const LatticePoint corner = l.corner(node.id);
    const double i = static_cast<double>(corner.i) + part.x * side, j = static_cast<double>(corner.j) + part.y * side;
    const double east = std::min(i + side, static_cast<double>(l.cells_x)),
                 south = std::min(j + side, static_cast<double>(l.cells_y));
    if (east <= i || south <= j) return kInfinity;
    const Box flat{{l.x_m(i), l.y_m(south), dataset_.height_m(node.bounds->min_n)},
                   {l.x_m(east), l.y_m(j), dataset_.height_m(node.bounds->max_n)}};
    double least = kInfinity;
    for (const LodView& view : views_) {
        const Box box = lowered_by_curvature(flat, view.eye, settings_.half_curvature);
        if (view.frustum.may_see(box))
            least = std::min(least, std::max(distance_to_box(view.eye, box), view.near_m) / view.focal_px);
    }
    return least;
}

// Visits the existing children of a part's texture.
template <class Visit>
void TexturePlan::for_each_deep_child(const CutNode& node, const Part& part, const Visit& visit) const {
    const int level = node.id.level + part.part.level;
    if (part.slot < 0 || level >= dataset_.texture_deepest_level ||
        part.part.level >= dataset_.lattice.tile_cells_log2 - 1)
        return;
    const auto slot = static_cast<std::size_t>(part.slot);
    const std::uint8_t exists = residency_->textures.headers[slot].child_mask;
    for (int q = 0; q < 4; ++q) {
        if ((exists >> q & 1) == 0) continue;
        const TilePart child{part.part.level + 1, 2 * part.part.x + (q & 1), 2 * part.part.y + (q >> 1)};
        const double need = texel_m(level) / texel_per_px(node, child) / settings_.texture_tau_px;
        visit(Part{child, residency_->textures.children[slot][static_cast<std::size_t>(q)], need});
    }
}

void TexturePlan::wish_deep(const CutNode& node, std::size_t index, const Part& part) {
    for_each_deep_child(node, part, [&](const Part& child) {
        if (!(child.need > 1)) return;
        deep_.push_back({texture_of(node, child.part), child.slot, child.need, index});
        mark_wanted(child.slot);
        wish_deep(node, index, child);
    });
}

void TexturePlan::emit_parts(const Cut& cut, std::int32_t leaf, const DrawItem& item, DrawList& out) {
    const CutNode& node = cut.nodes()[static_cast<std::size_t>(leaf)];
    if (node.leaf && item.texture.scale == 1 && item.texture.slot >= 0)
        emit_part(node, {{}, item.texture.slot, 0}, item, out);
    else
        out.push_back(item);
}

// A part whose texture has no child there at all shows nothing there: no present cell lies under it.
void TexturePlan::emit_part(const CutNode& node, const Part& part, const DrawItem& item, DrawList& out) {
    std::array<Part, 4> children;
    int count = 0;
    bool any = false;
    for_each_deep_child(node, part, [&](const Part& child) {
        children[static_cast<std::size_t>(count++)] = child;
        any = any || (child.need > 1 && child.slot >= 0);
    });
    if (!any || part.part.level >= dataset_.lattice.tile_cells_log2 - 1 - item.geomip) {
        out.push_back(item);
        return;
    }
    for (int k = 0; k < count; ++k) {
        const Part& child = children[static_cast<std::size_t>(k)];
        DrawItem drawn = item;
        drawn.part = child.part;
        if (!(child.need > 1) || child.slot < 0) {
            out.push_back(drawn);
            continue;
        }
        drawn.texture = {child.slot, static_cast<float>(1 << child.part.level), static_cast<float>(-child.part.x),
                         static_cast<float>(-child.part.y)};
        drawn.texture_share = 1;
        drawn.neighbour_textures.fill(-1);
        const TileId texture = texture_of(node, child.part);
        const double texel_px = texel_m(texture.level) / texel_per_px(node, child.part);
        // The part fills its texture: all its borders are the texture's.
        DrawItem whole = drawn;
        whole.texture = {child.slot, 1, 0, 0};
        add_neighbours(texture, texel_px, whole);
        drawn.neighbour_textures = whole.neighbour_textures;
        emit_part(node, child, drawn, out);
    }
}

}  // namespace scree
