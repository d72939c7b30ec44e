#include "runtime/view/relative_frame.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>

#include "common/height_tile.h"
#include "tests/runtime/lod/synthetic_terrain.h"

namespace scree {
namespace {

std::array<std::uint32_t, 3> bits(glm::vec3 v) {
    return {std::bit_cast<std::uint32_t>(v.x), std::bit_cast<std::uint32_t>(v.y), std::bit_cast<std::uint32_t>(v.z)};
}

Lattice random_lattice(test::Random& random) {
    const std::int64_t cells = std::int64_t{1} << test::uniform(random, 8, 29);
    auto lattice = make_lattice(test::uniform_real(random, -1e6, 1e6), test::uniform_real(random, -1e7, 1e7),
                                std::exp(test::uniform_real(random, -2, 5)), cells, cells / 2 + 3, 5);
    EXPECT_TRUE(lattice.ok());
    return *lattice;
}

TEST(RelativeFrame, AgreesWithDoublePrecisionFromAnywhere) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int k = 0; k < 100000; ++k) {
        const Lattice l = random_lattice(random);
        const double offset = test::uniform_real(random, -1000, 1000),
                     quantum = std::exp2(test::uniform(random, -6, 2));
        const auto cell = [&](std::int64_t cells) {
            return static_cast<std::int32_t>(test::uniform_real(random, 0, 1) * static_cast<double>(cells));
        };
        const std::int32_t i = cell(l.cells_x), j = cell(l.cells_y),
                           n = test::uniform(random, -kMaxHeightUnits, kMaxHeightUnits);
        const glm::dvec3 vertex{l.x_m(i), l.y_m(j), offset + n * quantum};
        const double away = std::exp(test::uniform_real(random, -2, 18));
        const glm::dvec3 eye =
            vertex + away * glm::dvec3(test::uniform_real(random, -1, 1), test::uniform_real(random, -1, 1),
                                       test::uniform_real(random, -1, 1));
        const glm::dvec3 exact = vertex - eye;
        const glm::vec3 p = make_relative_frame(l, offset, quantum, eye).position(i, j, static_cast<float>(n));
        // Near vertices are exact to their own size; the lattice's grain and what is left of the eye set the rest.
        const glm::dvec3 grain = 3e-7 * (glm::abs(exact) + glm::dvec3(l.spacing_m, l.spacing_m, quantum)) + 2e-9;
        const glm::dvec3 beyond{std::max({0.0, l.x_m(0) - eye.x, eye.x - l.x_m(static_cast<double>(l.cells_x))}),
                                std::max({0.0, eye.y - l.y_m(0), l.y_m(static_cast<double>(l.cells_y)) - eye.y}),
                                std::max(0.0, std::abs(eye.z - offset) - kMaxHeightUnits * quantum)};
        for (int axis = 0; axis < 3; ++axis)
            ASSERT_NEAR(p[axis], exact[axis], grain[axis] + 2e-7 * beyond[axis])
                << "axis " << axis << ", " << away << " m away";
        ASSERT_LE(glm::length(glm::dvec3(p) - exact), 1e-3 * glm::length(exact) + 1e-6 * l.spacing_m + 1e-6 * quantum);
    }
}

// Shared vertices of tiles of any level, from beside the ground to 10,000 km away.
TEST(RelativeFrame, TilesThatShareAVertexPutItAtTheSameBits) {
    SCREE_TRACE_SEED();
    const test::SyntheticTerrain terrain(test::TerrainShape{}, test::rough_heights(test::seed(), 3000));
    const Lattice& l = terrain.lattice();
    const std::int64_t m = l.tile_cells();
    for (const double away : {1.0, 1e3, 1e6, 1e7}) {
        const glm::dvec3 eye =
            glm::dvec3(l.x_m(20.37), l.y_m(11.81), 60) + away * glm::normalize(glm::dvec3(0.3, -0.5, 0.7));
        const RelativeFrame frame =
            make_relative_frame(l, terrain.dataset().height_offset_m, terrain.dataset().height_quantum_m, eye);
        std::unordered_map<std::int64_t, std::array<std::uint32_t, 3>> seen;
        std::int64_t shared = 0;
        for (const TileId id : terrain.tiles()) {
            const LatticePoint c = l.corner(id);
            for (std::int64_t k = 0; k < (m + 1) * (m + 1); ++k) {
                const std::int64_t i = c.i + k % (m + 1) * l.step(id.level), j = c.j + k / (m + 1) * l.step(id.level);
                const glm::vec3 p =
                    frame.position(static_cast<std::int32_t>(i), static_cast<std::int32_t>(j),
                                   static_cast<float>(terrain.tile(id)->samples[static_cast<std::size_t>(k)]));
                const auto [it, inserted] = seen.try_emplace(i * 1000000 + j, bits(p));
                ASSERT_EQ(it->second, bits(p));
                shared += inserted ? 0 : 1;
            }
        }
        EXPECT_GT(shared, 1000);
    }
}

