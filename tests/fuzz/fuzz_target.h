// A fuzz target: one function of bytes that must return whatever they hold. The entry point has libFuzzer's name, so
// that with clang the same file links against it (-fsanitize=fuzzer); fuzz_driver.cpp runs it with any compiler.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace scree::fuzz {

/// Well-formed inputs that mutations start from.
std::vector<std::string> seeds();

/// An invariant that holds in every build, asserts or not.
inline void require(bool holds, const char* what) {
    if (holds) return;
    std::fprintf(stderr, "broken: %s\n", what);
    std::abort();
}

}  // namespace scree::fuzz
