#include "tests/programs/ply_surface.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "tests/common/test_support.h"

namespace scree::test {
namespace {

// Two triangles over the unit square, each of its own height at (1, 1) and (0, 0).
PlyMesh square(double z = 0) {
    return {{{0, 0, z}, {1, 0, z + 1}, {1, 1, z + 3}, {0, 1, z + 2}}, {{0, 1, 2}, {0, 2, 3}}};
}

TEST(PlySurface, InterpolatesByBarycentricWeights) {
    const PlySurface s(square());
    EXPECT_EQ(s.height(0, 0), 0);
    EXPECT_EQ(s.height(1, 1), 3);
    EXPECT_NEAR(s.height(0.75, 0.25).value(), 0.75 + 2 * 0.25, 1e-12);  // z = x + 2 y on both
    EXPECT_NEAR(s.height(0.2, 0.9).value(), 0.2 + 2 * 0.9, 1e-12);
    EXPECT_NEAR(s.height(0.5, 0.5).value(), 1.5, 1e-12);
    EXPECT_EQ(s.spread(0.5, 0.5), 0);
    for (const auto& [x, y] : {std::pair{-0.01, 0.5}, {1.01, 0.5}, {0.5, -0.01}, {0.5, 1.01}, {1e300, 0.0}, {NAN, 0.5}})
        EXPECT_EQ(s.height(x, y), std::nullopt) << x << ", " << y;
    EXPECT_EQ(PlySurface({}).height(0, 0), std::nullopt);
}

TEST(PlySurface, NeverAnswersOffTheTriangles) {
    PlyMesh mesh = square();
    mesh.triangles.pop_back();  // the half below the diagonal remains
    const PlySurface s(mesh);
    EXPECT_TRUE(s.height(0.6, 0.5));
    EXPECT_EQ(s.height(0.5, 0.6), std::nullopt);
}

// What a look at every triangle says, for meshes of large and small triangles far from the origin.
TEST(PlySurface, AnswersAsALookAtEveryTriangle) {
    SCREE_TRACE_SEED();
    Random random(seed());
    const auto real = [&](double low, double high) {
        return std::uniform_real_distribution<double>(low, high)(random);
    };
    for (int round = 0; round < 20; ++round) {
        PlyMesh mesh;
        for (int k = 0; k < 60; ++k) {
            const double size = std::exp(real(-3, 3)), x = 400000 + real(0, 30), y = 5300000 + real(0, 20);
            const auto base = static_cast<std::int32_t>(mesh.vertices.size());
            for (int c = 0; c < 3; ++c)
                mesh.vertices.push_back({x + size * real(-1, 1), y + size * real(-1, 1), real(0, 100)});
            mesh.triangles.push_back({base, base + 1, base + 2});
        }
        const PlySurface s(mesh);
        int hits = 0;
        for (int k = 0; k < 300; ++k) {
            const double x = 400000 + real(-5, 35), y = 5300000 + real(-5, 25);
            std::optional<double> highest;
            for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
                const auto one = PlySurface({mesh.vertices, {mesh.triangles[t]}}).height(x, y);
                if (one && (!highest || *one > *highest)) highest = one;
            }
            ASSERT_EQ(s.height(x, y), highest) << x << ", " << y;
            hits += highest ? 1 : 0;
        }
        EXPECT_GT(hits, 10);
    }
}

TEST(PlySurface, CountsBordersAndNoCracksOnAWholeMesh) {
    const auto seams = PlySurface(square()).seams();
    EXPECT_EQ(seams.edges, 5);
    EXPECT_EQ(seams.open_edges, 4);
    EXPECT_EQ(seams.t_junctions, 0);
    EXPECT_EQ(seams.cracks, 0);
    EXPECT_EQ(seams.upside_down, 0);
}

TEST(PlySurface, FindsAVertexThatOneSideDoesNotShare) {
    for (const double z : {1.5, 1.6}) {  // on the diagonal's line, and off it
        SCOPED_TRACE(z);
        PlyMesh mesh = square();
        mesh.vertices.push_back({0.5, 0.5, z});
        mesh.triangles = {{0, 1, 2}, {0, 4, 3}, {4, 2, 3}};
        const PlySurface s(mesh);
        const auto seams = s.seams();
        EXPECT_EQ(seams.open_edges, 4 + 3);
        EXPECT_EQ(seams.cracks, 3);
        EXPECT_EQ(seams.t_junctions, 1);
        EXPECT_NEAR(s.spread(0.5, 0.5), z - 1.5, 1e-12);
    }
}

TEST(PlySurface, FindsAStepBetweenTwoHalves) {
    PlyMesh mesh = square();
    mesh.vertices.push_back({0, 0, 5});
    mesh.vertices.push_back({1, 1, 8});
    mesh.triangles = {{0, 1, 2}, {4, 5, 3}};
    const PlySurface s(mesh);
    EXPECT_EQ(s.seams().cracks, 2);
    EXPECT_EQ(s.seams().open_edges, 6);
    EXPECT_NEAR(s.spread(0.5, 0.5), 5, 1e-12);
    EXPECT_NEAR(s.height(0.5, 0.5).value(), 6.5, 1e-12) << "the higher of the two";
}

TEST(PlySurface, FindsTrianglesTwiceAndUpsideDown) {
    PlyMesh mesh = square();
    mesh.triangles.push_back({0, 2, 3});
    EXPECT_GT(PlySurface(mesh).seams().cracks, 0);
    mesh = square();
    mesh.triangles[1] = {0, 3, 2};
    const auto seams = PlySurface(mesh).seams();
    EXPECT_EQ(seams.upside_down, 1);
    EXPECT_EQ(seams.cracks, 1) << "the diagonal runs twice in one direction";
}

TEST(PlySurface, VerticesAtOnePlaceAreOne) {
    PlyMesh mesh = square();
    mesh.vertices.push_back(mesh.vertices[0]);
    mesh.triangles[1] = {4, 2, 3};
    EXPECT_EQ(PlySurface(mesh).seams().open_edges, 4);
}

TEST(PlyFile, ReadsWhatItWritesAndRefusesTheRest) {
    const TemporaryFolder folder;
    const std::string path = folder.file("m.ply");
    write_ply(path, square(400000.1));
    const PlyMesh mesh = read_ply(path);
    EXPECT_EQ(mesh.vertices, square(400000.1).vertices);
    EXPECT_EQ(mesh.triangles, square().triangles);
    const auto whole = read_bytes(path);
    for (std::size_t size = 0; size < whole.size(); size += 7) {
        write_bytes(path, {whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size)});
        EXPECT_THROW(read_ply(path), std::runtime_error) << size;
    }
    auto damaged = whole;
    damaged.back() = 0x7f;  // the last index
    write_bytes(path, damaged);
    EXPECT_THROW(read_ply(path), std::runtime_error);
    damaged = whole;
    damaged[damaged.size() - 13] = 4;
    write_bytes(path, damaged);
    EXPECT_THROW(read_ply(path), std::runtime_error);
    damaged = whole;
    damaged.push_back(0);
    write_bytes(path, damaged);
    EXPECT_THROW(read_ply(path), std::runtime_error);
}

}  // namespace
}  // namespace scree::test
