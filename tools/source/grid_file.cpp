#include "tools/source/grid_file.h"

#include <cctype>
#include <cmath>
#include <filesystem>
#include <utility>

#include <fmt/format.h>

#include "tools/source/number_text.h"
#include "tools/source/pam_file.h"
#include "tools/source/projection_file.h"
#include "tools/source/raster_formats.h"

namespace scree {
namespace {

constexpr std::string_view kSpace(" \t\r\n\f\v\0", 7);

// What a user named that is no raster but the text beside one. Radiance images are called so, too.
bool is_header_of_a_raster(const std::string& path, std::string_view start) {
    return lower_case(std::filesystem::path(path).extension().string()) == ".hdr" && !start.starts_with("#?");
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
    if (is_header_of_a_raster(path, *start))
        return unusable_grid(path, "this is the header of a raster; name the raster that lies beside it");
    const GridFormat* format = grid_format_of(path, *start);
    if (format == nullptr) return std::optional<GridFile>{};
    Result<GridFile> grid = format->open(std::move(*file));
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
