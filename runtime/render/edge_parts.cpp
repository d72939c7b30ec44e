#include "runtime/render/edge_parts.h"

#include <algorithm>

namespace scree {

std::span<const TilePart> EdgeParts::of(const DrawItem& item, int finest_level) {
    finest_level_ = std::min(finest_level, 3);
    count_ = 0;
    add(item.tile, item.part);
    return {parts_.data(), count_};
}

void EdgeParts::add(TileId tile, TilePart part) {
    if (!field_.is_near_end(tile.level + part.level, (tile.x << part.level) + part.x, (tile.y << part.level) + part.y))
        return;
    if (part.level >= finest_level_) {
        parts_[count_++] = part;
        return;
    }
    const std::size_t first = count_;
    for (int q = 0; q < 4; ++q) add(tile, {part.level + 1, 2 * part.x + (q & 1), 2 * part.y + (q >> 1)});
    // All four of them whole: one draw. Each costs more than its triangles.
    const bool whole = count_ == first + 4 && parts_[first].level == part.level + 1 &&
                       std::all_of(parts_.begin() + first, parts_.begin() + count_,
                                   [&](const TilePart& p) { return p.level == part.level + 1; });
    if (!whole) return;
    count_ = first;
    parts_[count_++] = part;
}

}  // namespace scree
