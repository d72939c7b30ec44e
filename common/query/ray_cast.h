// The first point of a ray on the terrain. The ray's distance range is split, from the whole lattice through quarters
// of quarters down to cells, at the distances where it passes the lines between them. Both sides of a line use the one
// number, and what is carried from part to part is the side of the surface that the ray is on: a ray that changes sides
// has hit, so none slips through an edge, a vertex or a step between tiles of different levels.
#pragma once

#include <optional>

#include "common/query/height_source.h"

namespace scree {

struct Vector3 {
    double x = 0, y = 0, z = 0;
};

struct RayHit {
    Vector3 position;
    double distance_m = 0;
    /// The true surface, where the cell is present, passes within so much above or below `position`: surface_error_m,
    /// and more at a step between tiles of different levels.
    double error_bound_m = 0;
};

/// First intersection, from above or below, of the ray with the finest surface that the source holds, over present
/// cells (edges included), at a distance of 0 to max_distance_m (which may be infinite). Metres in the dataset's CRS;
/// `direction` of any length. Tiles whose height range the ray passes above or below are not looked into. Exact but for
/// double rounding: a part in 1e15 or so of the largest coordinate. A source that holds coarse tiles may hit or miss
/// where the true surface does not, by no more than their errors; absent cells are known at the deepest level only.
/// Errors: ErrorCode::usage for a zero direction, a negative distance, what is not a number or beyond 1e15 m; the
/// source's own.
Result<std::optional<RayHit>> cast_ray(HeightSource& source, const Vector3& origin, const Vector3& direction,
                                       double max_distance_m);

}  // namespace scree
