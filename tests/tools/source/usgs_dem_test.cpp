#include <algorithm>
#include <string>
#include <tuple>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/tools/source/grid_test_support.h"
#include "tools/source/crs.h"
#include "tools/source/state_plane.h"

namespace scree {
namespace {

using test::TempDirectory;

constexpr double kVoid = -32767;

struct Profile {
    double x = 0, y = 0, local_datum = 0;
    std::vector<int> south_to_north;
};

enum class Ends { padded, padded_crlf, lines, crlf_lines, none };

// Data elements in the order of the standard; defaults are those of a UTM quad.
struct Dem {
    int pattern = 1, system = 1, zone = 10, ground_unit = 2, height_unit = 2;
    double angle = 0;
    double step_x = 30, step_y = 30, step_z = 1;
    int counted = -1;  ///< profiles; -1: as many as there are
    std::string datums = "    ";
    std::vector<Profile> profiles;
};

std::string fortran(double value) {
    std::string text = fmt::format("{:24.15E}", value);
    std::replace(text.begin(), text.end(), 'E', 'D');
    return text;
}

std::string record_a(const Dem& dem) {
    std::string a = "A QUAD";
    a.resize(144, ' ');
    a += fmt::format("{:6}{:6}{:6}{:6}", 1, dem.pattern, dem.system, dem.zone);
    for (int i = 0; i < 15; ++i) a += fortran(0);
    a += fmt::format("{:6}{:6}{:6}", dem.ground_unit, dem.height_unit, 4);
    for (int i = 0; i < 10; ++i) a += fortran(i);  // corners, least and greatest: the profiles say it themselves
    a += fortran(dem.angle) + "     0";
    a += fmt::format("{:12.6E}{:12.6E}{:12.6E}", dem.step_x, dem.step_y, dem.step_z);
    a += fmt::format("{:6}{:6}", 1, dem.counted >= 0 ? dem.counted : static_cast<int>(dem.profiles.size()));
    a.resize(888, ' ');
    return a + dem.datums;
}

void end_record(std::string& file, std::string record, Ends ends) {
    if (ends == Ends::padded || ends == Ends::padded_crlf) record.resize(1024, ' ');
    if (ends == Ends::lines) record += '\n';
    if (ends == Ends::padded_crlf || ends == Ends::crlf_lines) record += "\r\n";
    file += record;
}

std::string file_of(const Dem& dem, Ends ends = Ends::padded) {
    std::string file;
    end_record(file, record_a(dem), ends);
    int number = 0;
    for (const Profile& p : dem.profiles) {
        std::string record = fmt::format("{:6}{:6}{:6}{:6}", 1, ++number, p.south_to_north.size(), 1) + fortran(p.x) +
                             fortran(p.y) + fortran(p.local_datum) + fortran(0) + fortran(0);
        for (const int value : p.south_to_north) {
            if (record.size() + 6 > 1024) {
                end_record(file, record, ends);
                record.clear();
            }
            record += fmt::format("{:6}", value);
        }
        end_record(file, record, ends);
    }
    return file;
}

// A grid of sample_at; long profiles take several records.
Dem rectangle(std::int64_t columns, std::int64_t rows) {
    Dem dem;
    for (std::int64_t column = 0; column < columns; ++column) {
        Profile p{560010 + 30.0 * static_cast<double>(column), 5100000, 0, {}};
        for (std::int64_t row = rows - 1; row >= 0; --row) p.south_to_north.push_back(test::sample_at(row, column));
        dem.profiles.push_back(std::move(p));
    }
    return dem;
}

// The test's files have two profiles of two values more often than not.
Dem small() { return rectangle(2, 2); }

Georeference place_of(const TempDirectory& directory, const Dem& dem) {
    const auto source = test::open_grid_or_fail(directory.write("place.dem", file_of(dem)));
    return source != nullptr && source->georeference() ? *source->georeference() : Georeference{};
}

TEST(UsgsDem, ValuesAndPlaceAreExactHoweverRecordsEnd) {
    const TempDirectory directory;
    for (const std::int64_t rows : {1, 145, 146, 147, 316, 317, 500})
        for (const Ends ends : {Ends::padded, Ends::padded_crlf, Ends::lines, Ends::crlf_lines, Ends::none}) {
            SCOPED_TRACE(fmt::format("{} rows, ends {}", rows, static_cast<int>(ends)));
            const auto source = test::open_grid_or_fail(directory.write("a.dem", file_of(rectangle(5, rows), ends)));
            ASSERT_NE(source, nullptr);
            EXPECT_EQ(source->info().width, 5);
            ASSERT_EQ(source->info().height, rows);
            EXPECT_EQ(source->info().type, SampleType::i32);
            EXPECT_EQ(source->info().nodata, kVoid);
            const Georeference& place = *source->georeference();
            EXPECT_EQ(place.first_x, 560010);
            EXPECT_EQ(place.first_y, 5100000 + 30.0 * static_cast<double>(rows - 1));
            EXPECT_EQ(place.column_x, 30);
            EXPECT_EQ(place.row_y, -30);
            EXPECT_TRUE(place.raster_is_point);
            EXPECT_EQ(place.height_unit_m, 1);
            test::expect_surface(*source);
        }
}

TEST(UsgsDem, AFileIsKnownByItsHeaderWhateverItIsCalled) {
    const TempDirectory directory;
    const auto source = test::open_grid_or_fail(directory.write("quad", file_of(rectangle(5, 9))));
    ASSERT_NE(source, nullptr);
    test::expect_surface(*source);
}

TEST(UsgsDem, ASlantedQuadIsVoidOutsideItsProfiles) {
    const TempDirectory directory;
    Dem dem;
    dem.profiles = {{600000, 4000060, 0, {1, 2}},
                    {600030, 4000030, 0, {3, -32767, 5, -32766}},
                    {600090, 4000000, 0, {6, 7, 8}}};  // a profile is missing before
    const auto source = test::open_grid_or_fail(directory.write("a.dem", file_of(dem)));
    ASSERT_NE(source, nullptr);
    const double v = kVoid;
    const std::vector<double> expected = {v, v, v, v,  //
                                          2, 5, v, v,  //
                                          1, v, v, 8,  //
                                          v, 3, v, 7,  //
                                          v, v, v, 6};
    EXPECT_EQ(test::read_all(*source), expected);
    EXPECT_EQ(test::read_rows(*source, 2, 4), std::vector<double>(expected.begin() + 8, expected.begin() + 16));
    EXPECT_EQ(test::read_all(*source), expected) << "after its last row was read";
    EXPECT_EQ(source->georeference()->first_x, 600000);
    EXPECT_EQ(source->georeference()->first_y, 4000120);
}

TEST(UsgsDem, FieldsWithoutSpaceBetweenThemAreParted) {
    const TempDirectory directory;
    for (const Ends ends : {Ends::padded, Ends::crlf_lines, Ends::none}) {
        Dem dem;
        dem.profiles = {{600000, 4000000, 0, {-32767, -32767, 12345, 100000, 999999, -999, -32767}},
                        {600030, 4000000, 0, {-32767, 1, 2, 3, 4, 5, 123456}}};
        const auto source = test::open_grid_or_fail(directory.write("a.dem", file_of(dem, ends)));
        ASSERT_NE(source, nullptr);
        EXPECT_EQ(test::read_all(*source), std::vector<double>({kVoid, 123456, -999, 5, 999999, 4, 100000, 3, 12345, 2,
                                                                kVoid, 1, kVoid, kVoid}));
    }
}

TEST(UsgsDem, HeightsAreScaledAndRaisedByTheDatumOfTheirProfile) {
    const TempDirectory directory;
    Dem dem = small();
    dem.step_z = 0.1;
    dem.height_unit = 1;
    dem.profiles[0].south_to_north = {15, -32767};
    dem.profiles[1].south_to_north = {-7, 144947};
    dem.profiles[1].local_datum = 100.5;
    auto source = test::open_grid_or_fail(directory.write("a.dem", file_of(dem)));
    ASSERT_NE(source, nullptr);
    EXPECT_EQ(source->info().type, SampleType::f32);
    EXPECT_EQ(source->georeference()->height_unit_m, 0.3048);
    const auto f = [](double value) { return static_cast<double>(static_cast<float>(value)); };
    EXPECT_EQ(test::read_all(*source), std::vector<double>({kVoid, f(144947 * 0.1 + 100.5), f(15 * 0.1), f(99.8)}));
    dem.step_z = 1;
    source = test::open_grid_or_fail(directory.write("b.dem", file_of(dem)));
    ASSERT_NE(source, nullptr);
    EXPECT_EQ(source->info().type, SampleType::f32);
    EXPECT_EQ(test::read_all(*source), std::vector<double>({kVoid, f(144947 + 100.5), 15, f(93.5)}));
}

TEST(UsgsDem, ArcSecondsRadiansAndFeetBecomeUnitsOfTheCrs) {
    const TempDirectory directory;
    Dem dem = rectangle(3, 4);
    dem.system = dem.zone = 0;
    dem.ground_unit = 3;
    dem.step_x = 6;
    dem.step_y = 3;
    for (int i = 0; i < 3; ++i) {
        dem.profiles[static_cast<std::size_t>(i)].x = -122 * 3600 + 6 * i;
        dem.profiles[static_cast<std::size_t>(i)].y = 46 * 3600;
    }
    Georeference place = place_of(directory, dem);
    EXPECT_TRUE(place.geographic);
    EXPECT_DOUBLE_EQ(place.first_x, -122);
    EXPECT_DOUBLE_EQ(place.first_y, 46 + 9.0 / 3600);
    EXPECT_DOUBLE_EQ(place.column_x, 6.0 / 3600);
    EXPECT_DOUBLE_EQ(place.row_y, -3.0 / 3600);
    constexpr double kSecond = 4.84813681109536e-6;
    dem.ground_unit = 0;
    dem.step_x = 2.908882e-5;  // a resolution has seven digits
    dem.step_y = 1.454441e-5;
    for (Profile& p : dem.profiles) {
        p.x *= kSecond;
        p.y *= kSecond;
    }
    place = place_of(directory, dem);
    EXPECT_NEAR(place.first_x, -122, 1e-12);
    EXPECT_NEAR(place.first_y, 46 + 9.0 / 3600, 1e-8);
    EXPECT_NEAR(place.column_x, 6.0 / 3600, 1e-9);
    dem = small();
    dem.ground_unit = 1;
    place = place_of(directory, dem);
    EXPECT_DOUBLE_EQ(place.first_x, 560010 * 0.3048);
    EXPECT_DOUBLE_EQ(place.first_y, 5100030 * 0.3048);
    EXPECT_DOUBLE_EQ(place.column_x, 30 * 0.3048);
    EXPECT_DOUBLE_EQ(place.row_y, -30 * 0.3048);
}

TEST(UsgsDem, DatumAndZoneNameTheCrs) {
    const TempDirectory directory;
    const struct {
        int system, zone;
        const char *datums, *crs, *vertical;
    } cases[] = {{1, 10, "    ", "EPSG:26710", ""},
                 {1, 10, " 0 0", "EPSG:26710", ""},
                 {1, 22, " 1 1", "EPSG:26722", ""},
                 {1, 60, " 2 1", "EPSG:3371", "EPSG:7968"},
                 {1, 7, " 3 2", "EPSG:32207", "EPSG:5703"},
                 {1, -7, "   2", "EPSG:32307", ""},
                 {1, 33, "   3", "EPSG:32633", ""},
                 {1, -33, "   3", "EPSG:32733", ""},
                 {1, 23, "   4", "EPSG:26923", ""},
                 {1, 59, "   4", "EPSG:3372", ""},
                 {1, 30, "   4", "", ""},
                 {1, -10, "   1", "", ""},
                 {1, 4, "   5", "", ""},
                 {0, 0, "   1", "EPSG:4267", ""},
                 {0, 0, "   2", "EPSG:4322", ""},
                 {0, 0, "   3", "EPSG:4326", ""},
                 {0, 0, "   4", "EPSG:4269", ""},
                 {0, 0, "   6", "", ""}};
    for (const auto& c : cases) {
        Dem dem = small();
        dem.system = c.system;
        dem.zone = c.zone;
        dem.ground_unit = c.system == 0 ? 3 : 2;
        dem.datums = c.datums;
        for (const Ends ends : {Ends::padded, Ends::lines}) {
            const auto source = test::open_grid_or_fail(directory.write("a.dem", file_of(dem, ends)));
            ASSERT_NE(source, nullptr);
            EXPECT_EQ(source->georeference()->crs, c.crs) << c.zone << c.datums;
            EXPECT_EQ(source->georeference()->vertical_datum, c.vertical);
        }
    }
}

TEST(UsgsDem, StatePlaneZonesAreReadWhereNumberDatumAndUnitSayWhichCrsTheyAre) {
    const TempDirectory directory;
    const struct {
        int zone, unit;
        const char *datums, *crs;
        double metres_per_unit;
    } read[] = {{401, 1, "   1", "EPSG:26741", 1200.0 / 3937},  // California I
                {401, 2, "   4", "EPSG:26941", 1},
                {503, 1, "    ", "EPSG:26755", 1200.0 / 3937},  // Colorado South
                {4601, 2, "   4", "EPSG:32148", 1},             // Washington North
                {5001, 1, "   1", "EPSG:26731", 1200.0 / 3937}};
    for (const auto& c : read) {
        Dem dem = small();
        dem.system = 2;
        dem.zone = c.zone;
        dem.ground_unit = c.unit;
        dem.datums = c.datums;
        const Georeference place = place_of(directory, dem);
        EXPECT_EQ(place.crs, c.crs);
        EXPECT_EQ(place.column_x, 30);
        EXPECT_EQ(place.first_x, 560010);
        const auto crs = Crs::parse(place.crs);
        ASSERT_TRUE(crs);
        EXPECT_DOUBLE_EQ(crs->metres_per_unit(), c.metres_per_unit);
    }
    // Metres on NAD27, feet on NAD83 (which differ by state), a number of no zone, another datum.
    for (const auto& [zone, unit, datums] :
         {std::tuple{401, 2, "   1"}, {401, 1, "   4"}, {390, 2, "   4"}, {401, 2, "   3"}, {-401, 1, "   1"}}) {
        Dem dem = small();
        dem.system = 2;
        dem.zone = zone;
        dem.ground_unit = unit;
        dem.datums = datums;
        test::expect_refusal(directory.write("a.dem", file_of(dem)), fmt::format("state plane zone {}", zone));
    }
}

TEST(UsgsDem, EveryStatePlaneZoneThatIsKnownIsOneOfItsDatumAndUnit) {
    int known = 0;
    for (int zone = -1; zone < 10000; ++zone)
        for (const bool nad27 : {true, false}) {
            const int epsg = nad27 ? epsg_of_state_plane_nad27(zone) : epsg_of_state_plane_nad83(zone);
            if (epsg == 0) continue;
            ++known;
            const auto crs = Crs::parse(fmt::format("EPSG:{}", epsg));
            ASSERT_TRUE(crs) << zone;
            EXPECT_EQ(crs->name().substr(0, 5), nad27 ? "NAD27" : "NAD83") << zone << ": " << crs->name();
            EXPECT_DOUBLE_EQ(crs->metres_per_unit(), nad27 ? 1200.0 / 3937 : 1) << zone << ": " << crs->name();
        }
    EXPECT_GT(known, 230);
}

TEST(UsgsDem, FilesThatEndTheirHeaderBeforeItsDatumAreOfNad27) {
    const TempDirectory directory;
    const Dem dem = rectangle(5, 9);
    const std::string profiles = file_of(dem).substr(1024);
    for (const char* end : {"", "\n", "\r\n"}) {
        const auto source =
            test::open_grid_or_fail(directory.write("a.dem", record_a(dem).substr(0, 864) + end + profiles));
        ASSERT_NE(source, nullptr);
        EXPECT_EQ(source->georeference()->crs, "EPSG:26710");
        test::expect_surface(*source);
    }
}

TEST(UsgsDem, WhatFollowsTheLastProfileIsPassedOver) {
    const TempDirectory directory;
    std::string statistics = "     1     0     0     7    30     0     0     7    30";
    statistics.resize(1024, ' ');
    const auto source = test::open_grid_or_fail(directory.write("a.dem", file_of(rectangle(5, 9)) + statistics));
    ASSERT_NE(source, nullptr);
    test::expect_surface(*source);
}

TEST(UsgsDem, SystemsAndUnitsThatAreNotKnownAreRefused) {
    const TempDirectory directory;
    const auto refuse = [&](auto change, const char* words) {
        Dem dem = small();
        change(dem);
        test::expect_refusal(directory.write("a.dem", file_of(dem)), words);
    };
    refuse([](Dem& d) { d.system = 2; }, "state plane zone 10 on datum 1, in metres");
    refuse([](Dem& d) { d.system = 7; }, "ground reference system");
    refuse([](Dem& d) { d.pattern = 2; }, "scattered");
    refuse([](Dem& d) { d.zone = 0; }, "zone");
    refuse([](Dem& d) { d.zone = 61; }, "zone");
    refuse([](Dem& d) { d.zone = -61; }, "zone");
    refuse([](Dem& d) { d.ground_unit = 3; }, "ground unit");
    refuse([](Dem& d) { d.system = 0; }, "ground unit");
    refuse([](Dem& d) { d.height_unit = 0; }, "elevation unit");
    refuse([](Dem& d) { d.height_unit = 3; }, "elevation unit");
    refuse([](Dem& d) { d.angle = 0.1; }, "turned");
    refuse([](Dem& d) { d.step_x = 0; }, "resolution in x");
    refuse([](Dem& d) { d.step_y = -30; }, "resolution in y");
    refuse([](Dem& d) { d.step_z = 1e9; }, "resolution in z");
    refuse([](Dem& d) { d.counted = 0; }, "'     0' profiles");
}

TEST(UsgsDem, CountsAndPlacesThatLieAreRefused) {
    const TempDirectory directory;
    const auto refuse = [&](auto change, const char* words) {
        Dem dem = rectangle(3, 4);
        change(dem);
        test::expect_refusal(directory.write("a.dem", file_of(dem)), words);
    };
    refuse([](Dem& d) { d.counted = 4; }, "profile 4 of 4: the file ends");
    refuse([](Dem& d) { d.counted = 999999; }, "profile 4 of 999999: the file ends");
    refuse([](Dem& d) { d.counted = 2; }, "another one follows");
    refuse([](Dem& d) { d.profiles[1].x = 560055; }, "beside the grid");
    refuse([](Dem& d) { d.profiles[1].y = 5100013; }, "beside the grid");
    refuse([](Dem& d) { d.profiles[1].x = 560010; }, "0 columns from");
    refuse([](Dem& d) { d.profiles[1].x = 559980; }, "columns from");
    refuse([](Dem& d) { d.profiles[1].x = 560010 + 30 * 17; }, "columns from");
    refuse([](Dem& d) { d.profiles[1].y = 1e300; }, "too far");
    refuse([](Dem& d) { d.profiles[1].y = 30 * 60e6; }, "samples");
    refuse([](Dem& d) { d.profiles[1].local_datum = 1e10; }, "datum");
    std::string file = file_of(rectangle(3, 4));
    const auto changed = [&](std::size_t at, const char* text) {
        return directory.write("b.dem", std::string(file).replace(at, std::strlen(text), text));
    };
    test::expect_refusal(changed(2048 + 6, "     7"), "it says that it is profile 7");
    test::expect_refusal(changed(2048 + 12, "     0"), "which cannot be");
    test::expect_refusal(changed(2048 + 18, "     2"), "which cannot be");
    test::expect_refusal(changed(2048 + 12, "     3"), "profile 3 of 3");
    test::expect_refusal(changed(2048 + 12, "     5"), "of 5");
    test::expect_refusal(changed(2048 + 12, "999999"), "value");
    test::expect_refusal(changed(2048 + 24, "                     nan"), "cannot be");
    test::expect_refusal(changed(2048 + 144, "   1.5"), "'1.5' is no integer");
    test::expect_refusal(changed(2048 + 150, "   15 "), "field of 6");
    test::expect_refusal(changed(816, "        -inf"), "resolution in x");
}

TEST(UsgsDem, WhatIsNoUsgsDemIsRefused) {
    const TempDirectory directory;
    test::expect_refusal(directory.write("a.dem", "hello"), "no USGS DEM");
    test::expect_refusal(directory.write("a.dem", std::string(5000, 'x')), "no USGS DEM");
    test::expect_refusal(directory.write("a.dem", std::string(5000, ' ')), "no USGS DEM");
    test::expect_refusal(directory.write("a.dem", file_of(small()).substr(0, 1024)), "no profile follows");
    test::expect_refusal(directory.write("a.dem", file_of(small()).substr(0, 1024) + std::string(1 << 20, '7')),
                         "no profile follows");
    std::string run = file_of(small());
    run.replace(1024 + 144, 12, "");
    run.insert(1024 + 144, std::string(1 << 20, '7'));
    test::expect_refusal(directory.write("a.dem", run), "is no number");
}

TEST(UsgsDem, NoPrefixIsMisread) {
    const TempDirectory directory;
    for (const Ends ends : {Ends::padded, Ends::crlf_lines, Ends::none}) {
        directory.write("a.dem", file_of(rectangle(3, 4), ends));
        test::expect_no_prefix_misread(directory, "a.dem");
        const std::string whole = file_of(rectangle(3, 4), ends);
        const std::size_t end = whole.find_last_of("0123456789") + 1;
        test::expect_refusal(directory.write("b.dem", std::string_view(whole).substr(0, end - 1)), "field of 6");
    }
}

TEST(UsgsDemOfRealFiles, ReadsAsGdalDoes) {
    const TempDirectory directory;
    SCREE_DATA_OR_SKIP(path, "formats/SainteHelens.dem");
    const auto source = test::open_grid_or_fail(path);
    ASSERT_NE(source, nullptr);
    EXPECT_EQ(source->info().width, 327);
    EXPECT_EQ(source->info().height, 466);
    EXPECT_EQ(source->georeference()->crs, "EPSG:26710");
    EXPECT_EQ(source->georeference()->first_x, 557820);
    EXPECT_EQ(source->georeference()->first_y, 5121960);
    const std::vector<double> by_gdal = test::read_by_gdal(directory, path);
    if (by_gdal.empty()) GTEST_SKIP() << "needs gdal_translate";
    // GDAL's box is that of the corners, which no profile reaches: a row of voids more at either end.
    const std::vector<double> voids(327, kVoid);
    std::vector<double> values = test::read_all(*source);
    values.insert(values.begin(), voids.begin(), voids.end());
    values.insert(values.end(), voids.begin(), voids.end());
    EXPECT_TRUE(values == by_gdal);
}

// Another writer's idea of the format, in the form with all elements of record A and heights in tenths.
TEST(UsgsDemOfRealFiles, ReadsWhatGdalWrites) {
    const TempDirectory directory;
    const std::string asc = directory.write(
        "a.asc",
        "ncols 3\nnrows 4\nxllcenter -122.5\nyllcenter 46.25\ncellsize 0.00083333333333333\nNODATA_value "
        "-32767\n1 2 3\n4 -32767 6\n7 8 9\n10 11 2543\n");
    const std::string dem = directory.path("a.dem");
    const std::string command = "gdal_translate -q -a_srs EPSG:4269 -ot Int16 -of USGSDEM -co ZRESOLUTION=1.0 '" + asc +
                                "' '" + dem + "' >/dev/null 2>&1";
    if (std::system(command.c_str()) != 0) GTEST_SKIP() << "needs gdal_translate";
    const auto source = test::open_grid_or_fail(dem);
    ASSERT_NE(source, nullptr);
    EXPECT_EQ(source->georeference()->crs, "EPSG:4269");
    EXPECT_NEAR(source->georeference()->first_x, -122.5, 1e-9);
    EXPECT_NEAR(source->georeference()->first_y, 46.2525, 1e-9);
    EXPECT_EQ(test::read_all(*source), std::vector<double>({1, 2, 3, 4, kVoid, 6, 7, 8, 9, 10, 11, 2543}));
}

}  // namespace
}  // namespace scree
