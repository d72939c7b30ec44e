#include "runtime/app/drawn_mesh.h"

#include <gtest/gtest.h>

#include <cstring>
#include <sstream>

#include "tests/runtime/lod/drawn_frame.h"
#include "tests/runtime/lod/grid_mesh.h"
#include "tests/runtime/lod/selection_support.h"

namespace scree {
namespace {

class Mesh : public testing::Test {
protected:
    Mesh()
        : terrain_(shape(), test::rough_heights(12, 400)),
          arena_(test::arena_of(terrain_)),
          patterns_(3),
          residency_(terrain_),
          selector_(terrain_.dataset()) {
        residency_.add_all();
        const Lattice& l = terrain_.lattice();
        camera_ = *look_at({l.x_m(3), l.y_m(61), 130}, {l.x_m(40), l.y_m(20), 0}, 100, 800, 800);
        draws_ = selector_.select({&camera_, 1}, test::with_tau(60), residency_).draws[0];
    }
    static test::TerrainShape shape() { return {}; }
    DrawnMesh mesh() const { return drawn_mesh(terrain_.dataset(), patterns_, draws_, arena_); }
    CrackReport cracks(const DrawnMesh& mesh) const { return count_cracks(terrain_.dataset(), draws_, mesh); }

    test::SyntheticTerrain terrain_;
    CpuArena arena_;
    TilePatterns patterns_;
    test::FakeResidency residency_;
    Selector selector_;
    Camera camera_;
    DrawList draws_;
};

TEST_F(Mesh, IsWholeAndUneven) {
    std::set<int> exponents;
    for (const DrawItem& item : draws_) exponents.insert(3 - item.tile.level + item.geomip);
    ASSERT_GT(exponents.size(), 2u);
    const CrackReport report = cracks(mesh());
    EXPECT_EQ(report.open_edges, 0);
    EXPECT_EQ(report.t_junctions, 0);
    EXPECT_EQ(report.edges, static_cast<std::int64_t>(mesh().corners.size()));
    EXPECT_EQ(test::DrawnFrame(terrain_, draws_).leak(mesh()), "");
}

// 13
TEST_F(Mesh, HasTheTrianglesThatItsPatternsCount) {
    for (const DrawItem& item : draws_) {
        const DrawnMesh one = drawn_mesh(terrain_.dataset(), patterns_, {item}, arena_);
        EXPECT_EQ(one.corners.size(), 3 * pattern_triangles(3, item.geomip, item.edge_mask));
    }
    for (int geomip = 0; geomip < 3; ++geomip)
        for (unsigned mask = 0; mask < kEdgeMaskCount; ++mask) {
            DrawItem item;
            item.height_slot = 0;
            item.geomip = geomip;
            item.edge_mask = mask;
            const DrawnMesh one = drawn_mesh(terrain_.dataset(), patterns_, {item}, arena_);
            EXPECT_EQ(one.corners.size(), 3 * pattern_triangles(3, geomip, mask));
        }
    // 2 x 2 cells with every edge thinned: a fan of 4 round the centre.
    EXPECT_EQ(pattern_triangles(3, 2, 15), 4u);
}

TEST_F(Mesh, OfTheWrongEdgeMaskHasTJunctionsWhereverANeighbourIsDrawn) {
    std::int64_t wrong = 0;
    const DrawList right = draws_;
    for (std::size_t k = 0; k < right.size(); ++k)
        for (const unsigned side : {kEdgeNorth, kEdgeEast, kEdgeSouth, kEdgeWest}) {
            draws_ = right;
            draws_[k].edge_mask ^= side;
            const CrackReport report = cracks(mesh());
            const bool leaks = !test::DrawnFrame(terrain_, draws_).leak(mesh()).empty();
            ASSERT_EQ(report.open_edges > 0, leaks);
            if (!leaks) continue;  // nothing is drawn beyond that edge
            ASSERT_GT(report.t_junctions, 0);
            ++wrong;
        }
    EXPECT_GT(wrong, 20);
}

TEST_F(Mesh, CountsATJunctionForEachEdgeThatAVertexSplits) {
    DrawItem west, east;
    west.tile = {3, 2, 2};
    east.tile = {3, 3, 2};
    for (DrawItem* item : {&west, &east}) item->height_slot = terrain_.index(item->tile);
    draws_ = {west, east};
    EXPECT_EQ(cracks(mesh()).open_edges, 0);
    draws_[0].edge_mask = kEdgeEast;  // 4 long edges against 8 short ones
    EXPECT_EQ(cracks(mesh()).open_edges, 12);
    EXPECT_EQ(cracks(mesh()).t_junctions, 4);
    draws_[0].edge_mask = 0;
    DrawnMesh lifted = mesh();
    for (LatticeVertex& v : lifted.corners)
        if (v.i == 24 && v.j == 19) {
            v.n += 1;
            break;
        }
    EXPECT_GE(cracks(lifted).open_edges, 2);
    EXPECT_EQ(cracks(lifted).t_junctions, 0);  // a gap, and every vertex meets a vertex
}

TEST_F(Mesh, WithOneHeightWrongOnASharedVertexIsOpenThere) {
    DrawnMesh broken = mesh();
    std::int64_t found = 0;
    for (std::size_t t = 0; t < broken.corners.size(); t += 30) {
        const LatticeVertex before = broken.corners[t];
        broken.corners[t].n += 1;
        const CrackReport report = cracks(broken);
        EXPECT_GE(report.open_edges, 2) << "vertex " << before.i << ", " << before.j;
        found += report.open_edges > 0 ? 1 : 0;
        broken.corners[t] = before;
    }
    EXPECT_GT(found, 10);
}

TEST_F(Mesh, WithoutTheTrianglesOfATileThatIsDrawnIsOpenAllRound) {
    DrawList fewer = draws_;
    const DrawItem gone = fewer[fewer.size() / 2];
    fewer.erase(fewer.begin() + static_cast<std::ptrdiff_t>(fewer.size() / 2));
    const DrawnMesh broken = drawn_mesh(terrain_.dataset(), patterns_, fewer, arena_);
    EXPECT_GT(cracks(broken).open_edges, 0) << gone.tile.level;
    // As a draw list without it, the same is a border: holes are count_holes' to find.
    EXPECT_EQ(count_cracks(terrain_.dataset(), fewer, broken).open_edges, 0);
}

TEST_F(Mesh, WithATriangleTwiceOrTurnedOverIsOpen) {
    DrawnMesh twice = mesh();
    for (std::size_t k = 0; k < 3; ++k) twice.corners.push_back(twice.corners[300 + k]);
    EXPECT_GT(cracks(twice).open_edges, 0);
    DrawnMesh turned = mesh();
    std::swap(turned.corners[300], turned.corners[301]);
    EXPECT_GT(cracks(turned).open_edges, 0);
}

TEST_F(Mesh, OfMeshesWithThePatternsTrianglesIsThatOfThePatterns) {
    for (DrawItem& item : draws_) {
        item.morph = 0;
        item.edge_morph = {};
    }
    const DrawnMesh by_patterns = mesh();
    MeshPool pool(by_patterns.corners.size(), 3 * 128);
    DrawList meshed = draws_;
    for (DrawItem& item : meshed) {
        if (item.geomip == 1) continue;  // beside tiles that keep their pattern
        const PatternRange range = patterns_.range(item.geomip, item.edge_mask);
        item.mesh = pool.put(std::span(patterns_.indices()).subspan(range.first, range.count));
        item.geomip = 0;
        item.edge_mask = 0;
    }
    EXPECT_EQ(drawn_mesh(terrain_.dataset(), patterns_, meshed, arena_, &pool).corners, by_patterns.corners);
}

TEST_F(Mesh, WithoutOneVertexOfASharedEdgeHasOneTJunction) {
    DrawItem west, east;
    west.tile = {3, 2, 2};
    east.tile = {3, 3, 2};
    draws_ = {west, east};
    MeshPool pool(10'000, 3 * 128);
    const auto report = [&](bool west_has, bool east_has) {
        for (std::size_t k = 0; k < 2; ++k) {
            test::GridMesh mesh(3);
            mesh.select_stride(1);
            mesh.set(k == 0 ? 8 : 0, 3, k == 0 ? west_has : east_has);
            draws_[k].height_slot = terrain_.index(draws_[k].tile);
            draws_[k].mesh = pool.put(mesh.indices());
        }
        return cracks(drawn_mesh(terrain_.dataset(), patterns_, draws_, arena_, &pool));
    };
    EXPECT_EQ(report(true, true).open_edges, 0);
    EXPECT_EQ(report(false, false).open_edges, 0);
    for (const bool west_has : {false, true}) {
        const CrackReport cracked = report(west_has, !west_has);
        EXPECT_EQ(cracked.open_edges, 3);
        EXPECT_EQ(cracked.t_junctions, 1);
    }
}

TEST_F(Mesh, OfAMeshWithAHoleIsOpenRoundTheHole) {
    test::GridMesh whole(3);
    whole.select_stride(2);
    std::vector<std::uint32_t> indices = whole.indices();
    MeshPool pool(1000, indices.size());
    DrawItem item;
    item.height_slot = terrain_.index(item.tile);
    item.mesh = pool.put(indices);
    draws_ = {item};
    EXPECT_EQ(cracks(drawn_mesh(terrain_.dataset(), patterns_, draws_, arena_, &pool)).open_edges, 0);
    indices.erase(indices.begin() + 3 * 9, indices.begin() + 3 * 10);
    draws_[0].mesh = pool.put(indices);
    EXPECT_GE(cracks(drawn_mesh(terrain_.dataset(), patterns_, draws_, arena_, &pool)).open_edges, 2);
}

TEST_F(Mesh, ComesBackFromItsPlyFile) {
    const test::TemporaryFolder folder;
    const std::string file = folder.file("mesh.ply");
    const DrawnMesh written = mesh();
    ASSERT_TRUE(write_ply(file, terrain_.dataset(), written, camera_.eye, 0).ok());
    const auto bytes = test::read_bytes(file);
    const std::string text(bytes.begin(), bytes.end());
    const std::size_t end = text.find("end_header\n");
    ASSERT_NE(end, std::string::npos);
    std::istringstream header(text.substr(0, end));
    std::string line;
    std::size_t vertices = 0, faces = 0;
    ASSERT_TRUE(std::getline(header, line) && line == "ply");
    ASSERT_TRUE(std::getline(header, line) && line == "format binary_little_endian 1.0");
    while (std::getline(header, line)) {
        if (line.starts_with("element vertex ")) vertices = std::stoul(line.substr(15));
        if (line.starts_with("element face ")) faces = std::stoul(line.substr(13));
    }
    ASSERT_EQ(faces * 3, written.corners.size());
    const std::size_t body = end + 11;
    ASSERT_EQ(text.size(), body + vertices * 24 + faces * 13);
    const std::set<LatticeVertex> distinct(written.corners.begin(), written.corners.end());
    EXPECT_EQ(vertices, distinct.size());
    const Lattice& l = terrain_.lattice();
    for (std::size_t t = 0; t < faces; ++t) {
        const char* face = text.data() + body + vertices * 24 + t * 13;
        ASSERT_EQ(face[0], 3);
        for (std::size_t k = 0; k < 3; ++k) {
            std::int32_t index = -1;
            std::memcpy(&index, face + 1 + 4 * k, 4);
            ASSERT_GE(index, 0);
            ASSERT_LT(static_cast<std::size_t>(index), vertices);
            double p[3];
            std::memcpy(p, text.data() + body + static_cast<std::size_t>(index) * 24, 24);
            const LatticeVertex& v = written.corners[3 * t + k];
            ASSERT_EQ(p[0], l.x_m(v.i));
            ASSERT_EQ(p[1], l.y_m(v.j));
            ASSERT_EQ(p[2], terrain_.dataset().height_m(static_cast<double>(v.n)));
        }
    }
}

TEST_F(Mesh, OfNothingIsAnEmptyPly) {
    const test::TemporaryFolder folder;
    ASSERT_TRUE(write_ply(folder.file("empty.ply"), terrain_.dataset(), {}, camera_.eye, 0).ok());
    EXPECT_FALSE(write_ply(folder.file("no folder/empty.ply"), terrain_.dataset(), {}, camera_.eye, 0).ok());
    EXPECT_EQ(cracks({}).open_edges, 0);
}

}  // namespace
}  // namespace scree
