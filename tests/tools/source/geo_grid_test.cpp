// Longitudes and latitudes of stores against PROJ itself, which is asked here without the project's own wrapper.
#include "common/geo_grid.h"

#include <gtest/gtest.h>
#include <proj.h>

#include <cmath>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>

#include "common/dataset.h"
#include "tests/common/test_support.h"
#include "tools/source/geo_grid_maker.h"

namespace scree {
namespace {

double uniform_real(test::Random& random, double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
}

class Proj {
public:
    explicit Proj(const std::string& crs) {
        PJ* raw = proj_create_crs_to_crs(context_.get(), crs.c_str(), "EPSG:4326", nullptr);
        pj_.reset(proj_normalize_for_visualization(context_.get(), raw));
        proj_destroy(raw);
    }
    LonLat at(double x, double y) const {
        const PJ_COORD c = proj_trans(pj_.get(), PJ_FWD, proj_coord(x, y, 0, 0));
        return {c.xy.x, c.xy.y};
    }

private:
    std::unique_ptr<PJ_CONTEXT, decltype(&proj_context_destroy)> context_{proj_context_create(), proj_context_destroy};
    std::unique_ptr<PJ, decltype(&proj_destroy)> pj_{nullptr, proj_destroy};
};

struct Region {
    const char* name;
    const char* crs;
    double west_m, north_m, spacing_m;
    std::int64_t cells_x, cells_y;
};

std::ostream& operator<<(std::ostream& out, const Region& r) { return out << r.name; }

constexpr const char* kLambert =
    "+proj=lcc +lat_1=36 +lat_2=38.5 +lat_0=37 +lon_0=-120 +datum=WGS84 +units=m +type=crs";

class GeoGridOf : public testing::TestWithParam<Region> {
protected:
    void SetUp() override {
        const Region& r = GetParam();
        lattice_ = *make_lattice(r.west_m, r.north_m, r.spacing_m, r.cells_x, r.cells_y, 5);
        grid_ = make_geo_grid(lattice_, r.crs);
        ASSERT_TRUE(grid_);
    }
    Lattice lattice_;
    std::optional<GeoGrid> grid_;
};

TEST_P(GeoGridOf, IsWithinWhatItStatesOfProjEverywhere) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    ASSERT_TRUE(grid_->check().ok()) << grid_->check().error().message;
    EXPECT_GT(grid_->error_m, 0);
    EXPECT_LE(grid_->error_m, geo_grid_tolerance_m(lattice_));
    EXPECT_LE(normals_to_text(*grid_).size(), kMostNormalsText);
    const Proj proj(GetParam().crs);
    double greatest_m = 0;
    for (int k = 0; k < 20000; ++k) {
        const double x = uniform_real(random, grid_->box_m[0], grid_->box_m[2]),
                     y = uniform_real(random, grid_->box_m[1], grid_->box_m[3]);
        const auto at = grid_->lon_lat(x, y);
        ASSERT_TRUE(at);
        ASSERT_LE(std::abs(at->longitude_deg), 180);
        greatest_m = std::max(greatest_m, ground_distance_m(normal_of(*at), normal_of(proj.at(x, y))));
    }
    EXPECT_LE(greatest_m, grid_->error_m);
    EXPECT_GE(greatest_m, grid_->error_m / 3) << "stated is what is true, not what would do";
}

TEST_P(GeoGridOf, CoversTheLatticeAndKnowsNothingBeyondItsBox) {
    const auto [west, south, east, north] = grid_->box_m;
    const double last_x = lattice_.x_m(static_cast<double>(lattice_.cells_x)),
                 last_y = lattice_.y_m(static_cast<double>(lattice_.cells_y));
    for (const double x : {lattice_.origin_x_m, last_x})
        for (const double y : {lattice_.origin_y_m, last_y}) EXPECT_TRUE(grid_->lon_lat(x, y));
    const double x = (west + east) / 2, y = (south + north) / 2, beyond = (east - west) / 1000;
    EXPECT_FALSE(grid_->lon_lat(west - beyond, y));
    EXPECT_FALSE(grid_->lon_lat(east + beyond, y));
    EXPECT_FALSE(grid_->lon_lat(x, south - beyond));
    EXPECT_FALSE(grid_->lon_lat(x, north + beyond));
    EXPECT_FALSE(grid_->lon_lat(NAN, y));
    EXPECT_FALSE(grid_->lon_lat(x, INFINITY));
}

TEST_P(GeoGridOf, TheWayBackLeadsToTheSamePlace) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    for (int k = 0; k < 3000; ++k) {
        // Corners and sides, too.
        const auto within = [&](double from, double to) {
            const double share = std::clamp(uniform_real(random, -0.1, 1.1), 0.0, 1.0);
            return from + share * (to - from);
        };
        const double x = within(grid_->box_m[0], grid_->box_m[2]), y = within(grid_->box_m[1], grid_->box_m[3]);
        const auto at = grid_->lon_lat(x, y);
        ASSERT_TRUE(at);
        const auto back = grid_->place(*at);
        ASSERT_TRUE(back) << x << ' ' << y;
        const auto again = grid_->lon_lat((*back)[0], (*back)[1]);
        ASSERT_TRUE(again);
        // On the ground, because a whole side of a map may be one pole.
        ASSERT_LT(ground_distance_m(normal_of(*at), normal_of(*again)), 1e-3) << x << ' ' << y;
        if (std::abs(at->latitude_deg) < 89 && std::abs(at->longitude_deg) < 179.9) {
            ASSERT_LT(std::hypot((*back)[0] - x, (*back)[1] - y), 1e-2) << x << ' ' << y;
        }
    }
}

