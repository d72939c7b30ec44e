// A directory of its own for one test, removed at its end.
#pragma once

#include <atomic>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <string_view>

#include <unistd.h>

namespace scree::test {

class TempDirectory {
public:
    TempDirectory() {
        static std::atomic<int> counter{0};
        path_ = std::filesystem::temp_directory_path() /
                ("scree test " + std::to_string(::getpid()) + "-" + std::to_string(counter++));
        std::filesystem::create_directories(path_);
    }
    ~TempDirectory() {
        std::error_code ignored;
        std::filesystem::remove_all(path_, ignored);
    }
    TempDirectory(const TempDirectory&) = delete;
    TempDirectory& operator=(const TempDirectory&) = delete;

    std::string path(const std::string& name) const { return (path_ / name).string(); }
    std::string write(const std::string& name, std::string_view text) const {
        std::ofstream(path(name), std::ios::binary) << text;
        return path(name);
    }

private:
    std::filesystem::path path_;
};

inline std::string read_bytes(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

/// A file under $SCREE_DATA, or empty when the variable or the file is missing.
inline std::string data_file(const std::string& name) {
    const char* root = std::getenv("SCREE_DATA");
    if (root == nullptr) return {};
    const std::filesystem::path path = std::filesystem::path(root) / name;
    return std::filesystem::exists(path) ? path.string() : std::string();
}

}  // namespace scree::test

/// Names the file for the rest of the test or skips it, saying how to run it.
#define SCREE_DATA_OR_SKIP(variable, name)                       \
    const std::string variable = ::scree::test::data_file(name); \
    if (variable.empty()) GTEST_SKIP() << "needs " << (name) << " in the folder that $SCREE_DATA names"
