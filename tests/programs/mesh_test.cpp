// The mesh that `shot --mesh` writes, judged without the project's own code: cracks, heights and errors in pixels.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <numbers>
#include <sstream>

#include "tests/common/test_support.h"
#include "tests/programs/pinhole.h"
#include "tests/programs/ply_surface.h"
#include "tests/programs/reports.h"
#include "tests/programs/sample_inputs.h"

namespace scree::test {
namespace {

class DrawnMeshFile : public ::testing::Test {
protected:
    static constexpr int kWidth = 300, kHeight = 220;
    void SetUp() override {
        for (int j = 60; j < 90; ++j)
            for (int i = 100; i < 150; ++i) grid_.at(i, j) = 0;
        write_heights_u16(folder_.file("d.tif"), grid_, &place_, "0");
        build_store_from({folder_.file("d.tif"), "--tile-size", "17", "--texture-size", "16"}, folder_.file("d.scree"));
    }
    bool present(int i, int j) const {
        return i >= 0 && j >= 0 && i + 1 < kWidth && j + 1 < kHeight && grid_.at(i, j) != 0 &&
               grid_.at(i + 1, j) != 0 && grid_.at(i, j + 1) != 0 && grid_.at(i + 1, j + 1) != 0;
    }
    Vec3 sample(int i, int j) const { return {place_.x + i * place_.step, place_.y - j * place_.step, grid_.at(i, j)}; }

    void check(const Vec3& eye, const Vec3& look, double tau, const std::string& budget);
    void check(const Vec3& eye, const Vec3& look, double tau, const std::string& budget, bool morph);

