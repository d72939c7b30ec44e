#include <cmath>
#include <limits>
#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/tools/source/grid_test_support.h"

namespace scree {
namespace {

using test::TempDirectory;

constexpr char kHeader[] = "ncols 3\nnrows 2\nxllcorner 1000\nyllcorner 5000\ncellsize 10\nNODATA_value -9999\n";

std::string values_of(std::int64_t columns, std::int64_t rows, const char* fraction) {
    std::string text;
    for (std::int64_t row = 0; row < rows; ++row) {
        for (std::int64_t column = 0; column < columns; ++column)
            text += fmt::format("{}{} ", test::sample_at(row, column), fraction);
        text += "\n";
    }
    return text;
}

std::string header_of(std::int64_t columns, std::int64_t rows) {
    return fmt::format("NCOLS {}\r\nNROWS {}\r\nXLLCORNER 0\r\nYLLCORNER 0\r\nCELLSIZE 5\r\n", columns, rows);
}

TEST(AsciiGrid, IntegersAreKnownAsSuchAndExact) {
    const TempDirectory directory;
    // More rows than a mark lies apart, and more bytes than the buffer holds.
    const std::string text = header_of(211, 600) + values_of(211, 600, "");
    const auto source = test::open_grid_or_fail(directory.write("a.asc", text));
    ASSERT_NE(source, nullptr);
    EXPECT_EQ(source->info().type, SampleType::i32);
    EXPECT_EQ(source->info().width, 211);
    EXPECT_EQ(source->info().height, 600);
    EXPECT_EQ(source->info().unit_bytes, 211 * 4);
    EXPECT_FALSE(source->info().nodata);
    test::expect_surface(*source);
}

TEST(AsciiGrid, FractionsAreDoubles) {
    const TempDirectory directory;
    const std::string text = header_of(211, 600) + values_of(211, 600, ".0");
    const auto source = test::open_grid_or_fail(directory.write("a.asc", text));
    ASSERT_NE(source, nullptr);
    EXPECT_EQ(source->info().type, SampleType::f64);
    test::expect_surface(*source);
    const auto one = test::open_grid_or_fail(directory.write("b.asc", std::string(kHeader) + "1 2 3 4 5 0.1"));
    EXPECT_EQ(one->info().type, SampleType::f64);
    EXPECT_EQ(one->info().nodata, -9999.0);
    EXPECT_EQ(test::read_all(*one), (std::vector<double>{1, 2, 3, 4, 5, 0.1}));
}

TEST(AsciiGrid, CornersAndCentresPlaceTheSameGrid) {
    const TempDirectory directory;
    const std::string corner = "xllcorner 1000 yllcorner 5000 ";
    const std::string centre = "YLLCENTER 5010 XLLCENTER 1005 ";
    for (const std::string& where : {corner, centre}) {
        const std::string text = "dy 20 nrows 2 DX 10 NoData_Value -1 " + where + "ncols 3\n1 2 3 4 5 -1";
        const auto source = test::open_grid_or_fail(directory.write("a.asc", text));
        ASSERT_NE(source, nullptr);
        const Georeference& place = *source->georeference();
        EXPECT_EQ(place.first_x, 1005);
        EXPECT_EQ(place.first_y, 5030);
        EXPECT_EQ(place.column_x, 10);
        EXPECT_EQ(place.row_y, -20);
        EXPECT_EQ(place.crs, "");
        EXPECT_EQ(source->info().nodata, -1.0);
    }
}

TEST(AsciiGrid, LineBreaksEndMarksAndSignsDoNotMatter) {
    const TempDirectory directory;
    const std::string path =
        directory.write("a.asc", std::string(kHeader) + "+1\t2\r\n3\n4 5\n\n -6 \r\n\x1A" + std::string(3, '\0'));
    const auto source = test::open_grid_or_fail(path);
    ASSERT_NE(source, nullptr);
    EXPECT_EQ(test::read_all(*source), (std::vector<double>{1, 2, 3, 4, 5, -6}));
}

TEST(AsciiGrid, ContentTellsTheKindWhateverTheName) {
    const TempDirectory directory;
    const auto source = test::open_grid_or_fail(directory.write("grid.txt", std::string(kHeader) + "1 2 3 4 5 6"));
    ASSERT_NE(source, nullptr);
    EXPECT_EQ(source->info().width, 3);
    test::expect_refusal(directory.write("other.asc", "hello there"), "not an ESRI ASCII grid");
}

TEST(AsciiGrid, NanAndWhatNoDoubleHoldsAreNotFinite) {
    const TempDirectory directory;
    const std::string path = directory.write("a.asc", std::string(kHeader) + "nan 1e999 -1e999 1e-999 0.5 -0.25e1");
    const auto source = test::open_grid_or_fail(path);
    ASSERT_NE(source, nullptr);
    const std::vector<double> values = test::read_all(*source);
    EXPECT_TRUE(std::isnan(values[0]));
    EXPECT_EQ(values[1], std::numeric_limits<double>::infinity());
    EXPECT_EQ(values[2], -std::numeric_limits<double>::infinity());
    EXPECT_EQ(values[3], 0);
    EXPECT_EQ(values[5], -2.5);
}

TEST(AsciiGrid, AnIntegerOfTenDigitsMakesDoubles) {
    const TempDirectory directory;
    const auto source =
        test::open_grid_or_fail(directory.write("a.asc", std::string(kHeader) + "1 2 3 4 5 3000000000"));
    ASSERT_NE(source, nullptr);
    EXPECT_EQ(test::read_all(*source).back(), 3e9);
}

TEST(AsciiGrid, BrokenValuesAreNamedByRowAndColumn) {
    const TempDirectory directory;
    const std::string header = kHeader;
    test::expect_refusal(directory.write("a.asc", header + "1 2 3 4 five 6"), "'five' in row 1, column 1");
    test::expect_refusal(directory.write("a.asc", header + "1 2 3,5 4 5 6"), "'3,5' in row 0, column 2");
    test::expect_refusal(directory.write("a.asc", header + "1 2 3 4  5   "), "ends before row 1, column 2");
    test::expect_refusal(directory.write("a.asc", header + "1 2 3 4 5 6 7"), "'7' follows the last");
    test::expect_refusal(directory.write("a.asc", header + "1 2 3 4 5-6 7"), "'5-6' in row 1");
    test::expect_refusal(directory.write("a.asc", header + "1 2 3 4 5 " + std::string(1 << 20, '1')), "no number");
}

TEST(AsciiGrid, HeadersThatCannotBeAreRefused) {
    const TempDirectory directory;
    const auto refused = [&](const std::string& text, const std::string& what) {
        test::expect_refusal(directory.write("a.asc", text), what);
    };
    refused("ncols 1000000000\nnrows 1000000000\nxllcorner 0\nyllcorner 0\ncellsize 1\n1 2 3",
            "bytes after the header");
    refused("ncols 0\nnrows 1\nxllcorner 0\nyllcorner 0\ncellsize 1\n1", "ncols is '0'");
    refused("ncols 1e30\nnrows 1\nxllcorner 0\nyllcorner 0\ncellsize 1\n1", "ncols is '1e30'");
    refused("ncols 1.5\nnrows 1\nxllcorner 0\nyllcorner 0\ncellsize 1\n1", "ncols is '1.5'");
    refused("ncols 1\nxllcorner 0\nyllcorner 0\ncellsize 1\n1", "lacks ncols or nrows");
    refused("ncols 1\nnrows 1\nyllcorner 0\ncellsize 1\n1", "lies nowhere");
    refused("ncols 1\nnrows 1\nxllcorner 0\nyllcorner 0\ncellsize 0\n1", "cellsize is 0");
    refused("ncols 1\nnrows 1\nxllcorner nan\nyllcorner 0\ncellsize 1\n1", "xllcorner is 'nan'");
    refused("ncols 1\nnrows 1\nxllcorner 0\nyllcorner 0\ncellsize 1\nspeed 7\n1", "'speed' in its header");
    refused("ncols 1\nnrows 1\nxllcorner 0\nyllcorner 0\ncellsize 1\n", "in its header");
}

TEST(AsciiGrid, NoPrefixIsMisread) {
    const TempDirectory directory;
    directory.write("a.asc", header_of(23, 19) + values_of(23, 19, ".0"));
    // Nothing can tell a file that is cut within its last number from a whole one: here that is one digit.
    const std::string whole = test::read_bytes(directory.path("a.asc"));
    directory.write("a.asc", whole.substr(0, whole.find_last_of(' ', whole.size() - 3)) + " 7\n");
    test::expect_no_prefix_misread(directory, "a.asc");
}

TEST(AsciiGrid, AProjectionFileBesideItGivesTheCrs) {
    const TempDirectory directory;
    const std::string path = directory.write("a.asc", std::string(kHeader) + "1 2 3 4 5 6");
    const auto crs = [&](const char* prj) {
        directory.write("a.prj", prj);
        const auto source = test::open_grid_or_fail(path);
        return source ? *source->georeference() : Georeference{};
    };
    const char* wkt = "PROJCS[\"x\",GEOGCS[\"y\"]]";
    EXPECT_EQ(crs(wkt).crs, wkt);
    const Georeference srtm = crs(
        "Projection    GEOGRAPHIC\nDatum         WGS84\nSpheroid      WGS84\nUnits         DD\nZunits        METERS\n"
        "Parameters\n");
    EXPECT_EQ(srtm.crs, "EPSG:4326");
    EXPECT_TRUE(srtm.geographic);
    EXPECT_EQ(srtm.height_unit_m, 1);
    EXPECT_EQ(crs("Projection UTM\r\nZone 10\r\nDatum NAD83\r\nZunits FEET\r\nUnits METERS\r\n").crs, "EPSG:26910");
    EXPECT_EQ(crs("Projection UTM\nZone -33\nDatum WGS84\nUnits METERS\n").crs, "EPSG:32733");
    const Georeference unknown = crs("Projection ALBERS\nDatum NAD27\nUnits METERS\n");
    EXPECT_EQ(unknown.crs, "");
    EXPECT_EQ(unknown.crs_name.find("Projection ALBERS"), 0u);
    directory.write("a.prj", std::string(70000, 'x'));
    test::expect_refusal(path, "70000 bytes");
}

TEST(AsciiGridOfGdal, ReadsAsGdalDoes) {
    const TempDirectory directory;
    const std::string path = directory.write("a.asc", header_of(31, 17) + values_of(31, 17, ".125"));
    SCREE_EXPECT_AS_GDAL_OR_SKIP(directory, path);
}

}  // namespace
}  // namespace scree
