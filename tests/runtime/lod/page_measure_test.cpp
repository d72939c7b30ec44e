// What loader threads find out about a tile's vertices for PageMesher.
#include "runtime/lod/page_measure.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>

#include "tests/runtime/lod/synthetic_terrain.h"

namespace scree {
namespace {

// A vertex whose ball is not in its parents' could be selected where they are not: a crack within the tile. Rounding
// up balls one by one is what breaks it.
TEST(PageMeasure, BallsAreNestedAsTheMesherKeepsThem) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    std::int64_t links = 0;
    for (int world = 0; world < 6; ++world) {
        const auto terrain = test::random_terrain(random);
        const Lattice& l = terrain.lattice();
        const int n = l.tile_cells_log2;
        const PageMeasure measure(n, ErrorMetric::guaranteed);
        std::vector<SlotVertex> vertices(slot_vertex_count(n));
        std::vector<VertexCost> costs(vertices.size());
        for (const TileId id : terrain.tiles()) {
            fill_vertex_slot(terrain.tile(id)->samples, n, vertices);
            measure.measure(terrain.dataset(), id, terrain.tile(id)->header, vertices, costs);
            const Bisection b(n, ((id.x + id.y) & 1) != 0);
            const double side_m = l.spacing_m * static_cast<double>(l.step(id.level));
            for (const std::int32_t v : b.coarse_to_fine()) {
                const VertexCost& cost = costs[static_cast<std::size_t>(v)];
                ASSERT_EQ(std::bit_cast<std::uint32_t>(cost.error_m) & 0xFFFFu, 0u) << "more bits than are kept";
                ASSERT_EQ(std::bit_cast<std::uint32_t>(cost.radius_m) & 0xFFFFu, 0u) << "more bits than are kept";
                for (const std::int32_t child : b.vertex(v).children) {
                    if (child < 0) break;
                    const auto k = static_cast<std::size_t>(v), c = static_cast<std::size_t>(child);
                    const double dx = side_m * (v % b.row() - child % b.row()),
                                 dy = side_m * (v / b.row() - child / b.row()),
                                 dz = static_cast<double>(vertices[k].height_n - vertices[c].height_n) *
                                      terrain.dataset().height_quantum_m;
                    ASSERT_GE(cost.error_m, costs[c].error_m);
                    ASSERT_GE(static_cast<double>(cost.radius_m) * (1 + 1e-12),
                              std::sqrt(dx * dx + dy * dy + dz * dz) + static_cast<double>(costs[c].radius_m));
                    ++links;
                }
            }
        }
    }
    EXPECT_GT(links, 10000);
}

}  // namespace
}  // namespace scree
