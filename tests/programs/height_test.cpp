// What `scree height` says is what went into the store: compared with the source's own samples.
#include <OpenImageIO/imageio.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <optional>
#include <sstream>

#include "common/store/sqlite_store.h"
#include "tests/common/test_support.h"
#include "tests/programs/reports.h"
#include "tests/programs/sample_inputs.h"

namespace scree::test {
namespace {

struct Told {
    double x = 0, y = 0;
    std::optional<double> height, bound;
};

std::vector<Told> told_by(const ProgramRun& run) {
    EXPECT_EQ(run.exit_code, 0) << describe(run);
    std::vector<Told> out;
    std::istringstream lines(run.out);
    for (std::string line; std::getline(lines, line);) {
        Told t;
        std::istringstream words(line);
        std::string third;
        EXPECT_TRUE(words >> t.x >> t.y >> third) << line;
        if (third != "absent") {
            double bound = 0;
            EXPECT_TRUE(words >> bound) << line;
            t.height = std::stod(third);
            t.bound = bound;
        }
        EXPECT_FALSE(words >> third) << line;
        out.push_back(t);
    }
    return out;
}

// On the two triangles of cell (i, j), split from its north-west to its south-east corner where i + j is even.
double on_triangles(const HeightGrid& grid, int i, int j, double u, double v) {
    const double nw = grid.at(i, j), ne = grid.at(i + 1, j), sw = grid.at(i, j + 1), se = grid.at(i + 1, j + 1);
    if ((i + j) % 2 == 0) return u > v ? nw + u * (ne - nw) + v * (se - ne) : nw + v * (sw - nw) + u * (se - sw);
    return u + v < 1 ? nw + u * (ne - nw) + v * (sw - nw) : se + (1 - u) * (sw - se) + (1 - v) * (ne - se);
}

struct Question {
    int i, j;     // cell
    double u, v;  // within it, 0 to 1: corners, edges, diagonals, insides
};

std::vector<Question> questions_on(const HeightGrid& grid, Random& random) {
    std::vector<Question> out;
    for (int k = 0; k < 600; ++k)
        out.push_back({uniform(random, 0, grid.width - 2), uniform(random, 0, grid.height - 2),
                       uniform(random, 0, 4) / 4.0, uniform(random, 0, 16) / 16.0});
    return out;
}

std::string csv_of(const std::vector<Question>& questions, const Place& place) {
    std::ostringstream csv;
    csv.precision(17);
    csv << "x,y\r\n";
    for (const Question& q : questions)
        csv << place.x + (q.i + q.u) * place.step << ", " << place.y - (q.j + q.v) * place.step << "\r\n\n";
    return csv.str();
}

void write_file(const std::string& path, const std::string& text) { std::ofstream(path, std::ios::binary) << text; }

TEST(Height, IsTheSourcesOnVerticesEdgesAndInside) {
    SCREE_TRACE_SEED();
    Random random(seed());
    const TemporaryFolder folder;
    HeightGrid grid = hills(75, 52, 8);
    for (int j = 20; j < 30; ++j)
        for (int i = 40; i < 60; ++i) grid.at(i, j) = -9999;
    const Place place;
    write_heights(folder.file("d.tif"), grid, place, "-9999");
    build_store_from({folder.file("d.tif"), "--tile-size", "9", "--texture-size", "16", "--fill", "none"},
                     folder.file("d.scree"));
    const auto questions = questions_on(grid, random);
    write_file(folder.file("q.csv"), csv_of(questions, place));
    const auto told = told_by(scree({"height", folder.file("d.scree"), "--file", folder.file("q.csv")}));
    ASSERT_EQ(told.size(), questions.size());
    int absent = 0;
    for (std::size_t k = 0; k < questions.size(); ++k) {
        const auto [i, j, u, v] = questions[k];
        const bool in_void =
            grid.at(i, j) < 0 || grid.at(i + 1, j) < 0 || grid.at(i, j + 1) < 0 || grid.at(i + 1, j + 1) < 0;
        if (in_void && u > 0 && u < 1 && v > 0 && v < 1) {
            EXPECT_FALSE(told[k].height) << i << ", " << j;
        }
        absent += told[k].height ? 0 : 1;
        if (in_void) continue;
        ASSERT_TRUE(told[k].height) << i << ", " << j;
        EXPECT_NEAR(*told[k].height, on_triangles(grid, i, j, u, v), 1e-9)
            << i << " + " << u << ", " << j << " + " << v;
        EXPECT_EQ(*told[k].bound, 0) << "whole metres are kept whole";
    }
    EXPECT_GT(absent, 5);
}

TEST(Height, OfALandscapeIsWithinTheBoundAndTheBoundIsHalfAQuantum) {
    SCREE_TRACE_SEED();
    Random random(seed() + 1);
    const TemporaryFolder folder;
    ASSERT_EQ(scree({"synth", "-o", folder.file("land"), "--size", "130", "--imagery-scale", "0", "--quiet"}).exit_code,
              0);
    build_store_from({folder.file("land/dem.tif"), "--texture-size", "32"}, folder.file("d.scree"));
    HeightGrid grid{130, 130, std::vector<float>(130 * 130)};
    auto in = OIIO::ImageInput::open(folder.file("land/dem.tif"));
    ASSERT_TRUE(in && in->read_image(0, 0, 0, 1, OIIO::TypeDesc::FLOAT, grid.z.data()));
    const auto info = report_of(scree({"info", folder.file("d.scree"), "--json", "-"}));
    const Place place{info["origin_m"][0], info["origin_m"][1], info["spacing_m"], 0, false};
    const auto questions = questions_on(grid, random);
    write_file(folder.file("q.csv"), csv_of(questions, place));
    ProgramOptions options;
    options.standard_input = folder.file("q.csv");
    const auto told = told_by(scree({"height", folder.file("d.scree"), "--file", "-"}, options));
    ASSERT_EQ(told.size(), questions.size());
    double farthest = 0;
    for (std::size_t k = 0; k < questions.size(); ++k) {
        const auto [i, j, u, v] = questions[k];
        ASSERT_TRUE(told[k].height && told[k].bound);
        const double off = std::abs(*told[k].height - on_triangles(grid, i, j, u, v));
        EXPECT_LE(off, *told[k].bound + 1e-9);
        EXPECT_GT(*told[k].bound, 0);
        EXPECT_LE(*told[k].bound, info["height_quantum_m"].get<double>() / 2);
        farthest = std::max(farthest, off);
    }
    EXPECT_GT(farthest, *told[0].bound / 2) << "the bound should be near what rounding does";
}

class HeightCommand : public ::testing::Test {
protected:
    void SetUp() override {
        write_heights(folder_.file("d.tif"), grid_, place_);
        build_store_from({folder_.file("d.tif"), "--tile-size", "9", "--texture-size", "16", "--crs", "EPSG:32633"},
                         store_);
    }
    TemporaryFolder folder_;
    std::string store_ = folder_.file("d.scree");
    HeightGrid grid_ = hills(40, 40, 5);
    Place place_{-0.5, 20, 0.5, 32633, false};  // negative places, and ones that begin with a point
};

TEST_F(HeightCommand, TakesNegativeNumbersForValues) {
    const auto told =
        told_by(scree({"height", store_, "-.5", "-0.5", "-5e-1", "20", "--", "-0.25", "19.75", "-90", "-9"}));
    ASSERT_EQ(told.size(), 4u);
    EXPECT_EQ(told[0].x, -0.5);
    EXPECT_FALSE(told[0].height) << "south of the last row, at 0.5";
    EXPECT_EQ(told[1].height, grid_.at(0, 0));
    EXPECT_EQ(told[2].height, on_triangles(grid_, 0, 0, 0.5, 0.5));
    EXPECT_FALSE(told[3].height);
}

// A place in a zone where PROJ's own answer is known to be near: 15 degrees east is UTM zone 33's middle.
class LonLatOfHeights : public ::testing::Test {
protected:
    void SetUp() override {
        write_heights(folder_.file("d.tif"), grid_, place_);
        build_store_from({folder_.file("d.tif"), "--tile-size", "9", "--texture-size", "16"}, store_);
        grid_of_store_ = (*SqliteStore::open(store_))->dataset().geo_grid;
        ASSERT_TRUE(grid_of_store_);
    }
    // Shortest text that is the number again.
    static std::string text(double number) { return nlohmann::json(number).dump(); }
    LonLat lon_lat_of(double i, double j) const {
        return *grid_of_store_->lon_lat(place_.x + i * place_.step, place_.y - j * place_.step);
    }
    TemporaryFolder folder_;
    std::string store_ = folder_.file("d.scree");
    HeightGrid grid_ = hills(40, 40, 5);
    Place place_{499900, 5300000, 10, 32633, false};
    std::optional<GeoGrid> grid_of_store_;
};

TEST_F(LonLatOfHeights, PointsMayBeLongitudesAndLatitudes) {
    // 499900 m is 100 m west of 15 degrees.
    EXPECT_NEAR(lon_lat_of(10, 0).longitude_deg, 15, 1e-7);
    const LonLat a = lon_lat_of(7.25, 22.5), b = lon_lat_of(31, 3);
    write_file(folder_.file("q.csv"), "lon,lat\n" + text(b.longitude_deg) + "," + text(b.latitude_deg) + "\n");
    const auto told = told_by(scree({"height", store_, "--lonlat", text(a.longitude_deg), text(a.latitude_deg), "12.5",
                                     "-33.25", "--file", folder_.file("q.csv")}));
    ASSERT_EQ(told.size(), 3u);
    EXPECT_EQ(told[0].x, a.longitude_deg);
    EXPECT_EQ(told[0].y, a.latitude_deg);
    ASSERT_TRUE(told[0].height && told[2].height);
    EXPECT_NEAR(*told[0].height, on_triangles(grid_, 7, 22, 0.25, 0.5), 1e-3);
    EXPECT_FALSE(told[1].height) << "elsewhere on the earth";
    EXPECT_NEAR(*told[2].height, grid_.at(31, 3), 1e-3);
    const auto json = report_of(scree(
        {"height", store_, text(a.longitude_deg), text(a.latitude_deg), "12.5", "-33.25", "--lonlat", "--json", "-"}));
    EXPECT_EQ(json["points"][0]["longitude_deg"], a.longitude_deg);
    EXPECT_NEAR(json["points"][0]["x_m"], place_.x + 72.5, 1e-4);
    EXPECT_EQ(json["points"][1]["present"], false);
    EXPECT_FALSE(json["points"][1].contains("x_m"));
}

TEST_F(LonLatOfHeights, SaysWhatIsNoLatitudeAndWhichStoreKnowsNone) {
    EXPECT_EQ(scree({"height", store_, "--lonlat", "15", "90.5"}).exit_code, 2);
    EXPECT_EQ(scree({"height", store_, "--lonlat", "15"}).exit_code, 2);
    write_file(folder_.file("q.csv"), "x,y\n15,47\n");
    EXPECT_EQ(scree({"height", store_, "--lonlat", "--file", folder_.file("q.csv")}).exit_code, 3);
    write_heights_u16(folder_.file("local.tif"), grid_, nullptr);
    build_store_from({folder_.file("local.tif"), "--spacing", "10", "--texture-size", "16"},
                     folder_.file("local.scree"));
    const auto run = scree({"height", folder_.file("local.scree"), "--lonlat", "15", "47"});
    EXPECT_EQ(run.exit_code, 3) << describe(run);
    EXPECT_NE(run.err.find("coordinate system is unknown"), std::string::npos) << run.err;
}

TEST_F(HeightCommand, ARayMeetsWhatThePointsTell) {
    const auto run = scree({"height", store_, "--ray", "-.25", "9.5", "9000", "0", "0", "-2", "3", "9"});
    ASSERT_EQ(run.exit_code, 0) << describe(run);
    double px = 0, py = 0, pz = 0, pb = 0, x = 0, y = 0, z = 0, bound = -1, distance = 0;
    std::string ray;
    std::istringstream(run.out) >> px >> py >> pz >> pb >> ray >> x >> y >> z >> bound >> distance;
    EXPECT_EQ(ray, "ray") << run.out;
    EXPECT_EQ(pz, on_triangles(grid_, 7, 22, 0, 0));
    EXPECT_NEAR(z, on_triangles(grid_, 0, 21, 0.5, 0), 1e-9);
    EXPECT_NEAR(distance, 9000 - z, 1e-9);
    EXPECT_EQ(x, -0.25);
    EXPECT_EQ(y, 9.5);
    EXPECT_EQ(bound, 0);
    EXPECT_EQ(scree({"height", store_, "--ray", "3", "9", "9000", "0", "0", "2"}).out, "ray absent\n");

    const auto json = report_of(
        scree({"height", store_, "3", "9", "-90", "0", "--ray", "3", "9", "9000", "0", "0", "-1", "--json", "-"}));
    expect_keys(json, {"points", "ray", "height_quantum_error_m", "warp_error_m"});
    EXPECT_EQ(json["points"][0]["height_m"], on_triangles(grid_, 7, 22, 0, 0));
    EXPECT_EQ(json["points"][0]["present"], true);
    EXPECT_EQ(json["points"][1]["present"], false);
    EXPECT_FALSE(json["points"][1].contains("height_m"));
    EXPECT_EQ(json["ray"]["hit"], true);
    EXPECT_NEAR(json["ray"]["position_m"][2], on_triangles(grid_, 7, 22, 0, 0), 1e-9);
}

TEST_F(HeightCommand, SaysWhichLineOfAFileIsNoPoint) {
    const std::string csv = folder_.file("points.csv");
    for (const char* bad : {"1", "1,", "1,2,3", "1;2", "1,nan", "inf,1", "one,two", "1,2 3", "x,y", "1,--2", ",2"}) {
        write_file(csv, std::string("1,2\n\n") + bad + "\n");
        const auto run = scree({"height", store_, "--file", csv});
        EXPECT_EQ(run.exit_code, 3) << bad << '\n' << describe(run);
        EXPECT_EQ(run.out, "");
        EXPECT_NE(run.err.find(csv + ": line 3"), std::string::npos) << run.err;
    }
    for (const std::string& unreadable : {folder_.file("nowhere.csv"), folder_.file("")}) {
        const auto run = scree({"height", store_, "--file", unreadable});
        EXPECT_EQ(run.exit_code, 3) << describe(run);
        EXPECT_NE(run.err.find(unreadable), std::string::npos);
    }
    write_file(csv, "");
    EXPECT_EQ(scree({"height", store_, "--file", csv}).exit_code, 0);
    write_file(csv, "+1, -.5\n 2 ,\t3\t");
    EXPECT_EQ(told_by(scree({"height", store_, "--file", csv})).size(), 2u);
}

TEST_F(HeightCommand, ADamagedTileIsFour) {
    // Bits of the payload of the last height tile, found by its bytes.
    std::vector<std::uint8_t> last;
    {
        auto store = SqliteStore::open(store_);
        ASSERT_TRUE(store.ok());
        ASSERT_TRUE((*store)
                        ->for_each(TileKind::height,
                                   [&](const SqliteStore::RowView& row) {
                                       last.assign(row.payload.begin(), row.payload.end());
                                       return true;
                                   })
                        .ok());
    }
    auto bytes = read_bytes(store_);
    const auto at = std::search(bytes.begin(), bytes.end(), last.begin(), last.end());
    ASSERT_NE(at, bytes.end());
    at[20] ^= 1;
    write_bytes(store_, bytes);
    const std::vector<std::string> south_east{"height", store_, "18.9", "0.6"};
    const auto run = scree(south_east);
    EXPECT_EQ(run.exit_code, 4) << describe(run);
    EXPECT_EQ(run.out, "");
    EXPECT_NE(run.err, "");
    EXPECT_EQ(scree({"height", store_, "--ray", "18.9", "0.6", "9000", "0", "0", "-1"}).exit_code, 4);
}

}  // namespace
}  // namespace scree::test
