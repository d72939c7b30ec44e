// What it costs to drop a vertex of a block: the paper's local correction, and the saturated exact error with the ball
// that it is seen in (Scree lod, 1.3 and 1.4). Metres throughout. Pure functions; any thread.
#pragma once

#include <span>

#include "runtime/lod/bisection.h"

namespace scree {

/// delta(v) = |z(v) - (z(a) + z(b)) / 2|, a and b the ends of its hypotenuse; 0 for corners. Sizes: vertex_count().
void local_corrections(const Bisection& bisection, std::span<const double> z, std::span<float> delta);

/// E(v): greatest vertical distance of the block's own vertices from the one or two triangles that are split at v;
/// exact but for rounding up to float. Not saturated. 0 for corners. z finite.
void dropped_errors(const Bisection& bisection, std::span<const double> z, std::span<float> error);

/// rho(v): distance from v to the furthest of its hypotenuse's ends and the apexes, in space, rounded up. `reach_m` is
/// added to each: how far the finest data may stand off the block's own vertices. Not nested.
void diamond_radii(const Bisection& bisection, std::span<const double> z, double spacing_m, double reach_m,
                   std::span<float> radius);

/// Makes both monotone up the hierarchy: E(v) = max over its children's E; rho(v) >= |v - c| + rho(c), rounded up.
/// After this whatever selects a vertex selects its parents (N*: Scree lod, 1.4).
void saturate(const Bisection& bisection, std::span<const double> z, double spacing_m, std::span<float> error,
              std::span<float> radius);

}  // namespace scree
