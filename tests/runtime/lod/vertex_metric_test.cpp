// The tests that select a vertex, at the extremes, in both precisions. Numbers in comments: Scree lod, section 7
// (docs/extremes.md).
#include "runtime/lod/vertex_metric.h"

#include <cmath>
#include <limits>

#include <glm/glm.hpp>

#include "runtime/view/camera.h"
#include "runtime/view/frustum.h"
#include "tests/common/test_support.h"

namespace scree {
namespace {

constexpr double kFocal = 1098.99097;  // 800 px, 40 degrees
constexpr double kFloors[] = {0, 0.1, 0.3, 0.6, 1};

double between(test::Random& random, double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
}
double scale_between(test::Random& random, double low, double high) {
    return std::exp(between(random, std::log(low), std::log(high)));
}

template <class Real>
VertexSight<Real> sight(double h, double dz) {
    const Real level = static_cast<Real>(h), up = static_cast<Real>(dz);
    return {level * level, up * up};
}

template <class Real>
class VertexMetric : public testing::Test {
protected:
    static constexpr double kGrain = 16 * static_cast<double>(std::numeric_limits<Real>::epsilon());
    static Real real(double value) { return static_cast<Real>(value); }
};
using Precisions = testing::Types<float, double>;
TYPED_TEST_SUITE(VertexMetric, Precisions);

// 1: delta_allow = tau (h^2 + dz^2) / (f h) is 1.819851 m at h = 1000, dz = 1000.
TYPED_TEST(VertexMetric, UcSelectsFromTheAllowedCorrectionOn) {
    const auto s = sight<TypeParam>(1000, 1000);
    EXPECT_FALSE(uc_selects(this->real(kFocal * 1.819851 * (1 - 1e-6)), this->real(1), s));
    EXPECT_TRUE(uc_selects(this->real(kFocal * 1.819851 * (1 + 1e-6)), this->real(1), s));
}

// 2
TYPED_TEST(VertexMetric, StraightUnderTheEyeUcDropsWhateverItCosts) {
    for (const double delta : {1e-6, 1.0, 1e6})
        for (const double tau : {0.0, 1e-3, 1.0, 1e3})
            EXPECT_FALSE(uc_selects(this->real(kFocal * delta), this->real(tau), sight<TypeParam>(0, 1000)));
    EXPECT_FALSE(uc_selects(this->real(1e9), this->real(1), sight<TypeParam>(0, 0)));  // the eye on the vertex: 0 > 0
}

// 2
TYPED_TEST(VertexMetric, StraightUnderTheEyeTheGuaranteedTestSeesTheRestOfTheBall) {
    const auto s = sight<TypeParam>(0, 1000);
    const double value = 100.0 / (1e6 - 1e4);  // rho / (r^2 - rho^2)
    EXPECT_NEAR(static_cast<double>(greatest_magnification(s, this->real(100), this->real(0))), value,
                value * this->kGrain);
    EXPECT_FALSE(
        guaranteed_selects(this->real(1 / value * (1 - 1e-5)), this->real(100), this->real(0), this->real(1), s));
    EXPECT_TRUE(
        guaranteed_selects(this->real(1 / value * (1 + 1e-5)), this->real(100), this->real(0), this->real(1), s));
}

// 2, 5: whatever the tolerance, an error that may be anywhere on the screen is drawn, and none is not.
TYPED_TEST(VertexMetric, AnEyeInTheBallSelectsEveryErrorButNone) {
    for (const double tau : {0.0, 1e-3, 1.0, 1e3, 1e30})
        for (const double floor : kFloors)
            for (const double away : {0.0, 1e-3, 99.9, 100.0}) {
                const auto s = sight<TypeParam>(away, 0);
                EXPECT_TRUE(
                    guaranteed_selects(this->real(1e-6), this->real(100), this->real(floor), this->real(tau), s));
                EXPECT_FALSE(guaranteed_selects(this->real(0), this->real(100), this->real(floor), this->real(tau), s));
                EXPECT_EQ(greatest_magnification(s, this->real(100), this->real(floor)),
                          std::numeric_limits<TypeParam>::infinity());
            }
}

// 5: delta 0 has nothing to show, h = 0 shows nothing; all else is above a tolerance of nothing.
TYPED_TEST(VertexMetric, AtAToleranceOfZeroWhatShowsAtAllIsSelected) {
    for (const double h : {1e-3, 1.0, 1e6, 1e9})
        for (const double dz : {0.0, 1.0, 1e6}) {
            EXPECT_TRUE(uc_selects(this->real(1e-3), this->real(0), sight<TypeParam>(h, dz)));
            EXPECT_FALSE(uc_selects(this->real(0), this->real(0), sight<TypeParam>(h, dz)));
            EXPECT_TRUE(guaranteed_selects(this->real(1e-3), this->real(0), this->real(0), this->real(0),
                                           sight<TypeParam>(h, dz)));
            EXPECT_FALSE(guaranteed_selects(this->real(0), this->real(0), this->real(0), this->real(0),
                                            sight<TypeParam>(h, dz)));
        }
}

// 5: a thousand pixels at a kilometre are 910 m.
TYPED_TEST(VertexMetric, AToleranceOfAThousandPixelsKeepsOnlyMountains) {
    const auto s = sight<TypeParam>(1000, 0);
    EXPECT_FALSE(uc_selects(this->real(kFocal * 909), this->real(1e3), s));
    EXPECT_TRUE(uc_selects(this->real(kFocal * 911), this->real(1e3), s));
    EXPECT_FALSE(guaranteed_selects(this->real(kFocal * 909), this->real(0), this->real(0), this->real(1e3), s));
    EXPECT_TRUE(guaranteed_selects(this->real(kFocal * 911), this->real(0), this->real(0), this->real(1e3), s));
}

// 12: a strip that twists by 160 m between exact sides has to be split from any distance below f K 160.
TYPED_TEST(VertexMetric, AnErrorOf160MetresIsSplitFrom222Kilometres) {
    const double error_px = kFocal * 1.26495 * 160;
    for (const double floor : kFloors) {
        EXPECT_TRUE(guaranteed_selects(this->real(error_px), this->real(0), this->real(floor), this->real(1),
                                       sight<TypeParam>(222.4e3, 0)));
        EXPECT_FALSE(guaranteed_selects(this->real(error_px), this->real(0), this->real(floor), this->real(1),
                                        sight<TypeParam>(222.5e3, 0)));
    }
}

// 8
TYPED_TEST(VertexMetric, TheBallsOfTheListHaveTheirValues) {
    const double level =
        static_cast<double>(greatest_magnification(sight<TypeParam>(1000, 0), this->real(100), this->real(0)));
    EXPECT_NEAR(level, 1.0 / 900, this->kGrain / 900);
    const double above =
        static_cast<double>(greatest_magnification(sight<TypeParam>(0, 1000), this->real(100), this->real(0)));
    EXPECT_NEAR(above, 1.0101e-4, 1e-9);
}

// Of max(h, c r) / r^2 where it is seen from the eye, at the ball's point.
double magnification(glm::dvec3 seen, double floor) {
    const double h = std::hypot(seen.x, seen.y), r = glm::length(seen);
    return std::max(h, floor * r) / (r * r);
}

// 8: the formula is the supremum: nothing in the ball is above it, and something comes up to it.
TYPED_TEST(VertexMetric, TheGreatestMagnificationIsThatOfTheBallsWorstPoint) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int ball = 0; ball < 1500; ++ball) {
        const double r = scale_between(random, 1, 1e6), rho = r * scale_between(random, 1e-4, 0.9);
        const double slope = ball % 8 == 0 ? 0 : ball % 8 == 1 ? 1.5707963267948966 : between(random, -1.57, 1.57);
        const glm::dvec3 centre{r * std::cos(slope), 0, r * std::sin(slope)};
        const double floor = kFloors[static_cast<std::size_t>(ball) % 5];
        const double bound = static_cast<double>(
            greatest_magnification(sight<TypeParam>(centre.x, centre.z), this->real(rho), this->real(floor)));
        // In float the radius and what is left of r^2 - rho^2 are rounded.
        const double slack = 1 + 8 * this->kGrain * r * r / (r * r - rho * rho);
        double worst = 0;
        for (int k = 0; k < 200; ++k) {
            const glm::dvec3 to{between(random, -1, 1), between(random, -1, 1), between(random, -1, 1)};
            if (glm::length(to) > 1) continue;
            worst = std::max(worst, magnification(centre + rho * to, floor));
        }
        EXPECT_LE(worst, bound * slack);
        for (int k = 0; k < 1440; ++k) {
            const double turn = k * 3.141592653589793 / 720;
            worst = std::max(worst, magnification(centre + rho * glm::dvec3(std::cos(turn), 0, std::sin(turn)), floor));
        }
        ASSERT_LE(worst, bound * slack) << "h " << centre.x << " dz " << centre.z << " rho " << rho;
        ASSERT_GE(worst, bound / slack * 0.999) << "h " << centre.x << " dz " << centre.z << " rho " << rho;
    }
}