constexpr double kHalfCurvature = 0.5 / 6'371'000;  // 1/m

TEST(RelativeFrame, CurvatureLowersByTheSquareOfTheDistanceOverTwiceTheRadius) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int k = 0; k < 10000; ++k) {
        const Lattice l = random_lattice(random);
        const auto i = static_cast<std::int32_t>(test::uniform_real(random, 0, 1) * static_cast<double>(l.cells_x));
        const auto j = static_cast<std::int32_t>(test::uniform_real(random, 0, 1) * static_cast<double>(l.cells_y));
        const double away = std::exp(test::uniform_real(random, 0, 13));
        const glm::dvec3 eye{l.x_m(i) + away * test::uniform_real(random, -1, 1),
                             l.y_m(j) + away * test::uniform_real(random, -1, 1), 500};
        const glm::vec3 flat = make_relative_frame(l, 0, 0.25, eye).position(i, j, 100);
        const glm::vec3 curved = make_relative_frame(l, 0, 0.25, eye, kHalfCurvature).position(i, j, 100);
        const double dx = l.x_m(i) - eye.x, dy = l.y_m(j) - eye.y, drop = (dx * dx + dy * dy) * kHalfCurvature;
        ASSERT_EQ(flat.x, curved.x);
        ASSERT_EQ(flat.y, curved.y);
        ASSERT_NEAR(static_cast<double>(flat.z) - static_cast<double>(curved.z), drop, 3e-6 * drop + 1e-4);
    }
}

// So that a tile that has morphed wholly and the coarser one that takes its place are the same surface, curved too.
TEST(RelativeFrame, AWhollyMorphedVertexLiesBetweenItsNeighbours) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    auto lattice = make_lattice(300000, 2700000, 30, 5000, 5000, 5);
    ASSERT_TRUE(lattice.ok());
    for (int k = 0; k < 10000; ++k) {
        const int geomip = test::uniform(random, 0, 2), step = 1 << test::uniform(random, 0, 3), d = step << geomip;
        const int i = test::uniform(random, 0, 3) * 2 + 1, j = test::uniform(random, 0, 3) * 2 + 1;
        const bool across = test::uniform(random, 0, 1) == 1;  // the middle of a cell, or else of an edge
        const VertexMorph morph =
            vertex_morph(i << geomip, (across ? j : j - 1) << geomip, 6, {geomip, 0, 1, {1, 1, 1, 1}});
        ASSERT_EQ(morph.weight, 1);
        const glm::dvec3 eye{lattice->x_m(test::uniform_real(random, -2e3, 7e3)), lattice->y_m(2500), 300};
        const RelativeFrame frame = make_relative_frame(*lattice, 0, 0.25, eye, 1000 * kHalfCurvature);
        const int at_i = 1000 + i * d, at_j = 1000 + (across ? j : j - 1) * d, dj = across ? d : 0;
        const glm::dvec3 before = frame.position(at_i - d, at_j - dj, 0),
                         after = frame.position(at_i + d, at_j + dj, 0);
        const glm::dvec3 between = frame.position(at_i, at_j, 0, frame.morph_reach_m2(morph, step));
        ASSERT_NEAR(between.z, 0.5 * (before.z + after.z), 1e-6 * std::abs(between.z) + 1e-4);
    }
}

