#include "tools/source/vertical_crs.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

namespace scree {
namespace {

Crs crs(const std::string& text) {
    auto parsed = Crs::parse(text);
    EXPECT_TRUE(parsed) << text;
    return std::move(*parsed);
}

VerticalCrs vertical(const std::string& text) {
    auto parsed = VerticalCrs::parse(text);
    EXPECT_TRUE(parsed) << text;
    return parsed ? *parsed : VerticalCrs{};
}

constexpr LonLatBox kColorado{-106, 39, -104, 41};

Result<VerticalShift> shift(const std::string& from, const std::string& to, const std::string& plane = "EPSG:4326",
                            const LonLatBox& area = kColorado) {
    return VerticalShift::make(crs(plane), vertical(from), vertical(to), area);
}

double shifted(const VerticalShift& shift, double x, double y, double z) {
    std::vector<double> heights{z};
    shift.apply(std::vector<double>{x}, std::vector<double>{y}, heights);
    return heights[0];
}

TEST(VerticalCrs, KnowsUnitsDirectionsAndEllipsoids) {
    const VerticalCrs feet = vertical("EPSG:6360"), depth = vertical("EPSG:5715"), ellipsoid = vertical("EPSG:4979");
    EXPECT_DOUBLE_EQ(feet.metres_per_unit, 1200.0 / 3937);
    EXPECT_TRUE(feet.up);
    EXPECT_FALSE(feet.ellipsoidal);
    EXPECT_FALSE(depth.up);
    EXPECT_EQ(depth.metres_per_unit, 1);
    EXPECT_TRUE(ellipsoid.ellipsoidal);
    EXPECT_TRUE(ellipsoid.up);
    EXPECT_EQ(vertical("EPSG:5773").text, "EPSG:5773");
}

TEST(VerticalCrs, RefusesWhatIsNoVerticalReference) {
    // A datum's code, a horizontal CRS, a compound one, nothing on record, a name.
    for (const char* text : {"EPSG:5103", "EPSG:4326", "EPSG:32633", "EPSG:9707", "EPSG:99999", "EGM96", ""}) {
        const auto parsed = VerticalCrs::parse(text);
        ASSERT_FALSE(parsed) << text;
        EXPECT_EQ(parsed.error().code, ErrorCode::input);
        EXPECT_NE(parsed.error().message.find('"' + std::string(text) + '"'), std::string::npos);
    }
}

TEST(VerticalShift, OfUnitsAloneLeavesMetres) {
    for (const char* plane : {"EPSG:4326", "EPSG:4269", "EPSG:26913"}) {
        const auto way = shift("EPSG:6360", "EPSG:5703", plane);
        ASSERT_TRUE(way) << way.error().message;
        EXPECT_TRUE(way->identity()) << plane;
    }
    EXPECT_TRUE(shift("EPSG:5703", "EPSG:5703")->identity());
}

TEST(VerticalShift, TurnsDepthsIntoHeightsWhateverTheirUnit) {
    for (const char* depth : {"EPSG:5715", "EPSG:8051"}) {
        const auto way = shift(depth, "EPSG:5714");
        ASSERT_TRUE(way) << way.error().message;
        ASSERT_FALSE(way->identity());
        EXPECT_NEAR(shifted(*way, -105, 40, 120), -120, 1e-9) << depth;
        EXPECT_NEAR(shifted(*way, -105, 40, -3), 3, 1e-9) << depth;
        EXPECT_EQ(way->accuracy_m(), 0);
    }
}

TEST(VerticalShift, NamesTheGridThatIsMissing) {
    // Of vertcon and of EGM 2008: neither comes with PROJ.
    const auto old = shift("EPSG:7968", "EPSG:5703", "EPSG:4269");
    if (old) GTEST_SKIP() << "the grids of VERTCON are installed";
    EXPECT_EQ(old.error().code, ErrorCode::input);
    EXPECT_NE(old.error().message.find("us_noaa_vertconc.tif"), std::string::npos) << old.error().message;
    EXPECT_NE(old.error().message.find("EPSG:7968"), std::string::npos) << old.error().message;
    EXPECT_NE(old.error().message.find("EPSG:5703"), std::string::npos) << old.error().message;
}

TEST(VerticalShift, NeverTakesOneDatumForAnother) {
    // PROJ's only way without a grid neglects the difference; NAP and RH 2000 have none at all.
    const auto way = shift("EPSG:5709", "EPSG:5613", "EPSG:4326", {14, 58, 16, 60});
    ASSERT_FALSE(way) << way->operation();
    EXPECT_EQ(way.error().code, ErrorCode::input);
}

// Points and undulations of NGA's test of its interpolation program F477 (INPUT.DAT, OUTPUT.DAT).
struct Undulation {
    double latitude, longitude, metres;
};
constexpr Undulation kEgm96[] = {{38.6281550, 269.7791550, -31.628}, {-14.6212170, 305.0211140, -2.969},
                                 {46.8743190, 102.4487290, -43.575}, {-23.6174460, 133.8747120, 15.871},
                                 {38.6254730, 359.9995000, 50.066},  {-0.4667440, 0.0023000, 17.329}};

TEST(VerticalShift, OfEgm96IsTheUndulationOnRecord) {
    const LonLatBox world{-180, -90, 180, 90};
    const auto way = shift("EPSG:5773", "EPSG:4979", "EPSG:4326", world);
    if (!way) GTEST_SKIP() << way.error().message;
    const auto back = shift("EPSG:4979", "EPSG:5773", "EPSG:4326", world);
    ASSERT_TRUE(back);
    EXPECT_GT(way->accuracy_m(), 0);
    for (const auto& [latitude, longitude, undulation] : kEgm96) {
        // Bilinear in steps of a quarter of a degree where the program is biquadratic.
        EXPECT_NEAR(shifted(*way, longitude, latitude, 100), 100 + undulation, 0.15) << latitude << ", " << longitude;
        EXPECT_NEAR(shifted(*back, longitude, latitude, 100), 100 - undulation, 0.15);
        EXPECT_NEAR(shifted(*back, longitude, latitude, shifted(*way, longitude, latitude, 7)), 7, 1e-6);
    }
}

TEST(VerticalShift, FindsItsPlaceFromAnyHorizontalCrs) {
    const auto degrees = shift("EPSG:5773", "EPSG:4979");
    if (!degrees) GTEST_SKIP() << degrees.error().message;
    const auto into = CrsTransform::make(crs("EPSG:4326"), crs("EPSG:32613"));
    std::vector<double> x{-105.3}, y{40.2};
    into->apply(x, y);
    const auto metres = shift("EPSG:5773", "EPSG:4979", "EPSG:32613");
    ASSERT_TRUE(metres);
    EXPECT_NEAR(shifted(*metres, x[0], y[0], 0), shifted(*degrees, -105.3, 40.2, 0), 1e-6);
    // Feet beyond the geoid: units and the shift at once.
    EXPECT_NEAR(shifted(*metres, x[0], y[0], 1000), shifted(*degrees, -105.3, 40.2, 1000), 1e-6);
}

}  // namespace
}  // namespace scree
