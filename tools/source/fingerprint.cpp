#include "tools/source/fingerprint.h"

#include <fmt/format.h>
#include <xxhash.h>

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <vector>

namespace scree {
namespace {
constexpr std::int64_t kPartBytes = std::int64_t{1} << 20;
}

std::string fingerprint_of(const std::string& path) {
    std::ifstream file(path, std::ios::binary | std::ios::ate);
    const std::int64_t size = file ? static_cast<std::int64_t>(file.tellg()) : -1;
    if (size < 0) return {};
    std::vector<char> bytes(static_cast<std::size_t>(std::min(size, 2 * kPartBytes)));
    const std::int64_t first = std::min(size, kPartBytes), last = static_cast<std::int64_t>(bytes.size()) - first;
    file.seekg(0);
    file.read(bytes.data(), first);
    file.seekg(size - last);
    file.read(bytes.data() + first, last);
    if (!file) return {};
    return fmt::format("{:016x}", XXH3_64bits_withSeed(bytes.data(), bytes.size(), static_cast<std::uint64_t>(size)));
}

std::uint64_t fingerprint_of_bytes(std::string_view bytes) { return XXH3_64bits(bytes.data(), bytes.size()); }

}  // namespace scree