INSTANTIATE_TEST_SUITE_P(
    Regions, GeoGridOf,
    testing::Values(Region{"UtmWindow", "EPSG:32651", 300000, 2790000, 20, 1000, 1000},
                    Region{"UtmZone", "EPSG:32610", 170000, 5300000, 10, 66000, 60000},
                    Region{"CompoundCrs", "EPSG:5972", 400000, 6700000, 10, 5000, 9000},
                    Region{"OneMetre", "EPSG:3826", 300000, 2770000, 1, 4000, 3000},
                    Region{"PoleInTheMiddle", "EPSG:3995", -2000000, 2000000, 30, 133333, 133333},
                    Region{"SouthPole", "EPSG:3031", -3000000, 1500000, 500, 12000, 6000},
                    Region{"Lambert", kLambert, -427623, 207894, 73.5, 9750, 4625},
                    Region{"AcrossTheAntimeridian", "EPSG:3832", 2500000, 4000000, 100, 25000, 20000},
                    Region{"UtmAcrossTheAntimeridian", "EPSG:32660", 600000, 1000000, 10, 20000, 20000},
                    Region{"World", "EPSG:4087", -20037508.342789244, 10013000, 10018.754171394622, 4000, 1999},
                    Region{"Strip", "EPSG:32633", 300000, 6000000, 5, 40000, 40}),
    [](const auto& region) { return std::string(region.param.name); });

// What the format says of it: readers of another make must give the same answer.
TEST(GeoGridFormat, ThePolynomialGoesThroughTheEightNodesAround) {
    const auto longitude_at = [](double column, int node) {
        GeoGrid grid;
        grid.columns = 12;
        grid.rows = 2;
        grid.box_m = {0, 0, 11, 1};
        grid.normals.assign(24, normal_of({0, 0}));
        for (const int k : {node, node + 12}) grid.normals[static_cast<std::size_t>(k)] = normal_of({1e-3, 0});
        return grid.lon_lat(column, 0.5)->longitude_deg / 1e-3;
    };
    const auto expect_nodes = [&](double column, int first) {
        double sum = 0;
        for (int node = 0; node < 12; ++node) {
            const double weight = longitude_at(column, node);
            EXPECT_EQ(std::abs(weight) > 1e-6, node >= first && node < first + 8) << column << ' ' << node;
            sum += weight;
        }
        EXPECT_NEAR(sum, 1, 1e-6);
    };
    expect_nodes(5.5, 2);
    expect_nodes(4.1, 1);
    expect_nodes(0.5, 0);
    expect_nodes(2.9, 0);
    expect_nodes(10.5, 4);
    EXPECT_NEAR(longitude_at(5.5, 5), 1225.0 / 2048, 1e-6);
    EXPECT_NEAR(longitude_at(5.5, 2), -5.0 / 2048, 1e-6);
}

