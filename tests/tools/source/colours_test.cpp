// What the samples of a file look like: goldens computed by hand from the formats' own definitions.
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/tools/source/temp_directory.h"
#include "tests/tools/source/test_tiff.h"
#include "tools/source/colour_reading.h"
#include "tools/source/image_source.h"

namespace scree {
namespace {

using test::layout_of;
using test::TempDirectory;
using test::TestTiff;
using Bytes = std::vector<std::uint8_t>;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

/// A TIFF in a folder of its own, opened anew for every question.
class Written {
public:
    Written(const TestTiff& layout, const void* samples) { EXPECT_TRUE(test::write_tiff(path(), layout, samples)); }
    std::string path() const { return directory_.path("x.tif"); }
    Result<std::unique_ptr<ImageSource>> open(const OpenOptions& options = {}) const {
        return ImageSource::open(path(), options);
    }
    Bytes rgba(const ColourReading& reading = {}) const {
        OpenOptions options;
        options.colours = reading;
        const auto source = open(options);
        EXPECT_TRUE(source.ok()) << source.error().message;
        if (!source) return {};
        const ImageInfo& info = (*source)->info();
        Bytes out(static_cast<std::size_t>(info.width * info.height * 4));
        const auto read = (*source)->read_rgba8(0, info.height, out);
        EXPECT_TRUE(read.ok()) << read.error().message;
        return out;
    }
    std::vector<double> values(int band = 1) const {
        OpenOptions options;
        options.height_band = band;
        const auto source = open(options);
        EXPECT_TRUE(source.ok()) << source.error().message;
        if (!source) return {};
        const ImageInfo& info = (*source)->info();
        std::vector<double> out(static_cast<std::size_t>(info.width * info.height));
        const auto read = (*source)->read_channel(0, info.height, std::span<double>(out));
        EXPECT_TRUE(read.ok()) << read.error().message;
        return out;
    }

private:
    TempDirectory directory_;
};

template <class T>
TestTiff row_of(std::uint32_t width, int channels) {
    TestTiff layout = layout_of<T>(width, 1);
    layout.channels = channels;
    return layout;
}

ColourReading stretched(double low, double high) {
    ColourReading reading;
    reading.stretch = Stretch{low, high};
    return reading;
}

TEST(Bands, AreShownInTheOrderNamed) {
    const Bytes samples = {1, 2, 3, 4, 5, 11, 12, 13, 14, 15};
    TestTiff layout = row_of<std::uint8_t>(2, 5);
    layout.photometric = PHOTOMETRIC_MINISBLACK;
    const Written file(layout, samples.data());
    EXPECT_EQ(file.rgba(), (Bytes{1, 2, 3, 255, 11, 12, 13, 255}));
    ColourReading reading;
    reading.bands = {5, 1, 4};
    EXPECT_EQ(file.rgba(reading), (Bytes{5, 1, 4, 255, 15, 11, 14, 255}));
    reading.bands = {4};
    EXPECT_EQ(file.rgba(reading), (Bytes{4, 4, 4, 255, 14, 14, 14, 255}));
}

TEST(Bands, ThatTheFileDoesNotHaveAreRefusedWithThoseItHas) {
    const Bytes samples(15);
    const Written file(row_of<std::uint8_t>(5, 3), samples.data());
    for (const std::vector<int>& bands : std::vector<std::vector<int>>{{1, 2, 4}, {0}, {1, 2}}) {
        OpenOptions options;
        options.colours.bands = bands;
        const auto opened = file.open(options);
        ASSERT_FALSE(opened.ok());
        EXPECT_EQ(opened.error().code, ErrorCode::usage);
        const bool named = opened.error().message.find("bands 1 to 3") != std::string::npos;
        EXPECT_EQ(named, bands.size() != 2) << opened.error().message;
    }
    OpenOptions options;
    options.height_band = 4;
    ASSERT_FALSE(file.open(options).ok());
    EXPECT_NE(file.open(options).error().message.find("bands 1 to 3"), std::string::npos);
}

TEST(Bands, AFourthBandIsAlphaOnlyWhereTheFileSaysSo) {
    const std::vector<float> samples = {0, 0.5f, 1, 0};
    const Written file(row_of<float>(1, 4), samples.data());
    EXPECT_EQ(file.rgba(), (Bytes{0, 128, 255, 255}));
}

TEST(StretchedColours, AreLinearAndClamped) {
    const std::vector<std::uint16_t> samples = {0, 100, 101, 200, 300, 65535};
    const Written file(row_of<std::uint16_t>(6, 1), samples.data());
    const Bytes rgba = file.rgba(stretched(100, 300));
    const Bytes expected = {0, 0, 1, 128, 255, 255};  // 127.5 rounds up
    for (std::size_t i = 0; i < 6; ++i) {
        EXPECT_EQ(rgba[4 * i], expected[i]) << samples[i];
        EXPECT_EQ(rgba[4 * i + 2], expected[i]);
        EXPECT_EQ(rgba[4 * i + 3], 255);
    }
}

TEST(StretchedColours, OfFloatsAreTransparentWhereNan) {
    const std::vector<float> samples = {-1e30f, 10, 15, 20, std::numeric_limits<float>::infinity(), kNan};
    const Written file(row_of<float>(6, 1), samples.data());
    const Bytes rgba = file.rgba(stretched(10, 20));
    const Bytes levels = {0, 0, 128, 255, 255};
    for (std::size_t i = 0; i < 5; ++i) {
        EXPECT_EQ(rgba[4 * i], levels[i]);
        EXPECT_EQ(rgba[4 * i + 3], 255);
    }
    EXPECT_EQ(rgba[23], 0);
    EXPECT_EQ(file.rgba()[23], 0);
}

TEST(StretchedColours, OfOneNanAmongThreeBandsAreTransparent) {
    const std::vector<double> samples = {0, kNan, 1, 0, 0, 1};
    const Written file(row_of<double>(2, 3), samples.data());
    const Bytes rgba = file.rgba();
    EXPECT_EQ(rgba[3], 0);
    EXPECT_EQ(Bytes(rgba.begin() + 4, rgba.end()), (Bytes{0, 0, 255, 255}));
}

TEST(StretchedColours, OfEightBitsAreSparedWhenTheStretchSaysSo) {
    const Bytes samples = {10, 20, 40};
    const Written file(row_of<std::uint8_t>(3, 1), samples.data());
    ColourReading reading = stretched(10, 40);
    const Bytes all = file.rgba(reading);
    EXPECT_EQ((Bytes{all[0], all[4], all[8]}), (Bytes{0, 85, 255}));
    reading.stretch->spares_8bit = true;
    const Bytes spared = file.rgba(reading);
    EXPECT_EQ((Bytes{spared[0], spared[4], spared[8]}), samples);
}

TEST(StretchedColours, ThatAreNoRangeAreRefused) {
    const Bytes samples(3);
    const Written file(row_of<std::uint8_t>(3, 1), samples.data());
    for (const Stretch stretch : {Stretch{5, 5}, Stretch{5, 4}, Stretch{kNan, 4}, Stretch{0, INFINITY}}) {
        OpenOptions options;
        options.colours.stretch = stretch;
        ASSERT_FALSE(file.open(options).ok());
        EXPECT_EQ(file.open(options).error().code, ErrorCode::usage);
    }
}

TEST(Nodata, MakesTransparentWhereAllShownBandsHoldIt) {
    const Bytes samples = {7, 7, 7, 7, 7, 8, 9, 9, 9};
    TestTiff layout = row_of<std::uint8_t>(3, 3);
    layout.nodata = "7";
    const Written file(layout, samples.data());
    EXPECT_EQ(file.rgba(), (Bytes{7, 7, 7, 0, 7, 7, 8, 255, 9, 9, 9, 255}));
    ColourReading reading;
    reading.nodata = 9;
    EXPECT_EQ(file.rgba(reading), (Bytes{7, 7, 7, 0, 7, 7, 8, 255, 9, 9, 9, 0}));
    reading.bands = {1, 2, 1};
    EXPECT_EQ(file.rgba(reading)[7], 0);  // the band that differs is not shown
}

TEST(Nodata, IsComparedAsThePixelHoldsIt) {
    const std::vector<float> samples = {0.1f, 1};
    const Written file(row_of<float>(2, 1), samples.data());
    ColourReading reading;
    reading.nodata = 0.1;
    EXPECT_EQ(file.rgba(reading)[3], 0);
    EXPECT_EQ(file.rgba(reading)[7], 255);
}

TEST(Types, AreScaledOverTheirRange) {
    const std::vector<std::uint32_t> wide = {0, 2147483648u, 4294967295u};
    EXPECT_EQ(Written(row_of<std::uint32_t>(1, 3), wide.data()).rgba(), (Bytes{0, 128, 255, 255}));
    const std::vector<std::int16_t> of_sign = {-5, 16384, 32767};
    EXPECT_EQ(Written(row_of<std::int16_t>(1, 3), of_sign.data()).rgba(), (Bytes{0, 128, 255, 255}));
    const std::vector<double> real = {-1, 0.25, 7};
    EXPECT_EQ(Written(row_of<double>(1, 3), real.data()).rgba(), (Bytes{0, 64, 255, 255}));
}

TEST(RgbRows, OfEveryWidthKeepTheirBytes) {
    for (std::uint32_t width = 1; width < 14; ++width) {
        Bytes samples(width * 3);
        for (std::size_t i = 0; i < samples.size(); ++i) samples[i] = static_cast<std::uint8_t>(i * 37 + 200);
        const Bytes rgba = Written(row_of<std::uint8_t>(width, 3), samples.data()).rgba();
        for (std::size_t x = 0; x < width; ++x) {
            for (std::size_t c = 0; c < 3; ++c) ASSERT_EQ(rgba[4 * x + c], samples[3 * x + c]) << width << " " << x;
            ASSERT_EQ(rgba[4 * x + 3], 255);
        }
    }
}

// Colours of index i: red 10 i, green 255 - i, blue i.
TestTiff palette_of(std::uint32_t width, int bits, int scale) {
    TestTiff layout = layout_of<std::uint8_t>(width, 1);
    layout.bits = bits;
    layout.photometric = PHOTOMETRIC_PALETTE;
    const int entries = 1 << bits;
    const auto add = [&](int value) { layout.colormap.push_back(static_cast<std::uint16_t>((value & 255) * scale)); };
    for (int i = 0; i < entries; ++i) add(10 * i);
    for (int i = 0; i < entries; ++i) add(255 - i);
    for (int i = 0; i < entries; ++i) add(i);
    return layout;
}

TEST(Palettes, OfOneToEightBitsShowTheirColours) {
    const Bytes of_one = {0b10100000};
    EXPECT_EQ(Written(palette_of(3, 1, 257), of_one.data()).rgba(),
              (Bytes{10, 254, 1, 255, 0, 255, 0, 255, 10, 254, 1, 255}));
    const Bytes of_two = {0b11011000};
    EXPECT_EQ(Written(palette_of(3, 2, 257), of_two.data()).rgba(),
              (Bytes{30, 252, 3, 255, 10, 254, 1, 255, 20, 253, 2, 255}));
    const Bytes of_four = {0xF2};
    EXPECT_EQ(Written(palette_of(2, 4, 257), of_four.data()).rgba(), (Bytes{150, 240, 15, 255, 20, 253, 2, 255}));
    const Bytes of_eight = {25, 0};
    EXPECT_EQ(Written(palette_of(2, 8, 257), of_eight.data()).rgba(), (Bytes{250, 230, 25, 255, 0, 255, 0, 255}));
    // Entries of 8 bits, which some writers stored, and of their 256-fold.
    EXPECT_EQ(Written(palette_of(2, 8, 1), of_eight.data()).rgba(), (Bytes{250, 230, 25, 255, 0, 255, 0, 255}));
    EXPECT_EQ(Written(palette_of(2, 8, 256), of_eight.data()).rgba(), (Bytes{250, 230, 25, 255, 0, 255, 0, 255}));
}

TEST(Palettes, OfSixteenBitIndicesShowTheirColours) {
    const std::vector<std::uint16_t> indices = {258, 65535};
    EXPECT_EQ(Written(palette_of(2, 16, 257), indices.data()).rgba(), (Bytes{20, 253, 2, 255, 246, 0, 255, 255}));
}

TEST(Palettes, HideTheIndexOfTheTagAndTheColourOfTheUser) {
    const Bytes indices = {3, 5};
    TestTiff layout = palette_of(2, 8, 257);
    layout.nodata = "3";
    layout.colormap[5] = layout.colormap[256 + 5] = layout.colormap[512 + 5] = 77 * 257;
    const Written file(layout, indices.data());
    EXPECT_EQ(file.rgba(), (Bytes{30, 252, 3, 0, 77, 77, 77, 255}));
    ColourReading reading;
    reading.nodata = 77;
    EXPECT_EQ(file.rgba(reading)[7], 0);
}

TEST(Palettes, CountAsThreeBands) {
    const Bytes indices = {3};
    const Written file(palette_of(1, 8, 257), indices.data());
    ColourReading reading;
    reading.bands = {3, 2, 1};
    EXPECT_EQ(file.rgba(reading), (Bytes{3, 252, 30, 255}));
    reading = stretched(0, 60);
    EXPECT_EQ(file.rgba(reading), (Bytes{128, 255, 13, 255}));
}

TEST(Palettes, AreNoHeights) {
    const Bytes indices = {3};
    const Written file(palette_of(1, 8, 257), indices.data());
    const auto source = file.open();
    ASSERT_TRUE(source.ok());
    EXPECT_TRUE((*source)->info().values_are_colours);
    float value = 0;
    const auto read = (*source)->read_channel(0, 1, std::span<float>(&value, 1));
    ASSERT_FALSE(read.ok());
    EXPECT_EQ(read.error().code, ErrorCode::input);
    EXPECT_NE(read.error().message.find("values are colours"), std::string::npos);
}

TEST(Palettes, WithoutAColourForWhatWasNeverWrittenShowNothingThere) {
    TestTiff layout = palette_of(20, 4, 257);
    layout.tile = 16;
    layout.sparse = true;
    layout.nodata = "200";  // above every index of 4 bits
    const Bytes rgba = Written(layout, nullptr).rgba();
    for (std::size_t i = 0; i < 20; ++i) EXPECT_EQ(rgba[4 * i + 3], 0);
}

TEST(Bits, OneIsWhiteOrBlackAsTheFileSays) {
    const Bytes bits = {0b01000000};
    TestTiff layout = layout_of<std::uint8_t>(2, 1);
    layout.bits = 1;
    EXPECT_EQ(Written(layout, bits.data()).rgba(), (Bytes{0, 0, 0, 255, 255, 255, 255, 255}));
    layout.photometric = PHOTOMETRIC_MINISWHITE;
    const Written inverted(layout, bits.data());
    EXPECT_EQ(inverted.rgba(), (Bytes{255, 255, 255, 255, 0, 0, 0, 255}));
    EXPECT_EQ(inverted.values(), (std::vector<double>{0, 1}));  // as stored
}

TEST(Bits, OfOddWidthsAreUnpacked) {
    const Bytes twelve = {0xFF, 0xF0, 0x01, 0x80, 0x00};  // 4095, 1, 2048
    TestTiff layout = layout_of<std::uint8_t>(3, 1);
    layout.bits = 12;
    const Written file(layout, twelve.data());
    EXPECT_EQ(file.values(), (std::vector<double>{4095, 1, 2048}));
    const Bytes rgba = file.rgba();
    EXPECT_EQ((Bytes{rgba[0], rgba[4], rgba[8]}), (Bytes{255, 0, 128}));
    layout.format = SAMPLEFORMAT_INT;
    EXPECT_EQ(Written(layout, twelve.data()).values(), (std::vector<double>{-1, 1, -2048}));
    layout = layout_of<std::uint8_t>(2, 1);
    layout.bits = 24;
    const Bytes three_bytes = {0, 0, 107, 1, 0, 0};
    EXPECT_EQ(Written(layout, three_bytes.data()).values(), (std::vector<double>{107, 65536}));
}

TEST(MinIsWhite, TurnsGreysButNotHeights) {
    const std::vector<std::uint16_t> samples = {0, 65535, 1000};
    TestTiff layout = row_of<std::uint16_t>(3, 1);
    layout.photometric = PHOTOMETRIC_MINISWHITE;
    const Written file(layout, samples.data());
    EXPECT_EQ(file.values(), (std::vector<double>{0, 65535, 1000}));
    const Bytes rgba = file.rgba(stretched(500, 1500));
    EXPECT_EQ((Bytes{rgba[0], rgba[4], rgba[8]}), (Bytes{255, 0, 128}));
}

TEST(Cmyk, IsInkOnWhite) {
    const Bytes inks = {0, 0, 0, 0, 255, 0, 0, 0, 100, 50, 0, 128};
    TestTiff layout = row_of<std::uint8_t>(3, 4);
    layout.photometric = PHOTOMETRIC_SEPARATED;
    const Written file(layout, inks.data());
    // 155 * 127 / 255 = 77, 205 * 127 / 255 = 102
    EXPECT_EQ(file.rgba(), (Bytes{255, 255, 255, 255, 0, 255, 255, 255, 77, 102, 127, 255}));
    layout.separate_planes = true;
    EXPECT_EQ(Written(layout, inks.data()).rgba(), file.rgba());
    const std::vector<std::uint16_t> deep = {100 * 257, 50 * 257, 0, 128 * 257};
    layout = row_of<std::uint16_t>(1, 4);
    layout.photometric = PHOTOMETRIC_SEPARATED;
    EXPECT_EQ(Written(layout, deep.data()).rgba(), (Bytes{77, 102, 127, 255}));
}

// 8 x 8 pixels, all of components 0, 100, 255 and 50.
const Bytes kFourComponentJpeg = {
    0xff, 0xd8, 0xff, 0xdb, 0x00, 0x43, 0x00, 0x01, 0x01, 0x01, 0x01, 0x01, 0x01, 0x01, 0x01, 0x01, 0x01, 0x01, 0x01,
    0x01, 0x01, 0x01, 0x01, 0x01, 0x01, 0x01, 0x01, 0x01, 0x01, 0x01, 0x01, 0x01, 0x01, 0x01, 0x01, 0x01, 0x01, 0x01,
    0x01, 0x01, 0x01, 0x01, 0x01, 0x01, 0x01, 0x01, 0x01, 0x01, 0x01, 0x01, 0x01, 0x01, 0x01, 0x01, 0x01, 0x01, 0x01,
    0x01, 0x01, 0x01, 0x01, 0x01, 0x01, 0x01, 0x01, 0x01, 0x01, 0x01, 0x01, 0x01, 0x01, 0xff, 0xc0, 0x00, 0x14, 0x08,
    0x00, 0x08, 0x00, 0x08, 0x04, 0x00, 0x11, 0x00, 0x01, 0x11, 0x00, 0x02, 0x11, 0x00, 0x03, 0x11, 0x00, 0xff, 0xc4,
    0x00, 0x16, 0x00, 0x01, 0x01, 0x01, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00,
    0x0a, 0x08, 0x0b, 0xff, 0xc4, 0x00, 0x14, 0x10, 0x01, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00,
    0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0xff, 0xda, 0x00, 0x0e, 0x04, 0x00, 0x00, 0x01, 0x00, 0x02, 0x00, 0x03, 0x00,
    0x00, 0x3f, 0x00, 0xcf, 0xfd, 0x0f, 0x9f, 0xc0, 0xc7, 0xbf, 0xff, 0xd9};

std::string jpeg_with_marker(std::uint8_t transform) {
    const Bytes adobe = {0xFF, 0xEE, 0, 14, 'A', 'd', 'o', 'b', 'e', 0, 100, 0, 0, 0, 0, transform};
    std::string jpeg(kFourComponentJpeg.begin(), kFourComponentJpeg.end());
    return jpeg.insert(2, std::string(adobe.begin(), adobe.end()));
}

Bytes first_pixel(const std::string& path) {
    const auto source = ImageSource::open(path);
    EXPECT_TRUE(source.ok()) << source.error().message;
    if (!source) return {};
    Bytes row(static_cast<std::size_t>((*source)->info().width * 4));
    EXPECT_TRUE((*source)->read_rgba8(0, 1, row).ok());
    row.resize(4);
    return row;
}

TEST(Cmyk, OfAnAdobeJpegIsInverted) {
    const TempDirectory directory;
    // 0 * 50 / 255, 100 * 50 / 255 = 19.6, 255 * 50 / 255
    EXPECT_EQ(first_pixel(directory.write("cmyk.jpg", jpeg_with_marker(0))), (Bytes{0, 20, 50, 255}));
    // Y 0, Cb 100, Cr 255 are inks 255 - (178, 0, 0); 77 * 50 / 255 = 15.1
    EXPECT_EQ(first_pixel(directory.write("ycck.jpg", jpeg_with_marker(2))), (Bytes{15, 50, 50, 255}));
}

TEST(Cmyk, OfAJpegWithoutTheMarkerIsRefused) {
    const TempDirectory directory;
    const std::string jpeg(kFourComponentJpeg.begin(), kFourComponentJpeg.end());
    const auto opened = ImageSource::open(directory.write("j.jpg", jpeg));
    ASSERT_FALSE(opened.ok());
    EXPECT_NE(opened.error().message.find("Adobe"), std::string::npos);
}

TEST(YCbCr, OfAJpegInATiffIsRgb) {
    TestTiff layout = layout_of<std::uint8_t>(16, 16);
    layout.channels = 3;
    layout.rows_per_strip = 16;
    layout.compression = COMPRESSION_JPEG;
    layout.photometric = PHOTOMETRIC_YCBCR;
    Bytes samples;
    for (int i = 0; i < 256; ++i) samples.insert(samples.end(), {200, 100, 50});
    const Written file(layout, samples.data());
    const Bytes rgba = file.rgba();
    for (std::size_t i = 0; i < 256; ++i) {
        EXPECT_NEAR(rgba[4 * i], 200, 3);
        EXPECT_NEAR(rgba[4 * i + 1], 100, 3);
        EXPECT_NEAR(rgba[4 * i + 2], 50, 3);
        EXPECT_EQ(rgba[4 * i + 3], 255);
    }
}

TEST(Alpha, OfSixteenBitsUnassociates) {
    const std::vector<std::uint16_t> samples = {16384, 0, 32768, 32768, 5, 6, 7, 0};
    TestTiff layout = row_of<std::uint16_t>(2, 4);
    layout.extra_sample = EXTRASAMPLE_ASSOCALPHA;
    const Written file(layout, samples.data());
    const Bytes rgba = file.rgba();
    EXPECT_EQ(Bytes(rgba.begin(), rgba.begin() + 4), (Bytes{128, 0, 255, 128}));  // a half is 127.5
    EXPECT_EQ(rgba[7], 0);
}

TEST(Alpha, MakesHeightsVoid) {
    const std::vector<std::int16_t> samples = {100, 255, 200, 0, 300, 1};
    TestTiff layout = row_of<std::int16_t>(3, 2);
    layout.extra_sample = EXTRASAMPLE_UNASSALPHA;
    const Written file(layout, samples.data());
    const std::vector<double> values = file.values();
    EXPECT_EQ(values[0], 100);
    EXPECT_TRUE(std::isnan(values[1]));
    EXPECT_EQ(values[2], 300);
    EXPECT_EQ(file.values(2), (std::vector<double>{255, 0, 1}));  // alpha itself
}

TEST(Heights, AreTheBandAskedFor) {
    const std::vector<float> samples = {1, 2, 3, 4};
    TestTiff layout = row_of<float>(2, 2);
    const Written file(layout, samples.data());
    EXPECT_EQ(file.values(), (std::vector<double>{1, 3}));
    EXPECT_EQ(file.values(2), (std::vector<double>{2, 4}));
}

TEST(Mask, MakesColoursTransparentAndHeightsVoid) {
    const Bytes samples = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12};
    TestTiff layout;
    layout.mask = {1, 0, 1, 1, 0, 0, 1, 1, 1, 1, 1, 0};
    const Written file(layout, samples.data());
    const Bytes rgba = file.rgba();
    const std::vector<double> values = file.values();
    for (std::size_t i = 0; i < 12; ++i) {
        EXPECT_EQ(rgba[4 * i], samples[i]);
        EXPECT_EQ(rgba[4 * i + 3], layout.mask[i] * 255);
        EXPECT_EQ(std::isnan(values[i]), layout.mask[i] == 0);
    }
}

TEST(Mask, OfEveryBandHidesWhatNoShownBandHolds) {
    const Bytes samples(2 * 3);
    TestTiff layout = row_of<std::uint8_t>(2, 3);
    layout.mask = {0, 0, 1, 0, 0, 0};
    layout.mask_channels = 3;
    const Written file(layout, samples.data());
    EXPECT_EQ(file.rgba()[3], 255);
    EXPECT_EQ(file.rgba()[7], 0);
    ColourReading reading;
    reading.bands = {1};
    EXPECT_EQ(file.rgba(reading)[3], 0);
}

TEST(Orientation, IsIgnored) {
    const Bytes samples = {1, 2, 3, 4};
    TestTiff layout = layout_of<std::uint8_t>(2, 2);
    layout.orientation = ORIENTATION_BOTRIGHT;
    EXPECT_EQ(Written(layout, samples.data()).values(), (std::vector<double>{1, 2, 3, 4}));
}

std::optional<Stretch> chosen(const std::vector<std::string>& paths, const OpenOptions& options = {}) {
    const auto stretch = choose_stretch(paths, options);
    EXPECT_TRUE(stretch.ok()) << stretch.error().message;
    return stretch.ok() ? *stretch : std::nullopt;
}

TEST(ChosenStretch, OfEightBitFilesIsNone) {
    const Bytes samples = {1, 2, 3};
    const Written grey(row_of<std::uint8_t>(3, 1), samples.data());
    const Written palette(palette_of(3, 8, 257), samples.data());
    EXPECT_EQ(chosen({grey.path(), palette.path()}), std::nullopt);
}

TEST(ChosenStretch, LeavesTwoPercentAsideAtEitherEnd) {
    std::vector<std::uint16_t> samples(101, 9999);
    for (std::size_t i = 0; i < 100; ++i) samples[i] = static_cast<std::uint16_t>(i * 37 % 100 + 1000);
    TestTiff layout = row_of<std::uint16_t>(101, 1);
    layout.nodata = "9999";
    const Written file(layout, samples.data());
    EXPECT_EQ(chosen({file.path()}), (Stretch{1001, 1098, true}));
    // Its 8-bit neighbours in a mosaic have no say and stay as they are.
    const Bytes bytes(3, 255);
    const Written neighbour(row_of<std::uint8_t>(3, 1), bytes.data());
    const auto both = chosen({neighbour.path(), file.path()});
    EXPECT_EQ(both, (Stretch{1001, 1098, true}));
    ColourReading reading;
    reading.stretch = both;
    EXPECT_EQ(neighbour.rgba(reading)[0], 255);
    EXPECT_EQ(file.rgba(reading)[4 * 100 + 3], 0);
}

TEST(ChosenStretch, IsOneForAllFilesAndBands) {
    std::vector<float> low(303), high(303);
    for (std::size_t i = 0; i < 303; ++i) {
        low[i] = static_cast<float>(i);
        high[i] = static_cast<float>(i + 303);
    }
    const Written first(row_of<float>(101, 3), low.data());
    const Written second(row_of<float>(101, 3), high.data());
    // 606 values 0 to 605: (605 * 2) / 100 = 12 aside at either end.
    EXPECT_EQ(chosen({first.path(), second.path()}), (Stretch{12, 593, true}));
    EXPECT_EQ(chosen({first.path(), second.path()}), chosen({first.path(), second.path()}));
    OpenOptions options;
    options.colours.bands = {1};
    EXPECT_EQ(chosen({first.path()}, options), (Stretch{6, 294, true}));  // 0, 3 .. 300
}

TEST(ChosenStretch, LeavesWhatMaskAndAlphaHideAside) {
    const std::vector<std::uint16_t> samples = {5, 6, 7, 60000};
    TestTiff layout = row_of<std::uint16_t>(4, 1);
    layout.mask = {1, 1, 1, 0};
    const Written file(layout, samples.data());
    EXPECT_EQ(chosen({file.path()}), (Stretch{5, 7, true}));
    const std::vector<std::uint16_t> with_alpha = {5, 1, 7, 65535, 60000, 0};
    layout = row_of<std::uint16_t>(3, 2);
    layout.extra_sample = EXTRASAMPLE_UNASSALPHA;
    const Written transparent(layout, with_alpha.data());
    EXPECT_EQ(chosen({transparent.path()}), (Stretch{5, 7, true}));
}

TEST(ChosenStretch, OfAConstantImageIsMidGrey) {
    const std::vector<float> samples(9, 1e20f);
    const Written file(row_of<float>(9, 1), samples.data());
    ColourReading reading;
    reading.stretch = chosen({file.path()});
    EXPECT_EQ(file.rgba(reading)[0], 128);
}

TEST(ChosenStretch, OfNothingVisibleIsStillUsable) {
    const std::vector<float> samples(9, kNan);
    const Written file(row_of<float>(9, 1), samples.data());
    ColourReading reading;
    reading.stretch = chosen({file.path()});
    EXPECT_EQ(file.rgba(reading)[3], 0);
}

TEST(ChosenStretch, OfAnImageTooLargeToReadIsThatOfAnEvenSample) {
    constexpr std::uint32_t kSide = 4600;  // 1.26 * 2^24 samples; the sample of row y is y
    std::vector<std::uint16_t> samples(std::size_t{kSide} * kSide);
    for (std::size_t i = 0; i < samples.size(); ++i) samples[i] = static_cast<std::uint16_t>(i / kSide);
    for (const std::uint32_t tile : {0u, 512u}) {
        TestTiff layout = layout_of<std::uint16_t>(kSide, kSide);
        layout.tile = tile;
        layout.rows_per_strip = 1;
        const Written file(layout, samples.data());
        const auto stretch = chosen({file.path()});
        ASSERT_TRUE(stretch);
        EXPECT_NEAR(stretch->low, 0.02 * kSide, 0.005 * kSide);
        EXPECT_NEAR(stretch->high, 0.98 * kSide, 0.005 * kSide);
    }
}

}  // namespace
}  // namespace scree
