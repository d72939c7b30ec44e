#include "runtime/render/draw_batches.h"

#include <gtest/gtest.h>

#include <vector>

namespace scree {
namespace {

constexpr int kLayers = 10;

DrawBatches make(int arrays, int bound_arrays) { return DrawBatches({arrays, kLayers, bound_arrays, 5, 8, 100}); }

DrawItem item_in(int array, std::vector<int> neighbour_arrays = {}) {
    DrawItem item;
    item.texture.slot = array * kLayers;
    for (std::size_t k = 0; k < neighbour_arrays.size(); ++k)
        item.neighbour_textures[k] = neighbour_arrays[k] * kLayers + 1;
    return item;
}

/// The batch that draws item 0's ring, or the whole of it.
DrawBatch border_batch(DrawBatches& batches, const DrawItem& item) {
    batches.sort(std::vector{item});
    EXPECT_FALSE(batches.draws().empty());
    return batches.batches().front();
}

TEST(DrawBatches, AnItemWithOneTextureIsOnePlainDraw) {
    DrawBatches batches = make(3, 3);
    batches.sort(std::vector{item_in(2), item_in(0), item_in(2)});
    ASSERT_EQ(batches.batches().size(), 2u);
    EXPECT_EQ(batches.blended_draws(), 0u);
    EXPECT_EQ(batches.batches()[0].imagery, Imagery::plain);
    EXPECT_EQ(batches.batches()[0].arrays[0], 0);
    EXPECT_EQ(batches.batches()[1].arrays[0], 2);
    EXPECT_EQ(batches.draws()[0].item, 1u);
    EXPECT_EQ(batches.draws()[1].item, 0u);
    EXPECT_EQ(batches.draws()[2].item, 2u);
    EXPECT_EQ(batches.draws()[2].shape, DrawShape::whole);
}

TEST(DrawBatches, OnlyTheRingIsFilteredAcrossBorders) {
    DrawBatches batches = make(1, 1);
    batches.sort(std::vector{item_in(0, {0})});
    ASSERT_EQ(batches.batches().size(), 2u);
    EXPECT_EQ(batches.batches()[0].imagery, Imagery::bordered);
    EXPECT_EQ(batches.draws()[0].shape, DrawShape::ring);
    EXPECT_EQ(batches.batches()[1].imagery, Imagery::plain);
    EXPECT_EQ(batches.draws()[1].shape, DrawShape::inner);
    EXPECT_EQ(batches.blended_draws(), 1u);
}

TEST(DrawBatches, ItemsWithoutARingAreFilteredWhole) {
    DrawBatches batches = make(1, 1);
    DrawItem coarse = item_in(0, {0}), part = coarse, enlarged = coarse;
    coarse.geomip = 3;  // 2 x 2 blocks
    part.part = {1, 0, 1};
    part.texture.scale = 2;
    part.texture.offset_v = -1;
    enlarged.texture.scale = 1.0f / 64;  // 4 texels on 16 blocks: half a texel is wider than a block
    for (const DrawItem& item : {coarse, part, enlarged}) {
        batches.sort(std::vector{item});
        ASSERT_EQ(batches.draws().size(), 1u);
        EXPECT_EQ(batches.draws()[0].shape, DrawShape::whole);
        EXPECT_EQ(batches.batches()[0].imagery, Imagery::bordered);
    }
}

TEST(DrawBatches, AMeshIsOneDrawInTheGroupThatItsRingWouldBeIn) {
    DrawBatches batches = make(3, 3);
    for (DrawItem item : {item_in(0), item_in(1, {1}), item_in(2, {2, 1}), item_in(2, {0, 1})})
        for (const float share : {1.0f, 0.5f}) {
            item.texture_share = share;
            item.mesh = {};
            const DrawBatch border = border_batch(batches, item);
            item.mesh = {0, 0, 6};
            const DrawBatch mesh = border_batch(batches, item);
            ASSERT_EQ(batches.draws().size(), 1u);
            EXPECT_EQ(batches.draws()[0].shape, DrawShape::whole);
            EXPECT_EQ(mesh.imagery, border.imagery);
            EXPECT_EQ(mesh.arrays, border.arrays);
        }
    DrawItem inside = item_in(0, {0});
    inside.mesh = {0, 0, 6};
    inside.texture = {0, 0.25f, 0.25f, 0.5f};
    EXPECT_EQ(border_batch(batches, inside).imagery, Imagery::plain);
}

TEST(DrawBatches, TilesInsideAnAncestorsTextureArePlain) {
    DrawBatches batches = make(1, 1);
    DrawItem item = item_in(0, {0});
    item.texture = {0, 0.25f, 0.25f, 0.5f};
    EXPECT_EQ(border_batch(batches, item).imagery, Imagery::plain);
    item.texture.offset_v = 0.75f;
    EXPECT_EQ(border_batch(batches, item).imagery, Imagery::bordered);
}

TEST(DrawBatches, DrawsLookAtNoMoreArraysThanTheyNeed) {
    DrawBatches batches = make(3, 3);
    EXPECT_EQ(border_batch(batches, item_in(1, {1, 1})).imagery, Imagery::bordered);
    const DrawBatch two = border_batch(batches, item_in(2, {2, 1}));
    EXPECT_EQ(two.imagery, Imagery::blended);
    EXPECT_EQ(two.arrays, (std::array{1, 2}));
    EXPECT_EQ(border_batch(batches, item_in(2, {0, 1})).imagery, Imagery::blended_of_all);
}

TEST(DrawBatches, BeyondWhatCanBeBoundTheCoarseTextureGoesBeforeNeighbours) {
    DrawBatches batches = make(9, 4);
    DrawItem item = item_in(7, {2, 5, 5});
    EXPECT_EQ(border_batch(batches, item).imagery, Imagery::blended);
    EXPECT_EQ(border_batch(batches, item).arrays, (std::array{5, 7}));
    item.texture_share = 0.5f;
    item.coarse_texture.slot = 8 * kLayers;
    EXPECT_EQ(border_batch(batches, item).arrays, (std::array{7, 8}));
    batches.sort(std::vector{item});
    EXPECT_EQ(batches.batches()[1].imagery, Imagery::faded);
    EXPECT_EQ(batches.batches()[1].arrays, (std::array{7, 8}));
}

}  // namespace
}  // namespace scree
