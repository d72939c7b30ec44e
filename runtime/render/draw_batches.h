// DrawBatches: which draws go into one multi-draw, that is share program and textures. Textures lie in several arrays,
// and a program has two bound at most: a blended draw looks at its own texture's array and at one other. What it wants
// from a third is left out: neighbours first, for a border in sight is less than a texture that pops up. No OpenGL
// here.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "runtime/lod/draw_list.h"

namespace scree {

/// Whether anything but the item's own texture is looked at.
inline bool is_blended(const DrawItem& item) {
    if (item.texture_share < 1) return true;
    for (const std::int32_t slot : item.neighbour_textures)
        if (slot >= 0) return true;
    return false;
}

struct DrawBatch {
    bool blended = false;
    int array = 0;
    int other_array = 0;  ///< the same as `array`: none
    std::size_t first = 0;
    std::size_t count = 0;
};

class DrawBatches {
public:
    DrawBatches() = default;
    /// Textures lie in `arrays` arrays of `layers` slots each; at most max_draws items are sorted at a time.
    DrawBatches(int arrays, int layers, int max_draws);

    /// Puts items of a batch together, otherwise as given; blended batches come first. Allocates nothing.
    void sort(std::span<const DrawItem> items);

    /// No batch is empty.
    std::span<const DrawBatch> batches() const { return batches_; }
    /// Where items[k] stands among all draws, and its batch.
    std::size_t place_of(std::size_t k) const { return placed_[k].draw; }
    const DrawBatch& batch_of(std::size_t k) const { return batches_[placed_[k].group]; }
    std::size_t blended_draws() const { return blended_draws_; }

private:
    struct Placed {
        std::size_t group = 0;  ///< all blended pairs of arrays, then the arrays of plain draws; later, the batch
        std::size_t draw = 0;
    };
    std::size_t array_of(std::int32_t slot) const { return static_cast<std::size_t>(slot / layers_); }
    std::size_t other_array(const DrawItem& item) const;
    std::size_t group_of(const DrawItem& item) const;
    void make_batches();

    std::size_t arrays_ = 1;
    std::int32_t layers_ = 1;
    std::vector<std::size_t> counts_;  ///< by group; then the index of the group's batch
    std::vector<Placed> placed_;
    std::vector<DrawBatch> batches_;
    std::size_t blended_draws_ = 0;
};

}  // namespace scree
