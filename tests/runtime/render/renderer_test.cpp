#include "runtime/render/renderer.h"

#include <epoxy/gl.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "common/mesh/tile_patterns.h"
#include "common/texture_tile.h"
#include "tests/runtime/render/gl_test.h"

namespace scree {
namespace {

using Rgb = std::array<int, 3>;
constexpr Rgb kRed{255, 0, 0}, kGreen{0, 255, 0}, kBlue{0, 0, 255}, kWhite{255, 255, 255}, kMagenta{255, 0, 255};

constexpr int kSize_px = 96;
constexpr int kTextureLog2 = 4;
constexpr double kWorld_m = 320;

/// A square world of 320 m whose middle is at (1160, 1840); `tile_cells_log2` 4 and 64 cells give levels 0 to 2.
Lattice small_world(std::int64_t cells = 64, int tile_cells_log2 = 4) {
    auto lattice = make_lattice(1000, 2000, kWorld_m / static_cast<double>(cells), cells, cells, tile_cells_log2);
    EXPECT_TRUE(lattice.ok());
    return *lattice;
}

/// North-west red, north-east green, south-west blue, south-east white in mip 0 and 1; coarser mips are black.
std::vector<std::uint8_t> quadrants_texture() {
    std::vector<std::uint8_t> chain;
    const std::array<std::uint16_t, 4> colours{kRed565, kGreen565, kBlue565, kWhite565};
    for (int mip = kTextureLog2; mip >= 0; --mip) {
        const int size = 1 << (kTextureLog2 - mip);
        const int blocks = size <= 4 ? 1 : size / 4;
        for (int row = 0; row < blocks; ++row)
            for (int column = 0; column < blocks; ++column) {
                const std::size_t quadrant = static_cast<std::size_t>(2 * row / blocks * 2 + 2 * column / blocks);
                const auto block = bc1_block(blocks > 1 ? colours[quadrant] : 0, 0, 0);
                chain.insert(chain.end(), block.begin(), block.end());
            }
    }
    return chain;
}

/// Green where the texel lies east of the middle, alpha 0 in the west, in every mip (the 1x1 mip is green).
std::vector<std::uint8_t> half_absent_texture() {
    std::vector<std::uint8_t> chain;
    for (int mip = kTextureLog2; mip >= 0; --mip) {
        const int size = 1 << (kTextureLog2 - mip);
        const int blocks = size <= 4 ? 1 : size / 4;
        for (int row = 0; row < blocks; ++row)
            for (int column = 0; column < blocks; ++column) {
                std::uint16_t absent = 0;
                for (int k = 0; k < 16; ++k)
                    if (size > 1 && 4 * column + k % 4 < size / 2)
                        absent = static_cast<std::uint16_t>(absent | (1u << k));
                const auto block = bc1_block(kGreen565, kGreen565, 0, absent);
                chain.insert(chain.end(), block.begin(), block.end());
            }
    }
    return chain;
}

/// Green where `has(u, v)`, alpha 0 elsewhere, in every mip; u, v in 0 .. 1 from the north-west corner.
template <class Has>
std::vector<std::uint8_t> texture_where(int size_log2, const Has& has) {
    std::vector<std::uint8_t> chain;
    for (int mip = size_log2; mip >= 0; --mip) {
        const int size = 1 << (size_log2 - mip), blocks = std::max(size / 4, 1);
        for (int row = 0; row < blocks; ++row)
            for (int column = 0; column < blocks; ++column) {
                std::uint16_t absent = 0;
                for (int k = 0; k < 16; ++k)
                    if (!has((4 * column + k % 4 + 0.5) / size, (4 * row + k / 4 + 0.5) / size))
                        absent = static_cast<std::uint16_t>(absent | (1u << k));
                const auto block = bc1_block(kGreen565, kGreen565, 0, absent);
                chain.insert(chain.end(), block.begin(), block.end());
            }
    }
    return chain;
}

struct Picture {
    std::vector<std::uint8_t> rgb;
    FrameTimes times;

