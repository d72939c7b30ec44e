#include "tools/source/fingerprint.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <xxhash.h>

#include "tests/tools/source/temp_directory.h"

namespace scree::test {
namespace {

constexpr std::size_t kMiB = std::size_t{1} << 20;

std::string pattern(std::size_t bytes) {
    std::string text(bytes, '\0');
    for (std::size_t k = 0; k < bytes; ++k) text[k] = static_cast<char>(k * 2654435761u >> 13);
    return text;
}

std::string documented(const std::string& hashed, std::size_t size) {
    return fmt::format("{:016x}", XXH3_64bits_withSeed(hashed.data(), hashed.size(), size));
}

TEST(Fingerprint, IsTheHashOfAWholeFileUpToTwoMiBAndOfBothEndsBeyond) {
    const TempDirectory folder;
    for (const std::size_t size : {std::size_t{0}, std::size_t{5}, kMiB, 2 * kMiB - 1, 2 * kMiB}) {
        const std::string text = pattern(size);
        EXPECT_EQ(fingerprint_of(folder.write("f", text)), documented(text, size)) << size;
    }
    for (const std::size_t size : {2 * kMiB + 1, 5 * kMiB + 3}) {
        const std::string text = pattern(size);
        EXPECT_EQ(fingerprint_of(folder.write("f", text)),
                  documented(text.substr(0, kMiB) + text.substr(size - kMiB), size))
            << size;
    }
}

TEST(Fingerprint, WhatCannotBeReadHasNone) {
    const TempDirectory folder;
    EXPECT_EQ(fingerprint_of(folder.path("missing")), "");
    EXPECT_EQ(fingerprint_of(folder.path("")), "");
}

}  // namespace
}  // namespace scree::test
