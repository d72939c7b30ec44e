#include "tools/source/raw_samples.h"

#include <array>
#include <cstring>
#include <string>

#include <gtest/gtest.h>

#include "tests/tools/source/grid_test_support.h"

namespace scree {
namespace {

using test::TempDirectory;

constexpr std::int64_t kColumns = 3, kRows = 5, kHeaderBytes = 7;

// From south to north after a few bytes of something else.
std::string south_first() {
    std::string bytes(kHeaderBytes, '?');
    for (std::int64_t row = kRows - 1; row >= 0; --row)
        for (std::int64_t column = 0; column < kColumns; ++column)
            test::append(bytes, static_cast<std::int16_t>(test::sample_at(row, column)), false);
    return bytes;
}

RawSamples backwards() {
    RawSamples samples;
    samples.width = kColumns;
    samples.height = kRows;
    samples.type = SampleType::i16;
    samples.pixel_bytes = samples.channel_bytes = 2;
    samples.row_bytes = -2 * kColumns;
    samples.first = kHeaderBytes + (kRows - 1) * 2 * kColumns;
    return samples;
}

TEST(RawSamples, RowsAreReadBackwardsWhereTheirStepIsNegative) {
    const TempDirectory directory;
    const auto decoder = make_raw_decoder(std::move(*ByteFile::open(directory.write("a", south_first()))), backwards());
    ASSERT_TRUE(decoder.ok()) << decoder.error().message;
    for (std::int64_t begin = 0; begin < kRows; begin += 2) {
        const std::int64_t end = std::min(begin + 2, kRows);
        std::array<std::int16_t, 2 * kColumns> rows{};
        ASSERT_TRUE((*decoder)->decode(begin, end, std::as_writable_bytes(std::span(rows)).data()).ok());
        for (std::int64_t i = 0; i < (end - begin) * kColumns; ++i)
            EXPECT_EQ(rows[static_cast<std::size_t>(i)], test::sample_at(begin + i / kColumns, i % kColumns));
    }
}

TEST(RawSamples, AFileThatEndsWithinItsLastRowIsRefusedHoweverRowsLie) {
    const TempDirectory directory;
    const std::string whole = south_first();
    RawSamples forwards = backwards();
    forwards.first = kHeaderBytes;
    forwards.row_bytes = -forwards.row_bytes;
    for (const RawSamples& samples : {forwards, backwards()}) {
        for (const std::size_t cut : {1, 2, 6}) {
            const std::string path = directory.write("a", whole.substr(0, whole.size() - cut));
            const auto decoder = make_raw_decoder(std::move(*ByteFile::open(path)), samples);
            ASSERT_FALSE(decoder.ok());
            EXPECT_NE(decoder.error().message.find(std::to_string(whole.size()) + " bytes"), std::string::npos)
                << decoder.error().message;
        }
        EXPECT_TRUE(make_raw_decoder(std::move(*ByteFile::open(directory.write("a", whole))), samples).ok());
    }
}

}  // namespace
}  // namespace scree
