#include "tools/pyramid/deep_tree.h"

#include <algorithm>
#include <cmath>

namespace scree {

DeepTree::DeepTree(const Lattice& lattice, int base_level)
    : lattice_(lattice),
      base_level_(base_level),
      refined_(static_cast<std::size_t>(std::max(0, lattice.deepest_level - base_level))) {}

// A refined tile is reached through refined ones.
void DeepTree::insert(TileId id) {
    while (id.level >= base_level_) {
        if (!refined_[static_cast<std::size_t>(id.level - base_level_)].insert(pack(id.x, id.y)).second) return;
        id = parent_of(id);
    }
}

void DeepTree::mark(double west, double north, double east, double south, int level) {
    if (level <= base_level_) return;
    const int parent = level - 1;
    const auto extent = static_cast<double>(lattice_.tile_extent(parent));
    const auto first = [&](double at) {
        return std::max<std::int64_t>(0, static_cast<std::int64_t>(std::floor(at / extent)));
    };
    const auto last = [&](double at, std::int64_t cells) {
        const double end = std::min(at, static_cast<double>(cells));
        return static_cast<std::int64_t>(std::ceil(end / extent)) - 1;
    };
    const std::int64_t x1 = last(east, lattice_.cells_x), y1 = last(south, lattice_.cells_y);
    for (std::int64_t y = first(north); y <= y1; ++y)
        for (std::int64_t x = first(west); x <= x1; ++x) insert({parent, x, y});
}

void DeepTree::grade() {
    for (int level = lattice_.deepest_level - 1; level > base_level_; --level) {
        const auto& here = refined_[static_cast<std::size_t>(level - base_level_)];
        for (const std::uint64_t packed : here) {
            const auto x = static_cast<std::int64_t>(packed & 0xFFFFFFFF), y = static_cast<std::int64_t>(packed >> 32);
            // The neighbours must exist, so that what lies beyond the edge is one level coarser at most.
            for (const auto& [dx, dy] : {std::pair{-1, 0}, {1, 0}, {0, -1}, {0, 1}}) {
                const TileId beside{level, x + dx, y + dy};
                if (lattice_.contains(beside) && beside.x * lattice_.tile_extent(level) < lattice_.cells_x &&
                    beside.y * lattice_.tile_extent(level) < lattice_.cells_y)
                    insert(parent_of(beside));
            }
        }
    }
}

bool DeepTree::refined(TileId id) const {
    if (id.level < base_level_) return true;
    if (id.level >= lattice_.deepest_level) return false;
    return refined_[static_cast<std::size_t>(id.level - base_level_)].count(pack(id.x, id.y)) != 0;
}

std::vector<TileId> DeepTree::refined_base_tiles() const {
    std::vector<TileId> tiles;
    if (refined_.empty()) return tiles;
    std::vector<std::uint64_t> packed(refined_[0].begin(), refined_[0].end());
    std::sort(packed.begin(), packed.end());
    for (const std::uint64_t p : packed)
        tiles.push_back({base_level_, static_cast<std::int64_t>(p & 0xFFFFFFFF), static_cast<std::int64_t>(p >> 32)});
    return tiles;
}

std::int64_t DeepTree::count() const {
    std::size_t count = 0;
    for (const auto& level : refined_) count += level.size();
    return static_cast<std::int64_t>(count);
}

}  // namespace scree