// 9: the fourth power of a distance; beyond it the test passes what it is asked, and is never no number.
TYPED_TEST(VertexMetric, UcKeepsItsAnswerToFourMillionKilometresAndPassesBeyondFloat) {
    for (const double focal : {kFocal, 4.4e7})
        for (const double tau : {1e-3, 1.0, 1e3})
            for (const double h : {1.0, 1e3, 1e6, 1e8, 1e9, 4e9})
                for (const double side : {0.999, 1.001}) {
                    if (tau > 1 && h > 1e8) continue;
                    const double delta = tau * h / focal * side;
                    EXPECT_EQ(uc_selects(this->real(focal * delta), this->real(tau), sight<TypeParam>(h, 0)), side > 1)
                        << focal << " px, " << tau << " px, " << h << " m";
                }
    EXPECT_FALSE(uc_selects(this->real(kFocal), this->real(1), sight<TypeParam>(1e10, 0)));
    EXPECT_FALSE(uc_selects(std::numeric_limits<TypeParam>::max(), this->real(1),
                            sight<TypeParam>(static_cast<double>(std::numeric_limits<TypeParam>::max()), 0)));
}

// 9: no power above the second, so there is nothing to overflow where a terrain can be.
TYPED_TEST(VertexMetric, TheGuaranteedTestKeepsItsAnswerToTenMillionKilometres) {
    for (const double focal : {kFocal, 4.4e7})
        for (const double tau : {1e-3, 1.0, 1e3})
            for (const double h : {1.0, 1e3, 1e6, 1e9, 4e9, 1e10})
                for (const double side : {0.999, 1.001}) {
                    const double error = tau * h / focal * side;
                    EXPECT_EQ(guaranteed_selects(this->real(focal * error), this->real(0), this->real(0.3),
                                                 this->real(tau), sight<TypeParam>(h, 0)),
                              side > 1)
                        << focal << " px, " << tau << " px, " << h << " m";
                }
}

