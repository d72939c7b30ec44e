#include "tests/runtime/render/image_compare.h"

#include <gtest/gtest.h>

namespace scree {
namespace {

Image grey(int width_px, int height_px) {
    return {width_px, height_px, std::vector<std::uint8_t>(3 * static_cast<std::size_t>(width_px * height_px), 100)};
}

std::filesystem::path scratch(const char* name) { return std::filesystem::path(testing::TempDir()) / name; }

TEST(ImageCompareTest, ToleratesSmallDifferencesAndFewPixels) {
    const Image golden = grey(10, 10);
    Image found = golden;
    for (auto& channel : found.rgb) channel = 102;
    EXPECT_TRUE(compare_images(golden, found, {2, 0}).same);
    found.rgb[0] = 200;
    EXPECT_FALSE(compare_images(golden, found, {2, 0.009}).same);
    const ImageDifference one = compare_images(golden, found, {2, 0.01});
    EXPECT_TRUE(one.same);
    EXPECT_EQ(one.largest, 100);
    EXPECT_DOUBLE_EQ(one.share, 0.01);
}

TEST(ImageCompareTest, AnotherSizeIsNeverTheSame) {
    EXPECT_FALSE(compare_images(grey(10, 5), grey(5, 10), {255, 1}).same);
}

TEST(ImageCompareTest, AFailureLeavesAPictureThatMarksThePixels) {
    const Image golden = grey(4, 3);
    Image found = golden;
    found.rgb[3 * 6 + 1] = 0;
    const auto path = scratch("scree_difference.png");
    const ImageDifference difference = compare_images(golden, found, {2, 0}, path);
    ASSERT_FALSE(difference.same);
    EXPECT_NE(difference.message.find(path.string()), std::string::npos);
    const auto shown = load_png(path);
    ASSERT_TRUE(shown.ok()) << shown.error().message;
    for (std::size_t pixel = 0; pixel < 12; ++pixel) EXPECT_EQ(shown->rgb[3 * pixel], pixel == 6 ? 255 : 50);
    std::filesystem::remove(path);
}

}  // namespace
}  // namespace scree
