#include "tools/source/suspect_values.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <limits>
#include <vector>

namespace scree {
namespace {

ImageInfo info_of(SampleType type, std::optional<double> tag = {}) {
    ImageInfo info;
    info.type = type;
    info.nodata = tag;
    return info;
}

std::optional<std::string> warning_of(const ImageInfo& info, const std::vector<double>& values,
                                      std::optional<double> user = {}) {
    HeightReading reading;
    reading.nodata = user;
    SuspectValues suspects(info, reading);
    suspects.add(values);
    return suspects.warning("a.tif");
}

// One value after the other, by the header's words: what stands in the middle of many must not be passed over.
TEST(SuspectValues, AreFoundWhereverTheyStand) {
    for (const std::size_t size : {1u, 3u, 8u, 1023u, 1024u, 1025u, 5000u})
        for (std::size_t at = 0; at < size; at += size < 100 ? 1 : size / 13) {
            std::vector<double> values(size, 12.5);
            for (std::size_t i = 0; i < size; i += 5) values[i] = std::numeric_limits<double>::quiet_NaN();
            values[at] = -32767;
            EXPECT_TRUE(warning_of(info_of(SampleType::f32), values)) << size << ", " << at;
            SuspectValues suspects(info_of(SampleType::f32), {});
            suspects.add(std::vector<float>(values.begin(), values.end()));
            EXPECT_EQ(suspects.warning("a.tif"), warning_of(info_of(SampleType::f32), values)) << size << ", " << at;
            values[(at + size / 2) % size] = -32700;  // ground beside it, unless it is the same sample
            EXPECT_FALSE(warning_of(info_of(SampleType::f32), values)) << size << ", " << at;
        }
}

TEST(SuspectValues, NamesFileCountValueAndRemedy) {
    std::vector<double> values(1234567, -32767);
    values.push_back(12);
    EXPECT_EQ(warning_of(info_of(SampleType::i16), values),
              "a.tif: 1,234,567 samples are -32767 and no nodata value is declared; if they are voids say --nodata "
              "-32767");
    EXPECT_EQ(warning_of(info_of(SampleType::f32), {3, -9999, 4}),
              "a.tif: 1 sample is -9999 and no nodata value is declared; if it is a void say --nodata -9999");
}

TEST(SuspectValues, EveryMarkerOfTheTypeIsSuspect) {
    const auto accused = [](SampleType type, double value) {
        return warning_of(info_of(type), {1, value, 2}).has_value();
    };
    for (const double v : {-32768.0, -32767.0, -9999.0, 32767.0}) EXPECT_TRUE(accused(SampleType::i16, v)) << v;
    EXPECT_TRUE(accused(SampleType::u16, 65535));
    EXPECT_TRUE(accused(SampleType::i32, std::numeric_limits<std::int32_t>::min()));
    EXPECT_TRUE(accused(SampleType::u32, std::numeric_limits<std::uint32_t>::max()));
    EXPECT_TRUE(accused(SampleType::f32, static_cast<double>(std::numeric_limits<float>::lowest())));
    EXPECT_TRUE(accused(SampleType::f32, static_cast<double>(1.70141e38f)));
    EXPECT_TRUE(accused(SampleType::f64, std::numeric_limits<double>::max()));
    EXPECT_TRUE(accused(SampleType::f16, -65504));
    EXPECT_FALSE(accused(SampleType::u8, 255));
    EXPECT_FALSE(accused(SampleType::u16, 0));
    EXPECT_FALSE(accused(SampleType::i16, -9998));
}

TEST(SuspectValues, DeclaredValuesAreNot) {
    EXPECT_FALSE(warning_of(info_of(SampleType::i16, -32767.0), {1, -32767, 2}));
    EXPECT_FALSE(warning_of(info_of(SampleType::i16), {1, -32767, 2}, -32767.0));
    EXPECT_FALSE(warning_of(info_of(SampleType::f32), {1, static_cast<double>(1.70141e38f)}, 1.70141e38));
    EXPECT_EQ(warning_of(info_of(SampleType::i16, -9999.0), {1, -9999, -32768}),
              "a.tif: 1 sample is -32768 and the declared nodata value is -9999; if it is a void say --nodata -32768");
}

TEST(SuspectValues, RealGroundAroundAValueClearsIt) {
    EXPECT_FALSE(warning_of(info_of(SampleType::f32), {-9999, -9950.5, -4000})) << "an ocean trench";
    EXPECT_FALSE(warning_of(info_of(SampleType::u16), {65535, 65435, 4})) << "a saturated sensor";
    EXPECT_TRUE(warning_of(info_of(SampleType::u16), {65535, 65434, 4}));
    EXPECT_TRUE(warning_of(info_of(SampleType::i16, -32768.0), {-32768, -32767, 4})) << "a declared void is no ground";
    EXPECT_EQ(warning_of(info_of(SampleType::i16), {-32768, -32767, -32767, 4}),
              "a.tif: 2 samples are -32767 and no nodata value is declared; if they are voids say --nodata -32767")
        << "nor is another suspect";
}

TEST(SuspectValues, VoidsOfOtherKindsDoNotMatter) {
    EXPECT_FALSE(warning_of(info_of(SampleType::f32),
                            {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(),
                             -std::numeric_limits<double>::infinity(), 7}));
}

std::optional<std::string> warning_of_file(const std::string& path) {
    auto dem = ImageSource::open(path);
    if (!dem) return dem.error().message;
    const ImageInfo& info = (*dem)->info();
    SuspectValues suspects(info, {});
    std::vector<double> row(static_cast<std::size_t>(info.width));
    for (std::int64_t j = 0; j < info.height; ++j) {
        EXPECT_TRUE((*dem)->read_channel(j, j + 1, std::span<double>(row)));
        suspects.add(row);
    }
    return suspects.warning("DEM");
}

TEST(SuspectValues, CraterLakeLacksItsTagAndFujiHasOne) {
    const char* root = std::getenv("SCREE_DATA");
    if (root == nullptr) GTEST_SKIP() << "needs the folder that $SCREE_DATA names";
    EXPECT_EQ(warning_of_file(std::string(root) + "/craterlake/craterlake-elev-16bit-30m.tif"),
              "DEM: 39,489 samples are -32767 and no nodata value is declared; if they are voids say --nodata -32767");
    EXPECT_EQ(warning_of_file(std::string(root) + "/srtm_void/mt_fuji_90m.tif"), std::nullopt);
    EXPECT_EQ(warning_of_file(std::string(root) + "/puget/ps_height_1k.png"), std::nullopt);
}

}  // namespace
}  // namespace scree