TYPED_TEST(VertexMetric, WhatOverflowsIsNeverDroppedByTheGuaranteedTest) {
    const TypeParam most = std::numeric_limits<TypeParam>::max();
    for (const TypeParam floor : {TypeParam{0}, TypeParam(0.3), TypeParam{1}}) {
        EXPECT_TRUE(guaranteed_selects(most, TypeParam{1}, floor, TypeParam{1}, sight<TypeParam>(1e3, 0)));
        EXPECT_TRUE(guaranteed_selects(TypeParam{1}, most, floor, TypeParam{1}, sight<TypeParam>(1e3, 0)));
    }
}

TYPED_TEST(VertexMetric, ADistanceThatIsNoNumberIsSelectedByTheGuaranteedTestAndDroppedByUc) {
    const TypeParam nan = std::numeric_limits<TypeParam>::quiet_NaN();
    const VertexSight<TypeParam> broken{nan, TypeParam{1}};
    EXPECT_TRUE(guaranteed_selects(TypeParam{1}, TypeParam{1}, TypeParam(0.3), TypeParam{1}, broken));
    EXPECT_TRUE(guaranteed_selects(TypeParam{1}, nan, TypeParam(0.3), TypeParam{1}, sight<TypeParam>(10, 0)));
    EXPECT_FALSE(uc_selects(TypeParam{1}, TypeParam{1}, broken));
    EXPECT_EQ(greatest_magnification(broken, TypeParam{1}, TypeParam{0}), std::numeric_limits<TypeParam>::infinity());
}

