// ProbedSurface: heights of a drawn surface at any place, in double but for the morphed heights, so that two frames
// from almost the same eye can be compared to a fraction of a millimetre.
#pragma once

#include <vector>

#include "runtime/app/cpu_arena.h"
#include "runtime/lod/draw_list.h"
#include "tests/runtime/lod/synthetic_terrain.h"

namespace scree::test {

class ProbedSurface {
public:
    ProbedSurface(const SyntheticTerrain& terrain, const CpuArena& arena) : terrain_(terrain), arena_(arena) {}
    /// Heights, metres, over places (i, j) in finest cells as seen from `eye`; NaN where nothing is drawn.
    std::vector<double> heights_m(const DrawList& draws, const std::vector<glm::dvec2>& places, glm::dvec3 eye,
                                  double half_curvature) const;

private:
    double height_m(const DrawItem& item, glm::dvec2 place, glm::dvec3 eye, double half_curvature) const;

    const SyntheticTerrain& terrain_;
    const CpuArena& arena_;
};

}  // namespace scree::test
