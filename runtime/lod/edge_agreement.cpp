#include "runtime/lod/edge_agreement.h"

#include <algorithm>
#include <bit>

#include "runtime/lod/block_selection.h"

namespace scree {
namespace {

constexpr int opposite(int side) { return (side + 2) % 4; }

TileId beside(TileId id, int side) {
    switch (side) {
        case 0:
            return {id.level, id.x, id.y - 1};
        case 1:
            return {id.level, id.x + 1, id.y};
        case 2:
            return {id.level, id.x, id.y + 1};
        default:
            return {id.level, id.x - 1, id.y};
    }
}

}  // namespace

void EdgeAgreement::Index::reset(std::size_t tiles) {
    std::size_t size = 64;
    while (size < 2 * tiles) size *= 2;
    if (entries_.size() < size) entries_.resize(size);
    std::fill(entries_.begin(), entries_.end(), std::pair{TileId{}, -1});
}

void EdgeAgreement::Index::add(TileId id, std::int32_t tile) {
    std::size_t at = place(id);
    while (entries_[at].second >= 0) at = (at + 1) & (entries_.size() - 1);
    entries_[at] = {id, tile};
}

std::int32_t EdgeAgreement::Index::find(TileId id) const {
    for (std::size_t at = place(id); entries_[at].second >= 0; at = (at + 1) & (entries_.size() - 1))
        if (entries_[at].first == id) return entries_[at].second;
    return -1;
}

EdgeAgreement::EdgeAgreement(const Lattice& lattice)
    : lattice_(lattice), m_(lattice.tile_cells()), words_((static_cast<std::size_t>(m_) + 64) / 64) {
    // What a border vertex depends on is the same in even and odd tiles: the tile's own centre has only corners.
    const Bisection bisection(lattice.tile_cells_log2, false);
    std::vector<std::uint8_t> active(bisection.vertex_count());
    for (int side = 0; side < 4; ++side)
        for (int k = 0; k <= m_; ++k) {
            std::fill(active.begin(), active.end(), std::uint8_t{0});
            add_closed(bisection, side_vertex(side, k, m_), active.data());
            added_.push_back(border_of(active.data()));
        }
}

TileBorder EdgeAgreement::border_of(const std::uint8_t* active) const {
    TileBorder border;
    for (int side = 0; side < 4; ++side)
        for (int k = 0; k <= m_; ++k)
            if (active[side_vertex(side, k, m_)] != 0) border.set(side, k);
    return border;
}

void EdgeAgreement::add_border(const Bisection& bisection, const TileBorder& border, const TileBorder& own,
                               std::uint8_t* active) const {
    for (std::size_t side = 0; side < 4; ++side)
        for (std::size_t w = 0; w < words_; ++w)
            for (std::uint64_t more = border.sides[side][w] & ~own.sides[side][w]; more != 0; more &= more - 1)
                add_closed(bisection,
                           side_vertex(static_cast<int>(side), static_cast<int>(64 * w) + std::countr_zero(more), m_),
                           active);
}

void EdgeAgreement::link() {
    const auto count = tiles_.size();
    index_.reset(count);
    for (std::size_t t = 0; t < count; ++t) index_.add(tiles_[t].id, static_cast<std::int32_t>(t));
    links_.clear();
    for (std::size_t t = 0; t < count; ++t)
        for (int side = 0; side < 4; ++side) link(static_cast<std::int32_t>(t), side);
    first_link_.assign(count + 1, 0);
    for (const Link& l : links_) {
        ++first_link_[static_cast<std::size_t>(l.fine) + 1];
        ++first_link_[static_cast<std::size_t>(l.coarse) + 1];
    }
    for (std::size_t t = 0; t < count; ++t) first_link_[t + 1] += first_link_[t];
    links_of_.resize(2 * links_.size());
    queue_.assign(first_link_.begin(), first_link_.end());
    for (std::size_t k = 0; k < links_.size(); ++k)
        for (const std::int32_t t : {links_[k].fine, links_[k].coarse})
            links_of_[static_cast<std::size_t>(queue_[static_cast<std::size_t>(t)]++)] = static_cast<std::int32_t>(k);
}

// Each pair once: from the smaller page, or towards east and south.
void EdgeAgreement::link(std::int32_t tile, int side) {
    const Tile& fine = tiles_[static_cast<std::size_t>(tile)];
    TileId other = beside(fine.id, side);
    if (!lattice_.contains(other)) return;
    std::int32_t found = index_.find(other);
    if (found >= 0 && (side == 0 || side == 3)) return;
    while (found < 0 && other.level > 0) {
        other = parent_of(other);
        found = index_.find(other);
    }
    if (found < 0) return;
    const Tile& coarse = tiles_[static_cast<std::size_t>(found)];
    const auto edge_stride = [&](const Tile& of, int its_side) {
        return lattice_.step(of.id.level) << (of.geomip + static_cast<int>(of.edge_mask >> its_side & 1u));
    };
    const std::int64_t stride = std::max(edge_stride(fine, side), edge_stride(coarse, opposite(side)));
    const std::int64_t fine_step = lattice_.step(fine.id.level), coarse_step = lattice_.step(coarse.id.level);
    const LatticePoint a = lattice_.corner(fine.id), c = lattice_.corner(coarse.id);
    const std::int64_t offset = side == 0 || side == 2 ? a.i - c.i : a.j - c.j;
    links_.push_back({tile, found, side, other.level == fine.id.level, static_cast<std::int32_t>(stride / fine_step),
                      static_cast<std::int32_t>(offset / coarse_step), static_cast<std::int32_t>(stride / coarse_step),
                      static_cast<std::int32_t>(lattice_.tile_extent(fine.id.level) / stride) + 1});
}

void EdgeAgreement::add(std::int32_t tile, int side, int k) {
    const TileBorder& more = added_[static_cast<std::size_t>(side * (m_ + 1) + k)];
    TileBorder& border = tiles_[static_cast<std::size_t>(tile)].border;
    for (std::size_t i = 0; i < 4; ++i)
        for (std::size_t w = 0; w < words_; ++w) border.sides[i][w] |= more.sides[i][w];
    if (queued_[static_cast<std::size_t>(tile)] != 0) return;
    queued_[static_cast<std::size_t>(tile)] = 1;
    queue_.push_back(tile);
}

void EdgeAgreement::exchange(const Link& l) {
    const TileBorder &fine = tiles_[static_cast<std::size_t>(l.fine)].border,
                     &coarse = tiles_[static_cast<std::size_t>(l.coarse)].border;
    const int other = opposite(l.side);
    const auto share = [&](int a, int b) {
        if (fine.has(l.side, a) == coarse.has(other, b)) return;
        if (fine.has(l.side, a))
            add(l.coarse, other, b);
        else
            add(l.fine, l.side, a);
    };
    if (!l.same_size) {
        for (int k = 0; k < l.count; ++k) share(k * l.fine_step, l.coarse_first + k * l.coarse_step);
        return;
    }
    for (std::size_t w = 0; w < words_; ++w) {
        std::uint64_t apart =
            fine.sides[static_cast<std::size_t>(l.side)][w] ^ coarse.sides[static_cast<std::size_t>(other)][w];
        for (; apart != 0; apart &= apart - 1) {
            const int k = static_cast<int>(64 * w) + std::countr_zero(apart);
            share(k, k);
        }
    }
}

void EdgeAgreement::agree() {
    queue_.clear();
    queued_.assign(tiles_.size(), 0);
    for (const Link& l : links_) exchange(l);
    for (std::size_t k = 0; k < queue_.size(); ++k) {
        const auto t = static_cast<std::size_t>(queue_[k]);
        queued_[t] = 0;
        for (std::int32_t i = first_link_[t]; i < first_link_[t + 1]; ++i)
            exchange(links_[static_cast<std::size_t>(links_of_[static_cast<std::size_t>(i)])]);
    }
}

}  // namespace scree
