#include "tools/source/source_list.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>
#include <string_view>

#include <fmt/format.h>

namespace scree {
namespace {

namespace fs = std::filesystem;

Error unusable(const std::string& path, const std::string& what) {
    return {ErrorCode::input, fmt::format("{}: {}", path, what)};
}

// What rasters are called. In a folder only these are taken: what else lies there (reports, archives, sidecars) is not
// the user's word.
constexpr std::array kRasterExtensions = {".tif", ".tiff", ".btf", ".png", ".jpg", ".jpeg", ".jp2", ".j2k", ".jpc",
                                          ".exr", ".bmp",  ".pnm", ".pgm", ".ppm", ".webp", ".tga", ".hgt", ".asc",
                                          ".bil", ".bip",  ".bsq", ".flt", ".dt0", ".dt1",  ".dt2", ".dem"};
// Those that are rasters only with a text header beside.
constexpr std::array kHeaderedExtensions = {".img", ".raw", ".dat", ".bin"};

std::string lower_extension(const fs::path& path) {
    std::string extension = path.extension().string();
    for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return extension;
}

template <class List>
bool holds(const List& list, std::string_view word) {
    return std::find(list.begin(), list.end(), word) != list.end();
}

bool has_header_beside(const fs::path& path) {
    std::error_code ignored;
    for (const char* extension : {".hdr", ".HDR"}) {
        fs::path replaced = path;
        if (fs::exists(replaced.replace_extension(extension), ignored)) return true;
        fs::path appended = path;
        if (fs::exists(appended += extension, ignored)) return true;
    }
    return false;
}

bool is_raster(const fs::path& path) {
    const std::string extension = lower_extension(path);
    if (holds(kRasterExtensions, extension)) return true;
    return holds(kHeaderedExtensions, extension) && has_header_beside(path);
}

bool is_hidden(const fs::path& path) {
    const std::string name = path.filename().string();
    return !name.empty() && name[0] == '.';
}

Result<std::vector<std::string>> rasters_below(const std::string& folder) {
    std::vector<std::string> found;
    std::error_code status;
    // Links to folders are not followed: they may lead round in a circle.
    fs::recursive_directory_iterator at(folder, status);
    while (!status && at != fs::recursive_directory_iterator()) {
        std::error_code ignored;
        if (is_hidden(at->path())) {
            if (at->is_directory(ignored)) at.disable_recursion_pending();
        } else if (at->is_regular_file(ignored) && is_raster(at->path())) {
            found.push_back(at->path().string());
        }
        at.increment(status);
    }
    if (status) return unusable(folder, fmt::format("the folder cannot be searched ({})", status.message()));
    if (found.empty())
        return unusable(folder, "no raster of a known kind lies in this folder, so there is nothing to read from it");
    std::sort(found.begin(), found.end());
    return found;
}

}  // namespace

Result<std::vector<std::string>> list_sources(const std::vector<std::string>& paths) {
    std::vector<std::string> sources;
    for (const std::string& path : paths) {
        std::error_code status;
        const fs::file_status facts = fs::status(path, status);
        if (facts.type() == fs::file_type::not_found) return unusable(path, "no such file or folder");
        if (!fs::status_known(facts)) return unusable(path, fmt::format("cannot be reached ({})", status.message()));
        if (!fs::is_directory(facts)) {
            sources.push_back(path);
            continue;
        }
        Result<std::vector<std::string>> found = rasters_below(path);
        if (!found) return found.error();
        sources.insert(sources.end(), found->begin(), found->end());
    }
    return sources;
}

}  // namespace scree
