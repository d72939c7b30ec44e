// A store judged by the files it was built from, not by itself: the source's samples as `scree samples` writes them,
// the drawn triangles as `shot --mesh` writes them, and arithmetic that shares nothing with either program.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <numbers>
#include <sstream>

#include "tests/common/test_support.h"
#include "tests/programs/pinhole.h"
#include "tests/programs/ply_surface.h"
#include "tests/programs/reports.h"
#include "tests/programs/sample_inputs.h"

namespace scree::test {
namespace {

constexpr int kWidthPx = 480, kHeightPx = 360;
constexpr double kFovDeg = 40;
constexpr double kRoundingPx = 1e-3;  // floats on screen, doubles here

struct Raster {
    double x0 = 0, y0 = 0, dx = 1, dy = 1;
    std::int64_t columns = 0, rows = 0;
    std::vector<double> z;
    double at(std::int64_t column, std::int64_t row) const {
        return z[static_cast<std::size_t>(row * columns + column)];
    }
    Vec3 sample(std::int64_t column, std::int64_t row) const {
        return {x0 + static_cast<double>(column) * dx, y0 - static_cast<double>(row) * dy, at(column, row)};
    }
    bool has_cell(std::int64_t column, std::int64_t row) const {
        if (column < 0 || row < 0 || column + 1 >= columns || row + 1 >= rows) return false;
        return std::isfinite(at(column, row) + at(column + 1, row) + at(column, row + 1) + at(column + 1, row + 1));
    }
    // Does the sample bear terrain?
    bool on_terrain(std::int64_t column, std::int64_t row) const {
        return has_cell(column, row) || has_cell(column - 1, row) || has_cell(column, row - 1) ||
               has_cell(column - 1, row - 1);
    }
};

// One source, by the words of docs/measuring.md.
Raster read_samples(const std::string& path) {
    const auto bytes = read_bytes(path);
    std::size_t at = 0;
    const auto take = [&](auto& value) {
        if (bytes.size() - at < sizeof value) throw std::runtime_error(path + ": cut off");
        std::memcpy(&value, bytes.data() + at, sizeof value);
        at += sizeof value;
    };
    char magic[8];
    std::uint32_t version = 0, count = 0, names = 0, name_bytes = 0, sample_bytes = 0;
    std::uint64_t columns = 0, rows = 0, step = 0, control_offset = 0, offset = 0;
    take(magic);
    take(version);
    take(count);
    take(names);
    take(name_bytes);
    if (std::memcmp(magic, "SCREESMP", 8) != 0 || version != 2 || count != 1 || names != 1)
        throw std::runtime_error(path);
    at += name_bytes;
    for (std::uint64_t* v : {&columns, &rows, &step}) take(*v);
    take(sample_bytes);
    take(control_offset);
    take(offset);
    // A raster that lies along x and y has its four corners for control points.
    Raster r;
    std::array<std::array<double, 2>, 4> corners{};
    at = control_offset;
    for (auto& corner : corners)
        for (double& v : corner) take(v);
    r.x0 = corners[0][0];
    r.y0 = corners[0][1];
    r.dx = (corners[3][0] - r.x0) / static_cast<double>(columns - 1);
    r.dy = (r.y0 - corners[3][1]) / static_cast<double>(rows - 1);
    if (step + 1 < std::max(columns, rows) || corners[1][1] != r.y0 || corners[2][0] != r.x0)
        throw std::runtime_error(path + ": does not lie along x and y");
    at = offset;
    r.columns = static_cast<std::int64_t>(columns);
    r.rows = static_cast<std::int64_t>(rows);
    r.z.resize(columns * rows);
    for (double& z : r.z) {
        float narrow = 0;
        sample_bytes == 8 ? take(z) : (take(narrow), void(z = narrow));
    }
    return r;
}

class Against : public ::testing::Test {
protected:
    void build(const std::string& dem, std::vector<std::string> reading = {}) {
        reading.insert(reading.begin(), dem);
        std::vector<std::string> samples{"samples", "-o", folder_.file("s.smp"), "--quiet"};
        samples.insert(samples.end(), reading.begin(), reading.end());
        const auto run = scree(samples);
        ASSERT_EQ(run.exit_code, 0) << describe(run);
        source_ = read_samples(folder_.file("s.smp"));
        build_store_from(reading, store_);
        const auto info = report_of(scree({"info", store_, "--json", "-"}));
        // What a store cannot see, because it was lost on the way in, it states.
        stated_m_ = info.value("height_quantum_error_m", 0.0) + info.value("warp_error_m", 0.0);
    }

    // Over the raster, in shares of its width and height from the north-west, so many of its widths above the ground.
    Vec3 above(double across, double down, double widths) const {
        const auto column = static_cast<std::int64_t>(across * static_cast<double>(source_.columns - 1));
        const auto row = static_cast<std::int64_t>(down * static_cast<double>(source_.rows - 1));
        Vec3 p = source_.sample(column, row);
        if (!std::isfinite(p[2])) p[2] = 0;
        p[2] += widths * source_.dx * static_cast<double>(source_.columns - 1);
        return p;
    }