    Rgb at(int x, int y) const {
        const auto k = 3 * static_cast<std::size_t>(y * kSize_px + x);
        return {rgb[k], rgb[k + 1], rgb[k + 2]};
    }
    int count(Rgb colour) const {
        int found = 0;
        for (int y = 0; y < kSize_px; ++y)
            for (int x = 0; x < kSize_px; ++x) found += at(x, y) == colour ? 1 : 0;
        return found;
    }
};

class RendererTest : public GlTest {
protected:
    void make(const RendererOptions& options) {
        auto created = Renderer::create(options);
        ASSERT_TRUE(created.ok()) << created.error().message;
        renderer_ = std::move(*created);
        for (int slot = 0; slot < options.height_slots; ++slot)
            renderer_->upload_height(slot, flat_slot(options.lattice.tile_cells_log2, 0));
    }

    void make_small(int slots = 4, int texture_slots = 4, int texture_size_log2 = kTextureLog2) {
        RendererOptions options;
        options.lattice = small_world();
        options.texture_size_log2 = texture_size_log2;
        options.height_slots = slots;
        options.texture_slots = texture_slots;
        options.max_draws = 64;
        make(options);
    }

    Picture draw(const Camera& camera, const std::vector<DrawItem>& items, const FrameSettings& settings,
                 int samples = 0) {
        auto target = RenderTarget::create({kSize_px, kSize_px, samples});
        EXPECT_TRUE(target.ok());
        Picture picture;
        picture.times = renderer_->draw(camera, items, settings, *target);
        picture.rgb = target->read_pixels();
        depth_ = target->read_depth();
        return picture;
    }

    /// A field of 256 cells a side of the small world, where `has_ground` (metres from the north-west corner).
    template <class Has>
    void give_field(const Has& has_ground, double band_m) {
        const Lattice lattice = small_world();
        const auto shape = EdgeField::shape_of(lattice, 8);
        std::vector<std::uint8_t> present;
        const double cell_m = shape.cell_side * lattice.spacing_m;
        for (std::int64_t y = 0; y < shape.rows; ++y)
            for (std::int64_t x = 0; x < shape.columns; ++x)
                present.push_back(
                    has_ground((static_cast<double>(x) + 0.5) * cell_m, (static_cast<double>(y) + 0.5) * cell_m) ? 1
                                                                                                                 : 0);
        ASSERT_TRUE(renderer_->set_edge_field(std::make_shared<EdgeField>(shape, present, band_m / cell_m)).ok());
    }

    /// From `height_m` over the middle straight down, north up; the world just fills the picture at 45 degrees and 386
    /// m.
    static Camera from_above(double height_m) {
        auto camera = look_at({1160, 1840, height_m}, {1160, 1840, 0}, 45, kSize_px, kSize_px);
        EXPECT_TRUE(camera.ok());
        return *camera;
    }

    static FrameSettings bare() {
        FrameSettings settings;
        settings.magenta_background = true;
        return settings;
    }