// 9: where float and double differ the value is the tolerance to within float's grain.
TEST(VertexMetricPrecision, FloatAndDoubleDifferOnlyOnTheThreshold) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    int close = 0;
    for (int k = 0; k < 200000; ++k) {
        const double h = scale_between(random, 1e-3, 4e9), dz = scale_between(random, 1e-3, 4e9);
        const double tau = scale_between(random, 1e-3, 1e3);
        const double r2 = h * h + dz * dz,
                     share = k % 3 == 0 ? 1 + 1e-7 * between(random, -1, 1) : scale_between(random, 0.01, 100);
        const double error_px = tau * r2 / h * share, rho = k % 2 == 0 ? 0 : 0.5 * std::sqrt(r2);
        if (tau * r2 > 1e18 || error_px > 1e18) continue;  // beyond float, and beyond what a terrain has
        const bool as_double = uc_selects(error_px, tau, sight<double>(h, dz));
        const bool as_float = uc_selects(static_cast<float>(error_px), static_cast<float>(tau), sight<float>(h, dz));
        if (as_double != as_float) {
            ASSERT_NEAR(share, 1, 4e-6);
            ++close;
        }
        const double least = tau / greatest_magnification(sight<double>(h, dz), rho, 0.3);
        ASSERT_EQ(guaranteed_selects(static_cast<float>(least * 1.0001), static_cast<float>(rho), 0.3f,
                                     static_cast<float>(tau), sight<float>(h, dz)),
                  true);
        ASSERT_EQ(guaranteed_selects(static_cast<float>(least * 0.9999), static_cast<float>(rho), 0.3f,
                                     static_cast<float>(tau), sight<float>(h, dz)),
                  false);
    }
    EXPECT_GT(close, 10);
}

