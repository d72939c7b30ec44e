#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/tools/source/grid_test_support.h"
#include "tools/source/source_list.h"

namespace scree {
namespace {

using test::TempDirectory;

constexpr int kColumns = 21, kRows = 31;
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr float kBlank = 1.70141e38F;

struct Header {
    std::string magic = "DSBB";
    int columns = kColumns, rows = kRows;
    double west = 1000, east = 1200, south = -50, north = 10;
    double lowest = 0, highest = 1;
};

std::string bytes_of(const Header& h) {
    std::string bytes = h.magic;
    test::append(bytes, static_cast<std::int16_t>(h.columns), false);
    test::append(bytes, static_cast<std::int16_t>(h.rows), false);
    for (const double value : {h.west, h.east, h.south, h.north, h.lowest, h.highest})
        test::append(bytes, value, false);
    return bytes;
}

std::string samples() {
    std::string bytes;
    for (int row = kRows - 1; row >= 0; --row)
        for (int column = 0; column < kColumns; ++column)
            test::append(bytes, static_cast<float>(test::sample_at(row, column)), false);
    return bytes;
}

TEST(Surfer, ValuesAndPlaceAreExact) {
    const TempDirectory directory;
    const auto source = test::open_grid_or_fail(directory.write("a.grd", bytes_of({}) + samples()));
    ASSERT_NE(source, nullptr);
    EXPECT_EQ(source->info().width, kColumns);
    EXPECT_EQ(source->info().height, kRows);
    EXPECT_EQ(source->info().type, SampleType::f32);
    ASSERT_TRUE(source->georeference());
    const Georeference& place = *source->georeference();
    EXPECT_EQ(place.first_x, 1000);
    EXPECT_EQ(place.first_y, 10);
    EXPECT_EQ(place.column_x, 10);
    EXPECT_EQ(place.row_y, -2);
    EXPECT_EQ(place.column_y, 0);
    EXPECT_EQ(place.row_x, 0);
    EXPECT_TRUE(place.raster_is_point);
    EXPECT_TRUE(place.crs.empty());
    test::expect_surface(*source);
}

TEST(Surfer, TheVoidIsTheFloatNextToWhatTheFormatSays) {
    const TempDirectory directory;
    std::string file = bytes_of({}) + samples();
    file.resize(file.size() - 4);
    test::append(file, kBlank, false);
    const auto source = test::open_grid_or_fail(directory.write("a.grd", file));
    ASSERT_NE(source, nullptr);
    EXPECT_EQ(source->info().nodata, static_cast<double>(kBlank));
    EXPECT_EQ(test::read_rows(*source, 0, 1).back(), static_cast<double>(kBlank));
}

TEST(Surfer, ItIsKnownByItsSignatureAndInFoldersByItsNameToo) {
    const TempDirectory directory;
    const std::string whole = bytes_of({}) + samples();
    const auto source = test::open_grid_or_fail(directory.write("grid", whole));
    ASSERT_NE(source, nullptr);
    test::expect_surface(*source);
    std::filesystem::create_directories(directory.path("f"));
    const std::string path = directory.write("f/A.GRD", whole);
    directory.write("f/netcdf.grd", std::string("CDF\1") + whole);
    directory.write("f/empty.grd", "");
    const auto listed = list_sources({directory.path("f")});
    ASSERT_TRUE(listed.ok()) << listed.error().message;
    EXPECT_EQ(*listed, std::vector<std::string>{path});
}

TEST(Surfer, ItsProjectionFileNamesItsCrs) {
    const TempDirectory directory;
    directory.write("a.prj", "Projection UTM\nZone 10\nDatum WGS84\nUnits METERS\n");
    const auto source = test::open_grid_or_fail(directory.write("a.grd", bytes_of({}) + samples()));
    ASSERT_NE(source, nullptr);
    EXPECT_EQ(source->georeference()->crs, "EPSG:32610");
    EXPECT_EQ(source->georeference()->first_x, 1000);
}

TEST(Surfer, OtherKindsOfGridsAreRefusedByName) {
    const TempDirectory directory;
    for (const char* magic : {"DSAA", "DSRB"})
        test::expect_refusal(directory.write("a.grd", bytes_of({.magic = magic}) + samples()), magic);
}

TEST(Surfer, SidesThatLieAreRefused) {
    const TempDirectory directory;
    const auto refuse = [&](const Header& header, const std::string& what) {
        test::expect_refusal(directory.write("a.grd", bytes_of(header) + samples()), what);
    };
    refuse({.columns = 0}, "0 x 31 samples");
    refuse({.rows = 1}, "21 x 1 samples");
    refuse({.columns = -21, .rows = -31}, "-21 x -31 samples");
    refuse({.columns = -32768}, "-32768 x 31 samples");
    refuse({.columns = 32767, .rows = 32767}, "4294705212 bytes");
    refuse({.columns = kColumns + 1}, "22 x 31 samples need 2784 bytes, but the file has 2660");
    // Fewer than there are: every row would be sheared.
    refuse({.columns = kColumns - 1}, "20 x 31 samples need 2536 bytes, but the file has 2660");
    test::expect_refusal(directory.write("a.grd", bytes_of({}) + samples() + "x"), "2661");
}

TEST(Surfer, ExtentsThatCannotBeAreRefused) {
    const TempDirectory directory;
    const auto refuse = [&](const Header& header, const std::string& what) {
        test::expect_refusal(directory.write("a.grd", bytes_of(header) + samples()), what);
    };
    refuse({.east = 1000}, "x goes from 1000 to 1000, so it lies nowhere");
    refuse({.east = 900}, "x goes from 1000 to 900");
    refuse({.south = 10, .north = -50}, "y goes from 10 to -50");
    refuse({.west = kNan}, "x goes from nan to 1200");
    refuse({.north = kInfinity}, "y goes from -50 to inf");
    refuse({.west = -1.7e308, .east = 1.7e308}, "lies nowhere");
    refuse({.west = 1e300, .east = 2e300}, "nowhere");
    refuse({.west = 0, .east = 5e-324}, "on one line");
}

// Writers leave it stale or never fill it in.
TEST(Surfer, TheRangeOfHeightsIsPassedOver) {
    const TempDirectory directory;
    const auto source = test::open_grid_or_fail(
        directory.write("a.grd", bytes_of({.lowest = kNan, .highest = -kInfinity}) + samples()));
    ASSERT_NE(source, nullptr);
    test::expect_surface(*source);
}

TEST(Surfer, NoPrefixIsMisread) {
    const TempDirectory directory;
    directory.write("a.grd", bytes_of({}) + samples());
    test::expect_no_prefix_misread(directory, "a.grd");
}

TEST(SurferOfGdal, ReadsWhatGdalWrites) {
    const TempDirectory directory;
    std::string asc = "ncols 7\nnrows 5\nxllcenter 100\nyllcenter 200\ncellsize 10\nNODATA_value -9999\n";
    for (int i = 0; i < 35; ++i) asc += std::to_string(i * 3) + ".5 ";
    const std::string from = directory.write("g.asc", asc), to = directory.path("g.grd");
    const std::string command = "gdal_translate -q -of GSBG '" + from + "' '" + to + "' >/dev/null 2>&1";
    if (std::system(command.c_str()) != 0) GTEST_SKIP() << "needs gdal_translate";
    const auto source = test::open_grid_or_fail(to);
    ASSERT_NE(source, nullptr);
    EXPECT_EQ(source->georeference()->first_x, 100);
    EXPECT_EQ(source->georeference()->first_y, 240);
    SCREE_EXPECT_AS_GDAL_OR_SKIP(directory, to);
}

}  // namespace
}  // namespace scree
