#include "tools/source/projection_file.h"

#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <string_view>

#include <fmt/format.h>

#include "tools/source/grid_file.h"

namespace scree {
namespace {

constexpr std::int64_t kMaxBytes = 65536;
constexpr std::size_t kMaxNameBytes = 200;

bool looks_like_wkt(std::string_view text) {
    const std::string start = upper_case(text.substr(0, 16));
    for (const char* word : {"PROJCS[", "GEOGCS[", "PROJCRS[", "GEOGCRS[", "GEODCRS[", "COMPD_CS[", "COMPOUNDCRS[",
                             "BOUNDCRS[", "LOCAL_CS[", "GEODETICCRS[", "GEOCCS["}) {
        if (start.starts_with(word)) return true;
    }
    return false;
}

// "Projection UTM", "Zone 10"... one a line; what follows "Parameters" are bare numbers.
std::map<std::string, std::string> keys_and_values(std::string_view text) {
    std::map<std::string, std::string> values;
    while (!text.empty()) {
        const std::size_t end = std::min(text.find_first_of("\r\n"), text.size());
        std::string_view line = text.substr(0, end);
        text.remove_prefix(std::min(end + 1, text.size()));
        const std::string key = lower_case(next_word(line));
        if (!key.empty()) values.emplace(key, lower_case(trimmed(line)));
    }
    return values;
}

struct OldDatum {
    std::string_view name;
    int geographic;
    int utm_north;  ///< code of zone 0
    int utm_south;  ///< 0: none
};
constexpr OldDatum kOldDatums[] = {{"wgs84", 4326, 32600, 32700},
                                   {"wgs_1984", 4326, 32600, 32700},
                                   {"nad83", 4269, 26900, 0},
                                   {"nad27", 4267, 26700, 0}};

std::string epsg_of_old_text(std::map<std::string, std::string>& values) {
    for (const OldDatum& datum : kOldDatums) {
        if (values["datum"] != datum.name) continue;
        const std::string& units = values["units"];
        if (values["projection"] == "geographic" && (units == "dd" || units == "degrees"))
            return fmt::format("EPSG:{}", datum.geographic);
        if (values["projection"] != "utm" || (units != "meters" && units != "metres")) return {};
        const auto zone = whole_number(values["zone"], -60, 60);
        const int base = zone.value_or(0) < 0 ? datum.utm_south : datum.utm_north;
        if (!zone || *zone == 0 || base == 0) return {};
        // NAD83 and NAD27 are registered for zones 1 to 23 only.
        if (datum.utm_south == 0 && *zone > 22) return {};
        return fmt::format("EPSG:{}", base + std::abs(*zone));
    }
    return {};
}

}  // namespace

std::optional<std::string> projection_file_beside(const std::string& path) {
    for (const char* extension : {".prj", ".PRJ", ".Prj"}) {
        std::error_code ignored;
        const std::string name = std::filesystem::path(path).replace_extension(extension).string();
        if (name != path && std::filesystem::is_regular_file(name, ignored)) return name;
    }
    return std::nullopt;
}

Result<void> take_projection_file(const std::string& path, Georeference& place) {
    const auto name = projection_file_beside(path);
    if (!name) return {};
    const Result<std::string> read = read_text_file(*name, kMaxBytes);
    if (!read) return read.error();
    std::string_view text = trimmed(*read);
    if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
    if (looks_like_wkt(text)) {
        if (!place.crs.empty()) return {};
        place.crs = std::string(text);
        place.geographic = upper_case(text.substr(0, 3)) == "GEO";
        return {};
    }
    auto values = keys_and_values(text);
    if (place.height_unit_m == 0 && values["zunits"] != "no") place.height_unit_m = length_unit_m(values["zunits"]);
    if (!place.crs.empty()) return {};
    place.crs = epsg_of_old_text(values);
    place.geographic = values["projection"] == "geographic";
    if (place.crs_name.empty()) place.crs_name = std::string(text.substr(0, kMaxNameBytes));
    return {};
}

double length_unit_m(std::string_view name) {
    constexpr std::pair<std::string_view, double> kUnits[] = {{"m", 1},
                                                              {"meter", 1},
                                                              {"meters", 1},
                                                              {"metre", 1},
                                                              {"metres", 1},
                                                              {"dm", 0.1},
                                                              {"decimeters", 0.1},
                                                              {"cm", 0.01},
                                                              {"centimeters", 0.01},
                                                              {"centimetre", 0.01},
                                                              {"mm", 0.001},
                                                              {"ft", 0.3048},
                                                              {"foot", 0.3048},
                                                              {"feet", 0.3048},
                                                              {"international foot", 0.3048},
                                                              {"us-ft", 1200.0 / 3937},
                                                              {"us_ft", 1200.0 / 3937},
                                                              {"sft", 1200.0 / 3937},
                                                              {"us survey foot", 1200.0 / 3937},
                                                              {"us survey feet", 1200.0 / 3937},
                                                              {"foot_us", 1200.0 / 3937}};
    const std::string lower = lower_case(trimmed(name));
    for (const auto& [unit, metres] : kUnits)
        if (lower == unit) return metres;
    return 0;
}

}  // namespace scree