    TemporaryFolder folder_;
    Place place_{352000, 2778000, 25, 3826};
    HeightGrid grid_ = hills(kWidth, kHeight, 21, 250);
};

void DrawnMeshFile::check(const Vec3& eye, const Vec3& look, double tau, const std::string& budget) {
    for (const bool morph : {false, true}) check(eye, look, tau, budget, morph);
}

void DrawnMeshFile::check(const Vec3& eye, const Vec3& look, double tau, const std::string& budget, bool morph) {
    SCOPED_TRACE("from " + words_of(eye) + " at tau " + std::to_string(tau) + (morph ? " with morph" : ""));
    const std::string ply = folder_.file("m.ply");
    std::vector<std::string> words{"shot",        folder_.file("d.scree"),
                                   "-o",          folder_.file("m.png"),
                                   "--mesh",      ply,
                                   "--eye",       words_of(eye),
                                   "--look",      words_of(look),
                                   "--tau",       std::to_string(tau),
                                   "--size",      "400x300",
                                   "--budget",    budget,
                                   "--curvature", "off",
                                   "--json",      "-"};
    if (!morph) words.push_back("--no-morph");
    const auto run = scree_view(words);
    const auto report = report_of(run);
    const double promised = std::max(tau, report.value("max_bound_px", 1e9));
    const PlyMesh mesh = read_ply(ply);
    ASSERT_FALSE(mesh.triangles.empty());
    EXPECT_EQ(mesh.triangles.size(), report.value("triangles", std::size_t{0}));

    // Vertices stand on the lattice; those over valid samples have the source's height, to the bit, unless they move.
    std::vector<std::array<int, 2>> lattice;
    for (const Vec3& v : mesh.vertices) {
        const double i = (v[0] - place_.x) / place_.step, j = (place_.y - v[1]) / place_.step;
        ASSERT_EQ(i, std::nearbyint(i));
        ASSERT_EQ(j, std::nearbyint(j));
        lattice.push_back({static_cast<int>(i), static_cast<int>(j)});
        const float source = i < kWidth && j < kHeight ? grid_.at(static_cast<int>(i), static_cast<int>(j)) : 0;
        if (source != 0 && !morph) {
            ASSERT_EQ(v[2], source) << i << ", " << j;
        }
    }

    // Which triangle covers each quarter of a cell's middle, and the drawn height of each lattice vertex. Everything in
    // units of a quarter cell; (2, 1) in a cell lies on no edge.
    std::map<std::pair<int, int>, int> cover;  // cell -> triangles over its point
    std::map<std::pair<int, int>, double> drawn;
    std::map<std::pair<std::int32_t, std::int32_t>, int> directed;
    for (const auto& t : mesh.triangles) {
        const auto &a = lattice[static_cast<std::size_t>(t[0])], &b = lattice[static_cast<std::size_t>(t[1])],
                   &c = lattice[static_cast<std::size_t>(t[2])];
        for (std::size_t k = 0; k < 3; ++k) ++directed[{t[k], t[(k + 1) % 3]}];
        const auto side = [](double px, double py, double qx, double qy, double x, double y) {
            return (qx - px) * (y - py) - (qy - py) * (x - px);
        };
        const double area = side(a[0], a[1], b[0], b[1], c[0], c[1]);
        ASSERT_LT(area, 0) << "not counter-clockwise from above (j runs south)";
        for (int j = std::min({a[1], b[1], c[1]}); j <= std::max({a[1], b[1], c[1]}); ++j)
            for (int i = std::min({a[0], b[0], c[0]}); i <= std::max({a[0], b[0], c[0]}); ++i) {
                const auto weights = [&](double x, double y) {
                    return Vec3{side(b[0], b[1], c[0], c[1], x, y) / area, side(c[0], c[1], a[0], a[1], x, y) / area,
                                side(a[0], a[1], b[0], b[1], x, y) / area};
                };
                const Vec3 middle = weights(i + 0.5, j + 0.25);
                if (middle[0] > 0 && middle[1] > 0 && middle[2] > 0) ++cover[{i, j}];
                const Vec3 w = weights(i, j);
                if (w[0] < 0 || w[1] < 0 || w[2] < 0) continue;
                const double z = w[0] * mesh.vertices[static_cast<std::size_t>(t[0])][2] +
                                 w[1] * mesh.vertices[static_cast<std::size_t>(t[1])][2] +
                                 w[2] * mesh.vertices[static_cast<std::size_t>(t[2])][2];
                const auto [known, fresh] = drawn.try_emplace({i, j}, z);
                ASSERT_NEAR(known->second, z, 1e-6)
                    << "two heights at " << i << ", " << j << (fresh ? " (not a number)" : "");
            }
    }
    for (const auto& [cell, count] : cover)
        ASSERT_EQ(count, 1) << "cell " << cell.first << ", " << cell.second << " is drawn twice";

    // An edge is used once a direction. One used in a single direction must be the border of what is drawn.
    std::int64_t inner = 0;
    for (const auto& [edge, uses] : directed) {
        ASSERT_EQ(uses, 1);
        if (directed.contains({edge.second, edge.first})) {
            ++inner;
            continue;
        }
        const auto &a = lattice[static_cast<std::size_t>(edge.first)],
                   &b = lattice[static_cast<std::size_t>(edge.second)];
        // The triangle lies to its left seen from above: (dy, -dx) in (i, j). Each cell along the other side is looked
        // at.
        const int dx = b[0] - a[0], dy = b[1] - a[1], length = std::max(std::abs(dx), std::abs(dy));
        ASSERT_TRUE(dx == 0 || dy == 0 || std::abs(dx) == std::abs(dy));
        if (dx != 0 && dy != 0) {
            ADD_FAILURE() << "a diagonal on the border, from " << a[0] << ", " << a[1];
            continue;
        }
        for (int k = 0; k < length; ++k) {
            const int outside_i = dx == 0 ? (dy > 0 ? a[0] - 1 : a[0]) : std::min(a[0], b[0]) + k;
            const int outside_j = dx == 0 ? std::min(a[1], b[1]) + k : (dx > 0 ? a[1] : a[1] - 1);
            ASSERT_FALSE(cover.contains({outside_i, outside_j}))
                << "open edge " << a[0] << ", " << a[1] << " - " << b[0] << ", " << b[1] << " beside drawn cell "
                << outside_i << ", " << outside_j;
        }
    }
    EXPECT_GT(inner, 0);

    // Each present cell in the picture is covered, and no vertex of one strays further than promised.
    const Pinhole camera(eye, look, 40, 400, 300);
    double worst_px = 0;
    std::int64_t seen = 0;
    for (int j = 0; j + 1 < kHeight; ++j)
        for (int i = 0; i + 1 < kWidth; ++i) {
            if (!present(i, j)) continue;
            const Vec3 centre{
                place_.x + (i + 0.5) * place_.step, place_.y - (j + 0.5) * place_.step,
                (grid_.at(i, j) + grid_.at(i + 1, j) + grid_.at(i, j + 1) + grid_.at(i + 1, j + 1)) / 4.0};
            ASSERT_TRUE(!camera.shows(centre) || cover.contains({i, j})) << "hole at cell " << i << ", " << j;
            for (const auto& [vi, vj] : {std::pair{i, j}, {i + 1, j}, {i, j + 1}, {i + 1, j + 1}}) {
                const Vec3 p = sample(vi, vj);
                const auto z = drawn.find({vi, vj});
                if (!camera.shows(p) || z == drawn.end() || !camera.shows({p[0], p[1], z->second})) continue;
                worst_px = std::max(worst_px, camera.distance_px(p, z->second));
                ++seen;
            }
        }
    EXPECT_GT(seen, 100);
    EXPECT_LE(worst_px, promised + 1e-3);
    EXPECT_TRUE(report.value("budget_limited", false) || worst_px <= tau + 1e-3) << worst_px;
}

TEST_F(DrawnMeshFile, IsWholeAndWithinTauOfTheSource) {
    const auto at = [&](double i, double j, double z) {
        return Vec3{place_.x + i * place_.step, place_.y - j * place_.step, z};
    };
    const std::array<std::array<Vec3, 2>, 5> poses{{{at(150, 330, 4000), at(150, 110, 1000)},
                                                    {at(20, 200, 1650), at(200, 60, 1100)},
                                                    {at(280, 20, 1500), at(200, 120, 900)},
                                                    {at(151, 111, 9000), at(150, 110, 1000)},
                                                    {at(90, 75, 1700), at(130, 70, 1000)}}};
    for (const auto& [eye, look] : poses)
        for (const double tau : {0.5, 4.0}) check(eye, look, tau, "64M");
}

TEST_F(DrawnMeshFile, StaysWholeUnderATinyBudget) {
    const auto at = [&](double i, double j, double z) {
        return Vec3{place_.x + i * place_.step, place_.y - j * place_.step, z};
    };
    for (const char* budget : {"2700K", "3M", "4M"}) {
        SCOPED_TRACE(budget);
        check(at(20, 200, 1650), at(200, 60, 1100), 0.5, budget);
        check(at(150, 330, 4000), at(150, 110, 1000), 0.5, budget);
    }
}

}  // namespace
}  // namespace scree::test
