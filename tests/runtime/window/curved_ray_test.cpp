#include "runtime/window/curved_ray.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "runtime/view/curvature.h"
#include "tests/runtime/lod/memory_store.h"

namespace scree {
namespace {

constexpr double kHalfCurvature = 0.5 / kEarthRadius_m;

// A hundred kilometres across: its far side is 200 m and more below the horizontal.
test::SyntheticTerrain wide_hills() {
    test::TerrainShape shape;
    shape.tile_cells_log2 = 5;
    shape.cells_x = shape.cells_y = 512;
    shape.spacing_m = 200;
    return test::SyntheticTerrain(shape, test::rough_heights(5, 4000));
}

/// Ground of a terrain in memory, a camera, and what the picture does with a place.
class CurvedRay : public testing::Test {
protected:
    CurvedRay() : terrain_(wide_hills()), store_(terrain_) {
        auto opened = Ground::open(store_);
        EXPECT_TRUE(opened.ok());
        ground_ = std::move(*opened);
    }

    Camera random_camera(test::Random& random) {
        const Lattice& l = terrain_.lattice();
        const auto place = [&] {
            return glm::dvec3(l.x_m(test::uniform_real(random, 0, 512)), l.y_m(test::uniform_real(random, 0, 512)), 0);
        };
        glm::dvec3 eye = place(), look = place();
        eye.z = height(eye).value_or(0) + std::pow(10, test::uniform_real(random, 0.5, 4));
        look.z = height(look).value_or(0);
        auto camera = look_at(eye, look, 40, 800, 600);
        EXPECT_TRUE(camera.ok());
        return *camera;
    }
    std::optional<double> height(const glm::dvec3& p) {
        auto h = ground_->height(p.x, p.y);
        EXPECT_TRUE(h.ok());
        return h.ok() && *h ? std::optional((*h)->height_m) : std::nullopt;
    }
    /// Through a pixel, from the picture's top left corner.
    static glm::dvec3 ray(const Camera& c, const glm::dvec2& px) {
        return c.forward + (2 * px.x / c.width_px - 1) * c.tan_half_x() * c.right() +
               (1 - 2 * px.y / c.height_px) * c.tan_half_y() * c.up;
    }
    /// The pixel in which the picture shows a place of the flat map.
    static glm::dvec2 pixel(const Camera& c, glm::dvec3 p, double half_curvature) {
        p -= c.eye;
        p.z -= half_curvature * (p.x * p.x + p.y * p.y);
        const double w = glm::dot(p, c.forward);
        EXPECT_GT(w, 0);
        return {(glm::dot(p, c.right()) / w / c.tan_half_x() + 1) / 2 * c.width_px,
                (1 - glm::dot(p, c.up) / w / c.tan_half_y()) / 2 * c.height_px};
    }
    std::optional<glm::dvec3> cast(const Camera& c, const glm::dvec3& direction, double half_curvature) {
        auto hit = cast_curved_ray(*ground_, c.eye, direction, half_curvature);
        EXPECT_TRUE(hit.ok());
        return hit.ok() ? *hit : std::nullopt;
    }
    /// How far the picture's ground at distance d of a ray lies under it, seen from the eye, radians.
    std::optional<double> clearance(const Camera& c, const glm::dvec3& direction, double t, double half_curvature) {
        const glm::dvec3 p = c.eye + t * direction;
        const double d = glm::length(glm::dvec2(p - c.eye));
        const auto h = height(p);
        if (!h) return std::nullopt;
        return (p.z - (*h - half_curvature * d * d)) / t;
    }

    test::SyntheticTerrain terrain_;
    test::MemoryStore store_;
    std::unique_ptr<Ground> ground_;
};

TEST_F(CurvedRay, MeetsTheGroundWhereThePictureShowsIt) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    int hits = 0, far = 0, differ = 0;
    for (int k = 0; k < 800; ++k) {
        const Camera camera = random_camera(random);
        const glm::dvec2 px{test::uniform_real(random, 0, 800), test::uniform_real(random, 0, 600)};
        for (const double curvature : {kHalfCurvature, 0.0}) {
            const auto hit = cast(camera, ray(camera, px), curvature);
            if (!hit) continue;
            const auto h = height(*hit);
            ASSERT_TRUE(h);
            EXPECT_NEAR(hit->z, *h, 1e-3) << "on the surface";
            EXPECT_LT(glm::length(pixel(camera, *hit, curvature) - px), 0.01);
            if (curvature == 0) continue;
            ++hits;
            far += glm::length(*hit - camera.eye) > 20000;
            differ += glm::length(pixel(camera, *hit, 0) - px) > 0.5;
        }
    }
    EXPECT_GT(hits, 50);
    EXPECT_GT(far, 3);
    EXPECT_GT(differ, 10) << "rays that the earth's bend matters to";
}

TEST_F(CurvedRay, LooksThroughNoGroundBeforeIt) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed() + 1);
    constexpr double kSlack_rad = 1e-5;
    int hits = 0, misses = 0;
    for (int k = 0; k < 150; ++k) {
        const Camera camera = random_camera(random);
        const glm::dvec3 along =
            glm::normalize(ray(camera, {test::uniform_real(random, 0, 800), test::uniform_real(random, 0, 600)}));
        const auto hit = cast(camera, along, kHalfCurvature);
        const glm::dvec3 lowered =
            hit ? *hit - glm::dvec3(0, 0, kHalfCurvature * std::pow(glm::length(glm::dvec2(*hit - camera.eye)), 2))
                : glm::dvec3(0);
        const double end = hit ? glm::length(lowered - camera.eye) - 1 : 200000;
        ++(hit ? hits : misses);
        for (double t = 20; t < end; t += 37) {
            const auto above = clearance(camera, along, t, kHalfCurvature);
            if (!above) continue;
            ASSERT_GT(*above, -kSlack_rad) << "of a ray that " << (hit ? "goes on" : "meets nothing") << ", at " << t;
        }
    }
    EXPECT_GT(hits, 30);
    EXPECT_GT(misses, 10);
}

