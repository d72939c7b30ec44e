// EdgeAgreement: tiles that share an edge draw the same vertices on it. What either side selects both get; a vertex
// comes with what it depends on, which may lie on its tile's other sides, coarser, so the tiles agree after a few
// rounds. The result depends on no order: it is the least that holds every tile's own vertices.
#pragma once

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "common/height_tile.h"
#include "common/lattice.h"
#include "runtime/lod/bisection.h"

namespace scree {

/// Which vertices of a tile's four sides are active, in the order north, east, south, west; bit k: the k-th sample from
/// the west or the north.
struct TileBorder {
    static constexpr std::size_t kWords = ((std::size_t{1} << kMaxTileCellsLog2) + 64) / 64;
    std::array<std::array<std::uint64_t, kWords>, 4> sides{};

    bool has(int side, int k) const {
        return (sides[static_cast<std::size_t>(side)][static_cast<std::size_t>(k) / 64] >> (k % 64) & 1) != 0;
    }
    void set(int side, int k) {
        sides[static_cast<std::size_t>(side)][static_cast<std::size_t>(k) / 64] |= std::uint64_t{1} << (k % 64);
    }
    friend bool operator==(const TileBorder&, const TileBorder&) = default;
};

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

class EdgeAgreement {
public:
    explicit EdgeAgreement(const Lattice& lattice);

    TileBorder border_of(const std::uint8_t* active) const;
    /// Adds to `active`, a byte a vertex, what `border` has and `own` has not, with what it depends on.
    void add_border(const Bisection& bisection, const TileBorder& border, const TileBorder& own,
                    std::uint8_t* active) const;

    /// The tiles of a frame, in place of those before: their place and, for their edges, what they are drawn with.
    struct Tile {
        TileId id;
        int geomip = 0;
        unsigned edge_mask = 0;
        TileBorder border;  ///< own vertices; of agree(), what is drawn
    };
    std::vector<Tile>& tiles() { return tiles_; }
    /// Finds which tiles share edges: whenever tiles, or what they are drawn with, have changed.
    void link();
    void agree();

    static std::int64_t slot_cost() { return sizeof(Tile) + 6 * sizeof(Link); }

private:
    // `fine` is the smaller page or one as large; the shared vertices of pages of two sizes.
    struct Link {
        std::int32_t fine = 0, coarse = 0;
        std::int32_t side = 0;  ///< of `fine`
        bool same_size = true;
        std::int32_t fine_step = 0, coarse_first = 0, coarse_step = 0, count = 0;
    };
    // Tiles by name: open addressing, kept from frame to frame.
    class Index {
    public:
        void reset(std::size_t tiles);
        void add(TileId id, std::int32_t tile);
        std::int32_t find(TileId id) const;

    private:
        std::size_t place(TileId id) const { return TileIdHash{}(id) & (entries_.size() - 1); }
        std::vector<std::pair<TileId, std::int32_t>> entries_;
    };

    void link(std::int32_t tile, int side);
    void add(std::int32_t tile, int side, int k);
    void exchange(const Link& link);

    Lattice lattice_;
    int m_;
    std::size_t words_;              ///< of a side's bits
    std::vector<TileBorder> added_;  ///< by side and place: the border vertices that a border vertex brings along
    std::vector<Tile> tiles_;
    Index index_;
    std::vector<Link> links_;
    std::vector<std::int32_t> first_link_, links_of_, queue_;
    std::vector<std::uint8_t> queued_;
};

}  // namespace scree
