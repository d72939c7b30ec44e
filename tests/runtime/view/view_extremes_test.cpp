// Views at the extremes: fields of 0.001 to 179 degrees, windows of a pixel to 33 million, coordinates of 10^7 m, eyes
// a million kilometres away, and no numbers. Numbers in comments: Scree lod, section 7 (docs/extremes.md).
#include <algorithm>
#include <cmath>
#include <limits>

#include "common/height_tile.h"
#include "runtime/view/camera.h"
#include "runtime/view/frustum.h"
#include "runtime/view/relative_frame.h"
#include "tests/common/test_support.h"

namespace scree {
namespace {

constexpr double kFields[] = {0.001, 0.01, 1, 40, 120, 179};
constexpr int kWindows[][2] = {{1, 1}, {1, 4320}, {7680, 1}, {800, 800}, {7680, 4320}, {16384, 16384}};

double between(test::Random& random, double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
}
double scale_between(test::Random& random, double low, double high) {
    return std::exp(between(random, std::log(low), std::log(high)));
}
glm::dvec3 any_direction(test::Random& random) {
    return {between(random, -1, 1), between(random, -1, 1), between(random, -1, 1)};
}
bool finite(const glm::dvec3& v) { return std::isfinite(v.x + v.y + v.z); }

template <class Visit>
void for_every_view(const Visit& visit) {
    for (const double fov : kFields)
        for (const auto& window : kWindows) visit(fov, window[0], window[1]);
}

TEST(ViewExtremes, EveryFieldAndWindowHasFiniteFactorsAndMatrix) {
    for_every_view([](double fov, int width, int height) {
        const auto camera = look_at({1e7, -1e7, 1e6}, {1e7, -1e7 + 1e-3, 1e6 - 1e-3}, fov, width, height);
        ASSERT_TRUE(camera.ok());
        EXPECT_TRUE(std::isfinite(camera->focal_px()) && camera->focal_px() > 0);
        EXPECT_TRUE(std::isfinite(camera->off_axis_factor()) && camera->off_axis_factor() >= 1);
        const glm::mat4 m = clip_from_relative(*camera);
        for (int k = 0; k < 16; ++k) ASSERT_TRUE(std::isfinite(m[k / 4][k % 4])) << fov;
    });
}

// The middle of the picture is where it looks, its corners are its field's, to the grain of the matrix's floats.
TEST(ViewExtremes, CornersOfTheFieldComeToTheCornersOfThePicture) {
    for_every_view([](double fov, int width, int height) {
        const auto camera = look_at({0, 0, 0}, {3, 5, -2}, fov, width, height);
        ASSERT_TRUE(camera.ok());
        const glm::mat4 m = clip_from_relative(*camera);
        for (const glm::dvec2 at : {glm::dvec2(0, 0), glm::dvec2(1, 1), glm::dvec2(-1, 1), glm::dvec2(-1, -1)}) {
            const glm::dvec3 p = camera->forward + at.x * camera->tan_half_x() * camera->right() +
                                 at.y * camera->tan_half_y() * camera->up;
            // In double over the matrix's floats: what a vertex shader adds is its own (see the renderer's tests).
            const glm::dvec4 clip = glm::dmat4(m) * glm::dvec4(p, 1);
            const double grain =
                5e-7 * (1 + glm::length(p)) * (1 + 1 / std::min(camera->tan_half_x(), camera->tan_half_y()));
            ASSERT_NEAR(clip.x / clip.w, at.x, grain) << fov;
            ASSERT_NEAR(clip.y / clip.w, at.y, grain) << fov;
        }
    });
}

TEST(ViewExtremes, NoFieldOrWindowLosesABoxThatHoldsAVisiblePoint) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    std::int64_t seen = 0;
    for (int round = 0; round < 2000; ++round)
        for_every_view([&](double fov, int width, int height) {
            const glm::dvec3 eye = 1e7 * any_direction(random);
            const auto camera =
                look_at(eye, eye + scale_between(random, 1e-3, 1e6) * any_direction(random), fov, width, height);
            if (!camera.ok()) return;
            const double z = scale_between(random, 0.11, 1e9);
            const glm::dvec3 p =
                camera->eye +
                z * (camera->forward + between(random, -0.99, 0.99) * camera->tan_half_x() * camera->right() +
                     between(random, -0.99, 0.99) * camera->tan_half_y() * camera->up);
            const Frustum frustum(*camera);
            if (!frustum.contains(p)) return;  // narrower than a double can say at 10^7 m
            ++seen;
            Box box{p, p};
            for (int axis = 0; axis < 3; ++axis) {
                if (test::uniform(random, 0, 2) != 0) box.low[axis] -= scale_between(random, 1e-3, 1e6);
                if (test::uniform(random, 0, 2) != 0) box.high[axis] += scale_between(random, 1e-3, 1e6);
            }
            ASSERT_TRUE(frustum.may_see(box)) << fov;
        });
    EXPECT_GT(seen, 50000);
}

// look_at refuses such views; one made by hand sees nothing rather than everything.
TEST(ViewExtremes, AViewThatIsNoNumberSeesNoBoxAndNoPoint) {
    const auto sound = look_at({0, 0, 100}, {0, 500, 0}, 60, 800, 600);
    ASSERT_TRUE(sound.ok());
    const Box ground{{-1000, -1000, -10}, {1000, 1000, 10}};
    ASSERT_EQ(Frustum(*sound).sight(ground), Sight::some);
    for (int field = 0; field < 11; ++field)
        for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
            Camera broken = *sound;
            if (field < 3) broken.eye[field] = bad;
            if (field >= 3 && field < 6) broken.forward[field - 3] = bad;
            if (field >= 6 && field < 9) broken.up[field - 6] = bad;
            if (field == 9) broken.fov_deg = bad;
            if (field == 10) broken.near_m = bad;
            const Frustum frustum(broken);
            EXPECT_EQ(frustum.sight(ground), Sight::none) << field;
            EXPECT_FALSE(frustum.may_see(ground)) << field;
            EXPECT_FALSE(frustum.contains({0, 500, 0})) << field;
        }
}

