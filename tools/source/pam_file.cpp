#include "tools/source/pam_file.h"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>

#include "tools/source/byte_file.h"
#include "tools/source/grid_file.h"
#include "tools/source/number_text.h"

namespace scree {
namespace {

constexpr std::int64_t kMaxBytes = std::int64_t{16} << 20;  // histograms and statistics may stand there, too
constexpr std::size_t kMaxNodataBytes = 400;

/// What stands between <name ...> and the next tag, of the first such element from `from` on; empty without one. Those
/// that are asked for hold text alone.
std::string_view text_of(std::string_view xml, const std::string& name) {
    const std::string open = "<" + name;
    for (std::size_t at = xml.find(open); at != std::string_view::npos; at = xml.find(open, at + 1)) {
        const std::size_t after = at + open.size();
        if (after >= xml.size() || (xml[after] != '>' && xml[after] != ' ')) continue;  // a longer name
        const std::size_t begin = xml.find('>', after);
        if (begin == std::string_view::npos || xml[begin - 1] == '/') return {};
        const std::size_t end = xml.find('<', begin);
        return end == std::string_view::npos ? std::string_view() : xml.substr(begin + 1, end - begin - 1);
    }
    return {};
}

std::string unescaped(std::string_view text) {
    constexpr std::pair<std::string_view, char> kEntities[] = {
        {"&quot;", '"'}, {"&apos;", '\''}, {"&lt;", '<'}, {"&gt;", '>'}, {"&amp;", '&'}};
    std::string out;
    while (!text.empty()) {
        char c = text[0];
        std::size_t bytes = 1;
        for (const auto& [entity, stands_for] : kEntities)
            if (text.starts_with(entity)) {
                c = stands_for;
                bytes = entity.size();
            }
        out += c;
        text.remove_prefix(bytes);
    }
    return out;
}

/// The dataset's part, and that of its first band. Bands may come in any order, and before the dataset's elements.
struct Parts {
    std::string dataset;
    std::string_view band;
};
Parts parts_of(std::string_view xml) {
    constexpr std::string_view kOpen = "<PAMRasterBand", kClose = "</PAMRasterBand>";
    Parts parts;
    while (true) {
        const std::size_t open = xml.find(kOpen);
        parts.dataset += xml.substr(0, open);
        if (open == std::string_view::npos) return parts;
        const std::size_t close = xml.find(kClose, open), tag_end = xml.find('>', open);
        if (close == std::string_view::npos || tag_end == std::string_view::npos) return parts;
        if (xml.substr(open, tag_end - open).find("band=\"1\"") != std::string_view::npos)
            parts.band = xml.substr(open, close - open);
        xml.remove_prefix(close + kClose.size());
    }
}

Result<std::array<double, 6>> parse_geotransform(std::string_view text) {
    std::array<double, 6> numbers{};
    std::string_view rest = text;
    for (std::size_t i = 0; i < numbers.size(); ++i) {
        const std::size_t comma = std::min(rest.find(','), rest.size());
        const auto number = parse_number(trimmed(rest.substr(0, comma)));
        const bool last = comma == rest.size();
        if (!number || !std::isfinite(*number) || last != (i + 1 == numbers.size()))
            return Error{ErrorCode::input, fmt::format("its GeoTransform is '{}', not six numbers, so the raster lies "
                                                       "nowhere",
                                                       trimmed(text).substr(0, 80))};
        numbers[i] = *number;
        rest.remove_prefix(last ? comma : comma + 1);
    }
    return numbers;
}

}  // namespace

Result<PamFile> parse_pam(std::string_view xml) {
    PamFile pam;
    if (xml.find("<PAMDataset") == std::string_view::npos) return pam;
    const Parts parts = parts_of(xml);
    if (const std::string_view text = text_of(parts.dataset, "GeoTransform"); !text.empty()) {
        auto numbers = parse_geotransform(text);
        if (!numbers) return numbers.error();
        pam.geotransform = *numbers;
    }
    pam.crs = unescaped(trimmed(text_of(parts.dataset, "SRS")));
    // An engineering CRS says that nothing is known of the place.
    for (const char* local : {"LOCAL_CS", "ENGCRS", "ENGINEERINGCRS"})
        if (upper_case(pam.crs).starts_with(local)) pam.crs.clear();
    if (const std::string_view text = trimmed(text_of(parts.band, "NoDataValue"));
        !text.empty() && text.size() <= kMaxNodataBytes)
        pam.nodata = std::string(text);
    const auto number_of = [&](const char* name) {
        const auto number = parse_number(trimmed(text_of(parts.band, name)));
        return number && std::isfinite(*number) ? number : std::nullopt;
    };
    pam.scale = number_of("Scale");
    if (pam.scale == 0.0) pam.scale.reset();
    pam.offset = number_of("Offset");
    pam.unit = unescaped(trimmed(text_of(parts.band, "UnitType")).substr(0, kMaxNodataBytes));
    return pam;
}

Result<PamFile> read_pam(const std::string& path) {
    const std::string name = path + ".aux.xml";
    std::error_code ignored;
    if (!std::filesystem::is_regular_file(name, ignored) || std::filesystem::file_size(name, ignored) == 0)
        return PamFile{};
    const auto text = read_text_file(name, kMaxBytes);
    if (!text) return text.error();
    auto pam = parse_pam(*text);
    if (!pam) return Error{pam.error().code, fmt::format("{}: {}", name, pam.error().message)};
    return pam;
}

Result<void> place_by(const PamFile& pam, const std::string& path, Georeference& place) {
    const std::array<double, 6>& t = *pam.geotransform;
    place.column_x = t[1];
    place.row_x = t[2];
    place.column_y = t[4];
    place.row_y = t[5];
    place.first_x = t[0] + (t[1] + t[2]) / 2;
    place.first_y = t[3] + (t[4] + t[5]) / 2;
    return check_place(place, path, "the GeoTransform of its .aux.xml");
}

}  // namespace scree
