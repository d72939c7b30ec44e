#include "runtime/render/png.h"

#include <gtest/gtest.h>

#include <fstream>

#include "tests/runtime/render/image_compare.h"

namespace scree {
namespace {

class PngTest : public testing::Test {
protected:
    void SetUp() override {
        const auto* test = testing::UnitTest::GetInstance()->current_test_info();
        directory_ = std::filesystem::path(testing::TempDir()) / (std::string("scree png \u00fc ") + test->name());
        std::filesystem::remove_all(directory_);
        std::filesystem::create_directory(directory_);
    }
    void TearDown() override { std::filesystem::remove_all(directory_); }

    int files() const {
        int count = 0;
        for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(directory_)) ++count;
        return count;
    }

    std::filesystem::path directory_;
    // Two columns, three rows: red green / blue white / black grey.
    const std::vector<std::uint8_t> rgb_{255, 0, 0, 0, 255, 0, 0, 0, 255, 255, 255, 255, 0, 0, 0, 128, 128, 128};
};

TEST_F(PngTest, TheFirstRowIsTheTopRow) {
    const auto path = directory_ / "rows.png";
    ASSERT_TRUE(write_png(path, 2, 3, rgb_).ok());
    const auto image = load_png(path);
    ASSERT_TRUE(image.ok()) << image.error().message;
    EXPECT_EQ(image->width_px, 2);
    EXPECT_EQ(image->height_px, 3);
    EXPECT_EQ(image->rgb, rgb_);
    EXPECT_EQ(files(), 1) << "nothing is left beside the picture";
}

TEST_F(PngTest, AnOlderFileIsReplacedWhole) {
    const auto path = directory_ / "old.png";
    std::ofstream(path) << "not a picture, and longer than the one that comes";
    ASSERT_TRUE(write_png(path, 2, 3, rgb_).ok());
    ASSERT_TRUE(load_png(path).ok());
    EXPECT_EQ(load_png(path)->rgb, rgb_);
}

TEST_F(PngTest, AFailureNamesThePathAndLeavesNothing) {
    const auto path = directory_ / "missing" / "picture.png";
    const auto written = write_png(path, 2, 3, rgb_);
    ASSERT_FALSE(written.ok());
    EXPECT_EQ(written.error().code, ErrorCode::io);
    EXPECT_NE(written.error().message.find(path.string()), std::string::npos);

    const auto taken = directory_ / "taken.png";
    std::filesystem::create_directory(taken);
    ASSERT_FALSE(write_png(taken, 2, 3, rgb_).ok());
    EXPECT_EQ(files(), 1) << "the temporary file is gone";
}

TEST_F(PngTest, ADamagedPictureIsAnErrorNotACrash) {
    const auto path = directory_ / "damaged.png";
    std::ofstream(path) << "\x89PNG\r\n and then nothing of the kind";
    const auto image = load_png(path);
    ASSERT_FALSE(image.ok());
    EXPECT_NE(image.error().message.find(path.string()), std::string::npos);
}

}  // namespace
}  // namespace scree