TEST(ViewExtremes, DistancesToABoxAreExactFromAMillimetreAtTenThousandKilometres) {
    const glm::dvec3 corner{1e7, 1e7, 1e6};
    const Box box{corner, corner + glm::dvec3(1e3, 1e3, 10)};
    for (int k = 1; k <= 1000; ++k) {
        ASSERT_NEAR(distance_to_box(corner - glm::dvec3(1e-3 * k, 0, 0), box), 1e-3 * k, 2e-9);
        ASSERT_NEAR(distance_to_box(corner + glm::dvec3(500, 500, 10 + 1e-3 * k), box), 1e-3 * k, 2e-10);
    }
    EXPECT_NEAR(distance_to_box(corner + glm::dvec3(500, 500, 1e9), box), 1e9 - 10, 1e-6);
}

// Spacings of a millimetre and of a hundred kilometres, ten thousand kilometres from the origin of coordinates: a
// vertex near the eye is where it is to a millionth of its distance and of the lattice's grain.
TEST(ViewExtremes, PositionsAreRightAtEverySpacingFarFromTheOrigin) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (const double spacing : {1e-3, 30.0, 1e5})
        for (int k = 0; k < 20000; ++k) {
            const std::int64_t cells = std::int64_t{1} << test::uniform(random, 8, 29);
            const auto lattice = make_lattice(1e7, -1e7, spacing, cells, cells, 5);
            ASSERT_TRUE(lattice.ok());
            const auto i = static_cast<std::int32_t>(between(random, 0, 1) * static_cast<double>(cells)),
                       j = static_cast<std::int32_t>(between(random, 0, 1) * static_cast<double>(cells)),
                       n = test::uniform(random, -kMaxHeightUnits, kMaxHeightUnits);
            const double quantum = spacing / 64;
            const glm::dvec3 vertex{lattice->x_m(i), lattice->y_m(j), 50 + n * quantum};
            const glm::dvec3 eye = vertex + scale_between(random, 1e-3, 1e9) * any_direction(random);
            const glm::dvec3 exact = vertex - eye;
            const glm::dvec3 p = make_relative_frame(*lattice, 50, quantum, eye).position(i, j, static_cast<float>(n));
            ASSERT_TRUE(finite(p));
            // What doubles of 10^7 m can say, what floats of the distance can, and of a lattice's step.
            const double side_m = static_cast<double>(cells) * spacing;
            const double beyond = std::max(0.0, glm::length(exact) - side_m);
            ASSERT_LE(glm::length(p - exact),
                      1e-6 * (glm::length(exact) + beyond + spacing) + 1e-15 * (side_m + glm::length(eye)) + 4e-9)
                << "spacing " << spacing;
        }
}

// 9: motions of a millimetre at 10^7 m are seen, every one.
TEST(ViewExtremes, MillimetresAreSeenTenThousandKilometresFromTheOrigin) {
    const auto lattice = make_lattice(1e7, 1e7, 10, 4096, 4096, 5);
    ASSERT_TRUE(lattice.ok());
    for (int k = 0; k < 2000; ++k) {
        const glm::dvec3 eye{1e7 + 20000.3 + 1e-3 * k, 1e7 - 15000.7, 1e6 + 12}, moved = eye + glm::dvec3(1e-3, 0, 0);
        const auto i = static_cast<std::int32_t>(2000 + k % 2), j = std::int32_t{1500};
        const float before = make_relative_frame(*lattice, 1e6, 0.25, eye).position(i, j, 7).x;
        const float after = make_relative_frame(*lattice, 1e6, 0.25, moved).position(i, j, 7).x;
        ASSERT_NEAR(static_cast<double>(before) - static_cast<double>(after), 1e-3, 3e-6);
    }
}

}  // namespace
}  // namespace scree