// C1: what a vertical correction moves on the screen, in any view, is at most f K delta h / (r_P r_Q), and that no more
// than the greater of the magnifications of its ends. On the axis alone it would be without K.
TEST(ScreenError, IsNeverMoreThanTheMetricSaysFromAnyFieldOfViewAndWindow) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    constexpr double kFields[] = {0.001, 0.01, 5, 40, 60, 90, 150, 179};
    constexpr int kWindows[][2] = {{1, 1}, {1, 4320}, {7680, 1}, {800, 800}, {7680, 4320}, {16384, 16384}};
    double worst = 0, worst_without_k = 0;
    for (int k = 0; k < 200000; ++k) {
        const auto& window = kWindows[k % 6];
        const auto camera = look_at({0, 0, 0}, {between(random, -1, 1), between(random, -1, 1), between(random, -1, 1)},
                                    kFields[k / 6 % 8], window[0], window[1]);
        ASSERT_TRUE(camera.ok());
        const double z = scale_between(random, 0.1, 1e9);
        const glm::dvec3 p = z * (camera->forward + between(random, -1, 1) * camera->tan_half_x() * camera->right() +
                                  between(random, -1, 1) * camera->tan_half_y() * camera->up);
        const double delta = z * scale_between(random, 1e-6, 1) * (k % 2 == 0 ? 1 : -1);
        const glm::dvec3 q = p + glm::dvec3(0, 0, delta);
        const auto at = [&](glm::dvec3 v) {
            return glm::dvec2(glm::dot(v, camera->right()), glm::dot(v, camera->up)) / glm::dot(v, camera->forward);
        };
        const glm::dvec2 to = at(q);
        if (!(glm::dot(q, camera->forward) >= camera->near_m && std::abs(to.x) <= camera->tan_half_x() &&
              std::abs(to.y) <= camera->tan_half_y()))
            continue;
        const double moved_px = camera->focal_px() * glm::length(to - at(p));
        const double h = std::hypot(p.x, p.y), magnified = std::max(h / glm::dot(p, p), h / glm::dot(q, q));
        const double exact = std::abs(delta) * h / (glm::length(p) * glm::length(q));
        ASSERT_LE(exact, std::abs(delta) * magnified * (1 + 1e-12));
        const double bound_px = camera->focal_px() * camera->off_axis_factor() * exact;
        // Two projections, each with the grain of a double over the whole picture.
        ASSERT_LE(moved_px, bound_px * (1 + 1e-9) + 1e-12 * (camera->width_px + camera->height_px));
        worst = std::max(worst, moved_px / (bound_px + 1e-9));
        worst_without_k = std::max(worst_without_k, moved_px / (camera->focal_px() * exact + 1e-9));
    }
    EXPECT_GT(worst, 0.9);
    EXPECT_GT(worst_without_k, 2);  // C2
}

// Of boxes above, below, beside and around the eye: no point of a box looks larger, and one looks as large.
TEST(BoxMagnification, IsTheGreatestOfItsPoints) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int k = 0; k < 300; ++k) {
        const glm::dvec3 eye{0, 0, 0};
        glm::dvec3 low, size;
        for (int axis = 0; axis < 3; ++axis) {
            low[axis] = between(random, -2000, 1000);
            size[axis] = between(random, 0, axis == 2 ? 600 : 1200);
        }
        const Box box{low, low + size};
        const double bound = greatest_box_magnification(eye, box);
        double greatest = 0;
        constexpr int kSteps = 24;
        for (int x = 0; x <= kSteps; ++x)
            for (int y = 0; y <= kSteps; ++y)
                for (int z = 0; z <= kSteps; ++z) {
                    const glm::dvec3 p = low + size * glm::dvec3(x, y, z) / double{kSteps};
                    const double h2 = p.x * p.x + p.y * p.y, r2 = h2 + p.z * p.z;
                    if (r2 > 0) greatest = std::max(greatest, std::sqrt(h2) / r2);
                }
        EXPECT_LE(greatest, bound * (1 + 1e-12));
        const bool inside = glm::all(glm::lessThanEqual(box.low, eye)) && glm::all(glm::lessThanEqual(eye, box.high));
        EXPECT_EQ(inside, std::isinf(bound));
        if (inside) continue;
        const double distance_m = distance_to_box(eye, box);
        EXPECT_LE(bound, 1 / distance_m * (1 + 1e-12));
        if (distance_m > 500) {
            EXPECT_GT(greatest, 0.95 * bound) << k;
        }
    }
    const Box below{{-1, -1, -1000}, {1, 1, -990}};
    EXPECT_NEAR(greatest_box_magnification(glm::dvec3{0}, below), std::sqrt(2.0) / (990.0 * 990 + 2), 1e-15);
    EXPECT_EQ(greatest_box_magnification(glm::dvec3{0, 0, 1e200}, below), 0);
    EXPECT_TRUE(std::isnan(greatest_box_magnification(glm::dvec3{0, std::nan(""), 0}, below)));
}

}  // namespace
}  // namespace scree
