// TileMeasure: what loader threads find out about a height tile's vertices while they have it at hand, so that no frame
// does. Which measure depends on the method of level of detail (runtime/lod/page_measure.h).
#pragma once

#include <span>

#include "common/dataset.h"
#include "common/height_tile.h"
#include "common/mesh/vertex_slot.h"
#include "common/tile_id.h"

namespace scree {

/// What it costs to drop a vertex.
struct VertexCost {
    float error_m = 0;   ///< greatest vertical distance
    float radius_m = 0;  ///< of the ball round the vertex in which that shows
};

class TileMeasure {
public:
    virtual ~TileMeasure() = default;
    /// Fills one entry a vertex, (m+1)^2. Called by several threads at once.
    virtual void measure(const Dataset& dataset, TileId id, const HeightTileHeader& header,
                         std::span<const SlotVertex> vertices, std::span<VertexCost> costs) const = 0;
};

}  // namespace scree
