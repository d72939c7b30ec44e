// Pictures of draws that look at several textures: seams between tiles and fading.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <vector>

#include "common/texture_tile.h"
#include "runtime/render/renderer.h"
#include "tests/common/test_support.h"
#include "tests/runtime/render/gl_test.h"

namespace scree {
namespace {

constexpr int kSize_px = 96;
constexpr int kTextureLog2 = 5;
constexpr int kBlocks = 8;  // of a texture's side
constexpr double kWorld_m = 320;
constexpr double kTexel_m = kWorld_m / 64;  // the world is 2 x 2 textures

using Block = std::vector<std::uint8_t>;

/// Blocks of two bright random colours for a square of 2^kTextureLog2 texels times `sides`.
std::vector<Block> random_blocks(test::Random& random, int sides) {
    std::vector<Block> blocks;
    const auto colour = [&] {
        return static_cast<std::uint16_t>(test::uniform(random, 16, 31) << 11 | test::uniform(random, 32, 63) << 5 |
                                          test::uniform(random, 16, 31));
    };
    for (int k = 0; k < sides * sides * kBlocks * kBlocks; ++k)
        blocks.push_back(bc1_block(colour(), colour(), static_cast<std::uint16_t>(test::uniform(random, 0, 65535))));
    return blocks;
}

/// A texture of the square of 2^size_log2 texels whose first block is (column, row); coarser mips are red.
std::vector<std::uint8_t> cut_out(const std::vector<Block>& blocks, int blocks_a_row, int column, int row,
                                  int size_log2) {
    std::vector<std::uint8_t> chain = plain_texture(size_log2, kRed565);
    const int side = (1 << size_log2) / 4;
    auto out = chain.begin() + static_cast<std::ptrdiff_t>(bc1_mip_offset(size_log2, 0));
    for (int j = 0; j < side; ++j)
        for (int i = 0; i < side; ++i)
            out = std::copy_n(blocks[static_cast<std::size_t>((row + j) * blocks_a_row + column + i)].begin(), 8, out);
    return chain;
}

struct Picture {
    std::vector<std::uint8_t> rgb;
    FrameTimes times;
    int at(int x, int y, int channel) const { return rgb[static_cast<std::size_t>(3 * (y * kSize_px + x) + channel)]; }
};

int largest_difference(const Picture& a, const Picture& b) {
    int largest = 0;
    for (std::size_t k = 0; k < a.rgb.size(); ++k) largest = std::max(largest, std::abs(a.rgb[k] - b.rgb[k]));
    return largest;
}

/// Colour steps between screen pixels either side of texel edges.
struct Steps {
    std::vector<int> all;
    double mean() const {
        double sum = 0;
        for (const int step : all) sum += step;
        return sum / static_cast<double>(all.size());
    }
    int percentile_99() {
        std::sort(all.begin(), all.end());
        return all[all.size() * 99 / 100];
    }
};

/// Adds the steps across the texel edges `pixel` pixels east and south of the picture's middle.
void add_steps(const Picture& picture, int pixel, Steps& steps) {
    const int edge = kSize_px / 2 + pixel;
    for (int k = 0; k < kSize_px; ++k)
        for (int channel = 0; channel < 3; ++channel) {
            steps.all.push_back(std::abs(picture.at(edge - 1, k, channel) - picture.at(edge, k, channel)));
            steps.all.push_back(std::abs(picture.at(k, edge - 1, channel) - picture.at(k, edge, channel)));
        }
}

class ImageryTest : public GlTest {
protected:
    /// n = 4, so levels 0 to 2 of 1, 4 and 16 tiles. With 2^kTextureLog2 texels, textures of level 1 are used.
    std::unique_ptr<Renderer> make(int texture_size_log2, int max_array_layers = kMaxArrayLayers) {
        RendererOptions options;
        auto lattice = make_lattice(1000, 2000, kWorld_m / 64, 64, 64, 4);
        EXPECT_TRUE(lattice.ok());
        options.lattice = *lattice;
        options.texture_size_log2 = texture_size_log2;
        options.texture_slots = 6;
        options.max_draws = 64;
        options.max_array_layers = max_array_layers;
        auto created = Renderer::create(options);
        EXPECT_TRUE(created.ok());
        (*created)->upload_height(0, flat_slot(4, 0));
        return std::move(*created);
    }

