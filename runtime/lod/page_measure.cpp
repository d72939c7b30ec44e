#include "runtime/lod/page_measure.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "common/mesh/geometric_error.h"
#include "runtime/lod/block_kernels.h"
#include "runtime/lod/vertex_errors.h"

namespace scree {
namespace {

// What the tile's own vertices are off by, in the quadrants that a vertex's triangles reach.
void add_base_errors(const Bisection& bisection, const std::array<double, 4>& base_m, std::span<float> error) {
    const int half = bisection.cells() / 2;
    for (const std::int32_t v : bisection.coarse_to_fine()) {
        float& cost = error[static_cast<std::size_t>(v)];
        if (!(cost > 0)) continue;
        const int i = v % bisection.row(), j = v / bisection.row();
        double greatest = 0;
        for (int q = 0; q < 4; ++q) {
            const bool east = (q & 1) != 0, south = q >> 1 != 0;
            if ((east ? i >= half : i <= half) && (south ? j >= half : j <= half))
                greatest = std::max(greatest, base_m[static_cast<std::size_t>(q)]);
        }
        cost = round_up_to_float(static_cast<double>(cost) + greatest);
    }
}

}  // namespace

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
        const std::array<double, 4> base_m = base_errors_m(dataset, header);
        dropped_errors(bisection, z, error);
        const auto [low, high] = std::minmax_element(z.begin(), z.end());
        const double side_m = spacing_m * bisection.cells(), reach_m = std::hypot(side_m, side_m, *high - *low) / 2;
        // What the balls are enlarged by for single precision: block_kernels.h.
        diamond_radii(bisection, z, spacing_m, *std::max_element(base_m.begin(), base_m.end()) + kBallPad * reach_m,
                      radius);
        saturate(bisection, z, spacing_m, error, radius);
        if (!header.is_leaf()) {
            add_base_errors(bisection, base_m, error);
            saturate(bisection, z, spacing_m, error, radius);
        }
    }
    for (std::size_t k = 0; k < costs.size(); ++k) costs[k] = {error[k], radius[k]};
}

std::array<double, 4> base_errors_m(const Dataset& dataset, const HeightTileHeader& header) {
    std::array<double, 4> base_m{};
    const auto beyond = dataset.lattice.tile_cells_log2 > 1 ? std::size_t{1} : std::size_t{0};
    for (std::size_t q = 0; q < 4; ++q)
        if ((header.child_mask >> q & 1) != 0) {
            // A tile of 2 x 2 cells has no second stride.
            const float error_n = beyond == 1 ? header.children[q].error_n[1] : header.own.error_n[0];
            base_m[q] = static_cast<double>(error_n) * dataset.height_quantum_m;
        }
    return base_m;
}

}  // namespace scree
