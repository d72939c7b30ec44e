#include <string>

#include <gtest/gtest.h>

#include "tests/tools/source/grid_test_support.h"

namespace scree {
namespace {

using test::TempDirectory;

std::string tile(std::int64_t columns, std::int64_t rows) {
    std::string bytes;
    for (std::int64_t row = 0; row < rows; ++row)
        for (std::int64_t column = 0; column < columns; ++column)
            test::append(bytes, static_cast<std::int16_t>(test::sample_at(row, column)), true);
    return bytes;
}

TEST(Hgt, ValuesPlaceAndVoidOfAThreeSecondTileAreExact) {
    const TempDirectory directory;
    std::string bytes = tile(1201, 1201);
    const auto source = test::open_grid_or_fail(directory.write("N37W123.hgt", bytes));
    ASSERT_NE(source, nullptr);
    EXPECT_EQ(source->info().type, SampleType::i16);
    EXPECT_EQ(source->info().nodata, -32768.0);
    EXPECT_LE(source->info().unit_bytes, 1 << 20);
    ASSERT_TRUE(source->georeference());
    const Georeference& place = *source->georeference();
    EXPECT_EQ(place.first_x, -123);
    EXPECT_EQ(place.first_y, 38);
    EXPECT_EQ(place.column_x, 1.0 / 1200);
    EXPECT_EQ(place.row_y, -1.0 / 1200);
    EXPECT_EQ(place.row_x, 0);
    EXPECT_EQ(place.column_y, 0);
    EXPECT_NEAR(place.x(1200, 1200), -122, 1e-12);
    EXPECT_NEAR(place.y(1200, 1200), 37, 1e-12);
    EXPECT_TRUE(place.raster_is_point);
    EXPECT_EQ(place.crs, "EPSG:4326");
    EXPECT_EQ(place.vertical_datum, "EPSG:5773");
    test::expect_surface(*source);
}

TEST(Hgt, SidesAreToldBySize) {
    const TempDirectory directory;
    const std::pair<std::int64_t, std::int64_t> sides[] = {{3601, 3601}, {1801, 3601}, {601, 1201}};
    for (const auto& [columns, rows] : sides) {
        const auto source = test::open_grid_or_fail(directory.write("s01e179.HGT", tile(columns, rows)));
        ASSERT_NE(source, nullptr);
        EXPECT_EQ(source->info().width, columns);
        EXPECT_EQ(source->info().height, rows);
        EXPECT_EQ(source->georeference()->first_x, 179);
        EXPECT_EQ(source->georeference()->first_y, 0);
        EXPECT_NEAR(source->georeference()->x(static_cast<double>(columns - 1), 0), 180, 1e-12);
        const auto last = test::read_rows(*source, rows - 1, rows);
        EXPECT_EQ(last.back(), test::sample_at(rows - 1, columns - 1));
    }
}

TEST(Hgt, TheCornerIsFoundInEveryUsualName) {
    const TempDirectory directory;
    const std::string bytes = tile(1201, 1201);
    for (const char* name : {"n05w001.hgt", "N05W001.SRTMGL3.hgt", "n05_w001_3arc_v2.hgt", "NASADEM_HGT_n05w001.hgt"}) {
        const auto source = test::open_grid_or_fail(directory.write(name, bytes));
        ASSERT_NE(source, nullptr) << name;
        EXPECT_EQ(source->georeference()->first_x, -1);
        EXPECT_EQ(source->georeference()->first_y, 6);
    }
}

TEST(Hgt, NamesWithoutCornerAndOtherSizesAreRefused) {
    const TempDirectory directory;
    const std::string bytes = tile(1201, 1201);
    for (const char* name : {"tile.hgt", "N91E000.hgt", "N10E180.hgt", "N1E100.hgt", "N010E100.hgt", "XN10E100.hgt",
                             "N10X100.hgt", "N10E1000.hgt"})
        test::expect_refusal(directory.write(name, bytes), "south-west corner");
    for (const std::size_t size : {std::size_t{1}, bytes.size() - 2, bytes.size() - 1})
        test::expect_refusal(directory.write("N10E100.hgt", bytes.substr(0, size)), std::to_string(size) + " bytes");
    test::expect_refusal(directory.write("N10E100.hgt", bytes + "x"), "2884803 bytes");
    test::expect_refusal(directory.write("N10E100.hgt", ""), "empty");
}

TEST(HgtOfRealFiles, ReadsAsGdalDoes) {
    const TempDirectory directory;
    for (const char* name : {"N36W117", "N37W122", "N38W124"}) {
        SCREE_DATA_OR_SKIP(path, std::string("srtm_california/") + name + ".hgt");
        SCREE_EXPECT_AS_GDAL_OR_SKIP(directory, path);
    }
}

}  // namespace
}  // namespace scree