    static Picture draw(Renderer& renderer, const std::vector<DrawItem>& items, double pixels_a_texel) {
        const double height_m = kSize_px * kTexel_m / (2 * pixels_a_texel * std::tan(glm::radians(22.5)));
        auto camera = look_at({1160, 1840, height_m}, {1160, 1840, 0}, 45, kSize_px, kSize_px);
        auto target = RenderTarget::create({kSize_px, kSize_px, 0});
        EXPECT_TRUE(camera.ok() && target.ok());
        FrameSettings settings;
        settings.magenta_background = true;
        Picture picture;
        picture.times = renderer.draw(*camera, items, settings, *target);
        picture.rgb = target->read_pixels();
        return picture;
    }

    /// The four quadrants of the world, with slots 0 to 3, and what lies round each.
    static std::vector<DrawItem> quadrants(bool with_neighbours) {
        std::vector<DrawItem> items;
        for (int quadrant = 0; quadrant < 4; ++quadrant) {
            DrawItem item;
            item.tile = child_of({0, 0, 0}, quadrant);
            item.texture.slot = quadrant;
            const int x = quadrant % 2, y = quadrant / 2;
            std::size_t side = 0;
            for (int dy = -1; dy <= 1; ++dy)
                for (int dx = -1; dx <= 1; ++dx) {
                    if (dx == 0 && dy == 0) continue;
                    const bool inside = x + dx >= 0 && x + dx <= 1 && y + dy >= 0 && y + dy <= 1;
                    item.neighbour_textures[side++] =
                        with_neighbours && inside ? static_cast<std::int32_t>(2 * (y + dy) + x + dx) : -1;
                }
            items.push_back(item);
        }
        return items;
    }

    /// The same places drawn by the 16 tiles of level 2, each with its parent's texture.
    static std::vector<DrawItem> with_parents_textures(const std::vector<DrawItem>& parents) {
        std::vector<DrawItem> items;
        for (const DrawItem& parent : parents)
            for (int quadrant = 0; quadrant < 4; ++quadrant) {
                DrawItem item = parent;
                item.tile = child_of(parent.tile, quadrant);
                item.texture.scale = 0.5f;
                item.texture.offset_u = quadrant % 2 == 0 ? 0.0f : 0.5f;
                item.texture.offset_v = quadrant / 2 == 0 ? 0.0f : 0.5f;
                items.push_back(item);
            }
        return items;
    }

    /// The same places drawn as parts of the root.
    static std::vector<DrawItem> as_parts(std::vector<DrawItem> items) {
        for (DrawItem& item : items) {
            const int x = static_cast<int>(item.tile.x), y = static_cast<int>(item.tile.y);
            item.tile = {0, 0, 0};
            item.part = {1, x, y};
            item.texture = {item.texture.slot, 2, static_cast<float>(-x), static_cast<float>(-y)};
        }
        return items;
    }

    static void upload_quadrants(Renderer& renderer, const std::vector<Block>& blocks) {
        for (int quadrant = 0; quadrant < 4; ++quadrant)
            renderer.upload_texture(
                quadrant, cut_out(blocks, 2 * kBlocks, quadrant % 2 * kBlocks, quadrant / 2 * kBlocks, kTextureLog2));
    }

