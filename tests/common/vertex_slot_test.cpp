#include "common/mesh/vertex_slot.h"

#include <gtest/gtest.h>

#include "common/mesh/drawn_surface.h"
#include "tests/common/test_support.h"

namespace scree {
namespace {

int birth(int i, int j, int n) {
    int level = 0;
    while (level < n && i % (2 << level) == 0 && j % (2 << level) == 0) ++level;
    return level;
}

/// Every vertex of a slot filled from heights of up to `amplitude` quanta against the surface of the level above.
void expect_next_heights(test::Random& random, int n, int amplitude) {
    const auto samples = test::random_samples(random, n, amplitude);
    std::vector<SlotVertex> slot(slot_vertex_count(n));
    fill_vertex_slot(samples, n, slot);
    const int m = 1 << n;
    const auto at = [&](int i, int j) { return samples[static_cast<std::size_t>(j * (m + 1) + i)]; };
    for (int j = 0; j <= m; ++j)
        for (int i = 0; i <= m; ++i) {
            const SlotVertex& v = slot[static_cast<std::size_t>(j * (m + 1) + i)];
            const int k = birth(i, j, n);
            double expected = at(i, j);
            if (k + 1 < n) {
                expected = drawn_height(samples, n, {k + 1, 0}, i, j, 1).quanta();
            } else if (k + 1 == n && (i != m / 2 || j != m / 2)) {  // the mid-point of a whole edge of the tile
                expected = 0.5 * (i == m / 2 ? double{1} * at(0, j) + at(m, j) : double{1} * at(i, 0) + at(i, m));
            }
            ASSERT_EQ(v.height_n, static_cast<float>(at(i, j)));
            ASSERT_EQ(static_cast<double>(v.next_n), expected) << i << ", " << j << " of 2^" << n << " cells";
        }
}

TEST(VertexSlot, HoldsTheGridOnly) {
    EXPECT_EQ(slot_vertex_count(5), 1089u);
    EXPECT_EQ(slot_bytes(5), 13068u);
}

TEST(VertexSlot, NextHeightsLieOnTheNextLevelsSurface) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int n = 2; n <= 8; ++n) expect_next_heights(random, n, 500'000);
}

TEST(VertexSlot, NextHeightsAreExactInHalvesAtTheExtremes) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int n = 2; n <= 5; ++n) expect_next_heights(random, n, kMaxHeightUnits);
    for (const std::int32_t extreme : {-kMaxHeightUnits, kMaxHeightUnits}) {
        std::vector<std::int32_t> samples(25, extreme);
        samples[2] = extreme - (extreme > 0 ? 1 : -1);  // an odd sum: its half needs all 24 bits of a float
        std::vector<SlotVertex> slot(25);
        fill_vertex_slot(samples, 2, slot);
        EXPECT_EQ(static_cast<double>(slot[1].next_n), 0.5 * (double{1} * samples[0] + samples[2]));
        EXPECT_NE(slot[1].next_n, slot[1].height_n);
    }
}

// Tiles side by side must agree on the vertices of their common edge, whatever lies to either side of it.
TEST(VertexSlot, AnEdgesNextHeightsDependOnTheEdgeAlone) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    const int n = 4, m = 16, pitch = m + 1;
    auto west = test::random_samples(random, n, kMaxHeightUnits);
    auto east = test::random_samples(random, n, kMaxHeightUnits);
    for (int j = 0; j <= m; ++j)
        east[static_cast<std::size_t>(j * pitch)] = west[static_cast<std::size_t>(j * pitch + m)];
    std::vector<SlotVertex> west_slot(slot_vertex_count(n)), east_slot(slot_vertex_count(n));
    fill_vertex_slot(west, n, west_slot);
    fill_vertex_slot(east, n, east_slot);
    for (int j = 0; j <= m; ++j)
        EXPECT_EQ(west_slot[static_cast<std::size_t>(j * pitch + m)].next_n,
                  east_slot[static_cast<std::size_t>(j * pitch)].next_n);
}

}  // namespace
}  // namespace scree
