#include "tools/source/source_list.h"

#include <algorithm>
#include <filesystem>

#include <fmt/format.h>

#include "tools/source/raster_formats.h"

namespace scree {
namespace {

namespace fs = std::filesystem;

Error unusable(const std::string& path, const std::string& what) {
    return {ErrorCode::input, fmt::format("{}: {}", path, what)};
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
        } else if (at->is_regular_file(ignored) && is_raster_in_folder(at->path().string())) {
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