    static Picture draw_as_one(Renderer& renderer, const std::vector<Block>& blocks, double pixels_a_texel) {
        renderer.upload_texture(0, cut_out(blocks, 2 * kBlocks, 0, 0, kTextureLog2 + 1));
        return draw(renderer, {DrawItem{}}, pixels_a_texel);
    }
};

TEST_F(ImageryTest, MagnifiedBordersAreFilteredAsOneTexture) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    const auto whole = make(kTextureLog2 + 1);
    for (const int layers : {6, 3, 2, 1}) {  // all in one array; in two, three and six
        const auto tiles = make(kTextureLog2, layers);
        for (const double magnification : {4.0, 3.0, 7.0, 1.5}) {
            const auto blocks = random_blocks(random, 2);
            upload_quadrants(*tiles, blocks);
            const Picture expected = draw_as_one(*whole, blocks, magnification);
            const auto items = quadrants(true);
            std::vector<DrawItem> coarsest = items;
            for (DrawItem& item : coarsest) item.geomip = 3;
            const std::array<std::vector<DrawItem>, 4> ways{items, with_parents_textures(items), as_parts(items),
                                                            coarsest};
            for (std::size_t way = 0; way < ways.size(); ++way)
                EXPECT_LE(largest_difference(draw(*tiles, ways[way], magnification), expected), 2)
                    << magnification << " x, way " << way << ", " << layers << " layers an array";
            EXPECT_GT(largest_difference(draw(*tiles, quadrants(false), magnification), expected), 20);
        }
    }
}

TEST_F(ImageryTest, BordersShowNoLargerStepsThanInnerTexelEdges) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    const auto tiles = make(kTextureLog2);
    for (const int magnification : {3, 4, 7}) {
        Steps inner, border, without;
        for (int round = 0; round < 24; ++round) {
            upload_quadrants(*tiles, random_blocks(random, 2));
            const Picture picture = draw(*tiles, quadrants(true), magnification);
            add_steps(picture, 0, border);
            // A tile's border is one of blocks too: only those compare.
            for (const int block : {-1, 1}) add_steps(picture, 4 * block * magnification, inner);
            add_steps(draw(*tiles, quadrants(false), magnification), 0, without);
        }
        const double inner_mean = inner.mean();
        const int inner_99 = inner.percentile_99();
        std::printf("%d x: steps across inner texel edges mean %.2f, 99 %% %d; borders %.2f, %d; clamped %.2f, %d\n",
                    magnification, inner_mean, inner_99, border.mean(), border.percentile_99(), without.mean(),
                    without.percentile_99());
        EXPECT_LE(border.mean(), inner_mean + 1);
        EXPECT_LE(border.percentile_99(), inner_99 * 1.05 + 1);
        EXPECT_GT(without.mean(), inner_mean + 1);
        EXPECT_GT(without.percentile_99(), inner_99 * 1.05 + 1);
    }
}

// Where only three textures meet, no pair of them shows a step.
TEST_F(ImageryTest, AnAbsentNeighbourLeavesItsWeightToTheOthers) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    const auto tiles = make(kTextureLog2);
    for (int absent = 0; absent < 4; ++absent)
        for (int round = 0; round < 8; ++round) {
            upload_quadrants(*tiles, random_blocks(random, 2));
            std::vector<DrawItem> items = quadrants(true);
            for (DrawItem& item : items)
                std::replace(item.neighbour_textures.begin(), item.neighbour_textures.end(), absent, -1);
            items.erase(items.begin() + absent);
            const Picture picture = draw(*tiles, items, 24);
            const int middle = kSize_px / 2;
            const auto is_absent = [&](int x, int y) { return (x >= middle) + 2 * (y >= middle) == absent; };
            for (int y = 0; y < kSize_px; ++y)
                for (int x = 1; x < kSize_px; ++x)
                    for (int channel = 0; channel < 3; ++channel) {
                        if (!is_absent(x, y) && !is_absent(x - 1, y)) {
                            ASSERT_LE(std::abs(picture.at(x, y, channel) - picture.at(x - 1, y, channel)), 22)
                                << "at " << x << ", " << y << " without " << absent;
                        }
                        if (!is_absent(y, x) && !is_absent(y, x - 1)) {
                            ASSERT_LE(std::abs(picture.at(y, x, channel) - picture.at(y, x - 1, channel)), 22)
                                << "at " << y << ", " << x << " without " << absent;
                        }
                    }
        }
}

double linear(double srgb) { return srgb <= 0.04045 ? srgb / 12.92 : std::pow((srgb + 0.055) / 1.055, 2.4); }
double encoded(double light) { return light <= 0.0031308 ? 12.92 * light : 1.055 * std::pow(light, 1 / 2.4) - 0.055; }

