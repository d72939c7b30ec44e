#include <array>
#include <cctype>
#include <filesystem>
#include <utility>

#include <fmt/format.h>

#include "tools/source/grid_file.h"
#include "tools/source/raw_samples.h"

namespace scree {
namespace {

struct Corner {
    int latitude_deg = 0;
    int longitude_deg = 0;
};

struct Sides {
    std::int64_t columns = 0;
    std::int64_t rows = 0;
};

// `text` begins with digits of just that number.
std::optional<int> digits(std::string_view text, std::size_t count) {
    if (text.size() < count) return std::nullopt;
    if (text.size() > count && std::isdigit(static_cast<unsigned char>(text[count])) != 0) return std::nullopt;
    int value = 0;
    for (const char c : text.substr(0, count)) {
        if (std::isdigit(static_cast<unsigned char>(c)) == 0) return std::nullopt;
        value = value * 10 + (c - '0');
    }
    return value;
}

// "N37W123" or "n37_w123" at the start of `text` (upper case).
std::optional<Corner> corner_at(std::string_view text) {
    if (text.size() < 7 || (text[0] != 'N' && text[0] != 'S')) return std::nullopt;
    const bool south = text[0] == 'S';
    std::string_view east_west = text.substr(3);
    const std::optional<int> latitude = digits(text.substr(1), 2);
    if (east_west[0] == '_') east_west.remove_prefix(1);
    if (!latitude || (east_west[0] != 'E' && east_west[0] != 'W')) return std::nullopt;
    const std::optional<int> longitude = digits(east_west.substr(1), 3);
    if (!longitude) return std::nullopt;
    const Corner corner{south ? -*latitude : *latitude, east_west[0] == 'W' ? -*longitude : *longitude};
    if (corner.latitude_deg < -90 || corner.latitude_deg > 89) return std::nullopt;
    if (corner.longitude_deg < -180 || corner.longitude_deg > 179) return std::nullopt;
    return corner;
}

std::optional<Corner> corner_of(const std::string& path) {
    const std::string name = upper_case(std::filesystem::path(path).filename().string());
    for (std::size_t at = 0; at < name.size(); ++at) {
        if (at > 0 && std::isalnum(static_cast<unsigned char>(name[at - 1])) != 0) continue;
        if (const auto corner = corner_at(std::string_view(name).substr(at))) return corner;
    }
    return std::nullopt;
}

// A degree of 3", 1" or half a second from edge to edge, its columns up to six times as wide toward the poles.
std::optional<Sides> sides_of(std::int64_t bytes) {
    for (const std::int64_t cells : {1200, 3600, 7200}) {
        for (const std::int64_t wider : {1, 2, 3, 4, 6}) {
            const Sides sides{cells / wider + 1, cells + 1};
            if (sides.columns * sides.rows * 2 == bytes) return sides;
        }
    }
    return std::nullopt;
}

}  // namespace

Result<GridFile> open_hgt(ByteFile file) {
    const auto corner = corner_of(file.path());
    if (!corner)
        return unusable_grid(file.path(),
                             "the name of an .hgt file gives its south-west corner, such as N37W123.hgt; this one does "
                             "not, so the tile lies nowhere");
    const auto sides = sides_of(file.size());
    if (!sides)
        return unusable_grid(
            file.path(),
            fmt::format("{} bytes are no .hgt tile: 1201 x 1201 samples are 2884802, 3601 x 3601 are 25934402, and "
                        "1801 x 3601 are 12970802",
                        file.size()));
    GridFile grid;
    Georeference place;
    place.first_x = corner->longitude_deg;
    place.first_y = corner->latitude_deg + 1;
    place.column_x = 1.0 / static_cast<double>(sides->columns - 1);
    place.row_y = -1.0 / static_cast<double>(sides->rows - 1);
    place.raster_is_point = true;
    place.crs = "EPSG:4326";
    place.crs_name = "WGS 84";
    place.geographic = true;
    place.vertical_datum = "EPSG:5773";
    place.height_unit_m = 1;
    grid.georeference = place;
    grid.nodata = "-32768";
    RawSamples samples;
    samples.width = sides->columns;
    samples.height = sides->rows;
    samples.type = SampleType::i16;
    samples.big_endian = true;
    samples.pixel_bytes = samples.channel_bytes = 2;
    samples.row_bytes = 2 * sides->columns;
    Result<std::unique_ptr<PixelDecoder>> decoder = make_raw_decoder(std::move(file), samples);
    if (!decoder) return decoder.error();
    grid.decoder = std::move(*decoder);
    return grid;
}

}  // namespace scree
