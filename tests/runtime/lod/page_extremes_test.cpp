// Whole pictures at the extremes, by every method that promises something: no number that is none, no hole, no crack,
// and no place further off than is stated. Numbers in comments: Scree lod, section 7 (docs/extremes.md).
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <ostream>

#include "tests/runtime/lod/drawn_frame.h"
#include "tests/runtime/lod/meshed_world.h"
#include "tests/runtime/lod/selection_support.h"

namespace scree {
namespace {

using test::MeshedWorld;
using test::TerrainShape;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

struct Method {
    const char* name;
    LodSettings lod;
};
void PrintTo(const Method& method, std::ostream* out) { *out << method.name; }

LodSettings settings(LodMethod method, ReuseTest reuse = ReuseTest::off, double s_px = 0) {
    LodSettings lod;
    lod.method = method;
    lod.reuse = reuse;
    lod.s_px = s_px;
    return lod;
}

class PageExtremes : public testing::TestWithParam<Method> {
protected:
    const LodSettings& lod() const { return GetParam().lod; }
    static Camera camera(glm::dvec3 eye, glm::dvec3 look, double fov_deg = 40, int width = 800, int height = 600) {
        auto made = look_at(eye, look, fov_deg, width, height);
        EXPECT_TRUE(made.ok()) << (made.ok() ? "" : made.error().message);
        return *made;
    }
    static void expect_sound(MeshedWorld& world, const Camera& view, double tau, double half_curvature = 0) {
        world.draw(view, tau, half_curvature);
        EXPECT_EQ(world.fault(view, 0, tau, half_curvature), "")
            << "tau " << tau << ", fov " << view.fov_deg << ", " << view.width_px << " x " << view.height_px << ", eye "
            << view.eye.x << ' ' << view.eye.y << ' ' << view.eye.z;
    }
};

INSTANTIATE_TEST_SUITE_P(Methods, PageExtremes,
                         testing::Values(Method{"geomip", settings(LodMethod::geomip)},
                                         Method{"rsg", settings(LodMethod::rsg)},
                                         Method{"rsg_exact", settings(LodMethod::rsg, ReuseTest::exact, 0.5)},
                                         Method{"block_rsg", settings(LodMethod::block_rsg)}),
                         [](const testing::TestParamInfo<Method>& method) { return method.param.name; });

// Eyes from a millimetre over a vertex to a million kilometres away, over, beside and in the ground.
std::vector<Camera> eyes_round(const MeshedWorld& world, double fov_deg, int width, int height) {
    const Dataset& d = world.terrain().dataset();
    const double cells = static_cast<double>(d.lattice.cells_x), extent = cells * d.lattice.spacing_m;
    const double low = d.min_height_m, high = d.max_height_m, mid = 0.5 * (low + high);
    const int i = static_cast<int>(cells) / 2 - 1, j = static_cast<int>(cells) / 3;
    const double ground = world.terrain().height_m(i, j);
    const glm::dvec3 middle = world.at(0.5 * cells, 0.5 * cells, mid);
    const glm::dvec3 pairs[][2] = {
        {world.at(i, j, ground + 1e-3), world.at(i + 1, j - 1, ground)},      // a millimetre over a vertex
        {world.at(i, j, ground + 1e-3), world.at(i, j, ground)},              // looking at it
        {world.at(i, j, ground), middle},                                     // in it
        {world.at(i + 0.3, j + 0.7, mid), world.at(0, 0, low)},               // within the relief
        {world.at(0.5 * cells, 0.5 * cells, high + extent), middle},          // straight above
        {world.at(-0.2 * cells, 0.4 * cells, high + 0.05 * extent), middle},  // beside
        {world.at(-1e-3 / d.lattice.spacing_m, 0.5 * cells, mid), middle},    // a millimetre before its edge
        {middle + glm::normalize(glm::dvec3(0.4, -1, 0.7)) * 1e6, middle},    // a thousand kilometres away
        {middle + glm::normalize(glm::dvec3(-0.6, 1, 0.3)) * 1e9, middle},    // a million
        {middle + glm::dvec3(0, 0, 1e9), middle},
    };
    std::vector<Camera> views;
    for (const auto& pair : pairs) {
        auto made = look_at(pair[0], pair[1], fov_deg, width, height);
        if (made.ok()) views.push_back(*made);
    }
    EXPECT_GE(views.size(), 9u);
    return views;
}

TEST_P(PageExtremes, SpacingsOfAMillimetreAndOfAHundredKilometres) {
    for (const double spacing : {1e-3, 10.0, 1e5}) {
        TerrainShape shape;
        shape.spacing_m = spacing;
        shape.quantum_m = std::exp2(std::round(std::log2(spacing / 40)));
        MeshedWorld world(shape, test::rough_heights(7, 2000), lod());
        for (const Camera& view : eyes_round(world, 40, 800, 600))
            for (const double tau : {0.0, 1e-3, 1.0, 1e3}) expect_sound(world, view, tau);
        EXPECT_GT(world.places_off(), 1000);
    }
}

TEST_P(PageExtremes, ReliefOfAThousandKilometresAndOfNone) {
    constexpr std::int32_t kMost = 4'000'000;  // quarters of a metre
    const test::HeightFunction grounds[] = {
        [](std::int64_t i, std::int64_t j) { return (i + j) % 2 == 0 ? kMost : -kMost; },
        [](std::int64_t i, std::int64_t j) { return (i / 5 + j / 3) % 2 == 0 ? kMost : -kMost; },
        [](std::int64_t, std::int64_t) { return kMost; },
        [](std::int64_t, std::int64_t) { return -kMost; },
        [rough = test::rough_heights(3, kMost)](std::int64_t i, std::int64_t j) { return rough(i, j); },
    };
    for (const auto& ground : grounds) {
        MeshedWorld world({}, ground, lod());
        for (const Camera& view : eyes_round(world, 60, 800, 600))
            for (const double tau : {0.0, 1e-3, 1.0, 1e3}) expect_sound(world, view, tau);
    }
}

TEST_P(PageExtremes, FieldsOfAHundredthOfADegreeAndOf179) {
    MeshedWorld world({}, test::rough_heights(11, 1500), lod());
    for (const double fov : {0.001, 0.01, 179.0})
        for (const Camera& view : eyes_round(world, fov, 800, 600))
            for (const double tau : {1e-3, 1.0, 1e3}) expect_sound(world, view, tau);
    EXPECT_GT(world.places_off(), 1000);
}

TEST_P(PageExtremes, WindowsOfOnePixelAndOf33Million) {
    MeshedWorld world({}, test::rough_heights(13, 1500), lod());
    constexpr int kWindows[][2] = {{1, 1}, {7680, 4320}, {1, 4320}, {7680, 1}};
    for (const auto& window : kWindows)
        for (const Camera& view : eyes_round(world, 40, window[0], window[1]))
            for (const double tau : {0.0, 1e-3, 1.0, 1e3}) expect_sound(world, view, tau);
    EXPECT_GT(world.places_off(), 1000);
}

TEST_P(PageExtremes, TilesOf5And257SamplesAndOneTile) {
    struct World {
        int n;
        std::int64_t cells;
    };
    for (const World& w : {World{2, 4}, World{2, 64}, World{5, 32}, World{8, 256}, World{8, 512}}) {
        TerrainShape shape;
        shape.tile_cells_log2 = w.n;
        shape.cells_x = shape.cells_y = w.cells;
        MeshedWorld world(shape, test::rough_heights(17, 2500), lod());
        const auto views = eyes_round(world, 50, 800, 600);
        // Large tiles take their time: from over a vertex, straight above and afar; to nothing only a tile of them.
        for (std::size_t k = 0; k < views.size(); k += w.n == 8 ? 4 : 1)
            for (const double tau : {0.0, 1.0, 30.0})
                if (w.n < 8 || tau == 30 || (tau == 0 && w.cells == 256 && k == 4)) expect_sound(world, views[k], tau);
        EXPECT_GT(world.places_off(), 10) << w.n;
    }
}

// Data that ends, has holes, is a strip of cells, or lies at ten thousand kilometres.
TEST_P(PageExtremes, AStripWithHolesFarFromTheOrigin) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    TerrainShape shape;
    shape.origin_x_m = 1e7;
    shape.origin_y_m = -1e7;
    shape.cells_x = 250;
    shape.cells_y = 11;
    MeshedWorld world(shape, test::rough_heights(19, 900), lod(), test::with_absent_discs(random, shape, 4));
    for (int k = 0; k < 40; ++k)
        for (const double tau : {0.0, 0.3, 10.0})
            expect_sound(world, test::random_camera(random, world.terrain()), tau);
    EXPECT_GT(world.places_off(), 1000);
}

TEST_P(PageExtremes, ASmallPlanet) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    MeshedWorld world({}, test::rough_heights(23, 1200), lod());
    for (int k = 0; k < 40; ++k)
        expect_sound(world, test::random_camera(random, world.terrain()), std::exp(test::uniform_real(random, -3, 4)),
                     test::random_half_curvature(random, world.terrain()));
    EXPECT_GT(world.places_off(), 1000);
}

