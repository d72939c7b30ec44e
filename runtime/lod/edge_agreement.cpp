#include "runtime/lod/edge_agreement.h"

#include <bit>

#include "runtime/lod/block_selection.h"

namespace scree {
namespace {

constexpr int opposite(int side) { return (side + 2) % 4; }

bool has(ConstTileBorder side, int k) { return (side[k / 64] >> (k % 64) & 1) != 0; }

// Every 2^log2-th bit, closed up.
std::uint64_t every(std::uint64_t bits, int log2) {
    for (; log2 > 0; --log2) {
        bits &= 0x5555555555555555u;
        bits = (bits | bits >> 1) & 0x3333333333333333u;
        bits = (bits | bits >> 2) & 0x0f0f0f0f0f0f0f0fu;
        bits = (bits | bits >> 4) & 0x00ff00ff00ff00ffu;
        bits = (bits | bits >> 8) & 0x0000ffff0000ffffu;
        bits = (bits | bits >> 16) & 0x00000000ffffffffu;
    }
    return bits;
}

std::size_t words_of_side(int cells) { return (static_cast<std::size_t>(cells) + 64) / 64; }

}  // namespace

EdgeAgreement::EdgeAgreement(const Lattice& lattice)
    : lattice_(lattice), m_(lattice.tile_cells()), words_(words_of_side(m_)) {
    // What a border vertex depends on is the same in even and odd tiles: the tile's own centre has only corners.
    const Bisection bisection(lattice.tile_cells_log2, false);
    std::vector<std::uint8_t> active(bisection.vertex_count());
    added_.resize(4 * static_cast<std::size_t>(m_ + 1) * words());
    TileBorder brings = added_.data();
    for (int side = 0; side < 4; ++side)
        for (int k = 0; k <= m_; ++k, brings += words()) {
            std::fill(active.begin(), active.end(), std::uint8_t{0});
            add_closed(bisection, side_vertex(side, k, m_), active.data());
            border_of(active.data(), brings);
        }
}

std::int64_t EdgeAgreement::slot_cost(const Lattice& lattice) {
    return static_cast<std::int64_t>(4 * words_of_side(lattice.tile_cells()) * sizeof(std::uint64_t) +
                                     4 * (sizeof(Link) + 2 * sizeof(std::int32_t)));
}

void EdgeAgreement::border_of(const std::uint8_t* active, TileBorder border) const {
    std::fill(border, border + words(), std::uint64_t{0});
    for (int side = 0; side < 4; ++side, border += words_) {
        const std::int32_t first = side_vertex(side, 0, m_), step = side_vertex(side, 1, m_) - first;
        for (int k = 0; k <= m_; ++k) border[k / 64] |= std::uint64_t{active[first + k * step] != 0} << (k % 64);
    }
}

void EdgeAgreement::add_border(const Bisection& bisection, ConstTileBorder border, ConstTileBorder own,
                               std::uint8_t* active) const {
    for (int side = 0; side < 4; ++side)
        for (std::size_t w = 0; w < words_; ++w, ++border, ++own)
            for (std::uint64_t more = *border & ~*own; more != 0; more &= more - 1)
                add_closed(bisection, side_vertex(side, static_cast<int>(64 * w) + std::countr_zero(more), m_), active);
}

void EdgeAgreement::link(std::span<const DrawnTile> tiles) {
    borders_.resize(tiles.size() * words());
    links_.clear();
    first_link_.assign(tiles.size() + 1, 0);
    for (std::size_t t = 0; t < tiles.size(); ++t)
        for (int side = 0; side < 4; ++side) {
            const std::int32_t other = tiles[t].beside[static_cast<std::size_t>(side)];
            if (other < 0) continue;
            // Each pair once: from the smaller page, or towards east and south.
            const bool same_size = tiles[static_cast<std::size_t>(other)].id.level == tiles[t].id.level;
            if (same_size && (side == 0 || side == 3)) continue;
            links_.push_back(link_between(tiles, t, side));
            ++first_link_[t + 1];
            ++first_link_[static_cast<std::size_t>(other) + 1];
        }
    for (std::size_t t = 0; t < tiles.size(); ++t) first_link_[t + 1] += first_link_[t];
    links_of_.resize(2 * links_.size());
    queue_.assign(first_link_.begin(), first_link_.end());
    for (std::size_t k = 0; k < links_.size(); ++k)
        for (const std::int32_t t : {links_[k].fine, links_[k].coarse})
            links_of_[static_cast<std::size_t>(queue_[static_cast<std::size_t>(t)]++)] = static_cast<std::int32_t>(k);
}

EdgeAgreement::Link EdgeAgreement::link_between(std::span<const DrawnTile> tiles, std::size_t tile, int side) const {
    const DrawnTile& fine = tiles[tile];
    const std::int32_t other = fine.beside[static_cast<std::size_t>(side)];
    const DrawnTile& coarse = tiles[static_cast<std::size_t>(other)];
    Link link{static_cast<std::int32_t>(tile), other, side};
    link.same_size = fine.id.level == coarse.id.level;
    if (link.same_size) return link;
    const auto edge_stride = [&](const DrawnTile& of, int its_side) {
        return lattice_.step(of.id.level) << (of.geomip + static_cast<int>(of.edge_mask >> its_side & 1u));
    };
    const std::int64_t stride = std::max(edge_stride(fine, side), edge_stride(coarse, opposite(side)));
    const std::int64_t fine_step = lattice_.step(fine.id.level), coarse_step = lattice_.step(coarse.id.level);
    const LatticePoint a = lattice_.corner(fine.id), c = lattice_.corner(coarse.id);
    const std::int64_t offset = side == 0 || side == 2 ? a.i - c.i : a.j - c.j;
    link.fine_step = static_cast<std::int32_t>(stride / fine_step);
    link.coarse_first = static_cast<std::int32_t>(offset / coarse_step);
    link.coarse_step = static_cast<std::int32_t>(stride / coarse_step);
    link.count = static_cast<std::int32_t>(lattice_.tile_extent(fine.id.level) / stride) + 1;
    return link;
}

void EdgeAgreement::add(std::int32_t tile, int side, int k) {
    ConstTileBorder more = added_.data() + static_cast<std::size_t>(side * (m_ + 1) + k) * words();
    TileBorder to = border(static_cast<std::size_t>(tile));
    for (std::size_t w = 0; w < words(); ++w) to[w] |= more[w];
    if (queued_[static_cast<std::size_t>(tile)] != 0) return;
    queued_[static_cast<std::size_t>(tile)] = 1;
    queue_.push_back(tile);
}

void EdgeAgreement::exchange(const Link& l) {
    const int other = opposite(l.side);
    ConstTileBorder fine = border(static_cast<std::size_t>(l.fine)) + static_cast<std::size_t>(l.side) * words_;
    ConstTileBorder coarse = border(static_cast<std::size_t>(l.coarse)) + static_cast<std::size_t>(other) * words_;
    const auto share = [&](int a, int b) {
        if (has(fine, a) == has(coarse, b)) return;
        if (has(fine, a))
            add(l.coarse, other, b);
        else
            add(l.fine, l.side, a);
    };
    if (!l.same_size && words_ == 1) {
        const std::uint64_t all = l.count < 64 ? (std::uint64_t{1} << l.count) - 1 : ~std::uint64_t{0};
        const std::uint64_t a = every(fine[0], std::countr_zero(static_cast<unsigned>(l.fine_step))),
                            b = every(coarse[0] >> l.coarse_first,
                                      std::countr_zero(static_cast<unsigned>(l.coarse_step)));
        for (std::uint64_t apart = (a ^ b) & all; apart != 0; apart &= apart - 1) {
            const int k = std::countr_zero(apart);
            share(k * l.fine_step, l.coarse_first + k * l.coarse_step);
        }
        return;
    }
    if (!l.same_size) {
        for (int k = 0; k < l.count; ++k) share(k * l.fine_step, l.coarse_first + k * l.coarse_step);
        return;
    }
    for (std::size_t w = 0; w < words_; ++w)
        for (std::uint64_t apart = fine[w] ^ coarse[w]; apart != 0; apart &= apart - 1) {
            const int k = static_cast<int>(64 * w) + std::countr_zero(apart);
            share(k, k);
        }
}

void EdgeAgreement::agree() {
    queue_.clear();
    queued_.assign(first_link_.empty() ? 0 : first_link_.size() - 1, 0);
    for (const Link& l : links_) exchange(l);
    for (std::size_t k = 0; k < queue_.size(); ++k) {
        const auto t = static_cast<std::size_t>(queue_[k]);
        queued_[t] = 0;
        for (std::int32_t i = first_link_[t]; i < first_link_[t + 1]; ++i)
            exchange(links_[static_cast<std::size_t>(links_of_[static_cast<std::size_t>(i)])]);
    }
}

}  // namespace scree
