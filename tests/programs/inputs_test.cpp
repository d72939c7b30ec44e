// Inputs as users have them: what stands beside a file, what it is called, heights in colours, zones that meet where
// longitudes turn over.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "common/query/ground.h"
#include "common/store/sqlite_store.h"
#include "tests/common/test_support.h"
#include "tests/programs/placement_inputs.h"
#include "tests/programs/reports.h"
#include "tools/source/crs.h"
#include "tools/source/image_source.h"
#include "tools/source/raster_formats.h"

namespace scree::test {
namespace {

double hills(double u, double v) { return 400 + 90 * std::sin(u / 7) * std::cos(v / 5) + 3 * std::sin(u + 2 * v); }

class Inputs : public ::testing::Test {
protected:
    std::string write(const std::string& name, const SampleGrid& grid, HeightFormat format = HeightFormat::striped) {
        return write_placed_heights(folder_.file(""), name, format, grid,
                                    [&](int c, int r) { return std::round(hills(c, r)); });
    }
    void write_text(const std::string& path, const std::string& text) { std::ofstream(path, std::ios::binary) << text; }
    nlohmann::json build(std::vector<std::string> arguments) {
        arguments.push_back("--force");
        return build_store_from(arguments, store_);
    }
    void expect_refused(std::vector<std::string> arguments, int code, const std::string& words) {
        arguments.push_back("--quiet");
        const auto run = scree(arguments);
        EXPECT_EQ(run.exit_code, code) << describe(run);
        EXPECT_NE(run.err.find(words), std::string::npos) << describe(run);
    }
    double height_at(double x, double y) {
        auto opened = SqliteStore::open(store_);
        if (!opened) return std::nan("");
        auto ground = Ground::open(**opened);
        const auto height = (*ground)->height(x, y);
        return height && *height ? (*height)->height_m : std::nan("");
    }

    // Colours n = red * 65536 + green * 256 + blue.
    std::string write_colours(const std::string& name, const std::function<std::uint32_t(int c, int r)>& value) {
        std::string bytes = "P6\n" + std::to_string(grid_.width) + " " + std::to_string(grid_.height) + "\n255\n";
        for (int r = 0; r < grid_.height; ++r)
            for (int c = 0; c < grid_.width; ++c) {
                const std::uint32_t n = value(c, r);
                for (const int shift : {16, 8, 0}) bytes += static_cast<char>(n >> shift & 255);
            }
        write_text(folder_.file(name + ".ppm"), bytes);
        write_text(folder_.file(name + ".wld"), "30\n0\n0\n-30\n450000\n5298000\n");
        return folder_.file(name + ".ppm");
    }

