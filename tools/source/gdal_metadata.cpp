#include "tools/source/gdal_metadata.h"

#include <cmath>
#include <optional>

#include "tools/source/number_text.h"

namespace scree {
namespace {

constexpr std::size_t kMaxUnitBytes = 40;

// The value of name="..." within the tag of an element.
std::optional<std::string_view> attribute(std::string_view tag, std::string_view name) {
    for (std::size_t at = tag.find(name); at != std::string_view::npos; at = tag.find(name, at + 1)) {
        const std::size_t quote = at + name.size() + 1;
        if (at == 0 || tag[at - 1] != ' ' || quote >= tag.size() || tag[quote - 1] != '=') continue;
        const std::size_t end = tag.find(tag[quote], quote + 1);
        if ((tag[quote] != '"' && tag[quote] != '\'') || end == std::string_view::npos) continue;
        return tag.substr(quote + 1, end - quote - 1);
    }
    return std::nullopt;
}

}  // namespace

GdalBandMetadata parse_gdal_metadata(std::string_view xml) {
    GdalBandMetadata band;
    constexpr std::string_view kItem = "<Item ";
    for (std::size_t at = xml.find(kItem); at != std::string_view::npos; at = xml.find(kItem, at + 1)) {
        const std::size_t open = xml.find('>', at);
        if (open == std::string_view::npos) break;
        const std::size_t close = xml.find('<', open);
        if (close == std::string_view::npos) break;
        const std::string_view tag = xml.substr(at, open - at);
        const std::string_view text = xml.substr(open + 1, close - open - 1);
        if (attribute(tag, "sample") != std::string_view("0")) continue;
        const std::string_view role = attribute(tag, "role").value_or("");
        const std::optional<double> number = parse_number(text);
        if (role == "scale" && number && std::isfinite(*number) && *number != 0) band.scale = *number;
        if (role == "offset" && number && std::isfinite(*number)) band.offset = *number;
        if (role == "unittype") band.unit = std::string(text.substr(0, kMaxUnitBytes));
    }
    return band;
}

}  // namespace scree
