#include "runtime/app/drawn_tile.h"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>

#include "common/mesh/tile_patterns.h"
#include "tests/runtime/lod/grid_mesh.h"
#include "tests/runtime/lod/synthetic_terrain.h"

namespace scree {
namespace {

using Indices = std::vector<std::uint32_t>;

constexpr int kCellsLog2 = 4;
constexpr int kCells = 1 << kCellsLog2;
constexpr std::size_t kLargest = 6 * kCells * kCells;

/// A tile of level 1 of 2 finest cells a sample, somewhere under an eye.
class Tile : public testing::Test {
protected:
    Tile() : random_(test::seed()), pool_(8 * kLargest, 2 * kLargest) {
        lattice_ = *make_lattice(1000, 2000, 5, 4 * kCells, 4 * kCells, kCellsLog2);
        frame_ = make_relative_frame(lattice_, 10, 0.25, {1100.3, 1910.7, 240.1}, 1e-5);
        item_.tile = {1, 1, 0};
        vertices_.resize(slot_vertex_count(kCellsLog2));
        fill_vertex_slot(test::random_samples(random_, kCellsLog2, 400), kCellsLog2, vertices_);
    }
    Result<void> set(DrawnTile& tile, const Indices& mesh) {
        DrawItem item = item_;
        item.mesh = pool_.put(mesh);
        return tile.set(item, vertices_, &pool_);
    }
    glm::dvec2 random_place() {
        const double extent = 2 * kCells;
        const auto one = [&] {
            return test::uniform(random_, 0, 3) == 0 ? static_cast<double>(test::uniform(random_, 0, 2 * kCells))
                                                     : test::uniform_real(random_, 0, extent);
        };
        return {one(), one()};
    }
    /// Found by looking into every triangle, without a table.
    std::optional<glm::dvec3> by_triangles(const Indices& mesh, glm::dvec2 place) const {
        const LatticePoint corner = lattice_.corner(item_.tile);
        for (std::size_t k = 0; k < mesh.size(); k += 3) {
            std::array<glm::dvec2, 3> at;
            std::array<glm::dvec3, 3> position;
            for (std::size_t c = 0; c < 3; ++c) {
                const auto index = static_cast<int>(mesh[k + c]);
                const int i = index % (kCells + 1), j = index / (kCells + 1);
                at[c] = {2 * i, 2 * j};
                position[c] =
                    frame_.position(static_cast<std::int32_t>(corner.i) + 2 * i,
                                    static_cast<std::int32_t>(corner.j) + 2 * j, vertices_[mesh[k + c]].height_n);
            }
            const glm::dmat3 corners(glm::dvec3(at[0], 1), glm::dvec3(at[1], 1), glm::dvec3(at[2], 1));
            const glm::dvec3 weights = glm::inverse(corners) * glm::dvec3(place, 1);
            if (std::min({weights.x, weights.y, weights.z}) < -1e-12) continue;
            return weights.x * position[0] + weights.y * position[1] + weights.z * position[2];
        }
        return std::nullopt;
    }

