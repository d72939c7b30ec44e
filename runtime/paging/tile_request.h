// TileRequest: a tile that somebody would like to have, and how much.
#pragma once

#include "common/store/tile_store.h"
#include "common/tile_id.h"

namespace scree {

struct TileRequest {
    TileKind kind = TileKind::height;
    TileId id;
    double priority = 0;  ///< projected error, in tolerances, of what stands in for it; larger is more urgent
    /// Wanted soon, not now: loaded when nothing else is, and never in the place of a tile used lately.
    bool prefetch = false;
};

}  // namespace scree