    void check_all_poses() {
        const std::array<std::array<Vec3, 2>, 4> poses{{{above(0.5, 0.99, 0.6), above(0.5, 0.45, 0)},
                                                        {above(0.03, 0.95, 0.004), above(0.7, 0.3, 0)},
                                                        {above(0.9, 0.1, 0.02), above(0.2, 0.6, 0)},
                                                        {above(0.45, 0.52, 0.08), above(0.5, 0.45, 0)}}};
        for (const auto& [eye, look] : poses)
            for (const double tau_px : {1.0, 4.0}) check(eye, look, tau_px);
        // Nothing allowed: every sample in its place, at its height, to the quantum.
        check(poses[3][0], poses[3][1], 0);
    }

    void check(const Vec3& eye, const Vec3& look, double tau_px) const;

    TemporaryFolder folder_;
    const std::string store_ = folder_.file("s.scree");
    Raster source_;
    double stated_m_ = 0;
};

void Against::check(const Vec3& eye, const Vec3& look, double tau_px) const {
    SCOPED_TRACE("from " + words_of(eye) + " to " + words_of(look) + " at tau " + std::to_string(tau_px));
    const std::string ply = folder_.file("m.ply");
    const auto report = report_of(scree_view({"shot",        store_,
                                              "-o",          folder_.file("m.png"),
                                              "--mesh",      ply,
                                              "--eye",       words_of(eye),
                                              "--look",      words_of(look),
                                              "--tau",       std::to_string(tau_px),
                                              "--size",      std::to_string(kWidthPx) + "x" + std::to_string(kHeightPx),
                                              "--fov",       std::to_string(kFovDeg),
                                              "--curvature", "off",
                                              "--json",      "-"}));
    ASSERT_FALSE(report.value("budget_limited", true));
    const PlySurface surface(read_ply(ply));
    ASSERT_FALSE(surface.mesh().triangles.empty());
    EXPECT_EQ(surface.mesh().triangles.size(), report.value("triangles", std::size_t{0}));

    const Pinhole picture(eye, look, kFovDeg, kWidthPx, kHeightPx);
    std::int64_t seen = 0, holes = 0;
    double worst_px = 0, worst_excess_px = -std::numeric_limits<double>::infinity(), worst_spread_m = 0;
    for (std::int64_t row = 0; row < source_.rows; ++row)
        for (std::int64_t column = 0; column < source_.columns; ++column) {
            const Vec3 p = source_.sample(column, row);
            if (!std::isfinite(p[2]) || !source_.on_terrain(column, row) || !picture.shows(p)) continue;
            ++seen;
            const auto drawn = surface.height(p[0], p[1]);
            if (!drawn) {
                ++holes;
                continue;
            }
            const double error_px = picture.distance_px(p, *drawn);
            const double stated_px =
                std::max(picture.distance_px(p, p[2] + stated_m_), picture.distance_px(p, p[2] - stated_m_));
            worst_px = std::max(worst_px, error_px);
            worst_excess_px = std::max(worst_excess_px, error_px - tau_px - stated_px);
            worst_spread_m = std::max(worst_spread_m, surface.spread(p[0], p[1]));
        }
    EXPECT_GT(seen, 500);
    EXPECT_EQ(holes, 0) << "of " << seen << " samples in the picture";
    EXPECT_LE(worst_excess_px, kRoundingPx) << "worst error " << worst_px << " px, " << stated_m_ << " m stated";
    EXPECT_LT(worst_spread_m, 1e-6) << "two heights over one sample";

    const PlySurface::Seams seams = surface.seams();
    EXPECT_EQ(seams.cracks, 0) << "of " << seams.edges << " edges";
    EXPECT_EQ(seams.t_junctions, 0);
    EXPECT_EQ(seams.upside_down, 0);
}

TEST_F(Against, ASyntheticLandscapeIsWithinTauOfItsFile) {
    ASSERT_EQ(
        scree({"synth", "-o", folder_.file("land"), "--size", "513", "--imagery-scale", "0", "--quiet"}).exit_code, 0);
    build(folder_.file("land/dem.tif"));
    EXPECT_GT(stated_m_, 0) << "float heights are rounded to the quantum";
    check_all_poses();
}

TEST_F(Against, ScaledIntegersWithVoidsAreWithinTauOfTheirFile) {
    HeightGrid grid = hills(300, 220, 77, 250);
    for (int j = 60; j < 90; ++j)
        for (int i = 100; i < 150; ++i) grid.at(i, j) = 0;
    write_heights_u16(folder_.file("d.tif"), grid, nullptr);
    build(folder_.file("d.tif"), {"--spacing", "40", "--height-scale", "0.25", "--nodata", "0"});
    check_all_poses();
}

TEST_F(Against, TheWindowOfThePaperIsWithinTauOfItsFile) {
    const char* root = std::getenv("SCREE_DATA");
    const std::string dem = std::string(root != nullptr ? root : "") + "/taipei/window_660_30m.tif";
    if (root == nullptr || !std::filesystem::exists(dem))
        GTEST_SKIP() << "needs taipei/window_660_30m.tif in the folder that $SCREE_DATA names";
    build(dem);
    check_all_poses();
}

}  // namespace
}  // namespace scree::test
