// What stands under the base's absent samples around data that ends between them: an inset whose rim lies over a void
// (docs/inputs.md). Rows of the base know nothing of it; a sample beside the rim goes on from the heights there, and
// those farther off from that one.
#pragma once

#include "common/result.h"
#include "tools/mosaic/stack.h"
#include "tools/pyramid/deep_tree.h"
#include "tools/pyramid/height_spool.h"

namespace scree {

/// Over the refined tiles of the base level, and some samples around. `grid`: points of the finest lattice; `shift`:
/// halvings from the base's to them. The spool is complete, voids filled. Errors: ErrorCode::io.
Result<HeightSpool::Support> rim_support(const HeightSpool& base, const HeightGrid& grid, const DeepTree& tree,
                                         int tile_cells_log2, int shift);

}  // namespace scree