    TemporaryFolder folder_;
    const std::string store_ = folder_.file("s.scree");
    const SampleGrid grid_ = north_up("EPSG:32633", 450000, 5298000, 30, 40, 33);
};

TEST_F(Inputs, HeightsInColoursAreThoseOfTheirEncoding) {
    struct Case {
        const char* name;
        double scale, offset;
    };
    for (const Case& encoding : {Case{"terrarium", 1.0 / 256, -32768}, {"mapbox", 0.1, -10000}}) {
        const auto n = [&](int c, int r) {  // below the sea and above it, and the ends of what fits
            return static_cast<std::uint32_t>(std::lround((hills(c, r) - 450 - encoding.offset) / encoding.scale));
        };
        const std::string path = write_colours(encoding.name, n);
        build({path, "--assume-crs", "EPSG:32633", "--height-encoding", encoding.name});
        for (int r = 0; r < grid_.height; r += 4)
            for (int c = 0; c < grid_.width; c += 3)
                ASSERT_NEAR(height_at(grid_.x(c, r), grid_.y(c, r)), n(c, r) * encoding.scale + encoding.offset, 1e-6)
                    << encoding.name << ' ' << c << ", " << r;
        EXPECT_EQ(report_of(scree({"info", store_, "--json", "-"})).value("height_quantum_error_m", -1.0), 0);
        expect_refused({"build", path, "-o", store_, "--force", "--assume-crs", "EPSG:32633"}, 3, "3 channels");
    }
    expect_refused({"build", write("grey", grid_), "-o", store_, "--force", "--height-encoding", "terrarium"}, 3,
                   "red, green and blue");
}

TEST_F(Inputs, BandsAreChosenOfTheImageryAlone) {
    const std::string dem = write("dem", grid_), colours = write_colours("colours", [](int, int) { return 0xC80A32u; });
    build({dem, "--imagery", colours, "--bands", "3,2,1", "--assume-crs", "EPSG:32633"});
    const std::string out = folder_.file("texels.tif");
    EXPECT_EQ(scree({"export", store_, "--imagery", out, "--quiet"}).exit_code, 0);
    auto texels = ImageSource::open(out);
    ASSERT_TRUE(texels) << texels.error().message;
    const ImageInfo& info = (*texels)->info();
    std::vector<std::uint8_t> rgba(static_cast<std::size_t>(info.width * info.height * 4));
    ASSERT_TRUE((*texels)->read_rgba8(0, info.height, rgba));
    const auto middle = static_cast<std::size_t>((info.height / 2 * info.width + info.width / 2) * 4);
    EXPECT_NEAR(rgba[middle], 0x32, 8);
    EXPECT_NEAR(rgba[middle + 1], 0x0A, 8);
    EXPECT_NEAR(rgba[middle + 2], 0xC8, 8);
}

TEST_F(Inputs, ScaleAndOffsetBesideAFileAreUsed) {
    for (const HeightFormat format : {HeightFormat::striped, HeightFormat::float_center, HeightFormat::bil}) {
        const std::string path = write("scaled", grid_, format);
        write_text(path + ".aux.xml",
                   "<PAMDataset><PAMRasterBand band=\"1\"><Offset>-100</Offset><Scale>0.25</Scale></PAMRasterBand>"
                   "<PAMRasterBand band=\"2\"><Offset>7</Offset></PAMRasterBand></PAMDataset>");
        build({path, "--assume-crs", "EPSG:32633"});
        EXPECT_NEAR(height_at(grid_.x(8, 9), grid_.y(8, 9)), std::round(hills(8, 9)) * 0.25 - 100, 1e-6) << path;
        std::filesystem::remove(path + ".aux.xml");
    }
    const std::string feet = write("feet", grid_);
    write_text(feet + ".aux.xml",
               "<PAMDataset><PAMRasterBand band=\"1\"><UnitType>ft</UnitType></PAMRasterBand></PAMDataset>");
    build({feet});
    EXPECT_NEAR(height_at(grid_.x(8, 9), grid_.y(8, 9)), std::round(hills(8, 9)) * 0.3048, 1.0 / 64);
}

TEST_F(Inputs, HowAFileBeginsCountsBeforeItsName) {
    const std::string tiff = write("tiff", grid_);
    for (const char* name : {"N46E014.hgt", "cell.dt1", "grid.asc", "grid.flt"}) {
        const std::string called = folder_.file(name);
        std::filesystem::copy_file(tiff, called);
        build({called});
        EXPECT_NEAR(height_at(grid_.x(8, 9), grid_.y(8, 9)), std::round(hills(8, 9)), 1e-6) << name;
    }
    std::filesystem::copy_file(write("text", grid_, HeightFormat::ascii_center), folder_.file("N47E014.hgt"));
    build({folder_.file("N47E014.hgt"), "--assume-crs", "EPSG:32633"});
    EXPECT_NEAR(height_at(grid_.x(8, 9), grid_.y(8, 9)), std::round(hills(8, 9)), 1e-6);
    // -40 and -1 m, as JPEG files begin; a raw grid may.
    const GridFormat* hgt = grid_format_of("N31E035.hgt", "\xFF\xD8\xFF\xFF\xFF\xFF");
    ASSERT_NE(hgt, nullptr);
    EXPECT_EQ(hgt->name, "SRTM .hgt");
    EXPECT_EQ(grid_format_of("N31E035.hgt", "\x89PNG\r\n\x1a\n"), nullptr);
}

TEST_F(Inputs, ChangedSidecarsAreNamed) {
    const std::string path = write("base", grid_, HeightFormat::float_center), other = write("other", grid_);
    write_text(folder_.file("base.prj"),
               "PROJCS[\"WGS 84 / UTM zone 33N\",GEOGCS[\"WGS 84\",DATUM[\"WGS_1984\","
               "SPHEROID[\"WGS 84\",6378137,298.257223563]],PRIMEM[\"Greenwich\",0],"
               "UNIT[\"degree\",0.0174532925199433]],PROJECTION[\"Transverse_Mercator\"],"
               "PARAMETER[\"latitude_of_origin\",0],PARAMETER[\"central_meridian\",15],"
               "PARAMETER[\"scale_factor\",0.9996],PARAMETER[\"false_easting\",500000],"
               "PARAMETER[\"false_northing\",0],UNIT[\"metre\",1],"
               "AUTHORITY[\"EPSG\",\"32633\"]]");
    build({path});
    const auto update = [&](const std::string& words) { expect_refused({"update", store_, other}, 3, words); };
    const std::string header = folder_.file("base.hdr");
    const auto append = [](const std::string& file) { std::ofstream(file, std::ios::app) << "\n"; };
    append(header);
    update("base.hdr has changed");
    std::filesystem::rename(folder_.file("base.prj"), folder_.file("away"));
    update("base.prj is gone");
    std::filesystem::rename(folder_.file("away"), folder_.file("base.prj"));
    write_text(path + ".aux.xml", "<PAMDataset></PAMDataset>");
    update("base.flt.aux.xml is new");
    // Named, it is read again.
    const auto again = scree({"update", store_, path, "--quiet"});
    EXPECT_EQ(again.exit_code, 0) << describe(again);
    const auto more = scree({"update", store_, other, "--quiet"});
    EXPECT_EQ(more.exit_code, 0) << describe(more);
}

TEST_F(Inputs, ZonesMeetWhereLongitudesTurnOver) {
    // 180 degrees at 9 degrees north: x 170 km in zone 1, 830 km in zone 60.
    const SampleGrid east = north_up("EPSG:32601", 165000, 996000, 120, 101, 61),
                     west = north_up("EPSG:32660", 820000, 996000, 120, 101, 61);
    const auto zone1 = Crs::parse("EPSG:32601"), zone60 = Crs::parse("EPSG:32660");
    const auto to_zone1 = CrsTransform::make(*zone60, *zone1);
    const auto land = [](double x, double y) { return 300 + 80 * std::sin(x / 1500) * std::cos(y / 1300); };
    const auto in_zone1 = [&](double x, double y) {
        to_zone1->apply({&x, 1}, {&y, 1});
        return std::pair(x, y);
    };
    const std::string a = write_placed_heights(folder_.file(""), "east", HeightFormat::striped, east,
                                               [&](int c, int r) { return land(east.x(c, r), east.y(c, r)); });
    const std::string b =
        write_placed_heights(folder_.file(""), "west", HeightFormat::striped, west, [&](int c, int r) {
            const auto [x, y] = in_zone1(west.x(c, r), west.y(c, r));
            return land(x, y);
        });
    const auto crs_of = [&] { return report_of(scree({"info", store_, "--json", "-"})).value("crs", ""); };
    // Each alone keeps its own CRS: it is metric, though a box of its longitudes could be taken for all the way round.
    build({b});
    EXPECT_EQ(crs_of(), "EPSG:32660");
    const auto alone = build({a});
    EXPECT_EQ(crs_of(), "EPSG:32601");
    EXPECT_EQ(alone.value("warp_error_m", -1.0), 0);
    build({a, b, "--crs", "EPSG:32601"});
    for (int k = 4; k < 60; k += 11) {
        EXPECT_NEAR(height_at(east.x(k, k), east.y(k, k)), land(east.x(k, k), east.y(k, k)), 0.5);  // west lies on top
        const auto [x, y] = in_zone1(west.x(k, k), west.y(k, k));
        EXPECT_NEAR(height_at(x, y), land(x, y), 0.5) << k;
    }
}

TEST_F(Inputs, DatumsOfSingleFilesAreTheUsersWord) {
    const std::string a = write("a", grid_.part(0, 0, 25, 33)), b = write("b", grid_.part(20, 0, 20, 33));
    build({a, b, "--source-vertical-crs", "a.tif=EPSG:5773"});
    EXPECT_EQ(report_of(scree({"info", store_, "--json", "-"})).value("vertical_datum", ""), "EPSG:5773");
    expect_refused({"build", "--source-vertical-crs", "a.tif=EPSG:5773", "--source-vertical-crs", "b.tif=EPSG:3855", a,
                    b, "-o", store_, "--force"},
                   3, "EPSG:3855");
    expect_refused({"build", a, "-o", store_, "--force", "--source-vertical-crs", "c.tif=EPSG:5773"}, 2, "c.tif");
    expect_refused({"build", a, "-o", store_, "--force", "--source-vertical-crs", "a.tif"}, 2, "NAME=EPSG:n");
    expect_refused({"build", a, "-o", store_, "--force", "--source-vertical-crs", "a.tif=EPSG:4"}, 2, "EPSG:4");
}

}  // namespace
}  // namespace scree::test
