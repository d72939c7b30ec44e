#include "runtime/lod/page_measure.h"

#include <vector>

#include "runtime/lod/vertex_errors.h"

namespace scree {

PageMeasure::PageMeasure(int tile_cells_log2, ErrorMetric metric)
    : bisections_{Bisection(tile_cells_log2, false), Bisection(tile_cells_log2, true)}, metric_(metric) {}

void PageMeasure::measure(const Dataset& dataset, TileId id, const HeightTileHeader& header,
                          std::span<const SlotVertex> vertices, std::span<VertexCost> costs) const {
    // A thread's own, kept from tile to tile.
    thread_local std::vector<double> z;
    thread_local std::vector<float> error, radius;
    const Bisection& bisection = bisections_[static_cast<std::size_t>((id.x + id.y) & 1)];
    z.resize(vertices.size());
    error.resize(vertices.size());
    radius.assign(vertices.size(), 0.0f);
    for (std::size_t k = 0; k < z.size(); ++k)
        z[k] = static_cast<double>(vertices[k].height_n) * dataset.height_quantum_m;
    if (metric_ == ErrorMetric::uc) {
        local_corrections(bisection, z, error);
    } else {
        const Lattice& l = dataset.lattice;
        const double spacing_m = l.spacing_m * static_cast<double>(l.step(id.level));
        dropped_errors(bisection, z, error);
        diamond_radii(bisection, z, spacing_m, base_error_m(dataset, header), radius);
        saturate(bisection, z, spacing_m, error, radius);
    }
    for (std::size_t k = 0; k < costs.size(); ++k) costs[k] = {error[k], radius[k]};
}

double base_error_m(const Dataset& dataset, const HeightTileHeader& header) {
    return header.is_leaf() ? 0 : static_cast<double>(header.own.error_n[0]) * dataset.height_quantum_m;
}

}  // namespace scree