// Bumps that no tile but the finest has a sample of: coarser ones are flat, none of their vertices costs anything, and
// they are off all the same. A planet so small that what flat triangles miss comes to as much again.
TEST_P(PageExtremes, ASmallPlanetOfBumpsThatOnlyTheFinestTilesHave) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    MeshedWorld world(
        {}, [](std::int64_t i, std::int64_t j) { return i % 2 != 0 && j % 2 != 0 ? 40 : 0; }, lod());
    for (int k = 0; k < 100; ++k) {
        const double turn = test::uniform_real(random, 0, 6.28), far = test::uniform_real(random, 250, 400);
        const Camera view =
            camera(world.at(32 + far * std::cos(turn), 32 + far * std::sin(turn), -300), world.at(32, 32, -600), 20);
        // Bumps of 10 m take half of what is allowed; half a hypotenuse of the root has a square of 32 of its cells.
        const double allowed_m = test::uniform_real(random, 21, 26);
        const double half_curvature = test::uniform_real(random, 0.7, 1) * allowed_m / (32 * 80.0 * 80.0);
        const double tau = allowed_m * view.focal_px() * view.off_axis_factor() / (10 * far - 320);
        expect_sound(world, view, tau, half_curvature);
    }
    EXPECT_GT(world.places_off(), 1000);
}

