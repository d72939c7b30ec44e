#include "runtime/view/curvature.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/common/test_support.h"

namespace scree {
namespace {

Dataset dataset_of(std::int64_t cells_x, std::int64_t cells_y, double spacing_m) {
    Dataset d;
    const auto lattice = make_lattice(300000, 2700000, spacing_m, cells_x, cells_y, 5);
    EXPECT_TRUE(lattice.ok());
    d.lattice = *lattice;
    return d;
}

TEST(Curvature, LowersByAHundredAndNinetySixMetresInFiftyKilometres) {
    const Dataset d = dataset_of(64, 64, 10);
    const double k = half_curvature(Curvature::on, d, {});
    EXPECT_NEAR(k * 50e3 * 50e3, 196.2, 0.05);
    // The sphere itself, 6 mm off.
    EXPECT_NEAR(k * 50e3 * 50e3, kEarthRadius_m - std::sqrt(kEarthRadius_m * kEarthRadius_m - 50e3 * 50e3), 0.007);
    EXPECT_EQ(half_curvature(Curvature::off, dataset_of(1 << 20, 1 << 20, 10), {}), 0);
}

// The angle under which the drop is seen, in pixels, from its definition.
double drop_px(const Camera& camera, double distance_m) {
    return camera.focal_px() * (distance_m * distance_m / (2 * kEarthRadius_m)) / distance_m;
}

TEST(Curvature, IsOnByItselfWhereTheFurthestCornerMovesByMoreThanATenthOfAPixel) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    const auto any = [&](double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); };
    int on = 0, off = 0;
    for (int k = 0; k < 20000; ++k) {
        const Dataset d =
            dataset_of(test::uniform(random, 32, 5000), test::uniform(random, 32, 5000), std::exp(any(-5, 3)));
        const Lattice& l = d.lattice;
        const double east = l.x_m(static_cast<double>(l.cells_x)), south = l.y_m(static_cast<double>(l.cells_y));
        const double margin = east - l.x_m(0);
        Camera camera;
        camera.fov_deg = any(5, 120);
        camera.height_px = test::uniform(random, 200, 3000);
        camera.eye = {any(l.x_m(0) - margin, east + margin), any(south - margin, l.y_m(0) + margin), any(0, 1e6)};
        double furthest = 0;
        for (const double x : {l.x_m(0), east})
            for (const double y : {l.y_m(0), south})
                furthest = std::max(furthest, std::hypot(x - camera.eye.x, y - camera.eye.y));
        const double px = drop_px(camera, furthest);
        if (std::abs(px - 0.1) < 1e-9) continue;
        ASSERT_EQ(half_curvature(Curvature::automatic, d, camera), px > 0.1 ? 0.5 / kEarthRadius_m : 0) << px;
        ++(px > 0.1 ? on : off);
    }
    EXPECT_GT(on, 1000);
    EXPECT_GT(off, 1000);
}

TEST(Curvature, IsNamedAutoOnAndOffAndNothingElse) {
    EXPECT_EQ(curvature_from("auto"), Curvature::automatic);
    EXPECT_EQ(curvature_from("on"), Curvature::on);
    EXPECT_EQ(curvature_from("off"), Curvature::off);
    for (const char* text : {"", "On", "automatic", "on ", "0", "1", "true"})
        EXPECT_FALSE(curvature_from(text).has_value()) << text;
}

}  // namespace
}  // namespace scree
