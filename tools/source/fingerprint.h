// What tells a source file from another of the same name and size (docs/store-format.md, "Dataset").
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace scree {

/// 16 hexadecimal digits; reads 2 MiB at most. Empty where the file cannot be read.
std::string fingerprint_of(const std::string& path);

/// XXH3-64.
std::uint64_t fingerprint_of_bytes(std::string_view bytes);

}  // namespace scree
