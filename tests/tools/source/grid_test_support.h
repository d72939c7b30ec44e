// What the tests of the DEM readers share: a surface whose every sample differs from its neighbours, and reading back.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/tools/source/temp_directory.h"
#include "tools/source/image_source.h"

namespace scree::test {

/// Distinct along rows, columns and channels; within int16.
inline int sample_at(std::int64_t row, std::int64_t column, std::int64_t channel = 0) {
    return static_cast<int>((row * 131 + column * 17 + channel * 4001) % 20011) - 7000;
}

template <class T>
void append(std::string& bytes, T value, bool big_endian) {
    std::array<char, sizeof(T)> raw{};
    std::memcpy(raw.data(), &value, sizeof(T));
    if (big_endian) std::reverse(raw.begin(), raw.end());
    bytes.append(raw.data(), raw.size());
}

inline std::unique_ptr<ImageSource> open_grid_or_fail(const std::string& path, const OpenOptions& options = {}) {
    auto opened = ImageSource::open(path, options);
    EXPECT_TRUE(opened.ok()) << opened.error().message;
    return opened.ok() ? std::move(*opened) : nullptr;
}

inline std::vector<double> read_rows(ImageSource& source, std::int64_t begin, std::int64_t end) {
    std::vector<double> values(static_cast<std::size_t>((end - begin) * source.info().width), -1e9);
    const auto read = source.read_channel(begin, end, std::span<double>(values));
    EXPECT_TRUE(read.ok()) << read.error().message;
    return values;
}

inline std::vector<double> read_all(ImageSource& source) { return read_rows(source, 0, source.info().height); }

/// Every sample is that of sample_at, read in bands that fit no unit, backwards and as float too.
inline void expect_surface(ImageSource& source, double scale = 1) {
    const std::int64_t width = source.info().width;
    const std::int64_t height = source.info().height;
    for (std::int64_t end = height; end > 0; end -= std::min<std::int64_t>(end, 7)) {
        const std::int64_t begin = std::max<std::int64_t>(0, end - 7);
        const std::vector<double> band = read_rows(source, begin, end);
        for (std::int64_t i = 0; i < (end - begin) * width; ++i)
            ASSERT_EQ(band[static_cast<std::size_t>(i)], sample_at(begin + i / width, i % width) * scale)
                << "row " << begin + i / width << ", column " << i % width;
    }
    std::vector<float> row(static_cast<std::size_t>(width));
    ASSERT_TRUE(source.read_channel(height - 1, height, std::span<float>(row)).ok());
    for (std::int64_t column = 0; column < width; ++column)
        ASSERT_EQ(row[static_cast<std::size_t>(column)], static_cast<float>(sample_at(height - 1, column) * scale));
}

/// Opening or reading fails with ErrorCode::input, and the message names the file and `what`.
inline void expect_refusal(const std::string& path, const std::string& what) {
    SCOPED_TRACE(path);
    auto opened = ImageSource::open(path);
    Result<void> read;
    if (opened) {
        std::vector<double> row(static_cast<std::size_t>((*opened)->info().width));
        for (std::int64_t r = 0; r < (*opened)->info().height && read.ok(); ++r)
            read = (*opened)->read_channel(r, r + 1, std::span<double>(row));
        ASSERT_FALSE(read.ok()) << "not refused";
    }
    const Error error = opened ? read.error() : opened.error();
    EXPECT_EQ(error.code, ErrorCode::input);
    EXPECT_NE(error.message.find(std::filesystem::path(path).stem().string()), std::string::npos) << error.message;
    EXPECT_NE(error.message.find(what), std::string::npos) << error.message;
}

/// No prefix of the file `name` (whose sidecars stand beside it) is misread: it is refused, opening or reading, or
/// gives the values of the whole.
inline void expect_no_prefix_misread(const TempDirectory& directory, const std::string& name) {
    const std::string whole = read_bytes(directory.path(name));
    const std::vector<double> values = read_all(*open_grid_or_fail(directory.path(name)));
    std::vector<double> read(values.size());
    for (std::size_t length = 0; length < whole.size(); length += std::max<std::size_t>(1, whole.size() / 211)) {
        directory.write(name, std::string_view(whole).substr(0, length));
        auto opened = ImageSource::open(directory.path(name));
        if (!opened) {
            EXPECT_EQ(opened.error().code, ErrorCode::input);
            continue;
        }
        ASSERT_EQ(static_cast<std::size_t>((*opened)->info().width * (*opened)->info().height), values.size());
        const auto result = (*opened)->read_channel(0, (*opened)->info().height, std::span<double>(read));
        if (result)
            EXPECT_EQ(read, values) << "cut at " << length;
        else
            EXPECT_EQ(result.error().code, ErrorCode::input);
    }
    directory.write(name, whole);
}

/// gdal_translate's reading of the first band, row-major; empty where GDAL's programs are not installed.
inline std::vector<double> read_by_gdal(const TempDirectory& directory, const std::string& path) {
    const std::string raw = directory.path("gdal.raw");
    const std::string command =
        "gdal_translate -q -b 1 -ot Float64 -of ENVI '" + path + "' '" + raw + "' >/dev/null 2>&1";
    if (std::system(command.c_str()) != 0) return {};
    const std::string bytes = read_bytes(raw);
    std::vector<double> values(bytes.size() / sizeof(double));
    std::memcpy(values.data(), bytes.data(), values.size() * sizeof(double));
    return values;
}

#define SCREE_EXPECT_AS_GDAL_OR_SKIP(directory, path)                                              \
    do {                                                                                           \
        const std::vector<double> expected_by_gdal = ::scree::test::read_by_gdal(directory, path); \
        if (expected_by_gdal.empty()) GTEST_SKIP() << "needs gdal_translate";                      \
        const auto opened_here = ::scree::test::open_grid_or_fail(path);                           \
        ASSERT_NE(opened_here, nullptr);                                                           \
        EXPECT_TRUE(::scree::test::read_all(*opened_here) == expected_by_gdal) << (path);          \
    } while (false)

}  // namespace scree::test
