#include "tools/source/image_source.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include <OpenImageIO/half.h>
#include <OpenImageIO/imageio.h>
#include <gtest/gtest.h>

#include "tests/tools/source/temp_directory.h"
#include "tests/tools/source/test_tiff.h"

namespace scree {
namespace {

using test::layout_of;
using test::TempDirectory;
using test::TestTiff;

constexpr std::uint32_t kWidth = 37;  // no multiple of a tile
constexpr std::uint32_t kHeight = 41;

// Values over the whole range of the type, its limits among them.
template <class T>
std::vector<T> samples_of() {
    std::vector<T> values(std::size_t{kWidth} * kHeight);
    std::uint64_t state = 12345;
    for (T& value : values) {
        state = state * 6364136223846793005u + 1442695040888963407u;
        if constexpr (std::is_floating_point_v<T>)
            value = static_cast<T>(static_cast<std::int64_t>(state >> 20)) / T(1024) - T(1000);
        else
            value = static_cast<T>(state >> 24);
    }
    values[5] = std::numeric_limits<T>::max();
    values[6] = std::numeric_limits<T>::lowest();
    return values;
}

std::unique_ptr<ImageSource> open_or_fail(const std::string& path, const OpenOptions& options = {}) {
    auto opened = ImageSource::open(path, options);
    EXPECT_TRUE(opened.ok()) << opened.error().message;
    return opened.ok() ? std::move(*opened) : nullptr;
}

template <class T>
void expect_values_exact(SampleType type, const TestTiff& layout) {
    const TempDirectory directory;
    const std::string path = directory.path("é values.tif");
    const std::vector<T> values = samples_of<T>();
    ASSERT_TRUE(test::write_tiff(path, layout, values.data()));
    const auto source = open_or_fail(path);
    ASSERT_NE(source, nullptr);
    EXPECT_EQ(source->info().type, type);
    EXPECT_EQ(source->info().width, kWidth);
    EXPECT_EQ(source->info().height, kHeight);
    EXPECT_EQ(source->info().tiled, layout.tile > 0);
    // Bands that match neither strips nor tiles, then a step back.
    std::vector<double> read(values.size());
    for (std::int64_t begin = 0; begin < kHeight; begin += 7) {
        const std::int64_t end = std::min<std::int64_t>(begin + 7, kHeight);
        const std::span<double> band(read.data() + begin * kWidth, static_cast<std::size_t>((end - begin) * kWidth));
        ASSERT_TRUE(source->read_channel(begin, end, band).ok());
    }
    std::vector<float> first(kWidth);
    ASSERT_TRUE(source->read_channel(0, 1, std::span<float>(first)).ok());
    for (std::size_t i = 0; i < values.size(); ++i)
        ASSERT_EQ(read[i], static_cast<double>(values[i])) << "sample " << i;
    for (std::size_t i = 0; i < first.size(); ++i) ASSERT_EQ(first[i], static_cast<float>(values[i]));
}

template <class T>
void expect_every_layout_exact(SampleType type) {
    TestTiff layout = layout_of<T>(kWidth, kHeight);
    for (const int compression : {COMPRESSION_NONE, COMPRESSION_LZW}) {
        for (const char* mode : {"w", "wb", "w8"}) {  // "wb" is big-endian
            layout.compression = compression;
            layout.mode = mode;
            layout.tile = 0;
            for (const std::uint32_t rows : {1u, 5u, kHeight}) {
                layout.rows_per_strip = rows;
                expect_values_exact<T>(type, layout);
            }
            layout.tile = 16;
            expect_values_exact<T>(type, layout);
        }
    }
}

TEST(ImageSource, Unsigned8BitValuesAreExact) { expect_every_layout_exact<std::uint8_t>(SampleType::u8); }
TEST(ImageSource, Signed8BitValuesAreExact) { expect_every_layout_exact<std::int8_t>(SampleType::i8); }
TEST(ImageSource, Unsigned16BitValuesAreExact) { expect_every_layout_exact<std::uint16_t>(SampleType::u16); }
TEST(ImageSource, Signed16BitValuesAreExact) { expect_every_layout_exact<std::int16_t>(SampleType::i16); }
TEST(ImageSource, Unsigned32BitValuesAreExact) { expect_every_layout_exact<std::uint32_t>(SampleType::u32); }
TEST(ImageSource, Signed32BitValuesAreExact) { expect_every_layout_exact<std::int32_t>(SampleType::i32); }
TEST(ImageSource, Unsigned64BitValuesAreExactAsFarAsDoubleIs) {
    expect_every_layout_exact<std::uint64_t>(SampleType::u64);
}
TEST(ImageSource, Signed64BitValuesAreExactAsFarAsDoubleIs) {
    expect_every_layout_exact<std::int64_t>(SampleType::i64);
}
TEST(ImageSource, Float32ValuesAreExact) { expect_every_layout_exact<float>(SampleType::f32); }
TEST(ImageSource, Float64ValuesAreExact) { expect_every_layout_exact<double>(SampleType::f64); }

TEST(ImageSource, HalfValuesAreExact) {
    const TempDirectory directory;
    std::vector<half> values;
    for (int i = 0; i < 12; ++i) values.emplace_back(static_cast<float>(i) * 300.5f - 900.25f);
    TestTiff layout;
    layout.bits = 16;
    layout.format = SAMPLEFORMAT_IEEEFP;
    ASSERT_TRUE(test::write_tiff(directory.path("h.tif"), layout, values.data()));
    const auto source = open_or_fail(directory.path("h.tif"));
    ASSERT_NE(source, nullptr);
    EXPECT_EQ(source->info().type, SampleType::f16);
    std::vector<float> read(12);
    ASSERT_TRUE(source->read_channel(0, 3, std::span<float>(read)).ok());
    for (std::size_t i = 0; i < read.size(); ++i) EXPECT_EQ(read[i], static_cast<float>(values[i]));
}

TEST(ImageSource, SeparatePlanesReadAsInterleavedOnes) {
    const TempDirectory directory;
    std::vector<std::uint8_t> values(4 * 3 * 3);
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<std::uint8_t>(i * 5);
    TestTiff layout;
    layout.channels = 3;
    layout.separate_planes = true;
    ASSERT_TRUE(test::write_tiff(directory.path("s.tif"), layout, values.data()));
    const auto source = open_or_fail(directory.path("s.tif"));
    ASSERT_NE(source, nullptr);
    std::vector<std::uint8_t> rgba(4 * 3 * 4);
    ASSERT_TRUE(source->read_rgba8(0, 3, rgba).ok());
    for (std::size_t pixel = 0; pixel < 12; ++pixel)
        for (std::size_t c = 0; c < 3; ++c) EXPECT_EQ(rgba[pixel * 4 + c], values[pixel * 3 + c]);
}

TEST(ImageSource, UnwrittenTilesAreNodata) {
    const TempDirectory directory;
    TestTiff layout = layout_of<std::int16_t>(20, 18);
    layout.tile = 16;
    layout.sparse = true;
    layout.nodata = "-9999";
    ASSERT_TRUE(test::write_tiff(directory.path("sparse.tif"), layout, nullptr));
    const auto source = open_or_fail(directory.path("sparse.tif"));
    ASSERT_NE(source, nullptr);
    std::vector<float> read(20 * 18);
    const auto result = source->read_channel(0, 18, std::span<float>(read));
    ASSERT_TRUE(result.ok()) << result.error().message;
    EXPECT_EQ(read, std::vector<float>(20 * 18, -9999.0f));
}

TEST(ImageSource, APngOf16BitsKeepsItsValues) {
    const TempDirectory directory;
    const std::string path = directory.path("p.png");
    const std::vector<std::uint16_t> values = {0, 1, 255, 256, 43798, 65535};
    auto out = OIIO::ImageOutput::create(path);
    ASSERT_TRUE(out && out->open(path, OIIO::ImageSpec(3, 2, 1, OIIO::TypeDesc::UINT16)));
    ASSERT_TRUE(out->write_image(OIIO::TypeDesc::UINT16, values.data()));
    out->close();
    const auto source = open_or_fail(path);
    ASSERT_NE(source, nullptr);
    std::vector<float> read(6);
    ASSERT_TRUE(source->read_channel(0, 2, std::span<float>(read)).ok());
    for (std::size_t i = 0; i < read.size(); ++i) EXPECT_EQ(read[i], values[i]);
}

template <class T>
std::optional<double> nodata_read_back(const char* text) {
    const TempDirectory directory;
    const std::vector<T> values(12, T{});
    TestTiff layout = layout_of<T>(4, 3);
    layout.nodata = text;
    EXPECT_TRUE(test::write_tiff(directory.path("n.tif"), layout, values.data()));
    const auto source = open_or_fail(directory.path("n.tif"));
    return source ? source->info().nodata : std::nullopt;
}

TEST(ImageSource, NodataIsWhatAPixelOfItsTypeHolds) {
    EXPECT_EQ(nodata_read_back<std::int16_t>("-32768"), -32768.0);
    EXPECT_EQ(nodata_read_back<std::uint16_t>(" 65535 "), 65535.0);
    EXPECT_EQ(nodata_read_back<float>("1.70141000918780003e+38"), static_cast<double>(1.70141000918780003e+38f));
    EXPECT_EQ(nodata_read_back<float>("0.1"), static_cast<double>(0.1f));
    EXPECT_EQ(nodata_read_back<float>("-1.7976931348623157e+308"),
              static_cast<double>(std::numeric_limits<float>::lowest()));
    EXPECT_EQ(nodata_read_back<double>("0.1"), 0.1);
    ASSERT_TRUE(nodata_read_back<float>("nan"));
    EXPECT_TRUE(std::isnan(*nodata_read_back<float>("nan")));
}

TEST(ImageSource, NodataThatNoPixelCanHoldIsNone) {
    EXPECT_FALSE(nodata_read_back<std::uint8_t>("-9999"));
    EXPECT_FALSE(nodata_read_back<std::int16_t>("0.5"));
    EXPECT_FALSE(nodata_read_back<std::int32_t>("nan"));
    EXPECT_FALSE(nodata_read_back<float>("none"));
}

TEST(ImageSource, ScaleAndOffsetOfTheFirstBandAreGivenAndNotApplied) {
    const TempDirectory directory;
    const std::vector<std::int16_t> values = {100, 200, 300, 400, 500, 600, 700, 800, 900, 1000, 1100, 1200};
    TestTiff layout = layout_of<std::int16_t>(4, 3);
    const auto item = [](int sample, const char* role, const char* text) {
        return "  <Item name=\"X\" sample=\"" + std::to_string(sample) + "\" role=\"" + role + "\">" + text +
               "</Item>\n";
    };
    const auto info_of = [&](const std::string& items) {
        layout.gdal_metadata = "<GDALMetadata>\n<Item name=\"scale\">7</Item>" + items + "</GDALMetadata>";
        EXPECT_TRUE(test::write_tiff(directory.path("m.tif"), layout, values.data()));
        const auto source = open_or_fail(directory.path("m.tif"));
        std::vector<float> read(12);
        EXPECT_TRUE(source->read_channel(0, 3, std::span<float>(read)).ok());
        EXPECT_EQ(read[11], 1200);
        return source->info();
    };
    const ImageInfo centimetres = info_of(item(0, "offset", "-5") + item(0, "scale", "0.01") + item(1, "scale", "3"));
    EXPECT_EQ(centimetres.value_scale, 0.01);
    EXPECT_EQ(centimetres.value_offset, -5);
    for (const char* text : {"0", "nan", "inf", "", "two"}) {
        const ImageInfo info = info_of(item(0, "scale", text));
        EXPECT_EQ(info.value_scale, 1) << text;
        EXPECT_EQ(info.value_offset, 0);
    }
}

TEST(ImageSource, GreyIsReplicatedAndOpaque) {
    const TempDirectory directory;
    std::vector<std::uint16_t> values(12, 0);
    values[0] = 65535;
    values[1] = 32768;
    ASSERT_TRUE(test::write_tiff(directory.path("g.tif"), layout_of<std::uint16_t>(4, 3), values.data()));
    const auto source = open_or_fail(directory.path("g.tif"));
    ASSERT_NE(source, nullptr);
    std::vector<std::uint8_t> rgba(48);
    ASSERT_TRUE(source->read_rgba8(0, 3, rgba).ok());
    EXPECT_EQ(std::vector<std::uint8_t>(rgba.begin(), rgba.begin() + 12),
              (std::vector<std::uint8_t>{255, 255, 255, 255, 128, 128, 128, 255, 0, 0, 0, 255}));
}

std::vector<std::uint8_t> rgba_with_alpha_kind(int kind) {
    const TempDirectory directory;
    TestTiff layout;
    layout.width = 1;
    layout.height = 1;
    layout.channels = 4;
    layout.extra_sample = kind;
    const std::uint8_t pixel[4] = {50, 100, 20, 128};
    EXPECT_TRUE(test::write_tiff(directory.path("c.tif"), layout, pixel));
    const auto source = open_or_fail(directory.path("c.tif"));
    std::vector<std::uint8_t> rgba(4);
    EXPECT_TRUE(source && source->read_rgba8(0, 1, rgba).ok());
    return rgba;
}

TEST(ImageSource, ColoursComeOutUnassociatedWhateverTheAlphaKind) {
    EXPECT_EQ(rgba_with_alpha_kind(EXTRASAMPLE_UNASSALPHA), (std::vector<std::uint8_t>{50, 100, 20, 128}));
    EXPECT_EQ(rgba_with_alpha_kind(EXTRASAMPLE_ASSOCALPHA), (std::vector<std::uint8_t>{100, 199, 40, 128}));
    EXPECT_EQ(rgba_with_alpha_kind(EXTRASAMPLE_UNSPECIFIED), (std::vector<std::uint8_t>{50, 100, 20, 255}));
}

TEST(ImageSource, AUnitAboveTheLimitIsRefusedWithTheMemoryItNeeds) {
    const TempDirectory directory;
    const std::vector<float> values(1024 * 1024, 1.0f);
    TestTiff layout = layout_of<float>(1024, 1024);
    layout.rows_per_strip = 1024;
    layout.compression = COMPRESSION_LZW;
    const std::string path = directory.path("strip.tif");
    ASSERT_TRUE(test::write_tiff(path, layout, values.data()));
    OpenOptions options;
    options.max_unit_bytes = 1 << 20;
    const auto refused = ImageSource::open(path, options);
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.error().code, ErrorCode::input);
    EXPECT_NE(refused.error().message.find("strip.tif"), std::string::npos);
    EXPECT_NE(refused.error().message.find("--memory"), std::string::npos);
    options.max_unit_bytes = 4 << 20;
    const auto source = open_or_fail(path, options);
    ASSERT_NE(source, nullptr);
    EXPECT_EQ(source->info().unit_bytes, 4 << 20);
}

// Every prefix of a file either fails to open, or fails at a row, or gives exactly the values that were written.
void expect_no_prefix_misread(const TestTiff& layout) {
    const TempDirectory directory;
    const std::vector<float> values = samples_of<float>();
    const std::string whole_path = directory.path("whole.tif");
    ASSERT_TRUE(test::write_tiff(whole_path, layout, values.data()));
    const std::string whole = test::read_bytes(whole_path);
    const std::string path = directory.path("cut.tif");
    std::vector<float> read(values.size());
    for (std::size_t length = 0; length < whole.size(); length += std::max<std::size_t>(1, whole.size() / 97)) {
        directory.write("cut.tif", std::string_view(whole).substr(0, length));
        auto opened = ImageSource::open(path);
        if (!opened) {
            EXPECT_EQ(opened.error().code, ErrorCode::input);
            continue;
        }
        const auto result = (*opened)->read_channel(0, kHeight, std::span<float>(read));
        if (!result) {
            EXPECT_EQ(result.error().code, ErrorCode::input);
            EXPECT_NE(result.error().message.find("cut.tif"), std::string::npos);
            EXPECT_NE(result.error().message.find("row"), std::string::npos);
        } else {
            EXPECT_EQ(read, values) << "cut at " << length;
        }
    }
}

TEST(ImageSource, ATruncatedFileIsAnInputErrorAndNeverWrongValues) {
    TestTiff layout = layout_of<float>(kWidth, kHeight);
    layout.rows_per_strip = 5;
    expect_no_prefix_misread(layout);
    layout.compression = COMPRESSION_ADOBE_DEFLATE;
    expect_no_prefix_misread(layout);
    layout.tile = 16;
    expect_no_prefix_misread(layout);
}

TEST(ImageSource, DamagedPixelsUnderAWholeHeaderNameTheRows) {
    const TempDirectory directory;
    TestTiff layout = layout_of<float>(kWidth, kHeight);
    layout.compression = COMPRESSION_ADOBE_DEFLATE;
    const std::string path = directory.path("d.tif");
    ASSERT_TRUE(test::write_tiff(path, layout, samples_of<float>().data()));
    std::string bytes = test::read_bytes(path);
    std::fill_n(bytes.begin() + 8, 64, '\xFF');  // the first strip follows the 8 bytes of the file's header
    directory.write("d.tif", bytes);
    const auto source = open_or_fail(path);
    ASSERT_NE(source, nullptr);
    std::vector<float> read(std::size_t{kWidth} * kHeight);
    const auto result = source->read_channel(0, kHeight, std::span<float>(read));
    ASSERT_FALSE(result.ok());
    EXPECT_EQ(result.error().code, ErrorCode::input);
    EXPECT_NE(result.error().message.find("d.tif: rows 0 to"), std::string::npos) << result.error().message;
}

TEST(ImageSource, ATruncatedJpegIsAnError) {
    const TempDirectory directory;
    const std::string path = directory.path("j.jpg");
    std::vector<std::uint8_t> values(64 * 64 * 3);
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<std::uint8_t>(i * 7);
    auto out = OIIO::ImageOutput::create(path);
    ASSERT_TRUE(out && out->open(path, OIIO::ImageSpec(64, 64, 3, OIIO::TypeDesc::UINT8)));
    ASSERT_TRUE(out->write_image(OIIO::TypeDesc::UINT8, values.data()));
    out->close();
    ASSERT_NE(open_or_fail(path), nullptr);
    std::filesystem::resize_file(path, std::filesystem::file_size(path) / 2);
    const auto cut = ImageSource::open(path);
    ASSERT_FALSE(cut.ok());
    EXPECT_NE(cut.error().message.find("cut off"), std::string::npos) << cut.error().message;
}

TEST(ImageSource, MissingEmptyAndForeignFilesAreInputErrors) {
    const TempDirectory directory;
    const std::vector<std::string> paths = {
        directory.path("none.tif"), directory.write("empty.tif", ""), directory.write("text.tif", "hello"),
        directory.write("stub.tif", std::string_view("II*\0\x08\0\0\0", 8)), directory.path("")};
    for (const std::string& path : paths) {
        const auto opened = ImageSource::open(path);
        ASSERT_FALSE(opened.ok()) << path;
        EXPECT_EQ(opened.error().code, ErrorCode::input);
        EXPECT_EQ(opened.error().message.find(path), 0u) << opened.error().message;
    }
}

TEST(ImageSource, APngHeaderOfAbsurdSidesIsRefusedBeforeDecoding) {
    const TempDirectory directory;
    std::string png("\x89PNG\r\n\x1a\n\0\0\0\rIHDR\x7f\xff\xff\xff\x7f\xff\xff\xff\x08\x02\0\0\0????", 33);
    const auto opened = ImageSource::open(directory.write("huge.png", png));
    ASSERT_FALSE(opened.ok());
    EXPECT_NE(opened.error().message.find("2147483647"), std::string::npos) << opened.error().message;
}

TEST(ImageSource, AWorldFilePlacesAnImageWithoutTags) {
    const TempDirectory directory;
    const std::vector<std::uint8_t> values(12, 1);
    ASSERT_TRUE(test::write_tiff(directory.path("w.tif"), TestTiff{}, values.data()));
    directory.write("w.tfw", "5 0 0 -5 100 200");
    const auto source = open_or_fail(directory.path("w.tif"));
    ASSERT_NE(source, nullptr);
    ASSERT_TRUE(source->georeference().has_value());
    EXPECT_EQ(source->georeference()->first_x, 100);
}

TEST(SampleTypes, OnlySixteenBitsAndLessFitFloat32AmongIntegers) {
    EXPECT_TRUE(fits_float32(SampleType::u16) && fits_float32(SampleType::f16) && fits_float32(SampleType::i8));
    EXPECT_FALSE(fits_float32(SampleType::u32) || fits_float32(SampleType::f64) || fits_float32(SampleType::i64));
    EXPECT_TRUE(is_integer(SampleType::u64));
    EXPECT_FALSE(is_integer(SampleType::f16));
}

TEST(ImageSourceOfRealFiles, PugetHeightsReachTheirKnownRange) {
    SCREE_DATA_OR_SKIP(path, "puget/ps_height_1k.png");
    const auto source = open_or_fail(path);
    ASSERT_NE(source, nullptr);
    const ImageInfo& info = source->info();
    ASSERT_EQ(info.width, 1025);
    ASSERT_EQ(info.type, SampleType::u16);
    std::vector<float> values(static_cast<std::size_t>(info.width * info.height));
    ASSERT_TRUE(source->read_channel(0, info.height, std::span<float>(values)).ok());
    EXPECT_EQ(*std::min_element(values.begin(), values.end()), 0);
    EXPECT_EQ(*std::max_element(values.begin(), values.end()), 43798);
}

TEST(ImageSourceOfRealFiles, TheNodataOfAFloatTiledFileEqualsItsPixels) {
    SCREE_DATA_OR_SKIP(path, "formats/greenriver.tif");
    const auto source = open_or_fail(path);
    ASSERT_NE(source, nullptr);
    EXPECT_TRUE(source->info().tiled);
    EXPECT_EQ(source->info().nodata, static_cast<double>(1.70141000918780003e+38f));
}

TEST(ImageSourceOfRealFiles, UntaggedVoidsComeThroughAsValues) {
    SCREE_DATA_OR_SKIP(path, "craterlake/craterlake-elev-16bit-30m.tif");
    const auto source = open_or_fail(path);
    ASSERT_NE(source, nullptr);
    const ImageInfo& info = source->info();
    EXPECT_FALSE(info.nodata);
    std::vector<double> values(static_cast<std::size_t>(info.width * info.height));
    ASSERT_TRUE(source->read_channel(0, info.height, std::span<double>(values)).ok());
    const auto voids = static_cast<double>(std::count(values.begin(), values.end(), -32767.0));
    EXPECT_NEAR(voids / static_cast<double>(values.size()), 0.33, 0.01);
}

// Neither byte order nor a stretch of a few bits to eight may change a height.
TEST(ImageSourcePng, InterlacedSixteenBitsAndFewBitsKeepTheirValues) {
    const unsigned char interlaced[] = {
        0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a, 0x00, 0x00, 0x00, 0x0d, 0x49, 0x48, 0x44, 0x52, 0x00, 0x00,
        0x00, 0x02, 0x00, 0x00, 0x00, 0x01, 0x10, 0x00, 0x00, 0x00, 0x01, 0xf6, 0xde, 0xcc, 0x83, 0x00, 0x00, 0x00,
        0x0e, 0x49, 0x44, 0x41, 0x54, 0x78, 0x9c, 0x63, 0x60, 0xd4, 0x61, 0x60, 0x60, 0x05, 0x00, 0x00, 0xc0, 0x00,
        0x33, 0xef, 0xdc, 0x8c, 0x2b, 0x00, 0x00, 0x00, 0x00, 0x49, 0x45, 0x4e, 0x44, 0xae, 0x42, 0x60, 0x82};
    const unsigned char two_bits[] = {
        0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a, 0x00, 0x00, 0x00, 0x0d, 0x49, 0x48, 0x44, 0x52, 0x00,
        0x00, 0x00, 0x04, 0x00, 0x00, 0x00, 0x01, 0x02, 0x00, 0x00, 0x00, 0x00, 0x96, 0xe7, 0x48, 0xb0, 0x00,
        0x00, 0x00, 0x0a, 0x49, 0x44, 0x41, 0x54, 0x78, 0x9c, 0x63, 0x90, 0x06, 0x00, 0x00, 0x1d, 0x00, 0x1c,
        0x8e, 0xf4, 0xf5, 0x21, 0x00, 0x00, 0x00, 0x00, 0x49, 0x45, 0x4e, 0x44, 0xae, 0x42, 0x60, 0x82};
    const TempDirectory directory;
    const auto expect_values = [&](const char* name, const auto& bytes, const std::vector<double>& expected) {
        std::ofstream(directory.path(name), std::ios::binary).write(reinterpret_cast<const char*>(bytes), sizeof bytes);
        const auto source = open_or_fail(directory.path(name));
        ASSERT_NE(source, nullptr);
        std::vector<double> values(expected.size());
        ASSERT_TRUE(source->read_channel(0, 1, std::span<double>(values)).ok());
        EXPECT_EQ(values, expected);
    };
    expect_values("interlaced.png", interlaced, {300, 5});
    expect_values("two bits.png", two_bits, {0, 1, 2, 3});
}

}  // namespace
}  // namespace scree
