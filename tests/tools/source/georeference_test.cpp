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

TEST(Georeference, AUserDefinedCrsOfUnknownMethodHasANameButNoText) {
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

// A transverse Mercator of our own on ED 50, which has a code.
TestTiff own_grid() {
    TestTiff tiff = placed();
    tiff.projected = KvUserDefined;
    tiff.geographic = 4230;
    tiff.citation = "our \"own\" grid";
    tiff.linear_unit = Linear_Foot;
    tiff.short_keys = {{ProjectionGeoKey, KvUserDefined}, {ProjCoordTransGeoKey, CT_TransverseMercator}};
    tiff.double_keys = {{ProjNatOriginLongGeoKey, 9.5},
                        {ProjNatOriginLatGeoKey, 10},
                        {ProjScaleAtNatOriginGeoKey, 0.9996},
                        {ProjFalseEastingGeoKey, 500000},
                        {ProjFalseNorthingGeoKey, 1000}};
    return tiff;
}

TEST(Georeference, AUserDefinedCrsIsAssembledWithItsDatumAndUnits) {
    const TempDirectory directory;
    const Georeference g = read_placed(directory, own_grid());
    for (const char* part :
         {"PROJCS[\"our 'own' grid\"", "DATUM[\"European Datum 1950\"", "6378388,297]", "AUTHORITY[\"EPSG\",\"6230\"]",
          "AUTHORITY[\"EPSG\",\"4230\"]", "PROJECTION[\"Transverse_Mercator\"]", "\"latitude_of_origin\",10]",
          "\"central_meridian\",9.5]", "\"scale_factor\",0.9996]", "\"false_easting\",500000]",
          "\"false_northing\",1000]", "0.3048]]"})
        EXPECT_NE(g.crs.find(part), std::string::npos) << part << " in " << g.crs;
}

TEST(Georeference, AnEllipsoidOfItsOwnIsKept) {
    const TempDirectory directory;
    TestTiff tiff = placed();
    tiff.model_type = ModelTypeGeographic;
    tiff.projected = 0;
    tiff.geographic = KvUserDefined;
    tiff.double_keys = {{GeogSemiMajorAxisGeoKey, 6371000}, {GeogInvFlatteningGeoKey, 300}};
    tiff.short_keys = {{GeogEllipsoidGeoKey, KvUserDefined},
                       {GeogGeodeticDatumGeoKey, KvUserDefined},
                       {GeogAngularUnitsGeoKey, Angular_Degree}};
    const Georeference g = read_placed(directory, tiff);
    EXPECT_TRUE(g.geographic);
    EXPECT_NE(g.crs.find("SPHEROID[\"unnamed\",6371000,300]"), std::string::npos) << g.crs;
    EXPECT_EQ(g.crs.find("GEOGCS["), 0u);
}

TEST(Georeference, ParametersThatAreNotFiniteLeaveTheCrsUnsaid) {
    const TempDirectory directory;
    TestTiff tiff = own_grid();
    tiff.double_keys[0].second = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(read_placed(directory, tiff).crs, "");
}

TEST(Georeference, EsriTextInACitationIsTheCrs) {
    const TempDirectory directory;
    TestTiff tiff = own_grid();
    tiff.citation = "ESRI PE String = PROJCS[\"x\",GEOGCS[\"y\"]]|";
    EXPECT_EQ(read_placed(directory, tiff).crs, "PROJCS[\"x\",GEOGCS[\"y\"]]");
}

TEST(Georeference, AUnitThatOverridesItsCodeIsHonoured) {
    const TempDirectory directory;
    TestTiff tiff = placed();
    tiff.linear_unit = Linear_Meter;
    EXPECT_EQ(read_placed(directory, tiff).crs, "EPSG:32633");
    tiff.linear_unit = Linear_Foot;
    const Georeference g = read_placed(directory, tiff);
    EXPECT_NE(g.crs.find("\"central_meridian\",15]"), std::string::npos) << g.crs;
    EXPECT_NE(g.crs.find("0.3048]]"), std::string::npos) << g.crs;
    EXPECT_EQ(g.linear_unit_m, 0.3048);
}

TEST(Georeference, HeightUnitsComeFromKeysOrGdalsUnitType) {
    const TempDirectory directory;
    TestTiff tiff = placed();
    EXPECT_EQ(read_placed(directory, tiff).height_unit_m, 0);
    tiff.vertical = 6360;
    EXPECT_DOUBLE_EQ(read_placed(directory, tiff).height_unit_m, 1200.0 / 3937);
    tiff.short_keys = {{VerticalUnitsGeoKey, Linear_Foot}};
    EXPECT_DOUBLE_EQ(read_placed(directory, tiff).height_unit_m, 0.3048);
    tiff.short_keys.clear();
    tiff.vertical = 5103;
    tiff.gdal_metadata =
        "<GDALMetadata><Item name=\"UNITTYPE\" sample=\"0\" role=\"unittype\">ft</Item></GDALMetadata>";
    const Georeference g = read_placed(directory, tiff);
    EXPECT_DOUBLE_EQ(g.height_unit_m, 0.3048);
    EXPECT_EQ(g.vertical_datum, "EPSG:5703");
}

TEST(Georeference, IntergraphsMatrixPlacesAnOldFile) {
    const TempDirectory directory;
    TestTiff tiff = placed();
    tiff.scale.clear();
    tiff.tie_points.clear();
    tiff.intergraph_matrix = {30, 5, 0, 1000, 4, -20, 0, 5000, 0, 0, 0, 0, 0, 0, 0, 1, 0};
    const Georeference g = read_placed(directory, tiff);
    EXPECT_EQ(g.first_x, 1000 + 15 + 2.5);
    EXPECT_EQ(g.first_y, 5000 + 2 - 10);
    EXPECT_EQ(g.column_x, 30);
    EXPECT_EQ(g.column_y, 4);
    EXPECT_EQ(g.row_x, 5);
    EXPECT_EQ(g.row_y, -20);
}

TEST(Georeference, ANegativeYScaleIsReadAsNorthUpAsGdalDoes) {
    const TempDirectory directory;
    TestTiff tiff = placed();
    tiff.scale = {30, -20, 0};
    const Georeference g = read_placed(directory, tiff);
    EXPECT_EQ(g.row_y, -20);
    EXPECT_EQ(g.first_y, 4990);
}

TEST(Georeference, ControlPointsAloneAreRefusedWithTheirNumber) {
    const TempDirectory directory;
    TestTiff tiff = placed();
    tiff.tie_points = {0, 0, 0, 1000, 5000, 0, 4, 0, 0, 1100, 5010, 0, 0, 3, 0, 990, 4900, 0};
    for (const std::vector<double>& scale : {std::vector<double>{}, std::vector<double>{0, 0, 0}}) {
        tiff.scale = scale;
        const std::string path = directory.path("gcp.tif");
        ASSERT_TRUE(test::write_tiff(path, tiff, kPixels.data()));
        const auto read = read_georeference(path);
        ASSERT_FALSE(read.ok());
        EXPECT_EQ(read.error().code, ErrorCode::input);
        EXPECT_NE(read.error().message.find("gcp.tif: placed by 3 ground control points"), std::string::npos);
    }
    directory.write("gcp.tfw", "10 0 0 -10 500 900");
    const auto read = read_georeference(directory.path("gcp.tif"));
    ASSERT_TRUE(read.ok() && read->has_value());
    EXPECT_EQ((*read)->first_x, 500);
    EXPECT_EQ((*read)->crs, "EPSG:32633");
}

// The registry's own library would report it to standard error by itself.
TEST(Georeference, AnUnknownUnitIsTakenForMetresInSilence) {
    const TempDirectory directory;
    TestTiff tiff = placed();
    tiff.linear_unit = 9999;
    const std::string path = directory.path("u.tif");
    ASSERT_TRUE(test::write_tiff(path, tiff, kPixels.data()));
    ::testing::internal::CaptureStderr();
    const auto read = read_georeference(path);
    EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
    ASSERT_TRUE(read.ok() && read->has_value());
    EXPECT_EQ((*read)->linear_unit_m, 1);
}

TEST(Georeference, AProjectionFileFillsInForMissingKeysOnly) {
    const TempDirectory directory;
    TestTiff tiff = placed();
    const std::string path = directory.path("p.tif");
    directory.write("p.prj", "GEOGCS[\"x\"]\n");
    ASSERT_TRUE(test::write_tiff(path, tiff, kPixels.data()));
    EXPECT_EQ((*read_georeference(path))->crs, "EPSG:32633");
    tiff.model_type = 0;
    ASSERT_TRUE(test::write_tiff(path, tiff, kPixels.data()));
    const auto read = read_georeference(path);
    EXPECT_EQ((*read)->crs, "GEOGCS[\"x\"]");
    EXPECT_TRUE((*read)->geographic);
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
    for (const double step :
         {0.0, 1e16, std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()}) {
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
