// What tells a source file from another of the same name and size (docs/store-format.md, "Dataset").
#pragma once

#include <string>

namespace scree {

/// 16 hexadecimal digits; reads 2 MiB at most. Empty where the file cannot be read.
std::string fingerprint_of(const std::string& path);

}  // namespace scree
