// The tests of vertex selection over arrays, in single precision, at the extremes (docs/extremes.md).
#include "runtime/lod/block_kernels.h"

#include <cmath>
#include <limits>
#include <vector>

#include "runtime/lod/vertex_metric.h"
#include "tests/common/test_support.h"

namespace scree {
namespace {

constexpr double kFloor = 0.3;

double between(test::Random& random, double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
}
double scale_between(test::Random& random, double low, double high) {
    return std::exp(between(random, std::log(low), std::log(high)));
}
float rounded_up(double value) {
    const auto f = static_cast<float>(value);
    return static_cast<double>(f) < value ? std::nextafter(f, std::numeric_limits<float>::infinity()) : f;
}

// 33 x 33 vertices about their middle, exact and as the kernels have them.
struct Arrays {
    Arrays(test::Random& random, double spacing_m) {
        const double relief = spacing_m * scale_between(random, 1e-2, 1e3);
        reach_m = std::hypot(16 * spacing_m, 16 * spacing_m, relief);
        for (int k = 0; k < 33 * 33; ++k) {
            x.push_back(spacing_m * (k % 33 - 16));
            y.push_back(spacing_m * (16 - k / 33));
            z.push_back(between(random, -relief, relief));
            rho.push_back(spacing_m * scale_between(random, 0.5, 40));
            error.push_back(static_cast<float>(k % 17 == 0 ? 0 : spacing_m * scale_between(random, 1e-6, 10)));
            radius.push_back(rounded_up(rho.back() + kBallPad * reach_m));
            for (auto [exact, rounded] : {std::pair{&x, &xf}, {&y, &yf}, {&z, &zf}})
                rounded->push_back(static_cast<float>(exact->back()));
        }
    }
    VertexArrays arrays() const { return {xf.data(), yf.data(), zf.data(), xf.size()}; }
    VertexSight<double> sight(std::size_t k, const double (&eye)[3]) const {
        const double dx = x[k] - eye[0], dy = y[k] - eye[1], dz = z[k] - eye[2];
        return {dx * dx + dy * dy, dz * dz};
    }
    std::vector<double> x, y, z, rho;
    std::vector<float> xf, yf, zf, error, radius;
    double reach_m = 0;
};

LocalEye local(const double (&eye)[3]) {
    return {static_cast<float>(eye[0]), static_cast<float>(eye[1]), static_cast<float>(eye[2])};
}

TEST(BlockKernels, AtEveryScaleNothingIsPassedThatTheExactTestSelectsAndLittleElseFails) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    std::int64_t selected = 0, passed = 0;
    std::vector<std::uint8_t> fails(33 * 33);
    for (const double spacing : {1e-3, 1.0, 30.0, 1e5})
        for (const double scale_px : {1e-3, 1390.0, 1e8})  // fields of 179 degrees to a hundredth
            for (int round = 0; round < 200; ++round) {
                const Arrays a(random, spacing);
                const double away = scale_between(random, 1e-3, 1e9), turn = between(random, 0, 6.3),
                             rise = between(random, -1, 1);
                const double eye[] = {away * std::cos(turn), away * std::sin(turn), away * rise};
                // The tolerance of some vertex, to a millionth.
                const auto pick = static_cast<std::size_t>(test::uniform(random, 0, 33 * 33 - 1));
                const double value = scale_px * static_cast<double>(a.error[pick]) *
                                     greatest_magnification(a.sight(pick, eye), a.rho[pick], kFloor);
                const double tau = std::isfinite(value) && value > 0 ? value * (1 + between(random, -1e-6, 1e-6))
                                                                     : scale_between(random, 1e-3, 1e3);
                fails_ball(a.arrays(), a.error.data(), a.radius.data(), local(eye), static_cast<float>(scale_px),
                           static_cast<float>(kFloor), static_cast<float>(tau), fails.data());
                const double tolerance = static_cast<double>(static_cast<float>(tau));
                for (std::size_t k = 0; k < fails.size(); ++k) {
                    const double error_px =
                        static_cast<double>(static_cast<float>(scale_px)) * static_cast<double>(a.error[k]);
                    const auto s = a.sight(k, eye);
                    if (guaranteed_selects(error_px, a.rho[k], kFloor, tolerance, s)) {
                        ASSERT_EQ(fails[k], 1) << "spacing " << spacing << ", " << away << " m away";
                        ++selected;
                    }
                    // Well below the tolerance, and well out of the ball.
                    if (!guaranteed_selects(error_px * 1.001, a.rho[k] * 1.001, kFloor, tolerance, s) &&
                        s.r2() > 1.1 * a.rho[k] * a.rho[k] + 1e-5 * a.reach_m * a.reach_m) {
                        ASSERT_EQ(fails[k], 0) << "spacing " << spacing << ", " << away << " m away";
                        ++passed;
                    }
                }
            }
    EXPECT_GT(selected, 10000);
    EXPECT_GT(passed, 10000);
}

// What is too far for single precision shows nothing; what is no number may be anywhere.
TEST(BlockKernels, AnEyeThatIsNoNumberFailsEveryErrorAndOneBeyondSinglePrecisionNone) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    const Arrays a(random, 30);
    std::vector<std::uint8_t> fails(33 * 33);
    const float nan = std::numeric_limits<float>::quiet_NaN(), infinity = std::numeric_limits<float>::infinity();
    for (const float bad : {nan, 1e20f, -1e30f, infinity})
        for (int axis = 0; axis < 3; ++axis) {
            float at[] = {10, 20, 300};
            at[axis] = bad;
            const LocalEye eye{at[0], at[1], at[2]};
            const auto expected = [&](std::size_t k) { return std::isnan(bad) && a.error[k] > 0 ? 1 : 0; };
            fails_ball(a.arrays(), a.error.data(), a.radius.data(), eye, 1390, 0.3f, 1, fails.data());
            for (std::size_t k = 0; k < fails.size(); ++k) ASSERT_EQ(fails[k], expected(k)) << bad;
            if (!std::isnan(bad)) continue;
            fails_ball_curved(a.arrays(), a.error.data(), a.radius.data(), eye, 1390, 0.3f, 1, 7.8e-8f, fails.data());
            for (std::size_t k = 0; k < fails.size(); ++k) ASSERT_EQ(fails[k], expected(k)) << bad;
        }
}