    test::Random random_;
    MeshPool pool_;
    Lattice lattice_;
    RelativeFrame frame_;
    DrawItem item_;
    std::vector<SlotVertex> vertices_;
};

constexpr double kRounding_m = 1e-9;

TEST_F(Tile, AMeshOfAPatternsTrianglesIsThePattern) {
    SCREE_TRACE_SEED();
    const TilePatterns patterns(kCellsLog2);
    DrawnTile by_pattern(lattice_, frame_), by_mesh(lattice_, frame_);
    for (item_.geomip = 0; item_.geomip < kCellsLog2; ++item_.geomip)
        for (item_.edge_mask = 0; item_.edge_mask < kEdgeMaskCount; ++item_.edge_mask) {
            const PatternRange range = patterns.range(item_.geomip, item_.edge_mask);
            const auto first = patterns.indices().begin() + range.first;
            ASSERT_TRUE(by_pattern.set(item_, vertices_).ok());
            ASSERT_TRUE(set(by_mesh, Indices(first, first + range.count)).ok());
            for (int k = 0; k < 200; ++k) {
                const glm::dvec2 p = random_place();
                ASSERT_LT(glm::length(by_mesh.at(p.x, p.y) - by_pattern.at(p.x, p.y)), kRounding_m)
                    << "geomip " << item_.geomip << ", mask " << item_.edge_mask << " at " << p.x << ", " << p.y;
            }
        }
}

TEST_F(Tile, AnyMeshOfTheGridIsEvaluatedInTheTriangleOverThePlace) {
    SCREE_TRACE_SEED();
    DrawnTile tile(lattice_, frame_);
    std::size_t fewest = kLargest, most = 0;
    for (int round = 0; round < 60; ++round) {
        test::GridMesh mesh(kCellsLog2);
        mesh.select_random(random_, round % 12);
        const Indices indices = mesh.indices();
        fewest = std::min(fewest, indices.size());
        most = std::max(most, indices.size());
        const auto ok = set(tile, indices);
        ASSERT_TRUE(ok.ok()) << ok.error().message;
        for (int k = 0; k < 200; ++k) {
            const glm::dvec2 p = random_place();
            const auto expected = by_triangles(indices, p);
            ASSERT_TRUE(expected.has_value());
            ASSERT_LT(glm::length(tile.at(p.x, p.y) - *expected), kRounding_m) << "at " << p.x << ", " << p.y;
        }
    }
    EXPECT_EQ(fewest, 6u);
    EXPECT_GT(most, 300u);
}

TEST_F(Tile, AfterAMeshAPatternIsAPatternAgain) {
    DrawnTile tile(lattice_, frame_), fresh(lattice_, frame_);
    ASSERT_TRUE(set(tile, test::GridMesh(kCellsLog2).indices()).ok());
    ASSERT_TRUE(tile.set(item_, vertices_).ok() && fresh.set(item_, vertices_).ok());
    EXPECT_EQ(tile.at(7.5, 3.25), fresh.at(7.5, 3.25));
}

TEST_F(Tile, AMeshThatDoesNotCoverItsTileOnceIsRefused) {
    SCREE_TRACE_SEED();
    DrawnTile tile(lattice_, frame_);
    for (int round = 0; round < 40; ++round) {
        test::GridMesh mesh(kCellsLog2);
        mesh.select_random(random_, 5);
        const Indices whole = mesh.indices();
        const auto at =
            static_cast<std::ptrdiff_t>(3 * test::uniform(random_, 0, static_cast<int>(whole.size() / 3) - 1));
        Indices less = whole, twice = whole, turned = whole, strayed = whole;
        less.erase(less.begin() + at, less.begin() + at + 3);
        twice.insert(twice.end(), whole.begin() + at, whole.begin() + at + 3);
        std::swap(turned[static_cast<std::size_t>(at)], turned[static_cast<std::size_t>(at) + 1]);
        strayed[static_cast<std::size_t>(at)] = (kCells + 1) * (kCells + 1);
        ASSERT_TRUE(set(tile, whole).ok());
        for (const Indices& broken : {less, twice, turned, strayed}) {
            if (broken.empty()) continue;
            const auto refused = set(tile, broken);
            ASSERT_FALSE(refused.ok());
            EXPECT_EQ(refused.error().code, ErrorCode::check_failed);
            EXPECT_NE(refused.error().message.find("tile 1/1/0"), std::string::npos);
        }
    }
}

// Whole, each triangle of the right area, but one cell is split the other way: no half of it has one plane.
TEST_F(Tile, ACellSplitAcrossItsDiagonalIsRefused) {
    constexpr std::uint32_t kEast = 1, kSouth = kCells + 1, kFar = kSouth + kEast;
    DrawnTile tile(lattice_, frame_);
    test::GridMesh mesh(kCellsLog2);
    mesh.select_stride(1);
    Indices rest;
    const Indices whole = mesh.indices();
    for (std::size_t k = 0; k < whole.size(); k += 3)
        if (std::any_of(whole.begin() + static_cast<std::ptrdiff_t>(k),
                        whole.begin() + static_cast<std::ptrdiff_t>(k) + 3,
                        [](std::uint32_t index) { return index > kEast && index != kSouth && index != kFar; }))
            rest.insert(rest.end(), &whole[k], &whole[k] + 3);
    ASSERT_EQ(rest.size() + 6, whole.size());
    const auto with = [&](std::initializer_list<std::uint32_t> two) {
        Indices indices = rest;
        indices.insert(indices.end(), two);
        return set(tile, indices).ok();
    };
    EXPECT_TRUE(with({0, kSouth, kFar, 0, kFar, kEast}));
    EXPECT_FALSE(with({0, kSouth, kEast, kEast, kSouth, kFar}));
    EXPECT_FALSE(with({0, kSouth, kSouth + 2, 0, kFar, kEast})) << "a triangle that reaches over others";
    EXPECT_FALSE(with({0, kSouth, kFar, 0, kFar, kEast, 0, 0, kEast})) << "a triangle without area";
}

}  // namespace
}  // namespace scree
