// What several tests need: seeds that are printed with a failure, random tiles, a folder that goes away.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>
#include <vector>

#include "common/height_tile.h"

namespace scree::test {

using Random = std::mt19937_64;

/// SCREE_TEST_SEED or a fixed one. Use with SCREE_TRACE_SEED so that a failure names it.
inline std::uint64_t seed() {
    const char* text = std::getenv("SCREE_TEST_SEED");
    return text != nullptr ? std::strtoull(text, nullptr, 10) : 4242;
}
#define SCREE_TRACE_SEED() SCOPED_TRACE("SCREE_TEST_SEED=" + std::to_string(::scree::test::seed()))

inline int uniform(Random& random, int low, int high) { return std::uniform_int_distribution<int>(low, high)(random); }

inline std::vector<std::int32_t> random_samples(Random& random, int tile_cells_log2, int amplitude) {
    const std::size_t pitch = (std::size_t{1} << tile_cells_log2) + 1;
    std::vector<std::int32_t> samples(pitch * pitch);
    for (auto& z : samples) z = uniform(random, -amplitude, amplitude);
    return samples;
}

inline std::vector<std::uint8_t> random_presence(Random& random, int tile_cells_log2, int percent) {
    std::vector<std::uint8_t> cells(std::size_t{1} << (2 * tile_cells_log2));
    for (auto& cell : cells) cell = uniform(random, 0, 99) < percent ? 1 : 0;
    return cells;
}

class TemporaryFolder {
public:
    TemporaryFolder() {
        std::string name = (std::filesystem::temp_directory_path() / "scree test \xC3\xA9 XXXXXX").string();
        path_ = ::mkdtemp(name.data());
    }
    ~TemporaryFolder() {
        std::error_code ignored;
        std::filesystem::remove_all(path_, ignored);
    }
    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;
    std::string file(const std::string& name) const { return (path_ / name).string(); }

private:
    std::filesystem::path path_;
};

inline std::vector<std::uint8_t> read_bytes(const std::string& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

inline void write_bytes(const std::string& path, const std::vector<std::uint8_t>& bytes) {
    std::ofstream out(path, std::ios::binary | std::ios::trunc);
    out.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
}

}  // namespace scree::test