TEST_P(PageExtremes, AnyWorldFromAnyEye) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int k = 0; k < 12; ++k) {
        TerrainShape shape;
        shape.tile_cells_log2 = test::uniform(random, 2, 4);
        shape.cells_x = test::uniform(random, 30, 140);
        shape.cells_y = test::uniform(random, 30, 140);
        shape.spacing_m = std::exp(test::uniform_real(random, -7, 11));
        shape.quantum_m = shape.spacing_m / 100;
        shape.error_growth = k % 2 == 0 ? 1.0f : 1.25f;
        MeshedWorld world(shape, test::rough_heights(random(), 1 << test::uniform(random, 3, 12)), lod());
        for (int view = 0; view < 12; ++view)
            expect_sound(world, test::random_camera(random, world.terrain()),
                         std::exp(test::uniform_real(random, -4, 6)));
    }
}

// look_at makes no such camera; one made by hand sees nothing, and the others nothing of it.
TEST_P(PageExtremes, AViewThatIsNoNumberSeesNothingAndChangesNoOther) {
    MeshedWorld world({}, test::rough_heights(29, 1500), lod());
    const Camera sound = camera(world.at(-5, 20, 300), world.at(30, 30, 50));
    world.draw(sound, 1);
    const DrawnMesh alone = world.mesh();
    ASSERT_FALSE(alone.corners.empty());
    for (int field = 0; field < 11; ++field)
        for (const double bad : {kNan, std::numeric_limits<double>::infinity()}) {
            Camera broken = sound;
            if (field < 3) broken.eye[field] = bad;
            if (field >= 3 && field < 6) broken.forward[field - 3] = bad;
            if (field >= 6 && field < 9) broken.up[field - 6] = bad;
            if (field == 9) broken.fov_deg = bad;
            if (field == 10) broken.near_m = bad;
            const Selection& s = world.draw(broken, 1);
            EXPECT_TRUE(s.draws[0].empty()) << field;
            EXPECT_TRUE(s.requests.empty()) << field;
            EXPECT_TRUE(std::isfinite(s.max_bound_px) && std::isfinite(s.mean_bound_px)) << field;
            for (const bool first : {true, false}) {
                const std::vector<Camera> both{first ? broken : sound, first ? sound : broken};
                world.draw(both, 1);
                EXPECT_EQ(world.mesh(first ? 1 : 0).corners, alone.corners) << field;
                EXPECT_EQ(world.fault(sound, first ? 1 : 0, 1), "") << field;
            }
        }
}

// A camera may stand where squares of distances overflow.
TEST_P(PageExtremes, AnEyeBeyondAllSquaresGivesNumbers) {
    MeshedWorld world({}, test::rough_heights(31, 1500), lod());
    for (const double away : {1e18, 1e100, 1e160, 1e300})
        for (const double tau : {0.0, 1.0}) {
            const glm::dvec3 middle = world.at(32, 32, 50);
            const Camera view = camera(middle + away * glm::dvec3(0.1, -0.5, 0.7), middle);
            const Selection& s = world.draw(view, tau);
            EXPECT_TRUE(std::isfinite(s.max_bound_px) && std::isfinite(s.mean_bound_px));
            EXPECT_LE(s.max_bound_px, lod().promise_px(tau));
        }
}

