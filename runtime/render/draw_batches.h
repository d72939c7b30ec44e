// DrawBatches: what is drawn of each item, and which draws go into one multi-draw, that is share program and textures.
//
// Filtering across texture borders costs pixels more, and only those near a border need it. So an item is drawn as its
// inner blocks, plain or faded, and its ring of border blocks, blended; a mesh that reaches a border is blended whole.
// Textures lie in several arrays, and on software OpenGL a pixel pays for each array that its program may look at:
// draws are sorted by the arrays they need. No OpenGL here.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "runtime/lod/draw_list.h"

namespace scree {

/// What of an item one draw shows.
enum class DrawShape : std::uint8_t { whole, inner, ring };

/// What the draws of a batch look at: their own texture; that and a coarse one; neighbours in the same array;
/// neighbours and a coarse one in two arrays; in all arrays.
enum class Imagery : std::uint8_t { plain, faded, bordered, blended, blended_of_all };
inline constexpr std::size_t kImageryKinds = 5;

struct DrawBatch {
    Imagery imagery = Imagery::plain;
    std::array<int, 2> arrays{};  ///< for units 0 and 1: equal where one is enough; unused with all arrays
    std::size_t first = 0;
    std::size_t count = 0;
};

struct SortedDraw {
    std::uint32_t item = 0;
    DrawShape shape = DrawShape::whole;
    std::size_t batch = 0;
};

struct DrawBatchesOptions {
    int arrays = 1;  ///< of texture slots
    int layers = 1;  ///< slots of an array
    /// Arrays that blended_of_all has bound: the first so many. A draw that wants others besides has two: its own and
    /// that of its coarse texture, or else of most of its neighbours; what lies elsewhere is left out.
    int bound_arrays = 1;
    int tile_cells_log2 = 5;
    int texture_size_log2 = 8;
    int max_items = 1;
};

class DrawBatches {
public:
    DrawBatches() = default;
    explicit DrawBatches(const DrawBatchesOptions& options);

    /// Replaces what was sorted before. Draws of a batch stand together, otherwise as the items; batches of blended
    /// draws come first. Allocates nothing; at most max_items items, 2 * max_items draws.
    void sort(std::span<const DrawItem> items);

    /// In their order in the batches.
    std::span<const SortedDraw> draws() const { return sorted_; }
    /// No batch is empty.
    std::span<const DrawBatch> batches() const { return batches_; }
    std::size_t blended_draws() const { return blended_draws_; }

private:
    struct Wanted {
        SortedDraw draw;
        std::size_t group = 0;
    };
    std::size_t array_of(std::int32_t slot) const;
    bool reaches_border(const DrawItem& item) const;
    bool has_ring(const DrawItem& item) const;
    std::size_t inner_group(const DrawItem& item) const;
    std::size_t blended_group(const DrawItem& item) const;
    std::size_t main_other_array(const DrawItem& item) const;
    DrawBatch batch_of_group(std::size_t group) const;
    void want(std::size_t item, DrawShape shape, std::size_t group);

    DrawBatchesOptions options_;
    std::size_t arrays_ = 1;
    /// Groups: all arrays, blended pairs, bordered by array, faded pairs, plain by array.
    std::vector<std::size_t> counts_;
    std::vector<Wanted> wanted_;
    std::vector<SortedDraw> sorted_;
    std::vector<DrawBatch> batches_;
    std::size_t blended_draws_ = 0;
};

}  // namespace scree