TEST_F(CurvedRay, GoesOverTheHorizonWhereAStraightOneHits) {
    // Level with a ridge of 1000 m that is 80 km away: 500 m of it are below the horizontal.
    test::TerrainShape shape;
    shape.tile_cells_log2 = 4;
    shape.cells_x = 512;
    shape.cells_y = 64;
    shape.spacing_m = 200;
    shape.quantum_m = 1;
    const test::SyntheticTerrain terrain(shape, [](std::int64_t i, std::int64_t) { return i > 400 ? 1000 : 0; });
    const test::MemoryStore store(terrain);
    auto ground = Ground::open(store);
    ASSERT_TRUE(ground.ok());
    const Lattice& l = terrain.lattice();
    const glm::dvec3 eye{l.x_m(0.5), l.y_m(32), 700};
    const auto hits = [&](double slope, double curvature) {
        auto hit = cast_curved_ray(**ground, eye, {1, 0, slope}, curvature);
        EXPECT_TRUE(hit.ok());
        return hit.ok() && hit->has_value();
    };
    EXPECT_TRUE(hits(0, 0));
    EXPECT_FALSE(hits(0, kHalfCurvature)) << "80 km on it is 502 m higher";
    EXPECT_TRUE(hits(-0.004, kHalfCurvature));
}

TEST_F(CurvedRay, StraightDownMeetsWhatIsBelow) {
    const Lattice& l = terrain_.lattice();
    const glm::dvec3 eye{l.x_m(100.25), l.y_m(37.75), 5000};
    for (const double lean : {0.0, 1e-300, 1e-12, 1e-8, 1e-5}) {
        auto hit = cast_curved_ray(*ground_, eye, {lean, 0, -1}, kHalfCurvature);
        ASSERT_TRUE(hit.ok() && *hit) << lean;
        EXPECT_NEAR((*hit)->z, *height(eye), 1) << lean;
        EXPECT_NEAR((*hit)->x, eye.x, 0.1) << lean;
        auto up = cast_curved_ray(*ground_, eye, {lean, 0, 1}, kHalfCurvature);
        ASSERT_TRUE(up.ok());
        EXPECT_FALSE(*up) << lean;
    }
}

TEST_F(CurvedRay, OddNumbersAreAnErrorOrNoHitAndComeToAnEnd) {
    constexpr double kNaN = std::numeric_limits<double>::quiet_NaN(), kHuge = 1e300;
    const Lattice& l = terrain_.lattice();
    const glm::dvec3 eye{l.x_m(100), l.y_m(100), 5000};
    EXPECT_FALSE(cast_curved_ray(*ground_, eye, {0, 0, 0}, kHalfCurvature).ok());
    EXPECT_FALSE(cast_curved_ray(*ground_, {kNaN, 0, 0}, {1, 0, 0}, kHalfCurvature).ok());
    EXPECT_FALSE(cast_curved_ray(*ground_, eye, {kNaN, 0, -1}, kHalfCurvature).ok());
    (void)cast_curved_ray(*ground_, eye, {1, 0.3, -0.2}, kHuge);  // no step of it is longer than nothing
    for (const double curvature : {1.0, 5e-324, -1.0, kNaN})
        EXPECT_TRUE(cast_curved_ray(*ground_, eye, {1, 0.3, -0.2}, curvature).ok()) << curvature;
    EXPECT_TRUE(cast_curved_ray(*ground_, eye, {kHuge, kHuge, -kHuge}, kHalfCurvature).ok());
    const auto far = cast_curved_ray(*ground_, {-1e13, 1e13, 10}, {1, -1, 0}, kHalfCurvature);
    ASSERT_TRUE(far.ok());
    EXPECT_FALSE(*far);
}

}  // namespace
}  // namespace scree
