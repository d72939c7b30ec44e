// Parsers that take a path are fed through files in a folder of the process.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "tests/tools/source/temp_directory.h"

namespace scree::fuzz {

inline const test::TempDirectory& folder() {
    static const test::TempDirectory kFolder;
    return kFolder;
}

inline std::string_view text_of(const std::uint8_t* data, std::size_t size) {
    return {reinterpret_cast<const char*>(data), size};
}

}  // namespace scree::fuzz
