#include "tools/source/grid_file.h"

#include <array>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <utility>

#include <fmt/format.h>

#include "tools/source/number_text.h"
#include "tools/source/pam_file.h"
#include "tools/source/projection_file.h"

namespace scree {
namespace {

constexpr std::size_t kSniffBytes = 1024;
constexpr std::string_view kSpace(" \t\r\n\f\v\0", 7);

std::optional<std::string> header_beside(const std::string& path) {
    for (const char* extension : {".hdr", ".HDR", ".Hdr"}) {
        std::error_code ignored;
        const std::string replaced = std::filesystem::path(path).replace_extension(extension).string();
        if (replaced != path && std::filesystem::is_regular_file(replaced, ignored)) return replaced;
        if (std::filesystem::is_regular_file(path + extension, ignored)) return path + extension;
    }
    return std::nullopt;
}

enum class Kind { none, hgt, ascii_grid, raw, dted, usgs_dem };

struct Found {
    Kind kind = Kind::none;
    std::string header_path;  ///< raw only
};

bool begins_as_tiff_or_erdas(std::string_view start) {
    return start.starts_with("II*") || start.starts_with("MM") || start.starts_with("II+") ||
           start.starts_with("EHFA_HEADER_TAG");
}

Result<Found> kind_of(const std::string& path, std::string_view start) {
    const std::string extension = lower_case(std::filesystem::path(path).extension().string());
    const auto is_one_of = [&](std::initializer_list<const char*> names) {
        for (const char* name : names)
            if (extension == name) return true;
        return false;
    };
    if (looks_like_dted(start) || is_one_of({".dt0", ".dt1", ".dt2"})) return Found{Kind::dted, {}};
    if (is_one_of({".hgt"})) return Found{Kind::hgt, {}};
    if (looks_like_ascii_grid(start) && !is_one_of({".hdr"})) return Found{Kind::ascii_grid, {}};
    if (is_one_of({".asc"})) return Found{Kind::ascii_grid, {}};
    const std::optional<std::string> header = header_beside(path);
    if (is_one_of({".bil", ".bip", ".bsq", ".flt"})) {
        if (header) return Found{Kind::raw, *header};
        return unusable_grid(path,
                             "a raw grid needs its header, the file of the same name that ends in .hdr; there is "
                             "none beside it");
    }
    if (header && is_one_of({".dem", ".img", ".raw", ".dat", ".bin", ""}) && !begins_as_tiff_or_erdas(start))
        return Found{Kind::raw, *header};
    if (is_one_of({".dem"}) || looks_like_usgs_dem(start)) return Found{Kind::usgs_dem, {}};
    const bool radiance = start.starts_with("#?");
    if (is_one_of({".hdr"}) && !radiance)
        return unusable_grid(path, "this is the header of a raster; name the raster that lies beside it");
    return Found{};
}

Result<GridFile> open_found(ByteFile file, const Found& found) {
    switch (found.kind) {
        case Kind::hgt:
            return open_hgt(std::move(file));
        case Kind::ascii_grid:
            return open_ascii_grid(std::move(file));
        case Kind::raw:
            return open_raw_grid(std::move(file), found.header_path);
        case Kind::dted:
            return open_dted(std::move(file));
        default:
            return open_usgs_dem(std::move(file));
    }
}

// What the header leaves open, an .aux.xml, a world file and a projection file beside it may say.
Result<void> ask_sidecars(const std::string& path, GridFile& grid) {
    const Result<PamFile> pam = read_pam(path);
    if (!pam) return pam.error();
    if (!grid.nodata) grid.nodata = pam->nodata;
    if (!grid.georeference && pam->geotransform) {
        grid.georeference.emplace();
        if (auto placed = place_by(*pam, path, *grid.georeference); !placed) return placed;
    }
    if (!grid.georeference) {
        Result<std::optional<Georeference>> world = read_world_file(path);
        if (!world) return world.error();
        grid.georeference = std::move(*world);
    }
    if (grid.georeference && grid.georeference->crs.empty()) grid.georeference->crs = pam->crs;
    if (grid.georeference) return take_projection_file(path, *grid.georeference);
    return {};
}

}  // namespace

Result<std::optional<GridFile>> open_grid_file(const std::string& path) {
    Result<ByteFile> file = ByteFile::open(path);
    if (!file) return file.error();
    const Result<std::string> start = file->head(kSniffBytes);
    if (!start) return start.error();
    const Result<Found> found = kind_of(path, *start);
    if (!found) return found.error();
    if (found->kind == Kind::none) return std::optional<GridFile>{};
    Result<GridFile> grid = open_found(std::move(*file), *found);
    if (!grid) return grid.error();
    if (auto asked = ask_sidecars(path, *grid); !asked) return asked.error();
    return std::optional<GridFile>(std::move(*grid));
}

Error unusable_grid(const std::string& path, const std::string& what) {
    return {ErrorCode::input, fmt::format("{}: {}", path, what)};
}

std::optional<std::int64_t> whole_number(std::string_view text, std::int64_t low, std::int64_t high) {
    const std::optional<double> value = parse_number(text);
    if (!value || *value != std::floor(*value)) return std::nullopt;
    if (!(*value >= static_cast<double>(low) && *value <= static_cast<double>(high))) return std::nullopt;
    if (std::abs(*value) > 0x1p53) return std::nullopt;
    return static_cast<std::int64_t>(*value);
}

std::string lower_case(std::string_view text) {
    std::string changed(text);
    for (char& c : changed) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return changed;
}

std::string upper_case(std::string_view text) {
    std::string changed(text);
    for (char& c : changed) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    return changed;
}

std::string_view trimmed(std::string_view text) {
    const std::size_t first = text.find_first_not_of(kSpace);
    if (first == std::string_view::npos) return {};
    return text.substr(first, text.find_last_not_of(kSpace) - first + 1);
}

std::string_view next_word(std::string_view& rest) {
    const std::size_t first = rest.find_first_not_of(kSpace);
    if (first == std::string_view::npos) return rest = {};
    const std::size_t end = std::min(rest.find_first_of(kSpace, first), rest.size());
    const std::string_view word = rest.substr(first, end - first);
    rest.remove_prefix(end);
    return word;
}

}  // namespace scree
