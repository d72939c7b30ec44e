#include "tools/source/text_reader.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/common/test_support.h"

namespace scree {
namespace {

ByteFile file_of(const test::TemporaryFolder& folder, const std::string& text) {
    test::write_bytes(folder.file("t"), {text.begin(), text.end()});
    auto file = ByteFile::open(folder.file("t"));
    EXPECT_TRUE(file);
    return std::move(*file);
}

TEST(TextReader, GivesEveryRunOfAFileLongerThanItsBufferAndWhereItEnds) {
    const test::TemporaryFolder folder;
    std::string text;
    std::vector<std::string> runs;
    std::vector<std::int64_t> ends;
    // Lengths from 1 to 13 between one and two bytes of space: borders of the buffer fall on every part of both.
    for (std::size_t k = 0; text.size() < 4 * TextReader::kBufferBytes; ++k) {
        runs.push_back(std::string(k % 13 + 1, static_cast<char>('a' + k % 26)));
        text += runs.back();
        ends.push_back(static_cast<std::int64_t>(text.size()));
        text += k % 3 == 0 ? "\r\n" : "\x1A";
    }
    const ByteFile file = file_of(folder, text);
    TextReader reader(file, 13);
    for (std::size_t k = 0; k < runs.size(); ++k) {
        const auto run = reader.take_run();
        ASSERT_TRUE(run);
        ASSERT_EQ(*run, runs[k]) << k;
        ASSERT_EQ(reader.offset(), ends[k]);
    }
    EXPECT_TRUE(reader.take_run()->empty());
    EXPECT_TRUE(reader.take(5)->empty());
    // Back, within the buffer and far before it.
    for (const std::size_t k : {runs.size() - 3, std::size_t{7}, runs.size() / 2}) {
        reader.seek(ends[k]);
        EXPECT_EQ(*reader.take_run(), runs[k + 1]);
    }
    reader.seek(file.size() + 100);
    EXPECT_TRUE(reader.take_run()->empty());
}

TEST(TextReader, TakesFieldsByTheirWidthAndFewerBytesAtTheEnd) {
    const test::TemporaryFolder folder;
    const ByteFile file = file_of(folder, "ab  cd\nef");
    TextReader reader(file, 10);
    EXPECT_EQ(*reader.take(3), "ab ");
    bool new_line = false;
    EXPECT_EQ(*reader.find_run(&new_line), "cd");
    EXPECT_FALSE(new_line);
    EXPECT_EQ(*reader.find_run(), "cd");  // it is still there
    reader.skip(2);
    EXPECT_EQ(*reader.find_run(&new_line), "ef");
    EXPECT_TRUE(new_line);
    EXPECT_EQ(*reader.take(9), "ef");
}

TEST(TextReader, RefusesRunsThatAreTooLongWhereverTheyStand) {
    const test::TemporaryFolder folder;
    for (const std::size_t before : {std::size_t{1}, TextReader::kBufferBytes - 5}) {
        const ByteFile file = file_of(folder, std::string(before, ' ') + std::string(21, '7') + " 1");
        TextReader short_runs(file, 20), long_runs(file, 21);
        EXPECT_FALSE(short_runs.take_run()) << before;
        EXPECT_EQ(long_runs.take_run()->size(), 21u);
    }
    const ByteFile endless = file_of(folder, std::string(3 * TextReader::kBufferBytes, '7'));
    EXPECT_FALSE(TextReader(endless, std::size_t{1} << 30).take_run());
}

}  // namespace
}  // namespace scree
