#include <string>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/tools/source/grid_test_support.h"

namespace scree {
namespace {

using test::TempDirectory;

constexpr std::int64_t kColumns = 29;
constexpr std::int64_t kRows = 23;

struct Layout {
    std::string name = "BIL";
    int channels = 1;
    int skip = 0;
    int band_row_gap = 0;  ///< bytes after each row of a band (BIL)
    int row_gap = 0;       ///< bytes after each whole row (BIL, BIP)
    int band_gap = 0;      ///< bytes after each band (BSQ)
    bool big_endian = false;
};

template <class T>
std::string raw_bytes(const Layout& layout) {
    std::string bytes(static_cast<std::size_t>(layout.skip), '\x55');
    const auto put = [&](std::int64_t row, std::int64_t column, std::int64_t channel) {
        test::append(bytes, static_cast<T>(test::sample_at(row, column, channel)), layout.big_endian);
    };
    if (layout.name == "BSQ") {
        for (int channel = 0; channel < layout.channels; ++channel) {
            for (std::int64_t row = 0; row < kRows; ++row)
                for (std::int64_t column = 0; column < kColumns; ++column) put(row, column, channel);
            bytes.append(static_cast<std::size_t>(layout.band_gap), '\x55');
        }
        return bytes;
    }
    for (std::int64_t row = 0; row < kRows; ++row) {
        if (layout.name == "BIP") {
            for (std::int64_t column = 0; column < kColumns; ++column)
                for (int channel = 0; channel < layout.channels; ++channel) put(row, column, channel);
        } else {
            for (int channel = 0; channel < layout.channels; ++channel) {
                for (std::int64_t column = 0; column < kColumns; ++column) put(row, column, channel);
                bytes.append(static_cast<std::size_t>(layout.band_row_gap), '\x55');
            }
        }
        bytes.append(static_cast<std::size_t>(layout.row_gap), '\x55');
    }
    return bytes;
}

template <class T>
std::string esri_header(const Layout& layout, const char* type) {
    const auto sample = static_cast<std::int64_t>(sizeof(T));
    const std::int64_t band_row =
        kColumns * sample * (layout.name == "BIP" ? layout.channels : 1) + layout.band_row_gap;
    std::string text =
        fmt::format("BYTEORDER {}\nLAYOUT {}\nNROWS {}\nNCOLS {}\nNBANDS {}\nNBITS {}\nPIXELTYPE {}\n",
                    layout.big_endian ? "M" : "I", layout.name, kRows, kColumns, layout.channels, 8 * sizeof(T), type);
    text += fmt::format("BANDROWBYTES {}\nSKIPBYTES {}\n", band_row, layout.skip);
    if (layout.name != "BSQ")
        text += fmt::format("TOTALROWBYTES {}\n",
                            (layout.name == "BIL" ? band_row * layout.channels : band_row) + layout.row_gap);
    if (layout.name == "BSQ") text += fmt::format("BANDGAPBYTES {}\n", layout.band_gap);
    return text + "ULXMAP 1005\nULYMAP 4990\nXDIM 10\nYDIM 20\nNODATA -9999\n";
}

const std::vector<Layout>& layouts() {
    static const std::vector<Layout> kLayouts = {{"BIL", 1, 0, 0, 0, 0, false},  {"BIL", 3, 0, 0, 0, 0, true},
                                                 {"BIL", 3, 7, 5, 11, 0, false}, {"BIP", 1, 0, 0, 0, 0, true},
                                                 {"BIP", 3, 9, 0, 13, 0, true},  {"BSQ", 1, 0, 0, 0, 0, false},
                                                 {"BSQ", 3, 0, 0, 0, 0, true},   {"BSQ", 3, 3, 0, 0, 17, false}};
    return kLayouts;
}

template <class T>
void expect_every_layout(SampleType type, const char* word) {
    const TempDirectory directory;
    for (const Layout& layout : layouts()) {
        SCOPED_TRACE(fmt::format("{} {} {}", word, layout.name, layout.channels));
        directory.write("a.hdr", esri_header<T>(layout, word));
        const auto source = test::open_grid_or_fail(directory.write("a.bil", raw_bytes<T>(layout)));
        ASSERT_NE(source, nullptr);
        EXPECT_EQ(source->info().type, type);
        EXPECT_EQ(source->info().channels, layout.channels);
        EXPECT_EQ(source->info().nodata, -9999.0);
        test::expect_surface(*source);
    }
}

TEST(RawGrid, ValuesAreExactInEveryLayoutAndType) {
    expect_every_layout<std::int16_t>(SampleType::i16, "SIGNEDINT");
    expect_every_layout<std::int32_t>(SampleType::i32, "signedint");
    expect_every_layout<std::int64_t>(SampleType::i64, "SIGNEDINT");
    expect_every_layout<float>(SampleType::f32, "FLOAT");
    expect_every_layout<double>(SampleType::f64, "FLOAT");
}

TEST(RawGrid, TheUpperLeftCentreAndTheStepsPlaceIt) {
    const TempDirectory directory;
    directory.write("a.hdr", esri_header<std::int16_t>({}, "SIGNEDINT"));
    const auto source = test::open_grid_or_fail(directory.write("a.bil", raw_bytes<std::int16_t>({})));
    ASSERT_TRUE(source && source->georeference());
    EXPECT_EQ(source->georeference()->first_x, 1005);
    EXPECT_EQ(source->georeference()->first_y, 4990);
    EXPECT_EQ(source->georeference()->column_x, 10);
    EXPECT_EQ(source->georeference()->row_y, -20);
}

TEST(RawGrid, StepsMayBeNamedAfterTheAxes) {
    const TempDirectory directory;
    const std::string path = directory.write("a.bil", raw_bytes<std::int16_t>({}));
    for (const char* steps : {"dx 2\ndy 3\n", "xdim 2\nydim 3\ndx 9\ndy 9\n", "cellsize 2\nydim 3\n"}) {
        directory.write("a.hdr", fmt::format("nrows {}\nncols {}\nnbits 16\n", kRows, kColumns) + steps +
                                     "xllcorner 10\nyllcorner 20\n");
        const auto source = test::open_grid_or_fail(path);
        ASSERT_TRUE(source && source->georeference()) << steps;
        EXPECT_EQ(source->georeference()->first_x, 11) << steps;
        EXPECT_EQ(source->georeference()->first_y, 20 + 3 * (kRows - 0.5)) << steps;
        EXPECT_EQ(source->georeference()->row_y, -3) << steps;
    }
}

// The point that the header names stays where it is.
TEST(RawGrid, EnviRastersTurnAboutTheirTiePoint) {
    const TempDirectory directory;
    directory.write("a.hdr",
                    "ENVI\nsamples = 29\nlines = 23\nbands = 1\ndata type = 2\nmap info = {UTM, 3.5, 5.5, 1000, 5000, "
                    "10, 10, 33, North, WGS-84, units=Meters, rotation=90}\n");
    const auto source = test::open_grid_or_fail(directory.write("a.img", raw_bytes<std::int16_t>({})));
    ASSERT_TRUE(source && source->georeference());
    const Georeference& g = *source->georeference();
    EXPECT_NEAR(g.x(2, 4), 1000, 1e-9);
    EXPECT_NEAR(g.y(2, 4), 5000, 1e-9);
    EXPECT_NEAR(g.y(3, 4), 5010, 1e-9);  // columns run to the north
    EXPECT_NEAR(g.x(2, 5), 1010, 1e-9);
}

TEST(RawGrid, WithoutAPlaceAWorldFileGivesIt) {
    const TempDirectory directory;
    directory.write("a.hdr", fmt::format("nrows {}\nncols {}\nnbits 16\npixeltype signedint\n", kRows, kColumns));
    const std::string path = directory.write("a.bil", raw_bytes<std::int16_t>({}));
    EXPECT_FALSE(test::open_grid_or_fail(path)->georeference());
    directory.write("a.blw", "5 0 0 -5 100 200");
    const auto source = test::open_grid_or_fail(path);
    ASSERT_TRUE(source->georeference());
    EXPECT_EQ(source->georeference()->first_x, 100);
    test::expect_surface(*source);
}

TEST(RawGrid, ANegativeVoidMeansSignedSamplesAsInGtopo30) {
    const TempDirectory directory;
    Layout layout;
    layout.big_endian = true;
    directory.write(
        "E020N40.HDR",
        fmt::format("BYTEORDER      M\nLAYOUT       BIL\nNROWS         {}\nNCOLS         {}\nNBANDS        1\n"
                    "NBITS         16\nBANDROWBYTES         {}\nTOTALROWBYTES        {}\nBANDGAPBYTES  0\n"
                    "NODATA        -9999\nULXMAP        20.00416666666667\nULYMAP        39.99583333333333\n"
                    "XDIM          0.00833333333333\nYDIM          0.00833333333333\n",
                    kRows, kColumns, kColumns * 2, kColumns * 2));
    directory.write("E020N40.PRJ",
                    "Projection    GEOGRAPHIC\nDatum         WGS84\nZunits        METERS\nUnits         DD\n");
    const auto source = test::open_grid_or_fail(directory.write("E020N40.DEM", raw_bytes<std::int16_t>(layout)));
    ASSERT_NE(source, nullptr);
    EXPECT_EQ(source->info().type, SampleType::i16);
    EXPECT_EQ(source->georeference()->crs, "EPSG:4326");
    EXPECT_EQ(source->georeference()->height_unit_m, 1);
    test::expect_surface(*source);
}

TEST(RawGrid, ThreeBandsOfBytesAreColours) {
    const TempDirectory directory;
    for (const char* layout : {"BIL", "BIP", "BSQ"}) {
        Layout l;
        l.name = layout;
        l.channels = 3;
        directory.write("a.hdr", fmt::format("nrows {}\nncols {}\nnbands 3\nlayout {}\n", kRows, kColumns, layout));
        const auto source = test::open_grid_or_fail(directory.write("a.bil", raw_bytes<std::uint8_t>(l)));
        ASSERT_NE(source, nullptr);
        EXPECT_EQ(source->info().type, SampleType::u8);
        std::vector<std::uint8_t> rgba(static_cast<std::size_t>(kRows * kColumns * 4));
        ASSERT_TRUE(source->read_rgba8(0, kRows, rgba).ok());
        for (std::int64_t i = 0; i < kRows * kColumns; ++i) {
            for (int c = 0; c < 3; ++c)
                ASSERT_EQ(rgba[static_cast<std::size_t>(i * 4 + c)],
                          static_cast<std::uint8_t>(test::sample_at(i / kColumns, i % kColumns, c)));
            ASSERT_EQ(rgba[static_cast<std::size_t>(i * 4 + 3)], 255);
        }
    }
}

TEST(RawGrid, GridFloatIsPlacedByItsLowerLeftCorner) {
    const TempDirectory directory;
    const auto header = [](const char* place, const char* order) {
        return fmt::format("ncols {}\nnrows {}\n{}\ncellsize 10\nNODATA_value -9999\nbyteorder {}\n", kColumns, kRows,
                           place, order);
    };
    for (const bool big_endian : {false, true}) {
        Layout layout;
        layout.big_endian = big_endian;
        const std::string path = directory.write("a.flt", raw_bytes<float>(layout));
        const char* order = big_endian ? "MSBFIRST" : "LSBFIRST";
        for (const char* place : {"xllcorner 1000\nyllcorner 5000", "xllcenter 1005\nyllcenter 5005"}) {
            directory.write("a.hdr", header(place, order));
            const auto source = test::open_grid_or_fail(path);
            ASSERT_NE(source, nullptr);
            EXPECT_EQ(source->info().type, SampleType::f32);
            EXPECT_EQ(source->info().nodata, -9999.0);
            EXPECT_EQ(source->georeference()->first_x, 1005);
            EXPECT_EQ(source->georeference()->first_y, 5000 + 10 * (kRows - 0.5));
            EXPECT_EQ(source->georeference()->row_y, -10);
            test::expect_surface(*source);
        }
    }
}

std::string envi_header(int type, const char* interleave, int channels, const char* more) {
    return fmt::format(
        "ENVI\ndescription = {{\n a, b = c}}\nsamples = {}\nlines   = {}\nbands = {}\nheader offset = 4\n"
        "data type = {}\ninterleave = {}\nbyte order = 1\ndata ignore value = -9999\n{}\n",
        kColumns, kRows, channels, type, interleave, more);
}

TEST(RawGrid, EnviHeadersAreRead) {
    const TempDirectory directory;
    const std::pair<const char*, const char*> interleaves[] = {{"bil", "BIL"}, {"bip", "BIP"}, {"bsq", "BSQ"}};
    for (const auto& [word, name] : interleaves) {
        Layout layout{name, 3, 4, 0, 0, 0, true};
        directory.write("a.img.hdr", envi_header(2, word, 3,
                                                 "map info = {UTM, 1.5, 2.5, 1000, 5000, 10, 20, 33, South,\n"
                                                 " WGS-84, units=Meters}"));
        const auto source = test::open_grid_or_fail(directory.write("a.img", raw_bytes<std::int16_t>(layout)));
        ASSERT_NE(source, nullptr);
        EXPECT_EQ(source->info().type, SampleType::i16);
        EXPECT_EQ(source->info().nodata, -9999.0);
        EXPECT_EQ(source->georeference()->first_x, 1000);
        EXPECT_EQ(source->georeference()->first_y, 5020);
        EXPECT_EQ(source->georeference()->row_y, -20);
        EXPECT_EQ(source->georeference()->crs, "EPSG:32733");
        test::expect_surface(*source);
    }
}

TEST(RawGrid, EnviCrsTextIsTakenAsItIs) {
    const TempDirectory directory;
    directory.write("a.hdr", envi_header(4, "bsq", 1,
                                         "map info = {Geographic Lat/Lon, 1, 1, 10, 50, 0.5, 0.25, WGS-84}\n"
                                         "coordinate system string = {GEOGCS[\"x\"]}"));
    const Layout layout{"BSQ", 1, 4, 0, 0, 0, true};
    const auto source = test::open_grid_or_fail(directory.write("a", raw_bytes<float>(layout)));
    ASSERT_NE(source, nullptr);
    EXPECT_EQ(source->georeference()->crs, "GEOGCS[\"x\"]");
    EXPECT_EQ(source->georeference()->first_x, 10.25);
    EXPECT_EQ(source->georeference()->first_y, 49.875);
}

TEST(RawGrid, HeadersThatCannotBeAreRefused) {
    const TempDirectory directory;
    const std::string path = directory.write("a.bil", raw_bytes<std::int16_t>({}));
    test::expect_refusal(path, "needs its header");
    const auto refused = [&](const std::string& header, const std::string& what) {
        directory.write("a.hdr", header);
        test::expect_refusal(path, what);
    };
    const std::string sides = fmt::format("nrows {}\nncols {}\nnbits 16\n", kRows, kColumns);
    refused("nrows 1\n", "lacks ncols");
    refused("", "empty");
    refused("ncols 1e9\nnrows 1e9\nnbits 64\nnbands 1000", "need");
    refused("ncols 29\nnrows 24\nnbits 16\n", "need");
    refused("ncols -1\nnrows 1\n", "ncols is '-1'");
    refused(sides + "nbands 0\n", "nbands is '0'");
    refused(sides + "nbands 2\n", "need");
    refused("nrows 2\nncols 2\nnbits 4\n", "nbits is 4");
    refused("nrows 2\nncols 2\nnbits 16\npixeltype float\n", "nbits is 16 for floats");
    refused(sides + "byteorder sideways\n", "byteorder is 'sideways'");
    refused(sides + "layout tiles\n", "layout is 'tiles'");
    refused(sides + "skipbytes 1\n", "need");
    refused(sides + "skipbytes 1e15\n", "need");
    refused(sides + "totalrowbytes 57\n", "totalrowbytes is '57'");
    refused(sides + "totalrowbytes 59\n", "need");
    refused(sides + "bandrowbytes 9e15\n", "bandrowbytes is '9e15'");
    refused(sides + "layout bsq\nbandgapbytes -1\n", "bandgapbytes is '-1'");
    refused(sides + "xdim 0\nulxmap 0\nulymap 0\n", "distance of samples is 0");
    refused(sides + "xdim x\n", "xdim is 'x'");
    refused("ENVI\nsamples = 29\nlines = 23\ndata type = 6\n", "data type is 6");
    refused("ENVI\nsamples = 29\nlines = 23\n", "lacks data type");
    refused("ENVI\nsamples = 29\nlines = 23\ndata type = 2\nfile compression = 1\n", "compression");
    refused("ENVI\nsamples = 29\nlines = 23\ndata type = 2\nmap info = {UTM, 1, 1}\n", "six numbers");
    refused("ENVI\nsamples = 29\nlines = 23\ndata type = 2\nmap info = {UTM, 1, 1, 0, 0, 1, 2, rotation=12}\n",
            "not square");
    refused("ENVI\nsamples = 29\nlines = 23\ndata type = 2\nmap info = {UTM, 1, 1, 0, 0, 1, 1, rotation=x}\n",
            "no angle");
    refused("ENVI\nsamples = 29\nlines = 23\ndata type = 2\nmap info = {UTM, 1, 1, 0, 0, 1, 1, rotation=1e99}\n",
            "no angle");
    refused("ENVI\nsamples = 29\nlines = 23\ndata type = 2\nmap info = {UTM, 1, 1, 0, 0, 0, 1}\n", "one line");
    directory.write("b.hdr", sides);
    test::expect_refusal(directory.path("b.hdr"), "name the raster");
}

TEST(RawGrid, NoPrefixIsMisread) {
    const TempDirectory directory;
    directory.write("a.hdr", esri_header<std::int16_t>({}, "SIGNEDINT"));
    directory.write("a.bil", raw_bytes<std::int16_t>({}));
    test::expect_no_prefix_misread(directory, "a.bil");
}

TEST(RawGridOfGdal, ReadsAsGdalDoes) {
    const TempDirectory directory;
    for (const Layout& layout : layouts()) {
        // GDAL passes over the keys of these.
        if (layout.band_row_gap + layout.row_gap + layout.band_gap > 0) continue;
        directory.write("a.hdr", esri_header<std::int16_t>(layout, "SIGNEDINT"));
        const std::string path = directory.write("a.bil", raw_bytes<std::int16_t>(layout));
        SCREE_EXPECT_AS_GDAL_OR_SKIP(directory, path);
    }
}

TEST(RawGridOfRealFiles, ReadsAsGdalDoes) {
    const TempDirectory directory;
    for (const char* name : {"formats/Mega_divide.bil", "formats/gabilan.bil"}) {
        SCREE_DATA_OR_SKIP(path, name);
        SCREE_EXPECT_AS_GDAL_OR_SKIP(directory, path);
    }
}

}  // namespace
}  // namespace scree
