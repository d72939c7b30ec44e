#include "runtime/render/line_renderer.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <memory>
#include <vector>

#include "common/mesh/vertex_slot.h"
#include "runtime/render/renderer.h"
#include "tests/runtime/render/gl_test.h"

namespace scree {
namespace {

constexpr int kSize_px = 100;

struct Picture {
    std::vector<std::uint8_t> rgb;
    int red(int x, int y) const { return rgb[3 * static_cast<std::size_t>(y * kSize_px + x)]; }
    std::array<int, 3> at(int x, int y) const {
        const auto k = 3 * static_cast<std::size_t>(y * kSize_px + x);
        return {rgb[k], rgb[k + 1], rgb[k + 2]};
    }
};

double light_of(int srgb) {
    const double c = srgb / 255.0;
    return c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4);
}

/// Lines over a black plane of 1000 x 1000 m in the middle of `middle`, at height 0; the rest of the picture is
/// magenta.
class LineRendererTest : public GlTest {
protected:
    void make(glm::dvec2 middle = {0, 0}) {
        auto lattice = make_lattice(middle.x - 500, middle.y + 500, 1000.0 / 16, 16, 16, 4);
        ASSERT_TRUE(lattice.ok());
        RendererOptions options;
        options.lattice = *lattice;
        options.texture_size_log2 = 4;
        auto ground = Renderer::create(options);
        ASSERT_TRUE(ground.ok());
        ground_ = std::move(*ground);
        ground_->upload_height(0, flat_slot(4, 0));
        ground_->upload_texture(0, plain_texture(4, 0));
        auto lines = LineRenderer::create();
        ASSERT_TRUE(lines.ok()) << lines.error().message;
        lines_ = std::move(*lines);
    }

    Picture draw(const Camera& camera, const std::vector<LineSegment>& lines, double width_px, double hidden_share = 0,
                 int samples = 0) {
        auto target = RenderTarget::create({kSize_px, kSize_px, samples});
        EXPECT_TRUE(target.ok());
        FrameSettings settings;
        settings.magenta_background = true;
        const DrawItem tile;
        ground_->draw(camera, {&tile, 1}, settings, *target);
        lines_->draw(camera, lines, width_px, hidden_share, *target);
        return {target->read_pixels()};
    }

    /// Straight down on the middle, north up: 100 m from side to side at height 0.
    static Camera from_above(glm::dvec2 middle = {0, 0}) {
        auto camera = look_at({middle.x, middle.y, 50}, {middle.x, middle.y, 0}, 90, kSize_px, kSize_px);
        EXPECT_TRUE(camera.ok());
        return *camera;
    }

