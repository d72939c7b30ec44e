#include "runtime/render/draw_batches.h"

#include <algorithm>
#include <cassert>

namespace scree {
namespace {

bool has_neighbours(const DrawItem& item) {
    return std::any_of(item.neighbour_textures.begin(), item.neighbour_textures.end(),
                       [](std::int32_t slot) { return slot >= 0; });
}

}  // namespace

DrawBatches::DrawBatches(const DrawBatchesOptions& options)
    : options_(options), arrays_(static_cast<std::size_t>(options.arrays)) {
    assert(options.arrays >= 1 && options.layers >= 1 && options.max_items >= 1);
    const auto max_items = static_cast<std::size_t>(options.max_items);
    counts_.resize(1 + 2 * (arrays_ * arrays_ + arrays_));
    wanted_.reserve(2 * max_items);
    sorted_.reserve(2 * max_items);
    batches_.reserve(std::min(counts_.size(), 2 * max_items));
}

std::size_t DrawBatches::array_of(std::int32_t slot) const {
    assert(slot >= 0 && slot / options_.layers < options_.arrays);
    return static_cast<std::size_t>(slot / options_.layers);
}

// Whether any of the item lies within half a texel of its texture's border.
bool DrawBatches::reaches_border(const DrawItem& item) const {
    const float reach = 0.5f / static_cast<float>(1 << options_.texture_size_log2);
    const TexturePlacement& t = item.texture;
    return std::min(t.offset_u, t.offset_v) < reach || std::max(t.offset_u, t.offset_v) + t.scale > 1 - reach;
}

// Whether the border blocks, 2 vertices' distances wide, hold all of the item's pixels within half a texel of its
// border, or within half a texel of the next mip. A mesh has no blocks to tell apart.
bool DrawBatches::has_ring(const DrawItem& item) const {
    if (item.mesh.count > 0) return false;
    const int blocks_log2 = options_.tile_cells_log2 - item.geomip - 1;
    if (item.part.level != 0 || item.texture.scale > 1 || blocks_log2 < 2) return false;
    const float texels = item.texture.scale * static_cast<float>(1 << options_.texture_size_log2);
    return texels >= static_cast<float>(1 << blocks_log2);
}

// Away from borders.
std::size_t DrawBatches::inner_group(const DrawItem& item) const {
    const std::size_t own = array_of(item.texture.slot), faded = 1 + arrays_ * arrays_ + arrays_;
    if (item.texture_share < 1) return faded + own * arrays_ + array_of(item.coarse_texture.slot);
    return faded + arrays_ * arrays_ + own;
}

// Besides the item's own array: the coarse texture's, or else the one that the most neighbours lie in.
std::size_t DrawBatches::main_other_array(const DrawItem& item) const {
    const std::size_t own = array_of(item.texture.slot);
    if (item.texture_share < 1) return array_of(item.coarse_texture.slot);
    const auto& neighbours = item.neighbour_textures;
    std::size_t best = own;
    std::ptrdiff_t most = 0;
    for (const std::int32_t slot : neighbours) {
        if (slot < 0 || array_of(slot) == own) continue;
        const std::ptrdiff_t there = std::count_if(neighbours.begin(), neighbours.end(), [&](std::int32_t other) {
            return other >= 0 && array_of(other) == array_of(slot);
        });
        if (there <= most) continue;
        most = there;
        best = array_of(slot);
    }
    return best;
}

std::size_t DrawBatches::blended_group(const DrawItem& item) const {
    const std::size_t own = array_of(item.texture.slot), other = main_other_array(item);
    const auto bound = static_cast<std::size_t>(options_.bound_arrays);
    const auto& neighbours = item.neighbour_textures;
    const bool two_hold_all = std::all_of(neighbours.begin(), neighbours.end(), [&](std::int32_t slot) {
        return slot < 0 || array_of(slot) == own || array_of(slot) == other;
    });
    const bool all_are_bound = own < bound && other < bound &&
                               std::all_of(neighbours.begin(), neighbours.end(),
                                           [&](std::int32_t slot) { return slot < 0 || array_of(slot) < bound; });
    if (!two_hold_all && all_are_bound) return 0;
    if (own == other && !(item.texture_share < 1)) return 1 + arrays_ * arrays_ + own;
    return 1 + std::min(own, other) * arrays_ + std::max(own, other);
}

DrawBatch DrawBatches::batch_of_group(std::size_t group) const {
    if (group == 0) return {Imagery::blended_of_all, {}, 0, 0};
    const std::size_t pairs = arrays_ * arrays_, half = pairs + arrays_;
    const bool near_border = group - 1 < half;
    const std::size_t k = (group - 1) % half;
    if (k < pairs)
        return {near_border ? Imagery::blended : Imagery::faded,
                {static_cast<int>(k / arrays_), static_cast<int>(k % arrays_)},
                0,
                0};
    const auto array = static_cast<int>(k - pairs);
    return {near_border ? Imagery::bordered : Imagery::plain, {array, array}, 0, 0};
}

void DrawBatches::want(std::size_t item, DrawShape shape, std::size_t group) {
    wanted_.push_back({{static_cast<std::uint32_t>(item), shape, 0}, group});
    ++counts_[group];
}

void DrawBatches::sort(std::span<const DrawItem> items) {
    assert(items.size() <= static_cast<std::size_t>(options_.max_items));
    wanted_.clear();
    batches_.clear();
    std::fill(counts_.begin(), counts_.end(), 0);
    for (std::size_t k = 0; k < items.size(); ++k) {
        const DrawItem& item = items[k];
        if (!has_neighbours(item) || !reaches_border(item)) {
            want(k, DrawShape::whole, inner_group(item));
        } else if (has_ring(item)) {
            want(k, DrawShape::ring, blended_group(item));
            want(k, DrawShape::inner, inner_group(item));
        } else {
            want(k, DrawShape::whole, blended_group(item));
        }
    }
    std::size_t next = 0;
    blended_draws_ = 0;
    for (std::size_t group = 0; group < counts_.size(); ++group) {
        if (counts_[group] == 0) continue;
        DrawBatch batch = batch_of_group(group);
        batch.first = next;
        next += counts_[group];
        if (batch.imagery != Imagery::plain) blended_draws_ = next;
        counts_[group] = batches_.size();
        batches_.push_back(batch);
    }
    sorted_.resize(wanted_.size());
    for (const Wanted& wanted : wanted_) {
        const std::size_t index = counts_[wanted.group];
        DrawBatch& batch = batches_[index];
        sorted_[batch.first + batch.count++] = {wanted.draw.item, wanted.draw.shape, index};
    }
}

}  // namespace scree
