#include "runtime/render/draw_batches.h"

#include <algorithm>
#include <cassert>

namespace scree {

DrawBatches::DrawBatches(int arrays, int layers, int max_draws)
    : arrays_(static_cast<std::size_t>(arrays)), layers_(layers) {
    assert(arrays >= 1 && layers >= 1 && max_draws >= 1);
    counts_.resize(arrays_ * (arrays_ + 1));
    placed_.resize(static_cast<std::size_t>(max_draws));
    batches_.reserve(std::min(counts_.size(), placed_.size()));
}

// The array that the most neighbours lie in besides the item's own; the coarse texture's goes before.
std::size_t DrawBatches::other_array(const DrawItem& item) const {
    const std::size_t own = array_of(item.texture.slot);
    if (item.texture_share < 1 && array_of(item.coarse_texture.slot) != own) return array_of(item.coarse_texture.slot);
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

std::size_t DrawBatches::group_of(const DrawItem& item) const {
    const std::size_t own = array_of(item.texture.slot);
    assert(item.texture.slot >= 0 && own < arrays_);
    if (!is_blended(item)) return arrays_ * arrays_ + own;
    return own * arrays_ + other_array(item);
}

void DrawBatches::make_batches() {
    batches_.clear();
    std::size_t next = 0;
    for (std::size_t group = 0; group < counts_.size(); ++group) {
        const std::size_t count = counts_[group];
        if (count == 0) continue;
        const bool blended = group < arrays_ * arrays_;
        const auto own = static_cast<int>(blended ? group / arrays_ : group - arrays_ * arrays_);
        const auto other = static_cast<int>(blended ? group % arrays_ : static_cast<std::size_t>(own));
        counts_[group] = batches_.size();
        batches_.push_back({blended, own, other, next, 0});
        next += count;
        if (blended) blended_draws_ = next;
    }
}

void DrawBatches::sort(std::span<const DrawItem> items) {
    assert(items.size() <= placed_.size());
    std::fill(counts_.begin(), counts_.end(), 0);
    blended_draws_ = 0;
    for (std::size_t k = 0; k < items.size(); ++k) {
        placed_[k].group = group_of(items[k]);
        ++counts_[placed_[k].group];
    }
    make_batches();
    for (std::size_t k = 0; k < items.size(); ++k) {
        placed_[k].group = counts_[placed_[k].group];
        DrawBatch& batch = batches_[placed_[k].group];
        placed_[k].draw = batch.first + batch.count++;
    }
}

}  // namespace scree
