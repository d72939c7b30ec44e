// EdgeField: how far it is from any place of a dataset to where its ground ends: at the end of its box, at a slanted
// border, at a void. A raster over the whole dataset, made once of what its coarse textures say of where there is
// ground, for drawing ends that dissolve. No OpenGL. Unchanging once made: any thread.
//
// Cells are root-aligned: a tile of any level, and a part of one, is a whole number of cells, or lies within one.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/store/tile_store.h"

namespace scree {

/// What dissolves, metres from the end inwards, in views that see all of a dataset or a part: 1.5 % of its longer side.
double edge_band_m(const Lattice& lattice);

/// Cells from each cell's middle to the nearest middle of one where `present` is 0, all cells beyond the raster being
/// such; exact up to `most`, and from there on at least that. Row-major. Two passes, as in Felzenszwalb and
/// Huttenlocher, "Distance transforms of sampled functions" (2012).
std::vector<float> distance_to_absence(std::span<const std::uint8_t> present, std::int64_t columns, float most);

/// Makes present what is absent and narrow: a cell stays absent where a wholly absent square of `width` cells (1 to 64)
/// lies no more than width / 2 cells from it, diagonally as well. All cells beyond the raster are absent.
std::vector<std::uint8_t> without_narrow_absence(std::span<const std::uint8_t> present, std::int64_t columns,
                                                 std::int64_t width);

class EdgeField {
public:
    /// 1 / kFar of the band is what values count in; kFar: as far from an end as the band is wide, or farther.
    static constexpr std::uint8_t kFar = 255;
    /// Cells at most, which makes the longer side of a square dataset 360 to 720 of them.
    static constexpr std::int64_t kMostCells = std::int64_t{1} << 19;

    struct Shape {
        int root_cells_log2 = 0;  ///< cells along a root tile's side
        std::int64_t columns = 0, rows = 0;
        double cell_side = 1;  ///< in finest cells of the lattice
    };
    /// The finest that the textures and so many cells allow.
    static Shape shape_of(const Dataset& dataset, std::int64_t most_cells);
    static Shape shape_of(const Lattice& lattice, int most_root_cells_log2, std::int64_t most_cells = kMostCells);
    /// Of memory while it is used, here and in OpenGL; `of_two`: and while the next one is made beside it.
    static std::int64_t bytes(const Shape& shape, bool of_two);
    /// What so many bytes allow, 1 at least and kMostCells at most.
    static std::int64_t cells_in(std::int64_t bytes, bool of_two);

    /// `present`: what has ground, columns x rows of the shape. The field is 0 wherever the ground may end, which is
    /// anywhere between the middles of a cell that is present and one that is not.
    EdgeField(const Shape& shape, std::span<const std::uint8_t> present, double band_cells);
    /// Of what has ground, as textures are drawn from afar. Voids narrower than the band are none: more would be hidden
    /// than is missing. A texture that is damaged or missing is stood in for by the one above it. Null where the store
    /// cannot be read at all.
    static std::shared_ptr<const EdgeField> read(const TileStore& store, double band_m, std::int64_t most_cells);

    /// Of a dataset that has ground in all of so many finest cells, and nowhere else.
    static std::shared_ptr<const EdgeField> of_box(const Lattice& lattice, std::int64_t cells_x, std::int64_t cells_y,
                                                   double band_m);

    const Shape& shape() const { return shape_; }
    /// Row-major, north-west first.
    std::span<const std::uint8_t> values() const { return values_; }
    /// Whether any of the square is within the band, by values between cells' middles that are interpolated. The
    /// square: number {x, y}, of 2^depth to a root tile's side.
    bool is_near_end(int depth, std::int64_t x, std::int64_t y) const;

private:
    /// Least values of squares of 2^k cells, k = 1 .., and of the cells round them.
    struct Level {
        std::int64_t columns = 0, rows = 0;
        std::vector<std::uint8_t> least;
    };
    void make_levels();

    Shape shape_;
    std::vector<std::uint8_t> values_;
    std::vector<Level> levels_;
};

}  // namespace scree
