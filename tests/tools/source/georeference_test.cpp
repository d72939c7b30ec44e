#include "tools/source/georeference.h"

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/tools/source/temp_directory.h"
#include "tests/tools/source/test_tiff.h"
#include "tools/source/number_text.h"

namespace scree {
namespace {

using test::TempDirectory;
using test::TestTiff;

const std::vector<std::uint8_t> kPixels(12, 7);

TestTiff placed() {
    TestTiff t;
    t.scale = {30, 20, 0};
    t.tie_points = {0, 0, 0, 1000, 5000, 0};
    t.model_type = ModelTypeProjected;
    t.projected = 32633;
    return t;
}

Georeference read_placed(const TempDirectory& directory, const TestTiff& tiff) {
    const std::string path = directory.path("t.tif");
    EXPECT_TRUE(test::write_tiff(path, tiff, kPixels.data()));
    const auto read = read_geotiff(path);
    EXPECT_TRUE(read.ok()) << read.error().message;
    EXPECT_TRUE(read->has_value());
    return read->value_or(Georeference{});
}

TEST(Georeference, PixelIsAreaLiesHalfAPixelInsideItsTiePoint) {
    const TempDirectory directory;
    const Georeference g = read_placed(directory, placed());
    EXPECT_EQ(g.first_x, 1015);
    EXPECT_EQ(g.first_y, 4990);
    EXPECT_EQ(g.column_x, 30);
    EXPECT_EQ(g.row_y, -20);
    EXPECT_FALSE(g.raster_is_point);
    EXPECT_TRUE(g.axis_aligned());
}

TEST(Georeference, PixelIsPointLiesOnItsTiePoint) {
    const TempDirectory directory;
    TestTiff tiff = placed();
    tiff.raster_type = RasterPixelIsPoint;
    const Georeference g = read_placed(directory, tiff);
    EXPECT_EQ(g.first_x, 1000);
    EXPECT_EQ(g.first_y, 5000);
    EXPECT_TRUE(g.raster_is_point);
}

TEST(Georeference, ATiePointMayHoldAnyRasterPlace) {
    const TempDirectory directory;
    TestTiff tiff = placed();
    tiff.tie_points = {2, 1, 0, 1000, 5000, 0};
    const Georeference g = read_placed(directory, tiff);
    EXPECT_EQ(g.first_x, 1000 - 2 * 30 + 15);
    EXPECT_EQ(g.first_y, 5000 + 20 - 10);
}

TEST(Georeference, AnUnrotatedModelTransformationIsAsGoodAsAScale) {
    const TempDirectory directory;
    TestTiff tiff = placed();
    tiff.scale.clear();
    tiff.tie_points.clear();
    tiff.matrix = {30, 0, 0, 1000, 0, -20, 0, 5000, 0, 0, 0, 0, 0, 0, 0, 1};
    const Georeference g = read_placed(directory, tiff);
    EXPECT_TRUE(g.axis_aligned());
    EXPECT_EQ(g.first_x, 1015);
    EXPECT_EQ(g.first_y, 4990);
    EXPECT_EQ(g.row_y, -20);
}

TEST(Georeference, ARotatedModelTransformationIsFlagged) {
    const TempDirectory directory;
    TestTiff tiff = placed();
    tiff.scale.clear();
    tiff.tie_points.clear();
    tiff.matrix = {30, 5, 0, 1000, 5, -20, 0, 5000, 0, 0, 0, 0, 0, 0, 0, 1};
    EXPECT_FALSE(read_placed(directory, tiff).axis_aligned());
}

TEST(Georeference, ProjectedCodeVerticalCodeAndCitationAreRead) {
    const TempDirectory directory;
    TestTiff tiff = placed();
    tiff.vertical = 5703;
    tiff.citation = "somewhere";
    const Georeference g = read_placed(directory, tiff);
    EXPECT_EQ(g.crs, "EPSG:32633");
    EXPECT_EQ(g.vertical_datum, "EPSG:5703");
    EXPECT_EQ(g.crs_name, "somewhere");
    EXPECT_FALSE(g.geographic);
    EXPECT_EQ(g.linear_unit_m, 1);
}

TEST(Georeference, AUserDefinedCrsHasANameButNoCode) {
    const TempDirectory directory;
    TestTiff tiff = placed();
    tiff.projected = KvUserDefined;
    tiff.linear_unit = Linear_Foot_US_Survey;
    tiff.citation = "our own grid";
    const Georeference g = read_placed(directory, tiff);
    EXPECT_EQ(g.crs, "");
    EXPECT_EQ(g.crs_name, "our own grid");
    EXPECT_FALSE(g.geographic);
    EXPECT_DOUBLE_EQ(g.linear_unit_m, 1200.0 / 3937.0);
}

TEST(Georeference, AGeographicFileSaysDegrees) {
    const TempDirectory directory;
    TestTiff tiff = placed();
    tiff.model_type = ModelTypeGeographic;
    tiff.projected = 0;
    tiff.geographic = 4326;
    const Georeference g = read_placed(directory, tiff);
    EXPECT_TRUE(g.geographic);
    EXPECT_EQ(g.crs, "EPSG:4326");
}

TEST(Georeference, AZeroOrInfiniteStepIsAnErrorThatNamesTheFile) {
    const TempDirectory directory;
    for (const double step : {0.0, std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()}) {
        TestTiff tiff = placed();
        tiff.scale = {step, 20, 0};
        const std::string path = directory.path("absurd.tif");
        ASSERT_TRUE(test::write_tiff(path, tiff, kPixels.data()));
        const auto read = read_geotiff(path);
        ASSERT_FALSE(read.ok()) << step;
        EXPECT_EQ(read.error().code, ErrorCode::input);
        EXPECT_NE(read.error().message.find("absurd.tif"), std::string::npos);
    }
}

TEST(Georeference, AFileWithoutTagsHasNone) {
    const TempDirectory directory;
    const std::string path = directory.path("bare.tif");
    ASSERT_TRUE(test::write_tiff(path, TestTiff{}, kPixels.data()));
    const auto tiff = read_geotiff(path);
    ASSERT_TRUE(tiff.ok());
    EXPECT_FALSE(tiff->has_value());
    const auto other = read_geotiff(directory.write("not.png", "\x89PNG"));
    ASSERT_TRUE(other.ok());
    EXPECT_FALSE(other->has_value());
    EXPECT_FALSE(read_world_file(path)->has_value());
}

TEST(WorldFile, ItsLastTwoNumbersAreTheFirstSample) {
    const TempDirectory directory;
    for (const char* name : {"a.tfw", "a.tifw", "a.wld", "a.TFW"}) {
        const std::string world = directory.write(name, "2.5\r\n0\r\n0.0\r\n-2.5e0\r\n+400001.25\r\n5299998.75\r\n");
        const auto read = read_world_file(directory.path("a.tif"));
        ASSERT_TRUE(read.ok() && read->has_value()) << name;
        EXPECT_EQ((*read)->first_x, 400001.25);
        EXPECT_EQ((*read)->first_y, 5299998.75);
        EXPECT_EQ((*read)->column_x, 2.5);
        EXPECT_EQ((*read)->row_y, -2.5);
        EXPECT_TRUE((*read)->axis_aligned());
        EXPECT_EQ((*read)->crs, "");
        std::filesystem::remove(world);
    }
}

TEST(WorldFile, RotationTermsAreFlagged) {
    const TempDirectory directory;
    directory.write("a.pgw", "2 0.5 0.5 -2 0 0");
    const auto read = read_world_file(directory.path("a.png"));
    ASSERT_TRUE(read.ok() && read->has_value());
    EXPECT_FALSE((*read)->axis_aligned());
}

TEST(WorldFile, WordsCommasAndMissingNumbersAreErrors) {
    const TempDirectory directory;
    for (const char* text :
         {"2,5 0 0 -2,5 0 0", "1 0 0 -1 5", "", "1 0 0 -1 x 0", "0 0 0 0 0 0", "nan 0 0 -1 0 0", "1e999 0 0 -1 0 0"}) {
        directory.write("b.jgw", text);
        const auto read = read_world_file(directory.path("b.jpg"));
        ASSERT_FALSE(read.ok()) << text;
        EXPECT_EQ(read.error().code, ErrorCode::input);
        EXPECT_NE(read.error().message.find("b.jgw"), std::string::npos);
    }
}

TEST(WorldFile, ATiffWithKeysButNoPlaceTakesItsPlaceFromTheWorldFile) {
    const TempDirectory directory;
    TestTiff tiff = placed();
    tiff.scale.clear();
    tiff.tie_points.clear();
    const std::string path = directory.path("k.tif");
    ASSERT_TRUE(test::write_tiff(path, tiff, kPixels.data()));
    directory.write("k.tfw", "10 0 0 -10 500 900");
    const auto read = read_georeference(path);
    ASSERT_TRUE(read.ok() && read->has_value());
    EXPECT_EQ((*read)->crs, "EPSG:32633");
    EXPECT_EQ((*read)->first_x, 500);
    EXPECT_EQ((*read)->row_y, -10);
}

TEST(NumberText, OnlyWholeNumbersOfADecimalPointAreTaken) {
    EXPECT_EQ(parse_number(" -32768 "), -32768.0);
    EXPECT_EQ(parse_number("+1.5e3"), 1500.0);
    EXPECT_TRUE(parse_number("nan") && *parse_number("nan") != *parse_number("nan"));
    for (const char* text : {"", " ", "1,5", "12abc", "+-3", "0x10"}) EXPECT_FALSE(parse_number(text)) << text;
}

TEST(GeoreferenceOfRealFiles, CraterLakeHeightsArePointsAndItsImageIsAreas) {
    SCREE_DATA_OR_SKIP(dem, "craterlake/craterlake-elev-16bit-30m.tif");
    SCREE_DATA_OR_SKIP(image, "craterlake/craterlake-imagery-30m.tif");
    const auto heights = read_geotiff(dem);
    const auto colours = read_geotiff(image);
    ASSERT_TRUE(heights.ok() && heights->has_value());
    ASSERT_TRUE(colours.ok() && colours->has_value());
    EXPECT_TRUE((*heights)->raster_is_point);
    EXPECT_FALSE((*colours)->raster_is_point);
    EXPECT_TRUE((*heights)->geographic);
}

TEST(GeoreferenceOfRealFiles, ARotatedTransformationIsFlagged) {
    SCREE_DATA_OR_SKIP(path, "formats/geomatrix.tif");
    const auto read = read_geotiff(path);
    ASSERT_TRUE(read.ok() && read->has_value());
    EXPECT_FALSE((*read)->axis_aligned());
    EXPECT_EQ((*read)->crs, "EPSG:32611");
}

TEST(GeoreferenceOfRealFiles, TaipeiIsInTwd97) {
    SCREE_DATA_OR_SKIP(path, "taipei/derived_aster_taipei_40m_twd97.tif");
    const auto read = read_geotiff(path);
    ASSERT_TRUE(read.ok() && read->has_value());
    EXPECT_EQ((*read)->crs, "EPSG:3826");
    EXPECT_EQ((*read)->column_x, 40);
    EXPECT_EQ((*read)->row_y, -40);
}

}  // namespace
}  // namespace scree
