// Height of the terrain at a point, from the finest tile that a source holds there.
#pragma once

#include <functional>
#include <optional>

#include "common/query/height_source.h"

namespace scree {

struct HeightAt {
    double height_m = 0;
    /// The true height is within so much of it (surface_error_m), where the cell is present.
    double error_bound_m = 0;
    /// Of the tile that answered.
    int level = 0;
    /// That tile is a leaf: nothing finer is stored, and it knows every absent cell. Others answer over them too.
    bool finest = false;
};

/// A lattice coordinate of which rounding cannot tell that it is not a whole number is that number: samples lie where
/// Lattice::x_m says, whatever the spacing. `metres` and `origin_m` are what it was computed from.
double on_lattice(double coordinate, double metres, double origin_m, double spacing_m);

/// Height on a tile's surface, drawn whole, in finest cell (ci, cj) at lattice position (i, j); nullopt where the cell
/// is known to be absent.
std::optional<HeightAt> height_in_cell(const Dataset& dataset, TileId id, const HeightTileView& tile, std::int64_t ci,
                                       std::int64_t cj, double i, double j);

/// Height at lattice position (i, j) over finest cell (ci, cj), from the finest tile under its root that the source
/// holds.
Result<std::optional<HeightAt>> height_over_cell(HeightSource& source, std::int64_t ci, std::int64_t cj, double i,
                                                 double j);

/// Asks for the height over each finest cell that touches (x, y): up to four where it lies on lines between cells, none
/// outside the extent or for NaN. Of leaves the deepest answers, the first of such; where there is none, the tile with
/// the least error, its bound wide enough for all. The first error otherwise.
using HeightOverCell =
    std::function<Result<std::optional<HeightAt>>(std::int64_t ci, std::int64_t cj, double i, double j)>;
Result<std::optional<HeightAt>> best_height(const Lattice& lattice, double x_m, double y_m, const HeightOverCell& ask);

/// Height in metres at (x, y) in the dataset's CRS; nullopt where nothing is present. Cells include their edges: on a
/// line between cells any present one answers, and on a line between leaves of two depths the deeper. Looks at a tile a
/// level. Errors: those of the source.
Result<std::optional<HeightAt>> height_at(HeightSource& source, double x_m, double y_m);

}  // namespace scree