TEST(GeoGridFormat, TheTextIsThatOfTheDocument) {
    GeoGrid grid;
    grid.columns = grid.rows = 2;
    for (const LonLat& at : {LonLat{0, 0}, LonLat{90, 0}, LonLat{0, 90}, LonLat{180, 0}})
        grid.normals.push_back(normal_of(at));
    // q = 2^32 (1, 0, 0), (0, 1, 0), (0, 0, 1), (-1, 0, 0). The last's residual: q - west - north + northwest.
    const std::vector<std::vector<std::int64_t>> residuals{{1, 0, 0}, {-1, 1, 0}, {-1, 0, 1}, {0, -1, -1}};
    std::vector<std::uint8_t> bytes;
    for (const auto& node : residuals)
        for (const std::int64_t r : node) {
            std::uint64_t zigzag = r < 0 ? std::uint64_t{0x1FFFFFFFF} : r > 0 ? std::uint64_t{0x200000000} : 0;
            for (; zigzag >= 128; zigzag >>= 7) bytes.push_back(static_cast<std::uint8_t>(zigzag % 128 + 128));
            bytes.push_back(static_cast<std::uint8_t>(zigzag));
        }
    const std::string text = normals_to_text(grid);
    EXPECT_EQ(text.size(), (bytes.size() * 8 + 5) / 6);
    EXPECT_EQ(text.substr(0, 8), "gICAgCAA") << "80 80 80 80 20, 00";
    const auto back = normals_from_text(text, 2, 2);
    ASSERT_TRUE(back.ok());
    EXPECT_EQ((*back)[3], (std::array<double, 3>{-1, 0, 0}));
}

TEST(GeoGridFormat, NormalsAreOfLengthOneOrRefused) {
    const auto grid = make_geo_grid(*make_lattice(300000, 2790000, 20, 1000, 1000, 5), "EPSG:32651");
    ASSERT_TRUE(grid);
    ASSERT_TRUE(grid->check().ok());
    // A twentieth of a metre on the earth, times more or less.
    for (const std::size_t node : {std::size_t{0}, grid->normals.size() / 2, grid->normals.size() - 1})
        for (const auto& [length, fits] :
             {std::pair(1 + 4e-9, true), std::pair(1 - 4e-9, true), std::pair(1 + 6e-9, false),
              std::pair(1 - 6e-9, false), std::pair(0.0, false), std::pair(-1.0, true),
              std::pair(std::nan(""), false)}) {
            GeoGrid scaled = *grid;
            for (double& v : scaled.normals[node]) v *= length;
            EXPECT_EQ(scaled.check().ok(), fits) << "node " << node << ", length " << length;
        }
}

TEST(GeoGridMaker, TakesNoMoreNodesThanItNeeds) {
    const Lattice window = *make_lattice(300000, 2790000, 20, 1000, 1000, 5);
    const auto grid = make_geo_grid(window, "EPSG:32651");
    ASSERT_TRUE(grid);
    EXPECT_LE(grid->columns, 4);
    EXPECT_EQ(grid->columns, grid->rows);
    EXPECT_LT(normals_to_text(*grid).size(), 200u);
}

TEST(GeoGridMaker, MakesNoneWhereThereIsNothingToMakeItFrom) {
    const Lattice l = *make_lattice(0, 0, 10, 100, 100, 5);
    EXPECT_FALSE(make_geo_grid(l, ""));
    EXPECT_FALSE(make_geo_grid(l, "EPSG:999999"));
    EXPECT_FALSE(make_geo_grid(l, "LOCAL_CS[\"site\",UNIT[\"metre\",1]]"));
    // Off the map: a sphere's disc ends.
    EXPECT_FALSE(make_geo_grid(*make_lattice(-9e6, 9e6, 1000, 18000, 18000, 5), "+proj=ortho +lat_0=40 +type=crs"));
}

