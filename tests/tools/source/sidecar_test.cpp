// What lies beside a raster and is taken for what the raster does not say: FILE.msk and FILE.aux.xml.
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/tools/source/grid_test_support.h"
#include "tests/tools/source/test_tiff.h"
#include "tools/source/crs.h"
#include "tools/source/number_text.h"
#include "tools/source/pam_file.h"

namespace scree {
namespace {

using test::TempDirectory;

constexpr int kWidth = 21, kHeight = 17;

bool masked_out(int column, int row) { return (column * 7 + row * 3) % 5 == 0; }

// Values 1, 2, 3... of one channel of 16 bits or three of 8.
std::string write_image(const TempDirectory& directory, const char* name, int channels, const char* nodata = nullptr) {
    auto t = test::layout_of<std::int16_t>(kWidth, kHeight);
    t.channels = channels;
    t.nodata = nodata;
    std::vector<std::int16_t> wide;
    std::vector<std::uint8_t> narrow;
    for (int i = 0; i < kWidth * kHeight * channels; ++i) {
        wide.push_back(static_cast<std::int16_t>(i + 1));
        narrow.push_back(static_cast<std::uint8_t>(i % 200 + 1));
    }
    if (channels > 1) {
        t.bits = 8;
        t.format = SAMPLEFORMAT_UINT;
    }
    EXPECT_TRUE(test::write_tiff(directory.path(name), t,
                                 channels > 1 ? static_cast<void*>(narrow.data()) : static_cast<void*>(wide.data())));
    return directory.path(name);
}

void write_mask(const std::string& path, int bits, int width = kWidth, int channels = 1) {
    auto t = test::layout_of<std::uint8_t>(static_cast<std::uint32_t>(width), kHeight);
    t.bits = bits;
    t.channels = channels;
    t.photometric = PHOTOMETRIC_MINISBLACK;
    // Without it GDAL passes over the file.
    t.gdal_metadata = "<GDALMetadata>";
    for (int band = 1; band <= 3; ++band)
        t.gdal_metadata += fmt::format("<Item name=\"INTERNAL_MASK_FLAGS_{}\">2</Item>", band);
    t.gdal_metadata += "</GDALMetadata>";
    const int row_bytes = (width * channels * bits + 7) / 8;
    std::vector<std::uint8_t> bytes(static_cast<std::size_t>(row_bytes * kHeight));
    for (int row = 0; row < kHeight; ++row)
        for (int column = 0; column < width; ++column)
            for (int c = 0; c < channels; ++c) {
                if (masked_out(column, row)) continue;
                const int i = column * channels + c;
                auto& byte = bytes[static_cast<std::size_t>(row * row_bytes + i * bits / 8)];
                byte = bits == 1 ? static_cast<std::uint8_t>(byte | 0x80u >> i % 8) : std::uint8_t{255};
            }
    ASSERT_TRUE(test::write_tiff(path, t, bytes.data()));
}

void expect_masked_heights(const std::string& path) {
    const auto source = test::open_grid_or_fail(path);
    ASSERT_NE(source, nullptr);
    const auto values = test::read_all(*source);
    for (int row = 0; row < kHeight; ++row)
        for (int column = 0; column < kWidth; ++column) {
            const double value = values[static_cast<std::size_t>(row * kWidth + column)];
            ASSERT_EQ(std::isnan(value), masked_out(column, row)) << column << ", " << row;
            if (masked_out(column, row)) continue;
            ASSERT_EQ(value, row * kWidth + column + 1);
        }
}

TEST(MaskFile, OfOneBitOrEightVoidsHeightsAndHidesColours) {
    const TempDirectory directory;
    const std::string heights = write_image(directory, "h.tif", 1), colours = write_image(directory, "c.tif", 3);
    for (const int bits : {1, 8}) {
        SCOPED_TRACE(bits);
        write_mask(heights + ".msk", bits);
        expect_masked_heights(heights);
        write_mask(colours + ".msk", bits);
        const auto source = test::open_grid_or_fail(colours);
        ASSERT_NE(source, nullptr);
        std::vector<std::uint8_t> rgba(kWidth * kHeight * 4);
        ASSERT_TRUE(source->read_rgba8(0, kHeight, rgba));
        for (int k = 0; k < kWidth * kHeight; ++k)
            ASSERT_EQ(rgba[static_cast<std::size_t>(4 * k + 3)], masked_out(k % kWidth, k / kWidth) ? 0 : 255);
    }
}

TEST(MaskFile, IsReadBesideGridsToo) {
    const TempDirectory directory;
    std::string bytes;
    for (int i = 0; i < kWidth * kHeight; ++i) test::append(bytes, static_cast<std::int16_t>(i + 1), false);
    directory.write("g.hdr", fmt::format("ncols {}\nnrows {}\nnbits 16\npixeltype signedint\n", kWidth, kHeight));
    const std::string path = directory.write("g.bil", bytes);
    write_mask(path + ".msk", 8);
    expect_masked_heights(path);
}

TEST(MaskFile, ThatDoesNotFitIsRefused) {
    const TempDirectory directory;
    const std::string path = write_image(directory, "h.tif", 1);
    write_mask(path + ".msk", 8, kWidth + 1);
    test::expect_refusal(path, "mask is not of the image's size");
    write_mask(path + ".msk", 8, kWidth, 2);
    test::expect_refusal(path, "mask is not of the image's size");
    directory.write("h.tif.msk", "nothing of the kind");
    test::expect_refusal(path, "it is the mask of");
    write_mask(path + ".msk", 8);
    const std::string whole = test::read_bytes(path + ".msk");
    directory.write("h.tif.msk", whole.substr(0, whole.size() / 2));
    test::expect_refusal(path, "h.tif");
}

TEST(MaskFile, MeansWhatGdalTakesItFor) {
    const TempDirectory directory;
    const std::string image = write_image(directory, "c.tif", 3);
    write_mask(image + ".msk", 8);
    const std::string command =
        "gdal_translate -q -b mask -ot Byte -of ENVI '" + image + "' '" + directory.path("m.raw") + "' >/dev/null 2>&1";
    if (std::system(command.c_str()) != 0) GTEST_SKIP() << "needs gdal_translate";
    const std::string by_gdal = test::read_bytes(directory.path("m.raw"));
    ASSERT_EQ(by_gdal.size(), static_cast<std::size_t>(kWidth * kHeight));
    const auto source = test::open_grid_or_fail(image);
    std::vector<std::uint8_t> rgba(kWidth * kHeight * 4);
    ASSERT_TRUE(source->read_rgba8(0, kHeight, rgba));
    for (std::size_t k = 0; k < by_gdal.size(); ++k) ASSERT_EQ(rgba[4 * k + 3] != 0, by_gdal[k] != 0) << k;
}

std::string pam(const std::string& elements, const std::string& band = "<NoDataValue>-9999</NoDataValue>") {
    return "<PAMDataset>\n" + elements + "\n<PAMRasterBand band=\"2\"><NoDataValue>1</NoDataValue></PAMRasterBand>\n" +
           "<PAMRasterBand band=\"1\">" + band + "</PAMRasterBand>\n</PAMDataset>\n";
}

constexpr const char* kUtm13 =
    "<SRS dataAxisToSRSAxisMapping=\"1,2\">PROJCS[&quot;WGS 84 / UTM zone 13N&quot;,GEOGCS[&quot;WGS 84&quot;,"
    "DATUM[&quot;WGS_1984&quot;,SPHEROID[&quot;WGS 84&quot;,6378137,298.257223563]],PRIMEM[&quot;Greenwich&quot;,0],"
    "UNIT[&quot;degree&quot;,0.0174532925199433]],PROJECTION[&quot;Transverse_Mercator&quot;],"
    "PARAMETER[&quot;latitude_of_origin&quot;,0],PARAMETER[&quot;central_meridian&quot;,-105],"
    "PARAMETER[&quot;scale_factor&quot;,0.9996],PARAMETER[&quot;false_easting&quot;,500000],"
    "PARAMETER[&quot;false_northing&quot;,0],UNIT[&quot;metre&quot;,1]]</SRS>";
constexpr const char* kPlace = "<GeoTransform>  5.0e+05, 30, 2,  4.4e+06, 1, -20</GeoTransform>";

TEST(AuxXml, SaysWhatTheFileDoesNot) {
    const TempDirectory directory;
    const std::string path = write_image(directory, "h.tif", 1);
    directory.write("h.tif.aux.xml", pam(std::string(kUtm13) + kPlace));
    const auto source = test::open_grid_or_fail(path);
    ASSERT_NE(source, nullptr);
    EXPECT_EQ(source->info().nodata, -9999.0);
    ASSERT_TRUE(source->georeference());
    const Georeference& g = *source->georeference();
    EXPECT_EQ(g.first_x, 500016);
    EXPECT_EQ(g.first_y, 4399990.5);
    EXPECT_EQ(g.column_x, 30);
    EXPECT_EQ(g.row_x, 2);
    EXPECT_EQ(g.column_y, 1);
    EXPECT_EQ(g.row_y, -20);
    const auto crs = Crs::parse(g.crs);
    ASSERT_TRUE(crs) << crs.error().message;
    EXPECT_EQ(crs->text(), "EPSG:32613");
}

TEST(AuxXml, NeverOverrulesTheFile) {
    const TempDirectory directory;
    auto t = test::layout_of<std::int16_t>(kWidth, kHeight);
    t.nodata = "7";
    t.scale = {10, 10, 0};
    t.tie_points = {0, 0, 0, 1000, 2000, 0};
    t.model_type = ModelTypeProjected;
    t.projected = 32633;
    const std::vector<std::int16_t> samples(kWidth * kHeight, 3);
    ASSERT_TRUE(test::write_tiff(directory.path("h.tif"), t, samples.data()));
    directory.write("h.tif.aux.xml", pam(std::string(kUtm13) + kPlace));
    const auto source = test::open_grid_or_fail(directory.path("h.tif"));
    EXPECT_EQ(source->info().nodata, 7.0);
    EXPECT_EQ(source->georeference()->crs, "EPSG:32633");
    EXPECT_EQ(source->georeference()->first_x, 1005);
    // But goes before a world file, as in GDAL.
    const std::string bare = write_image(directory, "w.tif", 1);
    directory.write("w.tfw", "1\n0\n0\n-1\n0\n0\n");
    directory.write("w.tif.aux.xml", pam(kPlace));
    EXPECT_EQ(test::open_grid_or_fail(bare)->georeference()->first_x, 500016);
    directory.write("w.tif.aux.xml", pam(""));
    EXPECT_EQ(test::open_grid_or_fail(bare)->georeference()->first_x, 0);
}

TEST(AuxXml, OfGridsIsReadToo) {
    const TempDirectory directory;
    directory.write("g.hdr", "ncols 2\nnrows 2\nnbits 8\n");
    const std::string path = directory.write("g.bil", "abcd");
    directory.write("g.bil.aux.xml", pam(std::string(kUtm13) + kPlace));
    const auto source = test::open_grid_or_fail(path);
    ASSERT_TRUE(source->georeference());
    EXPECT_EQ(source->georeference()->first_x, 500016);
    EXPECT_EQ(source->georeference()->crs.substr(0, 7), "PROJCS[");
}

TEST(AuxXml, ThatPlacesNothingIsRefusedOrPassedOver) {
    for (const char* text : {"1,2,3,4,5", "1,2,3,4,5,6,7", "1,2,3,nan,5,6", "a,b,c,d,e,f", "1 2 3 4 5 6", ",,,,,"}) {
        const auto parsed = parse_pam(pam("<GeoTransform>" + std::string(text) + "</GeoTransform>"));
        ASSERT_FALSE(parsed) << text;
        EXPECT_EQ(parsed.error().code, ErrorCode::input);
    }
    const TempDirectory directory;
    const std::string path = write_image(directory, "h.tif", 1);
    directory.write("h.tif.aux.xml", pam("<GeoTransform>0,0,0,0,0,0</GeoTransform>"));
    test::expect_refusal(path, ".aux.xml");
    // A place on no Earth is none, and a name that begins alike is another.
    EXPECT_EQ(parse_pam(pam("<SRS>LOCAL_CS[&quot;x&quot;]</SRS><SRSX>no</SRSX>"))->crs, "");
    EXPECT_EQ(parse_pam(pam("<SRS>a&amp;quot;b</SRS>"))->crs, "a&quot;b");
    EXPECT_FALSE(parse_pam("<GeoTransform>1,2,3,4,5,6</GeoTransform>")->geotransform);
    EXPECT_FALSE(parse_pam(pam("", "<NoDataValue/>"))->nodata);
}

TEST(AuxXml, EveryPrefixIsReadWithoutHarm) {
    const std::string whole = pam(std::string(kUtm13) + kPlace);
    for (std::size_t length = 0; length <= whole.size(); ++length) {
        const auto parsed = parse_pam(std::string_view(whole).substr(0, length));
        if (!parsed || !parsed->geotransform) continue;
        EXPECT_EQ((*parsed->geotransform)[5], -20) << length;
    }
}

std::string output_of(const std::string& command) {
    std::string text;
    FILE* pipe = ::popen((command + " 2>/dev/null").c_str(), "r");
    if (pipe == nullptr) return text;
    char part[4096];
    for (std::size_t n = 0; (n = std::fread(part, 1, sizeof part, pipe)) > 0;) text.append(part, n);
    return ::pclose(pipe) == 0 ? text : std::string();
}

// Of gdalinfo -json; empty where GDAL is not installed.
std::vector<double> geotransform_by_gdal(const std::string& path) {
    const std::string text = output_of("gdalinfo -json '" + path + "'");
    std::vector<double> numbers;
    const std::size_t key = text.find("\"geoTransform\"");
    if (key == std::string::npos) return numbers;
    std::size_t at = text.find('[', key) + 1;
    while (numbers.size() < 6) {
        const std::size_t end = text.find_first_of(",]", at);
        std::string word = text.substr(at, end - at);
        word.erase(0, word.find_first_not_of(" \n"));
        word.erase(word.find_last_not_of(" \n") + 1);
        numbers.push_back(parse_number(word).value_or(NAN));
        at = end + 1;
    }
    return numbers;
}

void expect_placed_as_by_gdal(const std::string& path) {
    const auto t = geotransform_by_gdal(path);
    if (t.empty()) GTEST_SKIP() << "needs gdalinfo";
    const auto source = test::open_grid_or_fail(path);
    ASSERT_TRUE(source && source->georeference());
    const Georeference& g = *source->georeference();
    const auto near = [](double a, double b) { return std::abs(a - b) <= 1e-9 * std::max(1.0, std::abs(b)); };
    EXPECT_TRUE(near(g.column_x, t[1]) && near(g.row_x, t[2]) && near(g.column_y, t[4]) && near(g.row_y, t[5]));
    EXPECT_TRUE(near(g.first_x, t[0] + (t[1] + t[2]) / 2) && near(g.first_y, t[3] + (t[4] + t[5]) / 2))
        << g.first_x << ", " << g.first_y;
}

TEST(AuxXml, OfGdalsOwnHandIsReadAsGdalReadsIt) {
    const TempDirectory directory;
    auto t = test::layout_of<std::uint16_t>(kWidth, kHeight);
    const std::vector<std::uint16_t> samples(kWidth * kHeight, 3);
    ASSERT_TRUE(test::write_tiff(directory.path("a.tif"), t, samples.data()));
    // Without GeoTIFF's tags all of it goes beside the file.
    const std::string bare = directory.path("b.tif");
    const std::string command =
        "gdal_translate -q -co PROFILE=BASELINE -a_srs EPSG:3826 -a_nodata 5 -a_ullr 300000 2700000 "
        "302100 2698300 '" +
        directory.path("a.tif") + "' '" + bare + "' 2>/dev/null";
    if (std::system(command.c_str()) != 0) GTEST_SKIP() << "needs gdal_translate";
    ASSERT_TRUE(std::filesystem::exists(bare + ".aux.xml"));
    const auto source = test::open_grid_or_fail(bare);
    EXPECT_EQ(source->info().nodata, 5.0);
    EXPECT_EQ(Crs::parse(source->georeference()->crs)->text(), "EPSG:3826");
    expect_placed_as_by_gdal(bare);
}

TEST(EnviRotation, IsGdals) {
    const TempDirectory directory;
    for (const char* angle : {"30", "-12.5", "170"}) {
        directory.write("r.hdr",
                        fmt::format("ENVI\nsamples = 4\nlines = 3\nbands = 1\ndata type = 1\nmap info = {{UTM, "
                                    "1, 1, 500000, 4400000, 25, 25, 13, North, WGS-84, rotation={}}}\n",
                                    angle));
        expect_placed_as_by_gdal(directory.write("r.img", "abcdefghijkl"));
    }
}

}  // namespace
}  // namespace scree
