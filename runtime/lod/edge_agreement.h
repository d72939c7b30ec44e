// EdgeAgreement: tiles that share an edge draw the same vertices on it. What either side selects both get; a vertex
// comes with what it depends on, which may lie on its tile's other sides, coarser, so the tiles agree after a few
// rounds. The result depends on no order: it is the least that holds every tile's own vertices.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "common/lattice.h"
#include "runtime/lod/bisection.h"
#include "runtime/lod/selection.h"

namespace scree {

/// Index of the k-th vertex of a side in a tile of m x m cells.
constexpr std::int32_t side_vertex(int side, int k, int m) {
    const int row = m + 1;
    switch (side) {
        case 0:
            return k;
        case 1:
            return k * row + m;
        case 2:
            return m * row + k;
        default:
            return k * row;
    }
}

/// Which vertices of a tile's four sides are active: words() bits a side, in the order north, east, south, west; bit k
/// is the k-th sample from the west or the north.
using TileBorder = std::uint64_t*;
using ConstTileBorder = const std::uint64_t*;

class EdgeAgreement {
public:
    explicit EdgeAgreement(const Lattice& lattice);

    /// Of a border, over its four sides.
    std::size_t words() const { return 4 * words_; }
    void border_of(const std::uint8_t* active, TileBorder border) const;
    bool same(ConstTileBorder a, ConstTileBorder b) const { return std::equal(a, a + words(), b); }
    /// Adds to `active`, a byte a vertex, what `border` has and `own` has not, with what it depends on.
    void add_border(const Bisection& bisection, ConstTileBorder border, ConstTileBorder own,
                    std::uint8_t* active) const;

    /// The tiles of a frame, in place of those before. Their borders are nobody's until written.
    void link(std::span<const DrawnTile> tiles);
    /// Of a tile: its own vertices, and after agree() what is drawn.
    TileBorder border(std::size_t tile) { return borders_.data() + tile * words(); }
    ConstTileBorder border(std::size_t tile) const { return borders_.data() + tile * words(); }
    void agree();

    static std::int64_t slot_cost(const Lattice& lattice);

private:
    // `fine` is the smaller page or one as large; the shared vertices of pages of two sizes.
    struct Link {
        std::int32_t fine = 0, coarse = 0;
        std::int32_t side = 0;  ///< of `fine`
        bool same_size = true;
        std::int32_t fine_step = 0, coarse_first = 0, coarse_step = 0, count = 0;
    };

    Link link_between(std::span<const DrawnTile> tiles, std::size_t fine, int side) const;
    void add(std::int32_t tile, int side, int k);
    void exchange(const Link& link);

    Lattice lattice_;
    int m_;
    std::size_t words_;                 ///< of a side's bits
    std::vector<std::uint64_t> added_;  ///< by side and place: the border vertices that a border vertex brings along
    std::vector<std::uint64_t> borders_;
    std::vector<Link> links_;
    std::vector<std::int32_t> first_link_, links_of_, queue_;
    std::vector<std::uint8_t> queued_;
};

}  // namespace scree
