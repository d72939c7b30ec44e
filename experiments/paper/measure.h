// One flight of a BlockWorld by one set of rules: what it draws, costs and errs.
#pragma once

#include <vector>

#include "runtime/lod/block_truth.h"

namespace scree::paper {

/// Means over the frames but the first, which a cache cannot help; errors over the frames that were judged.
struct Figures {
    int frames = 0;
    double triangles = 0, dike_triangles = 0;
    double blocks_in_view = 0;
    double lod_ms = 0;        ///< CPU time of a frame's selection, meshes and dikes: the least of the repeats' means
    double reused_share = 0;  ///< of the blocks in view
    double regenerated = 0, meshes_made = 0, strips_made = 0;  ///< a frame
    SelectionTruth selection;                                  ///< of UC
    std::int64_t judged_reused = 0;                            ///< blocks reused in judged frames
    BlockTruth truth;
};

struct MeasureOptions {
    int judge_every = 4;  ///< frames
    int repeats = 3;      ///< of the timing, without judging between the frames
};

Figures measure(BlockWorld& world, const std::vector<Camera>& flight, const BlockRules& rules,
                const MeasureOptions& options);

}  // namespace scree::paper