TEST_F(ImageryTest, ATextureFadesInOverACoarserOne) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (const int layers : {6, 3, 2, 1}) {
        const auto renderer = make(kTextureLog2, layers);
        upload_quadrants(*renderer, random_blocks(random, 2));
        const auto coarse = random_blocks(random, 1);
        renderer->upload_texture(5, cut_out(coarse, kBlocks, 0, 0, kTextureLog2));

        std::vector<DrawItem> fine_items = quadrants(true), coarse_items = quadrants(false);
        for (int quadrant = 0; quadrant < 4; ++quadrant) {
            DrawItem& item = fine_items[static_cast<std::size_t>(quadrant)];
            item.coarse_texture = {5, 0.5f, quadrant % 2 == 0 ? 0.0f : 0.5f, quadrant / 2 == 0 ? 0.0f : 0.5f};
            coarse_items[static_cast<std::size_t>(quadrant)].texture = item.coarse_texture;
        }
        const Picture fine_picture = draw(*renderer, fine_items, 4), coarse_picture = draw(*renderer, coarse_items, 4);
        EXPECT_GT(largest_difference(fine_picture, coarse_picture), 60);
        for (const float share : {0.0f, 0.25f, 1.0f}) {
            for (DrawItem& item : fine_items) item.texture_share = share;
            const Picture picture = draw(*renderer, fine_items, 4);
            int largest = 0;
            for (std::size_t k = 0; k < picture.rgb.size(); ++k) {
                const double there = linear(fine_picture.rgb[k] / 255.0),
                             before = linear(coarse_picture.rgb[k] / 255.0);
                const double expected = 255 * encoded(share * there + (1 - share) * before);
                largest = std::max(largest, static_cast<int>(std::abs(picture.rgb[k] - expected) + 0.5));
            }
            EXPECT_LE(largest, 2) << "share " << share << ", " << layers << " layers an array";
        }
    }
}

TEST_F(ImageryTest, WhatIsAbsentFadesWithoutFringes) {
    const auto renderer = make(kTextureLog2);
    const auto fill = [&](int slot, std::uint16_t transparent) {
        std::vector<std::uint8_t> chain;
        for (std::size_t k = 0; k < bc1_chain_bytes(kTextureLog2) / 8; ++k) {
            const Block block = bc1_block(kGreen565, kGreen565, 0, transparent);
            chain.insert(chain.end(), block.begin(), block.end());
        }
        renderer->upload_texture(slot, chain);
    };
    fill(0, 0xFFFF);
    fill(1, 0);
    for (const float share : {0.2f, 0.8f}) {
        DrawItem item;
        item.texture_share = share;
        item.coarse_texture.slot = 1;
        const Picture picture = draw(*renderer, {item}, 4);
        const bool drawn = share < 0.5f;
        for (int channel = 0; channel < 3; ++channel)
            EXPECT_EQ(picture.at(20, 20, channel), drawn == (channel == 1) ? 255 : 0) << "share " << share;
    }
}

TEST_F(ImageryTest, WarmingUpUsesEveryProgramAndLeavesNothing) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    const auto blocks = random_blocks(random, 2);
    for (const int layers : {6, 3, 1}) {
        const auto renderer = make(kTextureLog2, layers), warm = make(kTextureLog2, layers);
        auto target = RenderTarget::create({kSize_px, kSize_px, 0});
        ASSERT_TRUE(target.ok());
        EXPECT_EQ(warm->warm_up({}, *target), layers == 1 ? 5u : 4u);
        upload_quadrants(*renderer, blocks);
        upload_quadrants(*warm, blocks);
        EXPECT_EQ(draw(*warm, quadrants(true), 4).rgb, draw(*renderer, quadrants(true), 4).rgb);
    }
}

TEST_F(ImageryTest, BlendingTakesFewBatchesAndTheSameTriangles) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (const int layers : {6, 3, 2, 1}) {
        const auto renderer = make(kTextureLog2, layers);
        upload_quadrants(*renderer, random_blocks(random, 2));
        std::vector<DrawItem> plain_items = quadrants(false), blended_items = quadrants(true);
        for (std::size_t k = 0; k < 4; ++k)
            plain_items[k].edge_mask = blended_items[k].edge_mask = static_cast<std::uint32_t>(7 * k + 1) % 16;
        const Picture plain = draw(*renderer, plain_items, 4), blended = draw(*renderer, blended_items, 4);
        EXPECT_EQ(plain.times.blended_draws, 0u);
        EXPECT_EQ(plain.times.draws, 4u);
        EXPECT_EQ(blended.times.blended_draws, 4u);
        EXPECT_EQ(blended.times.draws, 8u);
        EXPECT_EQ(blended.times.triangles, plain.times.triangles);
        EXPECT_LE(blended.times.multi_draws, plain.times.multi_draws + 3);
    }
}

}  // namespace
}  // namespace scree