// A pool too small for what eyes near high peaks want, at any tolerance: drawn whole, as well as asked for or as
// stated.
TEST(PagePool, WhereMeshesDoNotFitTheyAreCoarserOrPatterns) {
    int coarser = 0, patterns = 0, meshes = 0;
    const test::HeightFunction walls = [](std::int64_t i, std::int64_t) { return i % 4 == 1 ? 4'000'000 : -4'000'000; };
    for (const LodMethod method : {LodMethod::rsg, LodMethod::block_rsg})
        for (const auto& ground : {test::rough_heights(41, 300), test::rough_heights(41, 4'000'000), walls})
            for (const std::int64_t tiles : {1, 200}) {
                TerrainShape shape;
                shape.tile_cells_log2 = 2;
                shape.cells_x = shape.cells_y = 96;
                MeshedWorld world(shape, ground, settings(method), {}, tiles);
                const auto views = eyes_round(world, 60, 800, 600);
                for (std::size_t k = 0; k < views.size(); k += 2)
                    for (const double tau : {0.0, 1.0, 1e3}) {
                        const Camera& view = views[k];
                        const Selection& s = world.draw(view, tau);
                        EXPECT_EQ(world.fault(view, 0, tau), "") << "tau " << tau;
                        ASSERT_LE(s.tau_effective_px, std::max(tau, 1.0 / 1024) * 4 * (1 + 1e-9));
                        if (s.draws[0].empty()) continue;
                        const bool by_meshes = std::any_of(s.draws[0].begin(), s.draws[0].end(),
                                                           [](const DrawItem& item) { return item.mesh.count > 0; });
                        ++(!by_meshes ? patterns : s.budget_limited ? coarser : meshes);
                        if (!by_meshes) {
                            EXPECT_LE(s.max_bound_px, tau * (1 + 1e-12));
                        }
                    }
            }
    EXPECT_GT(coarser, 0);
    EXPECT_GT(patterns, 5);
    EXPECT_GT(meshes, 5);
}

// --- reuse -----------------------------------------------------------------------------------------------------------

Camera over(const MeshedWorld& world, double i, double j, double z, double look_i, double look_j, double fov = 50,
            int width = 800, int height = 600) {
    auto made = look_at(world.at(i, j, z), world.at(look_i, look_j, 0), fov, width, height);
    EXPECT_TRUE(made.ok());
    return *made;
}

MeshedWorld cached_world(double s_px, const TerrainShape& shape = {}) {
    return MeshedWorld(shape, test::rough_heights(37, 1500), settings(LodMethod::rsg, ReuseTest::exact, s_px));
}

// 20
TEST(PageReuse, TurningOnTheSpotReusesEveryTileThatWasSeen) {
    for (const double s : {0.0, 0.1, 5.0}) {
        MeshedWorld world = cached_world(s);
        const Camera ahead = over(world, -20, 32, 250, 40, 32);
        world.draw(ahead, 1);
        EXPECT_EQ(world.counters().chosen, world.counters().tiles);
        ASSERT_GT(world.counters().tiles, 4);
        world.draw(ahead, 1);
        EXPECT_EQ(world.counters().chosen, 0);
        EXPECT_EQ(world.counters().remade, 0);
        world.draw(over(world, -20, 32, 250, 40, 34, 40), 1);  // within what the wider view saw
        EXPECT_EQ(world.fault(over(world, -20, 32, 250, 40, 34, 40), 0, 1), "");
    }
}

// 20, and s = 0.
TEST(PageReuse, WithoutAnAllowanceAnyMotionChoosesAnew) {
    MeshedWorld world = cached_world(0);
    world.draw(over(world, -20, 32, 250, 40, 32), 1);
    world.draw(over(world, -20 + 1e-7, 32, 250, 40, 32), 1);
    EXPECT_EQ(world.counters().chosen, world.counters().tiles);
}

