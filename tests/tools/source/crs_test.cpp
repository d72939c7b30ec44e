#include "tools/source/crs.h"

#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/common/test_support.h"

namespace scree {
namespace {

Crs crs(const std::string& text) {
    Result<Crs> parsed = Crs::parse(text);
    EXPECT_TRUE(parsed.ok()) << parsed.error().message;
    return parsed ? *parsed : *Crs::parse("EPSG:4326");
}

struct Point {
    double x, y;
};

Point transform(const std::string& from, const std::string& to, Point point) {
    const Result<CrsTransform> way = CrsTransform::make(crs(from), crs(to));
    EXPECT_TRUE(way.ok()) << way.error().message;
    if (way) way->apply({&point.x, 1}, {&point.y, 1});
    return point;
}

const std::string kEsriUtm33 =
    "PROJCS[\"WGS_1984_UTM_Zone_33N\",GEOGCS[\"GCS_WGS_1984\",DATUM[\"D_WGS_1984\",SPHEROID[\"WGS_1984\",6378137.0,"
    "298.257223563]],PRIMEM[\"Greenwich\",0.0],UNIT[\"Degree\",0.0174532925199433]],PROJECTION[\"Transverse_Mercator\"]"
    ","
    "PARAMETER[\"False_Easting\",500000.0],PARAMETER[\"False_Northing\",0.0],PARAMETER[\"Central_Meridian\",15.0],"
    "PARAMETER[\"Scale_Factor\",0.9996],PARAMETER[\"Latitude_Of_Origin\",0.0],UNIT[\"Meter\",1.0]]";

TEST(Crs, OneCrsHasOneTextHoweverItIsWritten) {
    for (const std::string& text : {std::string("EPSG:32633"), std::string("+proj=utm +zone=33 +datum=WGS84"),
                                    std::string("  urn:ogc:def:crs:EPSG::32633\n"), kEsriUtm33}) {
        const Crs read = crs(text);
        EXPECT_EQ(read.text(), "EPSG:32633");
        EXPECT_EQ(read.name(), text == kEsriUtm33 ? read.name() : "WGS 84 / UTM zone 33N");
        EXPECT_FALSE(read.geographic());
        EXPECT_EQ(read.metres_per_unit(), 1);
        EXPECT_TRUE(read.same_as(crs("EPSG:32633")));
        EXPECT_FALSE(read.same_as(crs("EPSG:32634")));
    }
}

TEST(Crs, ANumberThatDoesNotFitItsDefinitionIsNotBelieved) {
    std::string lie = kEsriUtm33;
    lie.replace(lie.find("15.0"), 4, "15.5");
    lie.insert(lie.size() - 1, ",AUTHORITY[\"EPSG\",\"32633\"]");
    const Crs read = crs(lie);
    EXPECT_EQ(read.text().rfind("PROJCRS[", 0), 0U) << read.text();
    EXPECT_EQ(read.text().find('\n'), std::string::npos);
    EXPECT_FALSE(read.same_as(crs("EPSG:32633")));
}

TEST(Crs, TheTextOfACrsIsThatCrs) {
    for (const char* text :
         {"EPSG:4326", "EPSG:3826", "EPSG:2154", "ESRI:102003", "OGC:CRS84",
          "+proj=longlat +ellps=bessel +towgs84=1,2,3",
          "+proj=lcc +lat_1=44.7 +lat_2=47.3 +lat_0=46 +lon_0=10.5 +datum=WGS84", "EPSG:2263", "EPSG:4807"}) {
        const Crs first = crs(text), second = crs(first.text());
        EXPECT_TRUE(first.same_as(second)) << text;
        EXPECT_EQ(second.text(), first.text());
        EXPECT_EQ(second.turn(), first.turn());
        EXPECT_EQ(second.metres_per_unit(), first.metres_per_unit());
    }
}

TEST(Crs, AxisOrderIsNoDifference) { EXPECT_TRUE(crs("OGC:CRS84").same_as(crs("EPSG:4326"))); }

TEST(Crs, ACompoundCrsIsTakenApart) {
    const Crs amersfoort = crs("EPSG:7415");
    EXPECT_EQ(amersfoort.text(), "EPSG:28992");
    EXPECT_EQ(amersfoort.vertical(), "EPSG:5709");
    EXPECT_EQ(crs("EPSG:4326+5773").vertical(), "EPSG:5773");
    EXPECT_EQ(crs("EPSG:28992").vertical(), "");
    EXPECT_EQ(crs("EPSG:4979").text(), "EPSG:4326");
}

TEST(Crs, UnitsAreThoseOfTheAxes) {
    EXPECT_NEAR(crs("EPSG:2263").metres_per_unit(), 1200.0 / 3937, 1e-12);
    EXPECT_EQ(crs("EPSG:4326").turn(), 360);
    EXPECT_EQ(crs("EPSG:4807").turn(), 400);
    EXPECT_TRUE(crs("EPSG:4326").geographic());
    EXPECT_TRUE(crs("EPSG:3413").east_north());
    EXPECT_FALSE(crs("EPSG:2053").east_north());
}

TEST(Crs, WhatIsNoHorizontalCrsIsRefusedByItsText) {
    const std::string long_text = "EPSG:" + std::string(100, '9');
    for (const std::string& text :
         {std::string(), std::string("WGS 84"), std::string("4326"), std::string("EPSG:"), std::string("EPSG:1"),
          std::string("EPSG:4978"), std::string("EPSG:5773"), std::string("PROJCS[\"x"), std::string("{\"a\":1}"),
          std::string("+proj=nothing"), std::string("+proj=helmert +x=1"),
          std::string("LOCAL_CS[\"x\",UNIT[\"metre\",1]]"), std::string(2 << 20, '['), long_text}) {
        const Result<Crs> read = Crs::parse(text);
        ASSERT_FALSE(read.ok()) << text.substr(0, 80);
        EXPECT_EQ(read.error().code, ErrorCode::input);
        EXPECT_NE(read.error().message.find(text.substr(0, 80)), std::string::npos);
        EXPECT_LT(read.error().message.size(), 300U);
    }
}

TEST(CrsTransform, XIsEastWhateverTheAuthoritySays) {
    const Point rainier = transform("EPSG:4326", "EPSG:32610", {-121.760, 46.852});
    EXPECT_NEAR(rainier.x, 594500, 1000);
    EXPECT_NEAR(rainier.y, 5189500, 1000);
    const Point back = transform("EPSG:32610", "EPSG:4326", rainier);
    EXPECT_NEAR(back.x, -121.760, 1e-9);
    EXPECT_NEAR(back.y, 46.852, 1e-9);
    // Spherical Mercator in closed form.
    const Point web = transform("EPSG:4326", "EPSG:3857", {90, 45});
    EXPECT_NEAR(web.x, 6378137 * std::acos(-1.0) / 2, 1e-6);
    EXPECT_NEAR(web.y, 6378137 * std::asinh(1.0), 1e-6);
}

TEST(CrsTransform, LongitudesMayGoRound) {
    const Point plain = transform("EPSG:4326", "EPSG:32601", {-179, 10});
    const Point round = transform("EPSG:4326", "EPSG:32601", {181, 10});
    const Point twice = transform("EPSG:4326", "EPSG:32601", {901, 10});
    EXPECT_NEAR(plain.x, round.x, 1e-6);
    EXPECT_NEAR(plain.x, twice.x, 1e-6);
    EXPECT_NEAR(transform("EPSG:4230", "EPSG:4326", {181, 50}).x, -179, 0.01);
    const Point paris = transform("EPSG:4807", "EPSG:2154", {0, 54});
    const Point paris_round = transform("EPSG:4807", "EPSG:2154", {400, 54});
    EXPECT_NEAR(paris.x, paris_round.x, 1e-6);
    EXPECT_NEAR(paris.x, 652000, 1000);
}

TEST(CrsTransform, PointsWithoutAnImageAreNowhereAndLeaveTheirNeighboursAlone) {
    const Result<CrsTransform> way = CrsTransform::make(crs("EPSG:4326"), crs("EPSG:32633"));
    ASSERT_TRUE(way.ok());
    const double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
    std::array<double, 7> x = {15, 15, 15, nan, infinity, 15, 15};
    std::array<double, 7> y = {45, 90.001, -91, 45, 45, nan, 90};
    way->apply(x, y);
    EXPECT_NEAR(x[0], 500000, 1e-6);
    EXPECT_NEAR(x[6], 500000, 1e-3);
    for (std::size_t i = 1; i < 6; ++i) {
        EXPECT_TRUE(std::isnan(x[i])) << i;
        EXPECT_TRUE(std::isnan(y[i])) << i;
    }
}

TEST(CrsTransform, TheSameCrsChangesNothing) {
    const Result<CrsTransform> way = CrsTransform::make(crs("EPSG:32633"), crs(kEsriUtm33));
    ASSERT_TRUE(way.ok());
    EXPECT_TRUE(way->identity());
    EXPECT_EQ(way->accuracy_m(), 0);
    double x = 123.456, y = 1e300;
    way->apply({&x, 1}, {&y, 1});
    EXPECT_EQ(x, 123.456);
    EXPECT_EQ(y, 1e300);
}

TEST(CrsTransform, AccuracyIsThatOfTheDatumShift) {
    const auto accuracy = [](const std::string& from, const std::string& to) {
        const Result<CrsTransform> way = CrsTransform::make(crs(from), crs(to));
        EXPECT_TRUE(way.ok());
        return way ? way->accuracy_m() : -2;
    };
    EXPECT_EQ(accuracy("EPSG:4326", "EPSG:32633"), 0);
    EXPECT_EQ(accuracy("EPSG:32633", "EPSG:32634"), 0);
    EXPECT_EQ(accuracy("EPSG:3826", "EPSG:32651"), 1);
    EXPECT_EQ(accuracy("+proj=longlat +ellps=bessel", "EPSG:32633"), -1);
}

// ED50 has dozens of shifts, each for a country or two: with a choice by point, neighbours part by metres where
// countries meet. Second differences of a smooth map are nothing against that.
TEST(CrsTransform, OneOperationServesAllPoints) {
    const Result<CrsTransform> way = CrsTransform::make(crs("EPSG:4230"), crs("EPSG:32631"));
    ASSERT_TRUE(way.ok());
    constexpr std::size_t kCount = 20000;
    std::vector<double> x(kCount), y(kCount);
    for (std::size_t i = 0; i < kCount; ++i) {
        x[i] = -5 + 15.0 * static_cast<double>(i) / kCount;
        y[i] = 36 + 20.0 * static_cast<double>(i) / kCount;
    }
    way->apply(x, y);
    for (std::size_t i = 2; i < kCount; ++i) {
        ASSERT_LT(std::abs(x[i] - 2 * x[i - 1] + x[i - 2]), 0.1);
        ASSERT_LT(std::abs(y[i] - 2 * y[i - 1] + y[i - 2]), 0.1);
    }
}

TEST(CrsTransform, AnAreaChoosesTheShiftThatIsMeantForIt) {
    const LonLatBox spain{-8, 37, 2, 43}, norway{5, 59, 10, 62};
    const Result<CrsTransform> first = CrsTransform::make(crs("EPSG:4230"), crs("EPSG:4326"), &spain);
    const Result<CrsTransform> second = CrsTransform::make(crs("EPSG:4230"), crs("EPSG:4326"), &norway);
    ASSERT_TRUE(first.ok() && second.ok());
    double x1 = 3, y1 = 50, x2 = 3, y2 = 50;
    first->apply({&x1, 1}, {&y1, 1});
    second->apply({&x2, 1}, {&y2, 1});
    EXPECT_NE(x1, x2);
    EXPECT_NEAR(x1, x2, 1e-3);
}

TEST(MeasureScale, UtmIsBelowScaleOnItsMeridianAndAboveAwayFromIt) {
    const Result<ScaleRange> scale = measure_scale(crs("EPSG:32633"), {12, 40, 18, 50});
    ASSERT_TRUE(scale.ok());
    EXPECT_NEAR(scale->least, 0.9996, 1e-6);
    // Snyder 1987, equation 8-11, first term: 1 + (dlambda cos phi)^2 / 2 at 40 degrees.
    EXPECT_NEAR(scale->greatest,
                0.9996 * (1 + std::pow(3 * std::acos(-1.0) / 180 * std::cos(40 * std::acos(-1.0) / 180), 2) / 2), 1e-5);
    EXPECT_NEAR(scale->worst(), scale->greatest, 1e-12);
}

TEST(MeasureScale, IsOfLengthsAndNotOfUnits) {
    const Result<ScaleRange> scale = measure_scale(crs("EPSG:2263"), {-74.2, 40.5, -73.7, 40.9});
    ASSERT_TRUE(scale.ok());
    EXPECT_NEAR(scale->least, 1, 1e-4);
    EXPECT_NEAR(scale->greatest, 1, 1e-4);
}

TEST(MeasureScale, LongitudesAreOfGreenwichWhateverTheCrsCountsFrom) {
    // Austria's western zone lies about 28 degrees east of Ferro.
    const Result<ScaleRange> scale = measure_scale(crs("EPSG:31281"), {10.32, 47, 10.35, 47.1});
    ASSERT_TRUE(scale.ok());
    EXPECT_NEAR(scale->least, 1, 1e-7);
    EXPECT_NEAR(scale->greatest, 1, 1e-7);
}

TEST(MeasureScale, WebMercatorGrowsWithLatitude) {
    const Result<ScaleRange> scale = measure_scale(crs("EPSG:3857"), {0, 60, 1, 60});
    ASSERT_TRUE(scale.ok());
    EXPECT_NEAR(scale->worst(), 2, 0.02);
}

TEST(MeasureScale, IsRefusedWhereThereIsNone) {
    EXPECT_FALSE(measure_scale(crs("EPSG:4326"), {0, 0, 1, 1}).ok());
    EXPECT_FALSE(measure_scale(crs("EPSG:32633"), {-180, -80, 180, 80}).ok());
    EXPECT_FALSE(measure_scale(crs("EPSG:3857"), {0, 80, 1, 90}).ok());
    const double nan = std::numeric_limits<double>::quiet_NaN();
    for (const LonLatBox& box :
         {LonLatBox{0, 10, 1, 5}, LonLatBox{0, -91, 1, 0}, LonLatBox{nan, 0, 1, 1}, LonLatBox{0, 0, 1, nan}}) {
        EXPECT_FALSE(measure_scale(crs("EPSG:32633"), box).ok());
        const Result<ChosenCrs> chosen = choose_crs(nullptr, box);
        ASSERT_FALSE(chosen.ok());
        EXPECT_EQ(chosen.error().code, ErrorCode::input);
    }
}

struct Choice {
    LonLatBox box;
    const char* text;  ///< of the CRS, or what its WKT names
    double worst_scale;
};

TEST(ChooseCrs, TakesTheSimplestThatIsTrueToScale) {
    const std::array<Choice, 15> choices = {{
        {{-122, 46, -121, 47}, "EPSG:32610", 1.001},
        {{121, -24, 121, -24}, "EPSG:32751", 1.001},        // a point
        {{179.95, -18, -177.5, -16}, "EPSG:32701", 1.001},  // across the antimeridian
        {{-180, 10, -179.9, 11}, "EPSG:32601", 1.0011},
        {{10, 76, 30, 81}, "EPSG:32634", 1.001},  // meridians meet: wide in degrees, not in metres
        {{5, 44, 16, 48}, "Lambert conformal conic 44.7 47.3", 1.001},
        {{-125, 24, -66, 50}, "Lambert conformal conic 28.3 45.7", 1.02},
        {{170, -20, -170, -10}, "Lambert conformal conic -18.3 -11.7", 1.003},
        {{95, -10, 141, 9}, "Mercator true at 6.7", 1.01},
        {{-180, 85, 180, 90}, "polar stereographic true at 87.5", 1.002},
        {{-180, -90, 180, -60}, "polar stereographic true at -75", 1.06},
        {{0, 90, 0, 90}, "polar stereographic true at 90", 1.001},
        {{-180, 0, 180, 90}, "polar stereographic true at 45", 1.8},  // a hemisphere
        {{-180, -85, 180, 85}, "Mercator true at 56.7", 7},
        {{-180, -90, 180, 90}, "EPSG:4087", 60},  // the world
    }};
    for (const Choice& choice : choices) {
        const Result<ChosenCrs> chosen = choose_crs(nullptr, choice.box);
        ASSERT_TRUE(chosen.ok()) << choice.text << ": " << chosen.error().message;
        EXPECT_NE(chosen->crs.text().find(choice.text), std::string::npos)
            << choice.text << " is not " << chosen->crs.text();
        EXPECT_LE(chosen->scale.worst(), choice.worst_scale) << choice.text;
        EXPECT_GE(chosen->scale.worst(), 1);
        EXPECT_EQ(chosen->crs.metres_per_unit(), 1);
        EXPECT_TRUE(chosen->crs.east_north());
    }
}

TEST(ChooseCrs, SaysWhy) {
    const Result<ChosenCrs> chosen = choose_crs(nullptr, {-124, 46, -121, 48});
    ASSERT_TRUE(chosen.ok());
    EXPECT_EQ(chosen->reason, "UTM zone 10 N: the sources span 3.0 x 2.0 degrees");
}

TEST(ChooseCrs, KeepsTheSourcesOwnWhereItIsMetricAndTrue) {
    const Crs taiwan = crs("EPSG:3826"), web = crs("EPSG:3857"), degrees = crs("EPSG:4326"), feet = crs("EPSG:2263"),
              lo = crs("EPSG:2053");
    EXPECT_EQ(choose_crs(&taiwan, {120.5, 23, 121.5, 25})->crs.text(), "EPSG:3826");
    EXPECT_EQ(choose_crs(&web, {120.5, 23, 121.5, 25})->crs.text(), "EPSG:32651");
    EXPECT_EQ(choose_crs(&web, {0, -2, 1, 2})->crs.text(), "EPSG:32631");  // 0.7 % along meridians
    EXPECT_EQ(choose_crs(&degrees, {120.5, 23, 121.5, 25})->crs.text(), "EPSG:32651");
    EXPECT_EQ(choose_crs(&feet, {-74.2, 40.5, -73.7, 40.9})->crs.text(), "EPSG:32618");
    EXPECT_EQ(choose_crs(&lo, {28.5, -27, 29.5, -26})->crs.text(), "EPSG:32735");
}

TEST(ChooseCrs, GivesTheDatumOfTheRegistry) {
    const Result<ChosenCrs> chosen = choose_crs(nullptr, {5, 44, 16, 48});
    ASSERT_TRUE(chosen.ok());
    const Result<CrsTransform> way = CrsTransform::make(crs("EPSG:4326"), chosen->crs);
    ASSERT_TRUE(way.ok());
    EXPECT_EQ(way->accuracy_m(), 0);
}

}  // namespace
}  // namespace scree
