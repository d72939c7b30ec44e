// measure_warp_error against the words of its header, sample by sample, with PROJ's own places.
#include "tools/pyramid/warp_error.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/programs/sample_inputs.h"
#include "tests/tools/mosaic/mosaic_support.h"

namespace scree {
namespace {

struct Built {
    MosaicPlan plan;
    std::unique_ptr<HeightStack> stack;
    std::unique_ptr<HeightSpool> spool;
    HeightQuantizer quantizer;
    std::vector<double> height_m;     // of lattice points, as stored
    std::vector<std::uint8_t> valid;  // of lattice points
};

Built build(const std::vector<std::string>& paths, const std::string& temporary) {
    MosaicRequest request;
    request.heights = paths;
    request.crs = "EPSG:32633";
    auto plan = plan_mosaic(request);
    EXPECT_TRUE(plan.ok());
    Built b{std::move(*plan), nullptr, nullptr, {}, {}, {}};
    b.plan.base_shift = 0;
    StackOptions options;
    options.temporary = temporary;
    b.stack = std::move(*HeightStack::read(b.plan.heights, b.plan.height_layers, false, options, {}));
    const Lattice& l = b.plan.lattice;
    auto grid = std::move(*b.stack->on(b.plan.finest_grid(), b.plan.crs));
    const std::int64_t width = l.cells_x + 1, height = l.cells_y + 1;
    b.spool = std::move(*HeightSpool::create(temporary, width, height, true));
    b.quantizer = {1, 0, 0, 1.0 / 64};
    for (std::int64_t j = 0; j < height; ++j) {
        std::vector<double> row(static_cast<std::size_t>(width));
        EXPECT_TRUE(grid->sample(0, j, width, 1, 1, row).ok());
        for (double& v : row) {
            if (!std::isfinite(v)) v = NAN;
            b.valid.push_back(std::isnan(v) ? 0 : 1);
            b.height_m.push_back(std::nearbyint(v * 64) / 64);
        }
        EXPECT_TRUE(b.spool->append(row).ok());
    }
    EXPECT_TRUE(b.spool->finish().ok());
    return b;
}

// On the plane through three lattice points, by barycentric coordinates.
struct Corner {
    double u, v, z;
};
std::optional<double> on_triangle(const Corner& a, const Corner& b, const Corner& c, double u, double v) {
    const double area = (b.u - a.u) * (c.v - a.v) - (c.u - a.u) * (b.v - a.v);
    const double wb = ((u - a.u) * (c.v - a.v) - (c.u - a.u) * (v - a.v)) / area;
    const double wc = ((b.u - a.u) * (v - a.v) - (u - a.u) * (b.v - a.v)) / area;
    if (wb < -1e-9 || wc < -1e-9 || wb + wc > 1 + 1e-9) return std::nullopt;
    return a.z + wb * (b.z - a.z) + wc * (c.z - a.z);
}

std::optional<double> surface(const Built& b, double i, double j) {
    const Lattice& l = b.plan.lattice;
    const auto ci = static_cast<std::int64_t>(std::floor(i)), cj = static_cast<std::int64_t>(std::floor(j));
    if (ci < 0 || cj < 0 || ci >= l.cells_x || cj >= l.cells_y) return std::nullopt;
    std::array<Corner, 4> corners{};  // nw, ne, sw, se
    for (std::int64_t k = 0; k < 4; ++k) {
        const auto at = static_cast<std::size_t>((cj + k / 2) * (l.cells_x + 1) + ci + k % 2);
        if (b.valid[at] == 0) return std::nullopt;
        corners[static_cast<std::size_t>(k)] = {static_cast<double>(k % 2), static_cast<double>(k / 2), b.height_m[at]};
    }
    const auto& [nw, ne, sw, se] = corners;
    const double u = i - static_cast<double>(ci), v = j - static_cast<double>(cj);
    // The union jack: the diagonal joins north-west and south-east where ci + cj is even.
    const bool even = (ci + cj) % 2 == 0;
    const auto first = even ? on_triangle(nw, ne, se, u, v) : on_triangle(nw, ne, sw, u, v);
    return first ? first : even ? on_triangle(nw, se, sw, u, v) : on_triangle(ne, se, sw, u, v);
}

class WarpErrors : public ::testing::Test {
protected:
    WarpError measure(const Built& b) {
        auto error = measure_warp_error({*b.stack, false, *b.spool, b.plan, b.quantizer});
        EXPECT_TRUE(error.ok());
        return *error;
    }
    test::TemporaryFolder folder_;
};

TEST_F(WarpErrors, AreThoseOfEverySampleAtItsPlace) {
    test::HeightGrid grid = test::hills(130, 100, 3, 200);
    for (int j = 30; j < 40; ++j)
        for (int i = 30; i < 50; ++i) grid.at(i, j) = NAN;
    test::write_geographic_heights(folder_.file("a.tif"), grid);
    const Built b = build({folder_.file("a.tif")}, folder_.file("t"));
    const WarpError measured = measure(b);
    auto transform = CrsTransform::make(*Crs::parse("EPSG:4326"), *Crs::parse("EPSG:32633"));
    ASSERT_TRUE(transform.ok());
    double greatest = 0, squares = 0;
    std::int64_t samples = 0;
    for (int r = 0; r < grid.height; ++r)
        for (int c = 0; c < grid.width; ++c) {
            if (std::isnan(grid.at(c, r))) continue;
            std::vector<double> x{14.5 + 0.001 * c}, y{47.25 - 0.001 * r};
            transform->apply(x, y);
            const auto z = surface(b, b.plan.lattice.i_of(x[0]), b.plan.lattice.j_of(y[0]));
            if (!z) continue;
            const double error = std::abs(*z - static_cast<double>(grid.at(c, r)));
            greatest = std::max(greatest, error);
            squares += error * error;
            ++samples;
        }
    // A thousandth of a sample, up slopes of some ten metres a sample.
    EXPECT_NEAR(measured.greatest_m, greatest, 0.05);
    EXPECT_NEAR(measured.rms_m, std::sqrt(squares / static_cast<double>(samples)), 0.005);
    EXPECT_NEAR(static_cast<double>(measured.samples), static_cast<double>(samples), 3);
    EXPECT_GT(measured.greatest_m, 1);
}

TEST_F(WarpErrors, OfSamplesUnderAnotherLayerDoNotCount) {
    test::HeightGrid low = test::hills(60, 60, 3, 200), high = low;
    for (float& z : low.z) z = 100;
    for (float& z : high.z) z = 900;
    // The same extent, half a sample off: all but a rim of the lower layer is hidden.
    test::write_heights(folder_.file("low.tif"), low, {400000, 5300000, 10, 32633, false});
    test::write_heights(folder_.file("high.tif"), high, {399995, 5300005, 10, 32633, false});
    const Built b = build({folder_.file("low.tif"), folder_.file("high.tif")}, folder_.file("t"));
    ASSERT_EQ(b.stack->layer_count(), 2u);
    const WarpError measured = measure(b);
    EXPECT_LT(measured.samples, 60 * 60 + 2 * 60);
    EXPECT_GT(measured.samples, 59 * 59 - 1);
}

}  // namespace
}  // namespace scree
