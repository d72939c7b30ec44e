// PageMeasure: the errors of a tile's vertices for the restricted square grid (docs/lod-methods.md, "The bound"). Runs
// on loader threads.
#pragma once

#include <array>

#include "runtime/lod/bisection.h"
#include "runtime/lod/lod_method.h"
#include "runtime/paging/tile_measure.h"

namespace scree {

class PageMeasure final : public TileMeasure {
public:
    /// `metric` uc: the paper's local corrections, no radius; else saturated errors against the finest data with their
    /// balls; 0 where the tile's own vertices are met without the vertex.
    PageMeasure(int tile_cells_log2, ErrorMetric metric);
    void measure(const Dataset& dataset, TileId id, const HeightTileHeader& header,
                 std::span<const SlotVertex> vertices, std::span<VertexCost> costs) const override;

private:
    std::array<Bisection, 2> bisections_;  ///< of even and odd tiles
    ErrorMetric metric_;
};

/// Certified errors of a tile's densest mesh over each quadrant against the finest data, edges whole, metres: 0 of a
/// leaf and where nothing is stored. A child at stride 2 of its samples is that mesh.
std::array<double, 4> base_errors_m(const Dataset& dataset, const HeightTileHeader& header);

}  // namespace scree