TEST(BlockKernels, AToleranceOfZeroFailsExactlyWhatHasAnError) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (const double spacing : {1e-3, 30.0, 1e5}) {
        const Arrays a(random, spacing);
        std::vector<std::uint8_t> fails(33 * 33);
        for (const float away : {1e-3f, 1e3f, 1e9f}) {
            fails_ball(a.arrays(), a.error.data(), a.radius.data(), {away, 0, away}, 1390, 0.3f, 0, fails.data());
            for (std::size_t k = 0; k < fails.size(); ++k) ASSERT_EQ(fails[k], a.error[k] > 0 ? 1 : 0);
        }
        fails_threshold(a.error.data(), fails.size(), 0, fails.data());
        for (std::size_t k = 0; k < fails.size(); ++k) ASSERT_EQ(fails[k], a.error[k] > 0 ? 1 : 0);
        fails_threshold(a.error.data(), fails.size(), 1e30f, fails.data());
        for (const std::uint8_t f : fails) ASSERT_EQ(f, 0);
    }
}

// Straight under the eye the paper's test passes, and where its fourth powers overflow.
TEST(BlockKernels, ThePapersTestPassesUnderTheEyeAndBeyondSinglePrecision) {
    const float x[] = {0, 100, 100}, y[] = {0, 0, 0}, z[] = {0, 0, 0}, delta[] = {1e6f, 1e6f, 0};
    std::uint8_t fails[3];
    fails_uc({x, y, z, 3}, delta, {0, 0, 1000}, 1099, 1, fails);
    EXPECT_EQ(fails[0], 0);
    EXPECT_EQ(fails[1], 1);
    EXPECT_EQ(fails[2], 0);
    fails_uc({x, y, z, 3}, delta, {1e10f, 0, 0}, 1099, 1, fails);
    for (const std::uint8_t f : fails) EXPECT_EQ(f, 0);
}

}  // namespace
}  // namespace scree