    std::unique_ptr<Renderer> renderer_;
    std::vector<float> depth_;
};

constexpr int kNear = kSize_px / 4, kFar = 3 * kSize_px / 4;

TEST_F(RendererTest, NorthIsUpAndEastIsRightSeenFromAbove) {
    make_small();
    renderer_->upload_texture(2, quadrants_texture());
    DrawItem root;
    root.texture.slot = 2;
    const Picture picture = draw(from_above(386), {root}, bare());
    EXPECT_EQ(picture.at(kNear, kNear), kRed);
    EXPECT_EQ(picture.at(kFar, kNear), kGreen);
    EXPECT_EQ(picture.at(kNear, kFar), kBlue);
    EXPECT_EQ(picture.at(kFar, kFar), kWhite);
    EXPECT_EQ(picture.times.draws, 1u);
    EXPECT_EQ(picture.times.triangles, pattern_triangles(4, 0, 0));
}

TEST_F(RendererTest, ColoursComeOutAsTheyWentIn) {
    make_small();
    renderer_->upload_texture(0, plain_texture(kTextureLog2, kGrey565));
    for (const int samples : {0, 4}) {
        const Picture picture = draw(from_above(100), {DrawItem{}}, bare(), samples);
        const Rgb middle = picture.at(kSize_px / 2, kSize_px / 2);
        EXPECT_NEAR(middle[0], 132, 1);
        EXPECT_NEAR(middle[1], 130, 1);
        EXPECT_NEAR(middle[2], 132, 1);
    }
}

TEST_F(RendererTest, ResettingPutsBackWhatDrawingChanged) {
    constexpr std::array<std::pair<GLenum, GLint>, 11> kInitial{{{GL_DRAW_FRAMEBUFFER_BINDING, 0},
                                                                 {GL_CURRENT_PROGRAM, 0},
                                                                 {GL_VERTEX_ARRAY_BINDING, 0},
                                                                 {GL_DRAW_INDIRECT_BUFFER_BINDING, 0},
                                                                 {GL_PACK_ALIGNMENT, 4},
                                                                 {GL_CLIP_ORIGIN, GL_LOWER_LEFT},
                                                                 {GL_CLIP_DEPTH_MODE, GL_NEGATIVE_ONE_TO_ONE},
                                                                 {GL_DEPTH_FUNC, GL_LESS},
                                                                 {GL_DEPTH_TEST, 0},
                                                                 {GL_CULL_FACE, 0},
                                                                 {GL_FRAMEBUFFER_SRGB, 0}}};
    const auto changed = [&] {
        std::vector<GLenum> names;
        for (const auto& [name, initial] : kInitial) {
            GLint now = -1;
            glGetIntegerv(name, &now);
            if (now != initial) names.push_back(name);
        }
        return names;
    };
    make_small();
    auto target = RenderTarget::create({kSize_px, kSize_px, 0});
    ASSERT_TRUE(target.ok());
    renderer_->draw(from_above(386), std::vector<DrawItem>(1), {}, *target);
    EXPECT_GE(changed().size(), 8u);
    target->read_pixels();
    Renderer::reset_state();
    EXPECT_EQ(changed(), std::vector<GLenum>{});
}

TEST_F(RendererTest, EachDrawTakesItsOwnSlotsAndPlace) {
    make_small(5, 5);
    const std::array<std::uint16_t, 4> colours{kRed565, kGreen565, kBlue565, kWhite565};
    std::vector<DrawItem> items;
    for (int quadrant = 0; quadrant < 4; ++quadrant) {
        DrawItem item;
        item.tile = child_of({0, 0, 0}, quadrant);
        item.height_slot = 4 - quadrant;
        item.texture.slot = quadrant + 1;
        items.push_back(item);
        renderer_->upload_texture(quadrant + 1,
                                  plain_texture(kTextureLog2, colours[static_cast<std::size_t>(quadrant)]));
    }
    const Picture picture = draw(from_above(380), items, bare());
    EXPECT_EQ(picture.at(kNear, kNear), kRed);
    EXPECT_EQ(picture.at(kFar, kNear), kGreen);
    EXPECT_EQ(picture.at(kNear, kFar), kBlue);
    EXPECT_EQ(picture.at(kFar, kFar), kWhite);
    EXPECT_EQ(picture.count(kMagenta), 0);
}

TEST_F(RendererTest, HeightsLiftTheirOwnTileOnly) {
    make_small();
    renderer_->upload_texture(0, plain_texture(kTextureLog2, kGreen565));
    renderer_->upload_height(1, flat_slot(4, 90));
    DrawItem west, east;
    west.tile = {1, 0, 0};
    east.tile = {1, 1, 0};
    east.height_slot = 1;
    const Camera camera = from_above(100);
    draw(camera, {west, east}, bare());
    const auto distance = [&](int x, int y) {
        return camera.near_m / static_cast<double>(depth_[static_cast<std::size_t>(y * kSize_px + x)]);
    };
    EXPECT_NEAR(distance(kNear, kNear), 100, 1e-3);
    EXPECT_NEAR(distance(kFar, kNear), 10, 1e-4);
}

TEST_F(RendererTest, AnAncestorsTextureShowsTheRightQuadrant) {
    make_small();
    renderer_->upload_texture(0, quadrants_texture());
    const std::array<Rgb, 4> expected{kRed, kGreen, kBlue, kWhite};
    for (int quadrant = 0; quadrant < 4; ++quadrant) {
        DrawItem item;
        item.tile = child_of({0, 0, 0}, quadrant);
        item.texture.scale = 0.5f;
        item.texture.offset_u = quadrant % 2 == 0 ? 0.0f : 0.5f;
        item.texture.offset_v = quadrant / 2 == 0 ? 0.0f : 0.5f;
        const Picture picture = draw(from_above(386), {item}, bare());
        const int x = quadrant % 2 == 0 ? kNear : kFar, y = quadrant / 2 == 0 ? kNear : kFar;
        EXPECT_EQ(picture.at(x, y), expected[static_cast<std::size_t>(quadrant)]) << "quadrant " << quadrant;
        EXPECT_EQ(picture.at(kSize_px - x, kSize_px - y), kMagenta);
    }
}

TEST_F(RendererTest, AbsentTexelsAreNotDrawnAndDoNotDarkenTheirNeighbours) {
    make_small();
    renderer_->upload_texture(0, half_absent_texture());
    // From 386 m mip 0 is magnified; from further the coarser mips come in, mixed by trilinear filtering.
    for (const double height_m : {50.0, 386.0, 3'000.0, 4'300.0, 9'000.0}) {
        const Picture picture = draw(from_above(height_m), {DrawItem{}}, bare());
        const int green = picture.count(kGreen), magenta = picture.count(kMagenta);
        EXPECT_GT(green, 0);
        EXPECT_EQ(green + magenta, kSize_px * kSize_px) << "fringes at " << height_m << " m";
        if (height_m > 390) continue;
        EXPECT_NEAR(green, kSize_px * kSize_px / 2, kSize_px);
        EXPECT_EQ(picture.at(kNear, kNear), kMagenta);
        EXPECT_EQ(picture.at(kFar, kNear), kGreen);
    }
}

TEST_F(RendererTest, TilesOfSeveralTextureArraysAreDrawnTogether) {
    constexpr int kSlots = 2 * 2048 + 3;
    make_small(4, kSlots);
    const std::array<int, 4> slots{kSlots - 1, 0, 2047, 2048};
    const std::array<std::uint16_t, 4> colours{kRed565, kGreen565, kBlue565, kWhite565};
    std::vector<DrawItem> items;
    for (int quadrant = 0; quadrant < 4; ++quadrant) {
        const auto q = static_cast<std::size_t>(quadrant);
        renderer_->upload_texture(slots[q], plain_texture(kTextureLog2, colours[q]));
        DrawItem item;
        item.tile = child_of({0, 0, 0}, quadrant);
        item.texture.slot = slots[q];
        items.push_back(item);
    }
    const Picture picture = draw(from_above(380), items, bare());
    EXPECT_EQ(picture.at(kNear, kNear), kRed);
    EXPECT_EQ(picture.at(kFar, kNear), kGreen);
    EXPECT_EQ(picture.at(kNear, kFar), kBlue);
    EXPECT_EQ(picture.at(kFar, kFar), kWhite);
    EXPECT_EQ(picture.times.multi_draws, 3u);
}

TEST_F(RendererTest, EveryTileSizeIsDrawnWithoutHoles) {
    for (int cells_log2 = kMinTileCellsLog2; cells_log2 <= kMaxTileCellsLog2; ++cells_log2) {
        RendererOptions options;
        options.lattice = small_world(std::int64_t{1} << cells_log2, cells_log2);
        options.texture_size_log2 = kTextureLog2;
        options.height_slots = 2;
        make(options);
        renderer_->upload_texture(0, plain_texture(kTextureLog2, kGreen565));
        for (int geomip = 0; geomip < cells_log2; ++geomip) {
            DrawItem item;
            item.height_slot = 1;
            item.geomip = geomip;
            item.edge_mask = static_cast<std::uint32_t>(5 * geomip) % kEdgeMaskCount;
            const Picture picture = draw(from_above(380), {item}, bare());
            EXPECT_EQ(picture.count(kGreen), kSize_px * kSize_px) << "2^" << cells_log2 << " cells, geomip " << geomip;
        }
    }
}

TEST_F(RendererTest, DepthIsOneAtTheNearPlaneAndZeroAtInfinity) {
    make_small();
    renderer_->upload_texture(0, plain_texture(kTextureLog2, kGreen565));
    const std::size_t middle = kSize_px / 2 * kSize_px + kSize_px / 2;
    draw(from_above(0.10001), {DrawItem{}}, bare());
    EXPECT_NEAR(depth_[middle], 1.0f, 2e-4f);
    draw(from_above(0.0999), {DrawItem{}}, bare());
    EXPECT_EQ(depth_[middle], 0.0f) << "nearer than the near plane";
    draw(from_above(1e4), {DrawItem{}}, bare());
    EXPECT_NEAR(depth_[middle] / 1e-5f, 1.0f, 1e-4f);
    EXPECT_EQ(depth_[0], 0.0f) << "beside the world";
}

// Vertices of 40 quanta on their way to 10, seen from above; the camera's place says which weight is to move them.
TEST_F(RendererTest, VerticesMorphByTheWeightOfWhereTheyLie) {
    make_small();
    renderer_->upload_texture(0, plain_texture(kTextureLog2, kGreen565));
    constexpr std::size_t kInner = 4;
    struct Case {
        int i, j, geomip;
        unsigned edge_mask;
        std::size_t moved_by;  ///< an edge, or kInner
    };
    for (const Case& c : {Case{9, 8, 0, 0, kInner}, Case{10, 8, 1, 0, kInner}, Case{10, 10, 1, 15, kInner},
                          Case{9, 0, 0, 0, 0}, Case{16, 9, 0, 0, 1}, Case{9, 16, 0, 0, 2}, Case{0, 9, 0, 0, 3},
                          Case{10, 0, 0, kEdgeNorth, 0}, Case{16, 12, 1, kEdgeEast, 1}}) {
        std::vector<SlotVertex> slot = flat_slot(4, 0);
        slot[static_cast<std::size_t>(c.j * 17 + c.i)] = {40, 10};
        renderer_->upload_height(0, slot);
        // A little inwards, so that the middle pixel sees the vertex's own tile.
        const double x = 1000 + 20 * c.i + (c.i == 16 ? -0.02 : 0.02), y = 2000 - 20 * c.j + (c.j == 16 ? 0.02 : -0.02);
        auto camera = look_at({x, y, 100}, {x, y, 0}, 0.5, kSize_px, kSize_px);
        ASSERT_TRUE(camera.ok());
        for (const std::size_t weight : {std::size_t{0}, std::size_t{1}, std::size_t{2}, std::size_t{3}, kInner})
            for (const std::int32_t neighbour : {-1, 1}) {  // by either program
                DrawItem item;
                item.geomip = c.geomip;
                item.edge_mask = c.edge_mask;
                item.neighbour_textures[0] = neighbour;
                (weight == kInner ? item.morph : item.edge_morph[weight]) = 0.25f;
                draw(*camera, {item}, bare());
                const double distance =
                    camera->near_m / static_cast<double>(depth_[kSize_px / 2 * kSize_px + kSize_px / 2]);
                EXPECT_NEAR(100 - distance, weight == c.moved_by ? 32.5 : 40, 0.2)
                    << "vertex " << c.i << ", " << c.j << ", weight " << weight;
            }
    }
}

// On an earth of a tenth the radius a plain at the eye's feet ends at the horizon, sqrt(2 h / R) below the level.
TEST_F(RendererTest, AFarPlainSinksBelowTheHorizon) {
    RendererOptions options;
    auto lattice = make_lattice(0, 0, 1000, 64, 64, 4);
    ASSERT_TRUE(lattice.ok());
    options.lattice = *lattice;
    options.texture_size_log2 = kTextureLog2;
    options.height_slots = 1;
    make(options);
    renderer_->upload_texture(0, plain_texture(kTextureLog2, kGreen565));
    std::vector<DrawItem> items;
    for (int quadrant = 0; quadrant < 16; ++quadrant) {
        DrawItem item;
        item.tile = {2, quadrant % 4, quadrant / 4};
        items.push_back(item);
    }
    constexpr double kHeight_m = 1000, kRadius_m = 637'100, kFar_m = 64'000;
    auto camera = look_at({32'000, -kFar_m, kHeight_m}, {32'000, 0, kHeight_m}, 20, kSize_px, kSize_px);
    ASSERT_TRUE(camera.ok());
    FrameSettings settings = bare();
    const auto top_row = [&] {
        const Picture picture = draw(*camera, items, settings);
        int row = 0;
        while (row < kSize_px && picture.at(kSize_px / 2, row) != kGreen) ++row;
        return row;
    };
    const double half = kSize_px / 2.0;
    EXPECT_NEAR(top_row(), half + camera->focal_px() * kHeight_m / kFar_m, 1);
    settings.half_curvature = 0.5 / kRadius_m;
    EXPECT_NEAR(top_row(), half + camera->focal_px() * std::sqrt(2 * kHeight_m / kRadius_m), 1);
}

TEST_F(RendererTest, NearerTilesHideFartherOnes) {
    make_small();
    renderer_->upload_height(1, flat_slot(4, 1));
    renderer_->upload_texture(0, plain_texture(kTextureLog2, kGreen565));
    renderer_->upload_texture(1, plain_texture(kTextureLog2, kRed565));
    DrawItem low, high;
    high.height_slot = 1;
    high.texture.slot = 1;
    // One metre apart, seen from 20 km: more than a 24-bit depth buffer could tell with this near plane.
    auto camera = look_at({1160, 1840, 20'000}, {1160, 1840, 0}, 0.5, kSize_px, kSize_px);
    ASSERT_TRUE(camera.ok());
    for (const auto& items : {std::vector{low, high}, std::vector{high, low}}) {
        const Picture picture = draw(*camera, items, bare());
        EXPECT_GT(picture.count(kRed), 0);
        EXPECT_EQ(picture.count(kGreen), 0);
    }
}

TEST_F(RendererTest, TheSkyFillsWhatNoTileCovers) {
    make_small();
    renderer_->upload_texture(0, plain_texture(kTextureLog2, kGreen565));
    for (const glm::dvec3 target :
         {glm::dvec3(1160, 3000, 10), glm::dvec3(1160, 1840, 900), glm::dvec3(1160, 1841, -900)}) {
        auto camera = look_at({1160, 1840, 60}, target, 60, kSize_px, kSize_px);
        ASSERT_TRUE(camera.ok());
        FrameSettings settings;
        EXPECT_EQ(draw(*camera, {}, settings).count(kMagenta), 0);
        settings.haze_distance_m = 500;
        EXPECT_EQ(draw(*camera, {DrawItem{}}, settings).count(kMagenta), 0);
    }
}

TEST_F(RendererTest, TheSkyIsBlueAboveAndBrightestAtTheHorizon) {
    make_small();
    auto camera = look_at({1160, 1840, 60}, {1160, 2840, 60}, 100, kSize_px, kSize_px);
    ASSERT_TRUE(camera.ok());
    const Picture picture = draw(*camera, {}, FrameSettings{});
    const auto brightness = [](Rgb c) { return c[0] + c[1] + c[2]; };
    const Rgb top = picture.at(kSize_px / 2, 0), horizon = picture.at(kSize_px / 2, kSize_px / 2 - 1),
              bottom = picture.at(kSize_px / 2, kSize_px - 1);
    EXPECT_GT(top[2], top[0] + 40);
    EXPECT_GT(brightness(horizon), brightness(top) + 100);
    EXPECT_GT(brightness(horizon), brightness(bottom) + 100);
}

TEST_F(RendererTest, HazeFadesFarGroundIntoTheHorizon) {
    make_small();
    renderer_->upload_texture(0, plain_texture(kTextureLog2, kGreen565));
    FrameSettings settings;
    const auto middle = [&](double haze_m) {
        settings.haze_distance_m = haze_m;
        return draw(from_above(300), {DrawItem{}}, settings).at(kSize_px / 2, kSize_px / 2);
    };
    EXPECT_EQ(middle(0), kGreen);
    const Rgb thin = middle(3'000), thick = middle(10);
    EXPECT_GT(thin[0], 20);
    EXPECT_GT(thick[0], thin[0]);
    EXPECT_NEAR(thick[1], 215, 12);  // the horizon's colour, whatever the ground's
}

// From above the world fills the picture but for a margin; its outer 32 m of 320 dissolve.
TEST_F(RendererTest, TheEndOfTheDataDissolvesIntoTheSky) {
    make_small();
    renderer_->upload_texture(0, plain_texture(kTextureLog2, kGreen565));
    const Camera camera = from_above(420);
    FrameSettings settings;
    settings.haze_distance_m = 5'000;
    const Picture sky = draw(camera, {}, settings), hard = draw(camera, {DrawItem{}}, settings);
    give_field([](double, double) { return true; }, 32);
    std::vector<DrawItem> quarters(4);
    for (int k = 0; k < 4; ++k) quarters[static_cast<std::size_t>(k)].tile = child_of({0, 0, 0}, k);
    quarters[2].neighbour_textures[0] = 1;  // drawn as a ring and an inner part
    for (const auto& items : {std::vector{DrawItem{}}, quarters})
        for (const int samples : {0, 4}) {
            const Picture soft = draw(camera, items, settings, samples);
            EXPECT_GT(soft.times.edge_draws, 0u);
            const double m_per_px = 2 * std::tan(glm::radians(22.5)) * 420 / kSize_px;
            double last_share = -1;
            for (int x = 0; x < kSize_px / 2; ++x) {
                const double inside_m = 160 - (kSize_px / 2 - x - 0.5) * m_per_px;
                for (const auto& [px, py] : {std::pair{x, 48}, std::pair{kSize_px - 1 - x, 40}, std::pair{40, x},
                                             std::pair{60, kSize_px - 1 - x}}) {
                    if (inside_m > 34) {
                        EXPECT_EQ(soft.at(px, py), hard.at(px, py)) << px << ' ' << py;
                    }
                    if (inside_m < 1.5) {
                        for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(soft.at(px, py)[c], sky.at(px, py)[c], 3);
                    }
                }
                const double share = (soft.at(x, 48)[1] - sky.at(x, 48)[1]) /
                                     static_cast<double>(hard.at(48, 48)[1] - sky.at(48, 48)[1]);
                EXPECT_GE(share, last_share - 0.03) << x;
                last_share = share;
            }
            EXPECT_GT(last_share, 0.95);
        }
    settings.magenta_background = true;
    const Picture magenta = draw(camera, {DrawItem{}}, settings);
    EXPECT_EQ(magenta.times.edge_draws, 0u);
    settings.soft_edge = false;
    EXPECT_EQ(magenta.rgb, draw(camera, {DrawItem{}}, settings).rgb);
    settings.magenta_background = false;
    EXPECT_EQ(hard.rgb, draw(camera, {DrawItem{}}, settings).rgb);
}

// A round void in the middle and a slanted border, by texels that are absent and a field that knows them.
TEST_F(RendererTest, VoidsAndSlantedBordersDissolveLikewise) {
    make_small(1, 1, 8);
    // Metres from the north-west corner.
    const auto void_m = [](double x, double y) { return std::hypot(x - 160, y - 160) - 50; };
    const auto slant_m = [](double x, double y) { return (x + 0.4 * y - 120) / std::hypot(1, 0.4); };
    const auto has_ground = [&](double x, double y) { return void_m(x, y) > 0 && slant_m(x, y) > 0; };
    renderer_->upload_texture(0, texture_where(8, [&](double u, double v) { return has_ground(320 * u, 320 * v); }));
    const Camera camera = from_above(380);
    FrameSettings settings;
    settings.haze_distance_m = 5'000;
    const Picture hard = draw(camera, {DrawItem{}}, settings);
    const auto sky = draw(camera, {}, settings);
    give_field(has_ground, 32);
    const Picture soft = draw(camera, {DrawItem{}}, settings);
    EXPECT_GT(soft.times.edge_draws, 0u);
    const double m_per_px = 2 * std::tan(glm::radians(22.5)) * 380 / kSize_px;
    // Away from the void due south, and from the slant due east; a texel is 1.25 m.
    for (const bool of_void : {true, false}) {
        double last_share = 0, least_share = 1;
        for (int k = 0; k < kSize_px / 2; ++k) {
            const int px = of_void ? kSize_px / 2 : k, py = of_void ? kSize_px / 2 + k : kSize_px / 4;
            const double x = 160 + (px + 0.5 - kSize_px / 2) * m_per_px, y = 160 + (py + 0.5 - kSize_px / 2) * m_per_px;
            const double inside_m = of_void ? void_m(x, y) : slant_m(x, y);
            const double to_others_m = std::min({x, y, 320 - x, 320 - y, of_void ? slant_m(x, y) : void_m(x, y)});
            if (to_others_m < 36) continue;
            const double share =
                (soft.at(px, py)[1] - sky.at(px, py)[1]) / static_cast<double>(255 - sky.at(px, py)[1]);
            if (inside_m < -4) {
                EXPECT_EQ(soft.at(px, py), sky.at(px, py)) << inside_m;
            }
            if (inside_m > -4 && inside_m < 1) {
                EXPECT_LT(share, 0.03) << inside_m;
            }
            if (inside_m > 36) {
                EXPECT_EQ(soft.at(px, py), hard.at(px, py)) << inside_m;
            }
            if (inside_m > 14 && inside_m < 18) {
                EXPECT_NEAR(share, 0.5, 0.25) << inside_m;
            }
            EXPECT_GE(share, last_share - 0.03) << of_void << ' ' << inside_m;
            last_share = share;
            least_share = std::min(least_share, share);
        }
        EXPECT_GT(last_share, 0.95);
        EXPECT_LT(least_share, 0.03);
    }
}

TEST_F(RendererTest, DebugViewsDrawWhatTheySay) {
    make_small();
    renderer_->upload_texture(0, plain_texture(kTextureLog2, kGreen565));
    FrameSettings settings = bare();
    settings.wireframe = true;
    const Picture wires = draw(from_above(200), {DrawItem{}}, settings);
    EXPECT_GT(wires.count(kGreen), 0);
    EXPECT_GT(wires.count(kMagenta), wires.count(kGreen));
}

// A highlighted tile is its colour of highlight_colour at 0.65, over its imagery in grey: here black or white.
TEST_F(RendererTest, HighlightsTellLevelGeomipAndError) {
    make_small();
    renderer_->upload_texture(0, plain_texture(kTextureLog2, 0));
    renderer_->upload_texture(1, plain_texture(kTextureLog2, kWhite565));
    const auto light_of = [](double srgb) {
        const double c = srgb / 255;
        return c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4);
    };
    DrawItem item;
    item.tile = {2, 1, 1};
    item.geomip = 1;
    item.bound_px = 0.6f;
    FrameSettings settings = bare();
    settings.highlight_full_px = 2;
    struct Case {
        Highlight highlight;
        double value;
    };
    for (const Case& c : {Case{Highlight::level, 2}, Case{Highlight::geomip, 1}, Case{Highlight::error, 0.3}})
        for (const int texture : {0, 1})
            for (const std::int32_t neighbour : {-1, 0})  // by either program
                for (const double haze_m : {0.0, 1e9}) {
                    item.texture.slot = texture;
                    item.neighbour_textures[0] = neighbour;
                    settings.highlight = c.highlight;
                    settings.haze_distance_m = haze_m;
                    const Rgb seen = draw(from_above(386), {item}, settings).at(35, 35);
                    const auto expected = highlight_colour(c.highlight, c.value);
                    for (std::size_t k = 0; k < 3; ++k)
                        EXPECT_NEAR(light_of(seen[k]), 0.65 * light_of(expected[k]) + 0.35 * texture, 0.01)
                            << "highlight " << static_cast<int>(c.highlight) << ", texture " << texture;
                }
}

TEST_F(RendererTest, ManyFramesInFlightDoNotMixTheirDraws) {
    make_small();
    renderer_->upload_texture(0, plain_texture(kTextureLog2, kRed565));
    renderer_->upload_texture(1, plain_texture(kTextureLog2, kGreen565));
    std::vector<RenderTarget> targets;
    for (int frame = 0; frame < 8; ++frame) {
        auto target = RenderTarget::create({kSize_px, kSize_px, 0});
        ASSERT_TRUE(target.ok());
        targets.push_back(std::move(*target));
        DrawItem item;
        item.texture.slot = frame % 2;
        renderer_->draw(from_above(100), std::vector{item}, bare(), targets.back());
    }
    for (std::size_t frame = 0; frame < targets.size(); ++frame) {
        const Picture picture{targets[frame].read_pixels(), {}};
        EXPECT_EQ(picture.at(kNear, kNear), frame % 2 == 0 ? kRed : kGreen) << "frame " << frame;
    }
}

TEST_F(RendererTest, BudgetBytesAreSlotsTimesSlotBytes) {
    RendererOptions options;
    options.lattice = small_world(64, 5);
    options.texture_size_log2 = 8;
    options.height_slots = 10;
    options.texture_slots = 3;
    EXPECT_EQ(renderer_bytes(options), 10 * slot_bytes(5) + 3 * bc1_chain_bytes(8));
}

TEST_F(RendererTest, MoreHeightSlotsThanVerticesFitAreRefused) {
    RendererOptions options;
    options.lattice = small_world(256, 8);
    options.height_slots = 40'000;
    const auto created = Renderer::create(options);
    ASSERT_FALSE(created.ok());
    EXPECT_EQ(created.error().code, ErrorCode::display);
    EXPECT_NE(created.error().message.find("40000"), std::string::npos);
}

TEST_F(RendererTest, TargetsOfImpossibleSizeAreRefused) {
    for (const auto& [width, height] : {std::pair{0, 10}, std::pair{10, -1}, std::pair{16385, 10}}) {
        const auto created = RenderTarget::create({width, height, 0});
        ASSERT_FALSE(created.ok());
        EXPECT_EQ(created.error().code, ErrorCode::usage);
    }
}

}  // namespace
}  // namespace scree
