// The texture half of TileWalk.
#include <fmt/format.h>

#include "common/store/texture_codec.h"
#include "tools/verify/tile_walk.h"

namespace scree {

void TileWalk::check_texture_end(const Frame& frame) {
    if (frame.textured || frame.tile->header.texture_ends || frame.id.level >= dataset_.texture_deepest_level) return;
    problems_.add(fmt::format("height tile {}/{}/{} does not say that textures end here: they end above it",
                              frame.id.level, frame.id.x, frame.id.y));
}

void TileWalk::check_texture(const Frame& frame) {
    if (!refined(frame)) coarsest_texture_end_ = std::min(coarsest_texture_end_, frame.id.level);
    const TextureRow row = read_texture(frame.id);
    // Refined wholly or not at all.
    judge_texture(frame.id, row, refined(frame) ? frame.texture_children : std::uint8_t{0},
                  frame.complete ? &frame.alpha : nullptr);
}

// The texels over a leaf of the heights belong to the deepest texture there.
void TileWalk::mark_leaf(Frame& frame, const CellPresence& presence) {
    if (refined(frame)) {
        frame.texture_children = visit_texture_children(frame.id, presence, frame.alpha, frame.complete);
        return;
    }
    std::size_t k = frames_.size() - 1;
    while (!frames_[k]->textured) --k;  // roots are
    Frame& target = *frames_[k];
    mark_present(TexelGrid(dataset_, target.id.level), target.id.x, target.id.y, presence, target.alpha);
}

TileWalk::TextureRow TileWalk::read_texture(TileId id) {
    auto found = reader_.read(TileKind::texture, id, texture_row_);
    if (found && !*found) {
        problems_.add(fmt::format("texture tile {}/{}/{} is missing", id.level, id.x, id.y));
        return {};
    }
    ++texture_rows_;
    tick_row();
    TextureRow row{true, {}};
    if (!found) {
        take_error("texture", id, found.error());
        return row;
    }
    auto tile = decode_texture_tile(texture_row_.payload, dataset_.texture_size_log2, texture_row_.codec);
    if (!tile) {
        take_error("texture", id, tile.error());
        return row;
    }
    ++report_.tiles_checked;
    row.tile = std::move(*tile);
    return row;
}

// `alpha` nullptr: not known, because something below could not be read.
void TileWalk::judge_texture(TileId id, const TextureRow& row, std::uint8_t child_mask, const AlphaRaster* alpha) {
    if (!row.tile) return;
    const std::string name = fmt::format("texture tile {}/{}/{}", id.level, id.x, id.y);
    if (row.tile->child_mask != child_mask)
        problems_.add(fmt::format("{}: child bits {:04b} should be {:04b}", name, row.tile->child_mask, child_mask));
    if (alpha == nullptr) return;
    if (const auto wrong = compare_alpha(row.tile->blocks, dataset_.texture_size_log2, *alpha))
        problems_.add(
            fmt::format("{}: {} texels are transparent where there are heights or opaque where there are none, "
                        "first in mip {} at ({}, {})",
                        name, wrong->texels, wrong->mip, wrong->column, wrong->row));
}

// Children of `id` at levels below a leaf of the heights: stored where a texel is opaque. Fills `alpha` from them.
std::uint8_t TileWalk::visit_texture_children(TileId id, const CellPresence& presence, AlphaRaster& alpha,
                                              bool& complete) {
    std::uint8_t mask = 0;
    AlphaRaster child_alpha(alpha.size);
    for (int q = 0; q < 4 && !failure_; ++q) {
        const TileId child = child_of(id, q);
        if (!any_opaque(child, presence)) continue;
        mask = static_cast<std::uint8_t>(mask | 1u << q);
        std::fill(child_alpha.texels.begin(), child_alpha.texels.end(), std::uint8_t{0});
        if (visit_texture_below(child, presence, child_alpha))
            halve_into_quadrant(child_alpha, q, alpha);
        else
            complete = false;
    }
    return mask;
}

// A texture tile deeper than the heights. False: its alpha is not known, for lack of rows.
bool TileWalk::visit_texture_below(TileId id, const CellPresence& presence, AlphaRaster& alpha) {
    const TextureRow row = read_texture(id);
    if (!row.exists || failure_)
        return false;  // only rows that exist are descended into: that bounds the walk on any store
    bool complete = true;
    std::uint8_t mask = 0;
    if (!row.tile)
        complete = false;
    else if (row.tile->child_mask == 0 || id.level >= dataset_.texture_deepest_level) {
        coarsest_texture_end_ = std::min(coarsest_texture_end_, id.level);
        mark_present(TexelGrid(dataset_, id.level), id.x, id.y, presence, alpha);
    } else
        mask = visit_texture_children(id, presence, alpha, complete);
    judge_texture(id, row, mask, complete ? &alpha : nullptr);
    return complete && !failure_;
}

// Whether a texel of the deepest level, stored there or not, under texture tile `id`, deeper than a leaf of the
// heights, has its centre in a present cell of it.
bool TileWalk::any_opaque(TileId id, const CellPresence& presence) const {
    const TexelGrid grid(dataset_, dataset_.texture_deepest_level, presence.step_log2);
    const int log2_cells = lattice_.tile_cells_log2 + lattice_.deepest_level - id.level - presence.step_log2;
    const auto first_cell = [&](std::int64_t tile) {
        return log2_cells >= 0 ? tile << log2_cells : tile >> -log2_cells;
    };
    const std::int64_t side = log2_cells >= 0 ? std::int64_t{1} << log2_cells : 1;
    const std::int64_t i0 = first_cell(id.x), j0 = first_cell(id.y);
    for (std::int64_t j = j0; j < j0 + side; ++j) {
        if (!grid.hits(j)) continue;
        for (std::int64_t i = i0; i < i0 + side; ++i)
            if (grid.hits(i) && presence.at(i << presence.step_log2, j << presence.step_log2)) return true;
    }
    return false;
}

}  // namespace scree