TEST(GeoGridMaker, StatesWhatItCannotKeep) {
    // The cone's tip and its cut are in it: no polynomial follows that.
    const Lattice l = *make_lattice(-2e6, 9e6, 100, 40000, 40000, 5);
    const auto grid = make_geo_grid(l, kLambert);
    ASSERT_TRUE(grid);
    EXPECT_GT(grid->error_m, 1000);
    EXPECT_LE(normals_to_text(*grid).size(), kMostNormalsText);
    EXPECT_TRUE(grid->check().ok());
}

TEST(GeoGridMaker, SaysTheSameTwice) {
    const Lattice l = *make_lattice(170000, 5300000, 10, 66000, 60000, 5);
    EXPECT_EQ(normals_to_text(*make_geo_grid(l, "EPSG:32610")), normals_to_text(*make_geo_grid(l, "EPSG:32610")));
}

TEST(GeoGridOfTheWorld, FindsPlacesByTheirLongitudeWhicheverWayItIsCounted) {
    const auto grid =
        make_geo_grid(*make_lattice(-20037508.342789244, 10013000, 10018.754171394622, 4000, 1999, 5), "EPSG:4087");
    ASSERT_TRUE(grid);
    for (const double longitude : {-180.0, -179.999, -90.0, 0.0, 12.5, 179.999, 180.0})
        for (const double latitude : {-89.94, -45.0, 0.0, 60.0, 89.94}) {
            const auto a = grid->place({longitude, latitude}), b = grid->place({longitude + 360, latitude});
            ASSERT_TRUE(a && b) << longitude << ' ' << latitude;
            const auto at = grid->lon_lat((*a)[0], (*a)[1]);
            ASSERT_TRUE(at);
            EXPECT_LT(ground_distance_m(normal_of(*at), normal_of({longitude, latitude})), 1e-2)
                << longitude << ' ' << latitude;
            EXPECT_NEAR((*a)[1], latitude / 90 * 10018754.17, 20);
        }
    EXPECT_FALSE(grid->place({0, 90})) << "6 km beyond the map";
    EXPECT_FALSE(grid->place({0, 90.1}));
    EXPECT_FALSE(grid->place({NAN, 0}));
    EXPECT_FALSE(grid->place({0, NAN}));
}

TEST(GeoGridOfTheWorld, MayEndAtThePoles) {
    const auto grid = make_geo_grid(*make_lattice(-20037508, 10018754, 10018.754, 4000, 2000, 5), "EPSG:4087");
    ASSERT_TRUE(grid);
    for (const double x : {-2e7, -1e6, 0.0, 1.7e7})
        for (const double y : {10018754.0, 10018753.0, -10018754.0, -10018700.0}) {
            const auto at = grid->lon_lat(x, y);
            ASSERT_TRUE(at);
            const auto back = grid->place(*at);
            ASSERT_TRUE(back) << x << ' ' << y;
            const auto again = grid->lon_lat((*back)[0], (*back)[1]);
            ASSERT_TRUE(again);
            EXPECT_LT(ground_distance_m(normal_of(*at), normal_of(*again)), 1e-3);
        }
}

Dataset dataset_with(const GeoGrid& grid) {
    Dataset d;
    d.lattice = *make_lattice(300000, 2790000, 20, 1000, 1000, 5);
    d.height_tiles = d.texture_tiles = d.present_cells = 1;
    d.geo_grid = grid;
    return d;
}

using Json = nlohmann::ordered_json;

TEST(GeoGridJson, ComesBackExactlyAndMayBeMissing) {
    for (const Region& r : {Region{"", "EPSG:32651", 300000, 2790000, 20, 1000, 1000},
                            Region{"", "EPSG:3995", -2000000, 2000000, 30, 133333, 133333}}) {
        const auto grid =
            make_geo_grid(*make_lattice(r.west_m, r.north_m, r.spacing_m, r.cells_x, r.cells_y, 5), r.crs);
        ASSERT_TRUE(grid);
        const std::string text = dataset_to_json(dataset_with(*grid));
        const auto back = dataset_from_json(text);
        ASSERT_TRUE(back.ok()) << back.error().message;
        EXPECT_EQ(back->geo_grid->normals, grid->normals);
        EXPECT_EQ(back->geo_grid->box_m, grid->box_m);
        EXPECT_EQ(back->geo_grid->error_m, grid->error_m);
        EXPECT_EQ(dataset_to_json(*back), text);
        Json without = Json::parse(text);
        without.erase("geo_grid");
        const auto old = dataset_from_json(without.dump());
        ASSERT_TRUE(old.ok());
        EXPECT_FALSE(old->geo_grid);
    }
}

