#include "runtime/app/see_through.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <optional>
#include <vector>

#include "runtime/view/curvature.h"
#include "tests/runtime/lod/memory_store.h"

namespace scree {
namespace {

using test::MemoryStore;
using test::SyntheticTerrain;

/// A level plain with parts of it absent: where a ray meets it is known without walking any tile.
class Plain {
public:
    Plain(double spacing_m, test::PresenceFunction present)
        : terrain_(
              shape(spacing_m), [](std::int64_t, std::int64_t) { return 0; }, present),
          store_(terrain_),
          ground_(std::move(*Ground::open(store_))) {}

    Ground& ground() { return *ground_; }
    const Lattice& lattice() const { return terrain_.lattice(); }
    double height_m() const { return terrain_.height_m(0, 0); }

    /// Does the ray through a point of the picture meet the plain, as the eye sees it?
    bool meets(const Camera& camera, double half_curvature, double x_px, double y_px) const {
        const double across = (x_px - camera.width_px / 2.0) / camera.focal_px(),
                     up = (camera.height_px / 2.0 - y_px) / camera.focal_px();
        const glm::dvec3 d = camera.forward + across * camera.right() + up * camera.up;
        // eye + t d on the plain lowered by curvature: h - k (t |d_xy|)^2 = eye_z + t d_z.
        const double k = half_curvature * (d.x * d.x + d.y * d.y), drop = camera.eye.z - height_m();
        double t = -drop / d.z;
        if (k > 0) {
            const double under_root = d.z * d.z - 4 * k * drop;
            if (under_root < 0) return false;
            t = 2 * drop / (-d.z + std::sqrt(under_root));
        }
        if (!(t > 0)) return false;
        const glm::dvec3 p = camera.eye + t * d;
        return terrain_.present(static_cast<std::int64_t>(std::floor(lattice().i_of(p.x))),
                                static_cast<std::int64_t>(std::floor(lattice().j_of(p.y))));
    }

private:
    static test::TerrainShape shape(double spacing_m) {
        test::TerrainShape s;
        s.spacing_m = spacing_m;
        return s;
    }
    SyntheticTerrain terrain_;
    MemoryStore store_;
    std::unique_ptr<Ground> ground_;
};

/// A picture of the plain as a perfect renderer draws it over magenta.
class Picture {
public:
    Picture(const Plain& plain, const Camera& camera, double half_curvature)
        : plain_(plain), camera_(camera), half_curvature_(half_curvature), pixels_(at(0, camera.height_px)) {
        for (int y = 0; y < camera.height_px; ++y)
            for (int x = 0; x < camera.width_px; ++x) set(x, y, !plain.meets(camera, half_curvature, x + 0.5, y + 0.5));
    }
    void set(int x, int y, bool magenta) {
        std::uint8_t* p = &pixels_[at(x, y)];
        p[0] = magenta ? 255 : 90;
        p[1] = magenta ? 0 : 120;
        p[2] = magenta ? 255 : 60;
    }
    bool magenta(int x, int y) const { return pixels_[at(x, y) + 1] == 0; }
    std::span<const std::uint8_t> bytes() const { return pixels_; }
    /// What must be counted: by the definition in the header.
    std::int64_t truth(double tolerance_px) const {
        std::int64_t count = 0;
        for (int x = 0; x < camera_.width_px; ++x) {
            bool drawn_above = false;
            for (int y = 0; y < camera_.height_px; ++y) {
                drawn_above = drawn_above || !magenta(x, y);
                if (!magenta(x, y) || !drawn_above) continue;
                bool behind = true;
                for (const double offset : {-tolerance_px, 0.0, tolerance_px})
                    behind = behind && plain_.meets(camera_, half_curvature_, x + 0.5, y + 0.5 + offset);
                count += behind ? 1 : 0;
            }
        }
        return count;
    }

private:
    std::size_t at(int x, int y) const { return 3 * static_cast<std::size_t>(y * camera_.width_px + x); }