TEST(RelativeFrame, AReachComesToTheSameBitsFromTilesOfAnyStep) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int k = 0; k < 10000; ++k) {
        RelativeFrame frame;
        frame.spacing_m = static_cast<float>(std::exp(test::uniform_real(random, -2, 5)));
        const float weight = static_cast<float>(test::uniform_real(random, 0, 1));
        const std::int64_t step = std::int64_t{1} << test::uniform(random, 0, 20);
        ASSERT_EQ(std::bit_cast<std::uint32_t>(frame.morph_reach_m2({weight, 64}, step)),
                  std::bit_cast<std::uint32_t>(frame.morph_reach_m2({weight, 16}, 2 * step)));
        ASSERT_GT(frame.morph_reach_m2({1, 1}, step), 0);
    }
}

// 9: the double path sees every motion of a tenth of a metre, and of a millimetre, in UTM.
TEST(RelativeFrame, FollowsMotionsOfAMillimetreInUtm) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    auto lattice = make_lattice(300000, 2700000, 30, 5000, 5000, 5);
    ASSERT_TRUE(lattice.ok());
    for (int k = 0; k < 20000; ++k) {
        const double step = k % 2 == 0 ? 1e-3 : 0.1;
        const std::int32_t i = test::uniform(random, 10, 4990), j = test::uniform(random, 10, 4990);
        const glm::dvec3 eye{lattice->x_m(i + test::uniform_real(random, -1, 1)),
                             lattice->y_m(j + test::uniform_real(random, -1, 1)), 35};
        glm::dvec3 moved = eye;
        const int axis = test::uniform(random, 0, 2);
        moved[axis] += step;
        const glm::vec3 before = make_relative_frame(*lattice, 0, 0.25, eye).position(i, j, 100);
        const glm::vec3 after = make_relative_frame(*lattice, 0, 0.25, moved).position(i, j, 100);
        ASSERT_NEAR(static_cast<double>(before[axis]) - static_cast<double>(after[axis]), step, 1e-5);
        ASSERT_EQ(before[(axis + 1) % 3], after[(axis + 1) % 3]);
    }
}

TEST(RelativeFrame, TenThousandKilometresAwayAMillimetreMovesNothingByMoreThanAFloatsGrain) {
    auto lattice = make_lattice(300000, 2700000, 30, 5000, 5000, 5);
    ASSERT_TRUE(lattice.ok());
    for (int k = 0; k < 2000; ++k) {
        const glm::dvec3 eye = glm::dvec3(3e5, 2.7e6, 0) + glm::dvec3(6e6, -5e6, 6.2e6) + 1e-3 * k;
        const glm::vec3 p = make_relative_frame(*lattice, 0, 0.25, eye).position(2500, 2500, 400);
        const glm::vec3 q = make_relative_frame(*lattice, 0, 0.25, eye + glm::dvec3(1e-3)).position(2500, 2500, 400);
        ASSERT_LE(glm::length(p - q), 2.0f);
        ASSERT_NEAR(p.x, lattice->x_m(2500) - eye.x, 2);
        ASSERT_NEAR(p.y, lattice->y_m(2500) - eye.y, 2);
        ASSERT_NEAR(p.z, 100 - eye.z, 2);
    }
}

TEST(RelativeFrame, ItsLatticePointStaysOnTheDataset) {
    auto lattice = make_lattice(300000, 2700000, 30, 5000, 400, 5);
    ASSERT_TRUE(lattice.ok());
    for (const double far : {-1e18, -1e7, 1e7, 1e18}) {
        const RelativeFrame frame = make_relative_frame(*lattice, 0, 0.25, {far, far, far});
        EXPECT_EQ(frame.i0, far < 0 ? 0 : 5000);
        EXPECT_EQ(frame.j0, far < 0 ? 400 : 0);
        EXPECT_EQ(frame.n0, far < 0 ? -kMaxHeightUnits : kMaxHeightUnits);
        const glm::vec3 p = frame.position(100, 100, 0);
        EXPECT_TRUE(std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z));
    }
}

}  // namespace
}  // namespace scree
