#include "tools/source/sidecars.h"

#include <fmt/format.h>

#include <filesystem>

#include "tools/source/fingerprint.h"
#include "tools/source/georeference.h"
#include "tools/source/projection_file.h"
#include "tools/source/raster_formats.h"

namespace scree {

namespace fs = std::filesystem;

std::vector<std::string> sidecars_of(const std::string& path) {
    std::vector<std::string> found;
    std::error_code ignored;
    const bool grid = grid_format_of(path) != nullptr;
    if (grid)
        if (auto header = header_beside(path)) found.push_back(std::move(*header));
    if (auto projection = projection_file_beside(path)) found.push_back(std::move(*projection));
    if (auto world = world_file_beside(path)) found.push_back(std::move(*world));
    for (const char* suffix : {".aux.xml", ".msk"})
        if (fs::is_regular_file(path + suffix, ignored)) found.push_back(path + suffix);
    return found;
}

SidecarPrints sidecar_prints(const std::string& path) {
    SidecarPrints prints;
    for (const std::string& sidecar : sidecars_of(path))
        prints[fs::path(sidecar).filename().string()] = fingerprint_of(sidecar);
    return prints;
}

std::string sidecar_difference(const SidecarPrints& then, const SidecarPrints& now) {
    std::string said;
    const auto say = [&](const std::string& name, const char* what) {
        said += fmt::format("{}{} {}", said.empty() ? "" : ", ", name, what);
    };
    for (const auto& [name, print] : then) {
        const auto same = now.find(name);
        if (same == now.end())
            say(name, "is gone");
        else if (same->second != print)
            say(name, "has changed");
    }
    for (const auto& [name, print] : now)
        if (then.count(name) == 0) say(name, "is new");
    return said;
}

}  // namespace scree