TEST(GeoGridJson, HostileValuesAreRefused) {
    const auto grid = make_geo_grid(*make_lattice(300000, 2790000, 20, 1000, 1000, 5), "EPSG:32651");
    ASSERT_TRUE(grid);
    const Json good = Json::parse(dataset_to_json(dataset_with(*grid)));
    const auto refused = [&](const std::function<void(Json&)>& spoil) {
        Json bad = good;
        spoil(bad.at("geo_grid"));
        const auto read = dataset_from_json(bad.dump());
        return !read.ok() && read.error().code == ErrorCode::store &&
               read.error().message.find("geo_grid") != std::string::npos;
    };
    EXPECT_FALSE(refused([](Json&) {}));
    for (const Json& value : {Json(nullptr), Json(3), Json("text"), Json::array()})
        EXPECT_TRUE(refused([&](Json& g) { g = value; })) << value;
    for (const char* key : {"columns", "rows", "box_m", "error_m", "normals"}) {
        EXPECT_TRUE(refused([&](Json& g) { g.erase(key); })) << key;
        for (const Json& value : {Json(nullptr), Json(-1), Json(1e300), Json::object(), Json(true), Json::array({1})})
            EXPECT_TRUE(refused([&](Json& g) { g[key] = value; })) << key << ' ' << value;
    }
    for (const char* key : {"columns", "rows"})
        for (const std::int64_t value : {std::int64_t{0}, std::int64_t{1}, std::int64_t{66}, INT64_MAX, INT64_MIN})
            EXPECT_TRUE(refused([&](Json& g) { g[key] = value; })) << key << ' ' << value;
    for (const Json& box : {Json{0, 0, 0, 1}, Json{1, 0, 0, 1}, Json{0, 1, 1, 0}, Json{-1e300, 0, 1e300, 1},
                            Json{0, 0, 1}, Json{0, 0, 1, "1"}})
        EXPECT_TRUE(refused([&](Json& g) { g["box_m"] = box; })) << box;
    const std::string text = good.at("geo_grid").at("normals").get<std::string>();
    for (const std::string& spoiled :
         {std::string(), text.substr(0, text.size() - 4), text + "AAAA", text + "=", "!" + text.substr(1),
          std::string(text.size(), 'A'), std::string(text.size(), '/'), std::string(10000000, 'A')})
        EXPECT_TRUE(refused([&](Json& g) { g["normals"] = spoiled; })) << spoiled.substr(0, 100);
}

TEST(GeoGridJson, WhateverTheTextNothingGoesWrong) {
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    const auto grid = make_geo_grid(*make_lattice(170000, 5300000, 10, 66000, 60000, 5), "EPSG:32610");
    ASSERT_TRUE(grid);
    const std::string text = normals_to_text(*grid);
    constexpr std::string_view kCharacters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    for (int k = 0; k < 5000; ++k) {
        std::string spoiled = text;
        for (int changes = test::uniform(random, 1, 4); changes > 0; --changes)
            spoiled[static_cast<std::size_t>(test::uniform(random, 0, static_cast<int>(text.size()) - 1))] =
                kCharacters[static_cast<std::size_t>(test::uniform(random, 0, 63))];
        GeoGrid spoiled_grid = *grid;
        auto normals = normals_from_text(spoiled, grid->columns, grid->rows);
        if (!normals) continue;
        spoiled_grid.normals = std::move(*normals);
        const auto at = spoiled_grid.lon_lat(500000, 5000000);
        if (at) (void)spoiled_grid.place(*at);
    }
}

}  // namespace
}  // namespace scree
