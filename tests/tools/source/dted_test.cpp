#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/tools/source/grid_test_support.h"

namespace scree {
namespace {

using test::TempDirectory;

constexpr std::int64_t kColumns = 21;
constexpr std::int64_t kRows = 31;
constexpr std::size_t kFirstRecord = 80 + 648 + 2700;
constexpr std::size_t kRecord = 8 + 2 * kRows + 4;

std::string labels(const char* longitude = "0015930E", const char* latitude = "0101500S") {
    std::string uhl =
        fmt::format("UHL1{}{}{:04}{:04}0030U  {:12}{:04}{:04}0", longitude, latitude, 1800, 1200, "", kColumns, kRows);
    uhl.resize(80, ' ');
    std::string text = uhl + "DSIU";
    text.resize(80 + 648, ' ');
    text += "ACC";
    text.resize(kFirstRecord, ' ');
    return text;
}

void append_record(std::string& file, std::int64_t column, const std::vector<std::uint16_t>& south_to_north) {
    std::string record("\xAA\0\0\0", 4);
    record[3] = static_cast<char>(column);
    test::append(record, static_cast<std::uint16_t>(column), true);
    test::append(record, std::uint16_t{0}, true);
    for (const std::uint16_t stored : south_to_north) test::append(record, stored, true);
    std::uint32_t sum = 0;
    for (const char c : record) sum += static_cast<unsigned char>(c);
    test::append(record, sum, true);
    file += record;
}

std::uint16_t sign_and_magnitude(int value) { return static_cast<std::uint16_t>(value < 0 ? 0x8000 | -value : value); }

std::string cell() {
    std::string file = labels();
    for (std::int64_t column = 0; column < kColumns; ++column) {
        std::vector<std::uint16_t> stored;
        for (std::int64_t row = kRows - 1; row >= 0; --row)
            stored.push_back(sign_and_magnitude(test::sample_at(row, column)));
        append_record(file, column, stored);
    }
    return file;
}

TEST(Dted, ValuesPlaceAndVoidAreExact) {
    const TempDirectory directory;
    const auto source = test::open_grid_or_fail(directory.write("a.dt1", cell()));
    ASSERT_NE(source, nullptr);
    EXPECT_EQ(source->info().width, kColumns);
    EXPECT_EQ(source->info().height, kRows);
    EXPECT_EQ(source->info().type, SampleType::i16);
    EXPECT_EQ(source->info().nodata, -32767.0);
    const Georeference& place = *source->georeference();
    EXPECT_DOUBLE_EQ(place.first_x, 1 + 59.0 / 60 + 30.0 / 3600);
    EXPECT_DOUBLE_EQ(place.first_y, -10.25 + 1200 * 30 / 36000.0);
    EXPECT_DOUBLE_EQ(place.column_x, 0.05);
    EXPECT_DOUBLE_EQ(place.row_y, -1.0 / 30);
    EXPECT_TRUE(place.raster_is_point);
    EXPECT_EQ(place.crs, "EPSG:4326");
    EXPECT_EQ(place.vertical_datum, "EPSG:5773");
    test::expect_surface(*source);
}

TEST(Dted, SignsAreReadAsMagnitudesAndAsTwosComplementWhereNoGroundIsSoLow) {
    const TempDirectory directory;
    std::string file = labels();
    for (std::int64_t column = 0; column < kColumns; ++column) {
        std::vector<std::uint16_t> stored(kRows, 0);
        stored[0] = 0xFFFF;  // void
        stored[1] = 0x8000;  // minus zero
        stored[2] = 0x8001;
        stored[3] = 0xFFFE;  // -2 in two's complement; -32766 otherwise
        stored[4] = 0x8000 | 16000;
        stored[5] = 9000;
        append_record(file, column, stored);
    }
    const auto source = test::open_grid_or_fail(directory.write("a.dt0", file));
    ASSERT_NE(source, nullptr);
    const std::vector<double> values = test::read_all(*source);
    const auto from_south = [&](std::int64_t i) {
        return values[static_cast<std::size_t>((kRows - 1 - i) * kColumns)];
    };
    EXPECT_EQ(from_south(0), -32767);
    EXPECT_EQ(from_south(1), 0);
    EXPECT_EQ(from_south(2), -1);
    EXPECT_EQ(from_south(3), -2);
    EXPECT_EQ(from_south(4), -16000);
    EXPECT_EQ(from_south(5), 9000);
}

TEST(Dted, TapeLabelsBeforeTheHeaderArePassedOver) {
    const TempDirectory directory;
    std::string tape = "VOL1";
    tape.resize(80, ' ');
    tape += "HDR1";
    tape.resize(160, ' ');
    const auto source = test::open_grid_or_fail(directory.write("tape", tape + cell()));
    ASSERT_NE(source, nullptr);
    test::expect_surface(*source);
}

TEST(Dted, AnyDamagedByteOfTheRecordsIsFound) {
    const TempDirectory directory;
    const std::string whole = cell();
    for (const std::size_t at : {kFirstRecord, kFirstRecord + 5, kFirstRecord + 3 * kRecord + 20,
                                 kFirstRecord + 4 * kRecord - 1, whole.size() - 1}) {
        std::string damaged = whole;
        damaged[at] = static_cast<char>(damaged[at] ^ 1);
        test::expect_refusal(directory.write("a.dt2", damaged), "damaged");
    }
    std::string changed = whole;
    changed[kFirstRecord + 3 * kRecord + 20] = static_cast<char>(changed[kFirstRecord + 3 * kRecord + 20] ^ 1);
    test::expect_refusal(directory.write("a.dt2", changed), "column 3: its bytes add up to");
}

TEST(Dted, HeadersThatCannotBeAreRefused) {
    const TempDirectory directory;
    const std::string records = cell().substr(kFirstRecord);
    test::expect_refusal(directory.write("a.dt1", labels("0015930X") + records), "no longitude and latitude");
    test::expect_refusal(directory.write("a.dt1", labels("9995930E") + records), "no longitude and latitude");
    test::expect_refusal(directory.write("a.dt1", "hello"), "no DTED file");
    test::expect_refusal(directory.write("a.dt1", std::string(5000, 'x')), "UHL");
    std::string sides = cell();
    sides.replace(47, 4, "9999");
    test::expect_refusal(directory.write("a.dt1", sides), "cut off");
    sides.replace(47, 4, "0000");
    test::expect_refusal(directory.write("a.dt1", sides), "cannot be");
    std::string step = cell();
    step.replace(20, 4, "NA  ");
    test::expect_refusal(directory.write("a.dt1", step), "cannot be");
}

TEST(Dted, NoPrefixIsMisread) {
    const TempDirectory directory;
    directory.write("a.dt1", cell());
    test::expect_no_prefix_misread(directory, "a.dt1");
}

TEST(DtedOfRealFiles, ReadsAsGdalDoes) {
    const TempDirectory directory;
    for (const char* name : {"n18_w156", "n19_w155", "n20_w156"}) {
        SCREE_DATA_OR_SKIP(path, std::string("dted_hawaii/") + name + "_3arc_v2.dt1");
        SCREE_EXPECT_AS_GDAL_OR_SKIP(directory, path);
    }
}

}  // namespace
}  // namespace scree