    std::unique_ptr<Renderer> ground_;
    std::unique_ptr<LineRenderer> lines_;
};

TEST_F(LineRendererTest, WidthAndColourAreWhatWasAskedAtEveryDistance) {
    make();
    for (const double height_m : {0.0, 25.0, 45.0})
        for (const double width_px : {0.5, 1.0, 3.0, 8.0}) {
            const Picture picture =
                draw(from_above(), {{{-400, 0, height_m}, {400, 0, height_m}, {255, 255, 255, 255}}}, width_px);
            double light = 0;
            for (int y = 0; y < kSize_px; ++y) light += light_of(picture.red(30, y));
            EXPECT_NEAR(light, width_px, 0.03 * width_px + 0.01) << height_m << " m, " << width_px << " px";
        }
    const Picture coloured = draw(from_above(), {{{-40, 0, 1}, {40, 0, 1}, {200, 100, 50, 255}}}, 5);
    EXPECT_EQ(coloured.at(50, 49), (std::array<int, 3>{200, 100, 50}));
    EXPECT_EQ(coloured.at(50, 40), (std::array<int, 3>{0, 0, 0}));
}

TEST_F(LineRendererTest, OpacityMixesLight) {
    make();
    const Picture half = draw(from_above(), {{{-40, 0, 1}, {40, 0, 1}, {255, 255, 255, 128}}}, 5);
    EXPECT_NEAR(light_of(half.red(50, 49)), 128 / 255.0, 0.01);
}

TEST_F(LineRendererTest, EndsLieWhereTheyShould) {
    make();
    // From 20 m west to 10 m east of the middle, 10 m north of it: a pixel a metre.
    const Picture picture = draw(from_above(), {{{-20, 10.5, 0}, {10, 10.5, 0}, {255, 255, 255, 255}}}, 2);
    EXPECT_EQ(picture.red(32, 39), 255);
    EXPECT_EQ(picture.red(58, 39), 255);
    for (const int x : {0, 20, 27, 62, 80, 99}) EXPECT_EQ(picture.red(x, 39), 0) << x;
    for (const int y : {0, 30, 42, 60, 99}) EXPECT_EQ(picture.red(50, y), 0) << y;
}

TEST_F(LineRendererTest, WhatLiesBehindTheEyeIsCutOffAndNotMirrored) {
    make();
    // Level, 10 m up, looking north; the line runs along the way at the eye's height less 5 m, from far behind it.
    auto camera = look_at({0, 0, 10}, {0, 100, 10}, 90, kSize_px, kSize_px);
    ASSERT_TRUE(camera.ok());
    const LineSegment through{{0, -1e9, 5}, {0, 1e9, 5}, {255, 255, 255, 255}};
    const LineSegment behind{{-30, -20, 15}, {30, -20, 15}, {255, 255, 255, 255}};
    const Picture picture = draw(*camera, {through, behind}, 3);
    for (int y = 52; y < kSize_px; ++y) EXPECT_EQ(picture.at(50, y), (std::array<int, 3>{255, 255, 255})) << y;
    for (int y = 0; y < 46; ++y)
        for (int x = 0; x < kSize_px; ++x) ASSERT_EQ(picture.at(x, y), (std::array<int, 3>{255, 0, 255})) << x << y;
}

TEST_F(LineRendererTest, WhatIsNearerThanTheNearPlaneIsNotDrawn) {
    make();
    // 5 cm below the eye, which sees from 10 cm on; and 15 cm.
    EXPECT_EQ(draw(from_above(), {{{-0.02, 0, 49.95}, {0.02, 0, 49.95}}}, 5).rgb, draw(from_above(), {}, 5).rgb);
    EXPECT_EQ(draw(from_above(), {{{-0.02, 0, 49.85}, {0.02, 0, 49.85}}}, 5).red(50, 49), 255);
}

TEST_F(LineRendererTest, NumbersThatAreNoneDrawNothing) {
    make();
    const double none = std::nan(""), endless = HUGE_VAL;
    const Picture empty = draw(from_above(), {}, 3);
    const Picture picture =
        draw(from_above(), {{{none, 0, 0}, {10, 0, 0}}, {{0, 0, 0}, {endless, 0, 0}}, {{0, 0, 0}, {0, 0, 200}}}, 3);
    // The last runs through the eye: of it the middle shows.
    EXPECT_EQ(picture.red(80, 50), empty.red(80, 50));
    EXPECT_EQ(picture.red(20, 50), empty.red(20, 50));
    EXPECT_EQ(picture.red(50, 50), 255);
}

TEST_F(LineRendererTest, HiddenPartsShowAtTheirShare) {
    make();
    const std::vector<LineSegment> below{{{-40, 0, -10}, {40, 0, -10}, {255, 255, 255, 255}}};
    EXPECT_EQ(draw(from_above(), below, 5, 0).red(50, 49), 0);
    EXPECT_NEAR(light_of(draw(from_above(), below, 5, 0.25).red(50, 49)), 0.25, 0.01);
    EXPECT_EQ(draw(from_above(), below, 5, 1).red(50, 49), 255);
    // Crossing the ground: seen on one side of the middle and hidden on the other.
    const std::vector<LineSegment> crossing{{{-40, 0, -20}, {40, 0, 20}, {255, 255, 255, 255}}};
    const Picture picture = draw(from_above(), crossing, 5, 0);
    for (int x = 20; x < 48; ++x) EXPECT_EQ(picture.red(x, 49), 0) << x;
    for (int x = 52; x < 90; ++x) EXPECT_EQ(picture.red(x, 49), 255) << x;
    // On the ground: in front of it.
    EXPECT_EQ(draw(from_above(), {{{-40, 0, 0}, {40, 0, 0}, {255, 255, 255, 255}}}, 5, 0).red(50, 49), 255);
}

TEST_F(LineRendererTest, TargetsOfSeveralSamplesShowTheSame) {
    make();
    const std::vector<LineSegment> lines{{{-40, -30, 3}, {40, 35, 3}, {255, 255, 255, 255}},
                                         {{-40, 20, -5}, {40, 20, -5}, {255, 255, 255, 255}}};
    const Picture one = draw(from_above(), lines, 4, 0.3), four = draw(from_above(), lines, 4, 0.3, 4);
    double one_light = 0, four_light = 0;
    for (int y = 0; y < kSize_px; ++y)
        for (int x = 0; x < kSize_px; ++x) {
            one_light += light_of(one.red(x, y));
            four_light += light_of(four.red(x, y));
            ASSERT_NEAR(one.red(x, y), four.red(x, y), 40) << x << ' ' << y;
        }
    EXPECT_GT(one_light, 300);
    EXPECT_NEAR(one_light, four_light, 0.01 * one_light);
}

TEST_F(LineRendererTest, FarFromTheOriginLinesLieAsExactly) {
    const std::vector<LineSegment> near_origin{{{-13.37, -21.11, 2}, {33.3, 17.77, 2}, {255, 255, 255, 255}}};
    make();
    const Picture expected = draw(from_above(), near_origin, 1.5);
    for (const glm::dvec2 middle : {glm::dvec2(1e7, 1e7), glm::dvec2(-1.5e7, 2e7)}) {
        make(middle);
        std::vector<LineSegment> moved = near_origin;
        for (LineSegment& line : moved) {
            line.from += glm::dvec3(middle, 0);
            line.to += glm::dvec3(middle, 0);
        }
        const Picture picture = draw(from_above(middle), moved, 1.5);
        for (std::size_t k = 0; k < expected.rgb.size(); ++k) ASSERT_NEAR(picture.rgb[k], expected.rgb[k], 1);
    }
}

TEST_F(LineRendererTest, TheNextPictureIsAsIfThereHadBeenNoLines) {
    make();
    const Picture before = draw(from_above(), {}, 3);
    draw(from_above(), {{{-40, 0, 1}, {40, 0, 1}, {255, 255, 255, 128}}}, 5, 0.5);
    EXPECT_EQ(draw(from_above(), {}, 3).rgb, before.rgb);
}

}  // namespace
}  // namespace scree
