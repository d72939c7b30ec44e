// Where texels must be transparent: an 8-bit alpha pyramid over the presence of finest cells, and its comparison with
// the one bit that BC1 keeps (docs/store-format.md, "Alpha").
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "common/dataset.h"

namespace scree {

/// 8-bit alpha of one texture tile, row-major.
struct AlphaRaster {
    explicit AlphaRaster(int side)
        : size(side), texels(static_cast<std::size_t>(side) * static_cast<std::size_t>(side), 0) {}
    int size;
    std::vector<std::uint8_t> texels;
    std::uint8_t at(int c, int r) const {
        return texels[static_cast<std::size_t>(r) * static_cast<std::size_t>(size) + static_cast<std::size_t>(c)];
    }
};

/// One step of the recursion: (sum of four + 2) >> 2. From `fine` into a quadrant of `coarse` of the same size.
void halve_into_quadrant(const AlphaRaster& fine, int quadrant, AlphaRaster& coarse);

/// Cells under the texels of a level of the texture pyramid: finest ones, or such of 2^step_log2 finest ones a side.
class TexelGrid {
public:
    TexelGrid(const Dataset& dataset, int texture_level, int step_log2 = 0);

    /// The cell, east or south, that holds the centre of texel `texel` (counted over the whole level).
    std::int64_t cell_of_texel(std::int64_t texel) const {
        return log2_cells_ >= 1 ? (2 * texel + 1) << (log2_cells_ - 1) : (2 * texel + 1) >> (1 - log2_cells_);
    }
    /// Whether some texel's centre lies in column (or row) `cell`.
    bool hits(std::int64_t cell) const {
        return log2_cells_ <= 0 || (cell & ((std::int64_t{1} << log2_cells_) - 1)) == std::int64_t{1}
                                                                                          << (log2_cells_ - 1);
    }
    /// First texel at or after the one that holds the west (north) border of `cell`.
    std::int64_t texel_at_cell(std::int64_t cell) const {
        return log2_cells_ >= 0 ? cell >> log2_cells_ : cell << -log2_cells_;
    }

private:
    int log2_cells_;  // a texel is 2^log2_cells_ cells wide
};

/// The cells of a leaf of the heights, each 2^step_log2 finest cells a side.
struct CellPresence {
    std::int64_t first_i = 0, first_j = 0;  ///< its north-west finest cell
    std::int64_t cells = 0;                 ///< a side
    int step_log2 = 0;
    std::span<const std::uint8_t> bits;  ///< cells * cells, or empty: all
    std::int64_t extent() const { return cells << step_log2; }
    /// Of the cell that finest cell (i, j) lies in.
    bool at(std::int64_t i, std::int64_t j) const {
        return bits.empty() ||
               bits[static_cast<std::size_t>(((j - first_j) >> step_log2) * cells + ((i - first_i) >> step_log2))] != 0;
    }
};

/// Sets to 255 the texels of texture tile (x, y) of the grid's level whose centre lies in a present cell of `presence`.
void mark_present(const TexelGrid& grid, std::int64_t x, std::int64_t y, const CellPresence& presence,
                  AlphaRaster& alpha);

struct AlphaDifference {
    std::int64_t texels = 0;
    int mip = 0, column = 0, row = 0;  ///< the first one
};
/// Compares a BC1 chain (coarsest mip first) with the mips of `alpha`: opaque iff >= 128. Nothing: they agree.
std::optional<AlphaDifference> compare_alpha(std::span<const std::uint8_t> chain, int size_log2,
                                             const AlphaRaster& alpha);

}  // namespace scree