// 20: who holds more detail than is wanted may keep it; who wants more must choose.
TEST(PageReuse, ALeapAReloadAnotherToleranceAndANarrowerFieldChooseAnew) {
    MeshedWorld world = cached_world(0.1);
    const Camera here = over(world, -20, 32, 250, 40, 32);
    const auto chosen_all = [&](const Camera& then, double tau) {
        world.draw(here, 1);
        world.draw(then, tau);
        EXPECT_GT(world.counters().tiles, 0);
        const bool all = world.counters().chosen == world.counters().tiles;
        world.reload();  // forgets
        return all;
    };
    EXPECT_TRUE(chosen_all(over(world, -20, 32, 1e6, 32, 32, 1), 1));  // a leap of a thousand kilometres
    EXPECT_TRUE(chosen_all(here, 0.5));
    EXPECT_TRUE(chosen_all(here, 0.99));
    EXPECT_TRUE(chosen_all(over(world, -20, 32, 250, 40, 32, 49), 1));             // f grows
    EXPECT_TRUE(chosen_all(over(world, -20, 32, 250, 40, 32, 50, 800, 601), 1));   // more pixels
    EXPECT_TRUE(chosen_all(over(world, -20, 32, 250, 40, 32, 50, 1200, 600), 1));  // K grows
    EXPECT_FALSE(chosen_all(here, 1));
    world.draw(here, 1);
    world.draw(here, 1);
    EXPECT_EQ(world.counters().chosen, 0);
    world.reload();
    world.draw(here, 1);
    EXPECT_EQ(world.counters().chosen, world.counters().tiles);
}

// The bound over flights: each frame is held to tau + s, whatever frames its tiles were chosen in.
TEST(PageReuse, FlightsOfAnyStepKeepTauPlusS) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    std::int64_t reused = 0, tiles = 0;
    double worst = 0;
    constexpr double kTau = 12;
    for (const double s : {1.0, 12.0, 30.0, 500.0})  // up to far above tau
        for (const double step : {1e-3, 0.3, 5.0, 200.0}) {
            MeshedWorld world = cached_world(s);
            const double above = test::uniform(random, 0, 1) == 0 ? 20 : 300;
            glm::dvec3 eye = world.at(test::uniform(random, -10, 70), test::uniform(random, -10, 70), 150 + above);
            for (int frame = 0; frame < 25; ++frame) {
                eye += step * glm::dvec3(test::uniform_real(random, -0.3, 1), test::uniform_real(random, -1, 1),
                                         test::uniform_real(random, -0.3, 0.3));
                const auto view = look_at(eye, world.at(32, 32, 0), 60, 800, 600);
                ASSERT_TRUE(view.ok());
                world.draw(*view, kTau);
                const double off_px = world.greatest_error_px(*view, world.mesh(), 0);
                ASSERT_LE(off_px, (kTau + s) * (1 + 1e-9)) << "s " << s << ", " << step << " m a frame";
                if (frame % 8 == 7) {
                    ASSERT_EQ(world.fault(*view, 0, kTau), "") << "s " << s << ", " << step << " m a frame";
                }
                worst = std::max(worst, off_px / (kTau + s));
                tiles += world.counters().tiles;
                reused += world.counters().tiles - world.counters().chosen;
            }
        }
    EXPECT_GT(reused, tiles / 4);
    EXPECT_LT(reused, tiles);
    EXPECT_GT(worst, 0.2);
}

// Motions of about a millimetre at ten thousand kilometres are judged as they are at the origin. Steps of 2^-10 m and
// powers of two keep every sum exact.
TEST(PageReuse, MillimetresAtTenThousandKilometresAreJudgedAsAtTheOrigin) {
    TerrainShape near_shape, far_shape;
    near_shape.spacing_m = far_shape.spacing_m = 8;
    near_shape.origin_x_m = near_shape.origin_y_m = 0;
    far_shape.origin_x_m = 1e7;
    far_shape.origin_y_m = -1e7;
    MeshedWorld near_world = cached_world(0.001, near_shape), far_world = cached_world(0.001, far_shape);
    std::int64_t chosen = 0, reused = 0;
    for (int frame = 0; frame < 400; ++frame) {
        const double i = 40 + frame * 0x1p-13;  // 2^-10 m
        for (MeshedWorld* world : {&near_world, &far_world}) world->draw(over(*world, i, 70, 64, i, 20), 0.5);
        ASSERT_EQ(near_world.counters().chosen, far_world.counters().chosen) << frame;
        ASSERT_EQ(near_world.counters().triangles, far_world.counters().triangles) << frame;
        ASSERT_EQ(near_world.mesh().corners, far_world.mesh().corners) << frame;
        if (frame == 0) continue;
        chosen += near_world.counters().chosen;
        reused += near_world.counters().tiles - near_world.counters().chosen;
    }
    EXPECT_GT(chosen, 0);
    EXPECT_GT(reused, 10 * chosen);
}

}  // namespace
}  // namespace scree
