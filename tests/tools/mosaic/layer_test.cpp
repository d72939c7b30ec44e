#include "tools/mosaic/layer.h"

#include <gtest/gtest.h>

namespace scree {
namespace {

Crs crs(const std::string& text) { return *Crs::parse(text); }

PlacedFile file(double x, double y, std::int64_t width, std::int64_t height, double step = 10,
                const std::string& in = "EPSG:32633") {
    Georeference where;
    where.first_x = x;
    where.first_y = y;
    where.column_x = step;
    where.row_y = -step;
    where.raster_is_point = true;
    ImageInfo info;
    info.width = width;
    info.height = height;
    return {"f", info, where, crs(in)};
}

std::vector<Layer> layers_of(const std::vector<PlacedFile>& files) {
    auto layers = group_layers(files);
    EXPECT_TRUE(layers.ok());
    return layers ? std::move(*layers) : std::vector<Layer>{};
}

void expect_member(const Layer& layer, std::size_t k, std::int64_t column, std::int64_t row) {
    ASSERT_LT(k, layer.members.size());
    EXPECT_EQ(layer.members[k].column, column);
    EXPECT_EQ(layer.members[k].row, row);
}

TEST(Layers, FilesOfOneGridAreMembersAtWholeOffsetsInOrder) {
    const auto layers = layers_of({file(1000, 5000, 20, 30), file(1190, 4900, 5, 5), file(1000, 5000, 3, 3)});
    ASSERT_EQ(layers.size(), 1u);
    ASSERT_EQ(layers[0].members.size(), 3u);
    for (std::size_t k = 0; k < 3; ++k) EXPECT_EQ(layers[0].members[k].file, k);
    expect_member(layers[0], 0, 0, 0);
    expect_member(layers[0], 1, 19, 10);
    expect_member(layers[0], 2, 0, 0);
    EXPECT_EQ(layers[0].columns, 24);
    EXPECT_EQ(layers[0].rows, 30);
    EXPECT_EQ(layers[0].where.first_x, 1000);
    EXPECT_EQ(layers[0].where.first_y, 5000);
}

TEST(Layers, AGridGrowsToTheWestAndNorthAndAllMembersMove) {
    const auto layers = layers_of({file(1000, 5000, 20, 30), file(900, 5040, 4, 4), file(1010, 4990, 1, 1)});
    ASSERT_EQ(layers.size(), 1u);
    expect_member(layers[0], 0, 10, 4);
    expect_member(layers[0], 1, 0, 0);
    expect_member(layers[0], 2, 11, 5);
    EXPECT_EQ(layers[0].where.first_x, 900);
    EXPECT_EQ(layers[0].where.first_y, 5040);
    EXPECT_EQ(layers[0].columns, 30);
    EXPECT_EQ(layers[0].rows, 34);
}

TEST(Layers, APhaseWithinAThousandthOfASampleIsTheSameGridAndOneBeyondIsNot) {
    EXPECT_EQ(layers_of({file(1000, 5000, 20, 30), file(1100.009, 5000, 20, 30)}).size(), 1u);
    EXPECT_EQ(layers_of({file(1000, 5000, 20, 30), file(1100.011, 5000, 20, 30)}).size(), 2u);
    EXPECT_EQ(layers_of({file(1000, 5000, 20, 30), file(1100, 5000.011, 20, 30)}).size(), 2u);
    EXPECT_EQ(layers_of({file(1000, 5000, 20, 30), file(1005, 5000, 20, 30)}).size(), 2u);
}

TEST(Layers, AStepThatDriftsByMoreThanThatOverTheFileIsAnotherGrid) {
    EXPECT_EQ(layers_of({file(1000, 5000, 20, 30), file(1000, 5000, 100, 10, 10.00005)}).size(), 1u);
    EXPECT_EQ(layers_of({file(1000, 5000, 20, 30), file(1000, 5000, 100, 10, 10.0005)}).size(), 2u);
    EXPECT_EQ(layers_of({file(1000, 5000, 20, 30), file(1000, 5000, 20, 30, 5)}).size(), 2u);
}

TEST(Layers, AnotherCrsIsAnotherLayer) {
    EXPECT_EQ(layers_of({file(1000, 5000, 20, 30), file(1000, 5000, 20, 30, 10, "EPSG:32634")}).size(), 2u);
}

TEST(Layers, FilesBetweenWhichAnotherGridLiesMakeTwoLayers) {
    const auto layers = layers_of({file(1000, 5000, 20, 30), file(1003, 5000, 20, 30), file(1100, 5000, 20, 30)});
    ASSERT_EQ(layers.size(), 3u);
    for (std::size_t k = 0; k < 3; ++k) {
        ASSERT_EQ(layers[k].members.size(), 1u);
        EXPECT_EQ(layers[k].members[0].file, k);
    }
}

TEST(Layers, ARimIsThereOnlyWhereEveryMemberStandsForAreas) {
    PlacedFile area = file(1000, 5000, 20, 30), other = file(1200, 5000, 20, 30);
    area.where.raster_is_point = other.where.raster_is_point = false;
    EXPECT_TRUE(layers_of({area, other})[0].half_sample_rim);
    other.where.raster_is_point = true;
    EXPECT_FALSE(layers_of({area, other})[0].half_sample_rim);
    EXPECT_FALSE(layers_of({other, area})[0].half_sample_rim);
}

TEST(Layers, TurnedGridsJoinToo) {
    PlacedFile first = file(1000, 5000, 20, 30);
    first.where.column_x = 6;
    first.where.column_y = 8;
    first.where.row_x = 8;
    first.where.row_y = -6;
    PlacedFile second = first;
    second.where.first_x = first.where.x(7, -3);
    second.where.first_y = first.where.y(7, -3);
    const auto layers = layers_of({first, second});
    ASSERT_EQ(layers.size(), 1u);
    expect_member(layers[0], 0, 0, 3);
    expect_member(layers[0], 1, 7, 0);
}

TEST(Layers, AGridOfTooManySamplesIsRefused) {
    EXPECT_TRUE(group_layers({file(0, 0, 2, 2, 1e-3), file(1e9, 0, 2, 2, 1e-3)}).ok());
    const auto layers = group_layers({file(0, 0, 2, 2, 1e-6), file(1.2e6, 0, 2, 2, 1e-6)});
    ASSERT_FALSE(layers.ok() && layers->size() == 1) << "2^40 samples";
}

}  // namespace
}  // namespace scree
