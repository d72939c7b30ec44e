// TileRequest: a tile that somebody would like to have, and how much.
#pragma once

#include "common/store/tile_store.h"
#include "common/tile_id.h"

namespace scree {

struct TileRequest {
    TileKind kind = TileKind::height;
    TileId id;
    double priority = 0;  ///< projected error, in tolerances, of what stands in for it; larger is more urgent
};

}  // namespace scree