    const Plain& plain_;
    const Camera& camera_;
    double half_curvature_;
    std::vector<std::uint8_t> pixels_;
};

// Stands in for a lake and an edge of the data inside the extent.
bool with_gaps(std::int64_t i, std::int64_t j) {
    const bool lake = (i - 30) * (i - 30) + (j - 30) * (j - 30) < 36;
    return !lake && i < 58;
}

struct View {
    double i, j, above_m, look_i, look_j;
};

Camera camera_of(const Plain& plain, const View& v, double scale) {
    const Lattice& l = plain.lattice();
    auto camera = look_at({l.x_m(v.i), l.y_m(v.j), plain.height_m() + scale * v.above_m},
                          {l.x_m(v.look_i), l.y_m(v.look_j), plain.height_m()}, 50, 64, 48);
    EXPECT_TRUE(camera.ok());
    return *camera;
}

/// From within, over the lake, from outside, steeply down: in metres of a plain of 640 m.
const std::array<View, 5> kViews{{{10.3, 50.2, 40, 35.1, 25.7},
                                  {30.2, 30.4, 25, 50.1, 31.3},
                                  {-25.2, 31.7, 60, 30.2, 30.1},
                                  {33.3, 40.1, 300, 31.2, 30.4},
                                  {20.1, 61.7, 8, 22.4, 5.3}}};

void expect_planted_holes_counted(double spacing_m, double half_curvature) {
    test::Random random(test::seed());
    Plain plain(spacing_m, with_gaps);
    std::int64_t planted = 0;
    for (const View& view : kViews) {
        const Camera camera = camera_of(plain, view, spacing_m / 10);
        for (const double tolerance_px : {1.0, 2.5}) {
            Picture picture(plain, camera, half_curvature);
            auto count = count_see_through(plain.ground(), camera, half_curvature, tolerance_px, picture.bytes());
            ASSERT_TRUE(count.ok());
            ASSERT_EQ(*count, 0) << "sky, the lake and the edge of the data are no holes";
            for (int hole = 0; hole < 12; ++hole) {
                const int x = test::uniform(random, 0, 60), y = test::uniform(random, 0, 44);
                for (int k = 0; k < 9; ++k) picture.set(x + k % 3, y + k / 3, true);
                const std::int64_t truth = picture.truth(tolerance_px);
                count = count_see_through(plain.ground(), camera, half_curvature, tolerance_px, picture.bytes());
                ASSERT_TRUE(count.ok());
                ASSERT_EQ(*count, truth);
            }
            planted += *count;
        }
    }
    EXPECT_GT(planted, 200);
}

TEST(SeeThrough, PlantedHolesAreCountedToThePixel) {
    SCREE_TRACE_SEED();
    expect_planted_holes_counted(10, 0);
}

// 64 km across: the far edge is lowered by 300 m.
TEST(SeeThrough, PlantedHolesAreCountedOnARoundEarthToo) {
    SCREE_TRACE_SEED();
    expect_planted_holes_counted(1000, 0.5 / kEarthRadius_m);
}

// What the round earth hides is not behind the picture: seen as flat, the plain would reach higher.
TEST(SeeThrough, BeyondTheHorizonThereIsNothing) {
    Plain plain(1000, [](std::int64_t, std::int64_t) { return true; });
    const Lattice& l = plain.lattice();
    auto camera = look_at({l.x_m(1.3), l.y_m(32.2), plain.height_m() + 60},
                          {l.x_m(30), l.y_m(32.2), plain.height_m() + 60}, 2, 16, 200);
    ASSERT_TRUE(camera.ok());
    Picture picture(plain, *camera, 0.5 / kEarthRadius_m);
    for (int x = 0; x < 16; ++x) picture.set(x, 0, false);  // a balloon: everything below it is looked at
    auto round = count_see_through(plain.ground(), *camera, 0.5 / kEarthRadius_m, 1, picture.bytes());
    auto flat = count_see_through(plain.ground(), *camera, 0, 1, picture.bytes());
    ASSERT_TRUE(round.ok() && flat.ok());
    EXPECT_EQ(*round, 0);
    EXPECT_GT(*flat, 100);
}

TEST(SeeThrough, ASilhouetteMayBeOffByTheToleranceAndAHoleMayNot) {
    Plain plain(10, [](std::int64_t, std::int64_t) { return true; });
    const Camera camera = camera_of(plain, kViews[2], 1);
    Picture picture(plain, camera, 0);
    // The highest two drawn pixels of every column are lost but for the topmost, which keeps what is below it in view.
    int lost = 0;
    for (int x = 0; x < 64; ++x)
        for (int y = 1; y < 47; ++y)
            if (picture.magenta(x, y - 1) && !picture.magenta(x, y)) {
                picture.set(x, 0, false);
                picture.set(x, y, true);
                ++lost;
                break;
            }
    ASSERT_GT(lost, 20);
    const auto strict = count_see_through(plain.ground(), camera, 0, 0.001, picture.bytes());
    const auto allowed = count_see_through(plain.ground(), camera, 0, 1.5, picture.bytes());
    ASSERT_TRUE(strict.ok() && allowed.ok());
    EXPECT_GT(*strict, lost / 2);
    EXPECT_EQ(*allowed, 0);
}

// The sea floor of a small island: the eye is at height 0, the ground further below it than the terrain is wide.
TEST(SeeThrough, GroundFarBelowTheEyeIsMet) {
    test::TerrainShape shape;
    shape.cells_x = shape.cells_y = 16;
    const SyntheticTerrain terrain(shape, [](std::int64_t, std::int64_t) { return -16000; });  // -3950 m
    const MemoryStore store(terrain);
    auto ground = Ground::open(store);
    ASSERT_TRUE(ground.ok());
    const Lattice& l = terrain.lattice();
    auto camera = look_at({l.x_m(8.2), l.y_m(8.3), 0}, {l.x_m(8.2), l.y_m(8.3), -1}, 1, 20, 20);
    ASSERT_TRUE(camera.ok());
    std::vector<std::uint8_t> picture;
    for (int k = 0; k < 400; ++k) picture.insert(picture.end(), {255, static_cast<std::uint8_t>(k < 20 ? 9 : 0), 255});
    for (const double half_curvature : {0.0, 0.5 / kEarthRadius_m}) {
        const auto count = count_see_through(**ground, *camera, half_curvature, 0.1, picture);
        ASSERT_TRUE(count.ok());
        EXPECT_EQ(*count, 380);
    }
}

TEST(SeeThrough, HandsOnTheErrorOfADamagedStore) {
    const SyntheticTerrain terrain({}, test::rough_heights(1, 100));
    MemoryStore store(terrain);
    for (const TileId id : terrain.tiles())
        if (id.level == 3) store.damage(TileKind::height, id, test::Damage::checksum);
    auto ground = Ground::open(store);
    ASSERT_TRUE(ground.ok());
    const Lattice& l = terrain.lattice();
    auto camera = look_at({l.x_m(32.2), l.y_m(32.3), 500}, {l.x_m(32.2), l.y_m(32.3), 0}, 40, 8, 8);
    std::vector<std::uint8_t> picture;
    for (int k = 0; k < 64; ++k) picture.insert(picture.end(), {255, static_cast<std::uint8_t>(k < 8 ? 9 : 0), 255});
    EXPECT_FALSE(count_see_through(**ground, *camera, 0, 1, picture).ok());
}

}  // namespace
}  // namespace scree
