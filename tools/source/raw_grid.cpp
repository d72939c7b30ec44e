#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "tools/source/grid_file.h"
#include "tools/source/number_text.h"
#include "tools/source/raster_formats.h"
#include "tools/source/raw_samples.h"

namespace scree {
namespace {

constexpr std::int64_t kMaxHeaderBytes = std::int64_t{1} << 20;  // ENVI headers list bands and wavelengths
constexpr std::int64_t kMaxChannels = 1024;

// Keys in lower case.
using Values = std::map<std::string, std::string>;

enum class Interleave { by_line, by_pixel, sequential };

std::optional<SampleType> integer_type(std::int64_t bits, bool is_signed) {
    switch (bits) {
        case 8:
            return is_signed ? SampleType::i8 : SampleType::u8;
        case 16:
            return is_signed ? SampleType::i16 : SampleType::u16;
        case 32:
            return is_signed ? SampleType::i32 : SampleType::u32;
        case 64:
            return is_signed ? SampleType::i64 : SampleType::u64;
        default:
            return std::nullopt;
    }
}

// One header and what has been taken from it. The first complaint stands.
class HeaderReader {
public:
    HeaderReader(std::string path, Values values) : path_(std::move(path)), values_(std::move(values)) {}

    std::optional<std::string> text(const std::string& key) const {
        const auto at = values_.find(key);
        return at == values_.end() ? std::nullopt : std::optional(at->second);
    }

    std::optional<std::string> first_text(std::initializer_list<const char*> keys) const {
        for (const char* key : keys)
            if (auto value = text(key)) return value;
        return std::nullopt;
    }

    std::int64_t count(const char* key, std::int64_t low, std::int64_t high, std::optional<std::int64_t> otherwise) {
        const auto value = text(key);
        if (!value && otherwise) return *otherwise;
        const auto number = whole_number(value.value_or(""), low, high);
        if (!number)
            complain(value ? fmt::format("{} is '{}', but it must be {} to {}", key, value->substr(0, 40), low, high)
                           : fmt::format("it lacks {}", key));
        return number.value_or(low);
    }

    std::optional<double> number(const char* key) {
        const auto value = text(key);
        if (!value) return std::nullopt;
        const auto read = parse_number(*value);
        if (!read || !std::isfinite(*read)) complain(fmt::format("{} is '{}', no number", key, value->substr(0, 40)));
        return read;
    }

    void complain(const std::string& what) {
        if (complaint_.empty()) complaint_ = what;
    }

    Result<void> verdict() const {
        if (complaint_.empty()) return {};
        return unusable_grid(path_, fmt::format("in this header {}, so the samples cannot be found", complaint_));
    }

private:
    std::string path_;
    Values values_;
    std::string complaint_;
};

struct RawGrid {
    RawSamples samples;
    std::optional<std::string> nodata;
    std::optional<Georeference> place;
};

// "KEY value", one a line.
Values esri_values(std::string_view text) {
    Values values;
    while (!text.empty()) {
        const std::size_t end = std::min(text.find_first_of("\r\n"), text.size());
        std::string_view line = text.substr(0, end);
        text.remove_prefix(std::min(end + 1, text.size()));
        const std::string key = lower_case(next_word(line));
        if (!key.empty()) values.emplace(key, trimmed(line));
    }
    return values;
}

// "key = value" or "key = {several lines}".
Values envi_values(std::string_view text) {
    Values values;
    while (!text.empty()) {
        const std::size_t line_end = std::min(text.find('\n'), text.size());
        const std::size_t equals = text.find('=');
        if (equals >= line_end) {
            text.remove_prefix(std::min(line_end + 1, text.size()));
            continue;
        }
        const std::string key = lower_case(trimmed(text.substr(0, equals)));
        std::size_t end = line_end;
        std::string_view value = trimmed(text.substr(equals + 1, end - equals - 1));
        if (value.starts_with('{')) {
            end = std::min(text.find('}', equals), text.size());
            const std::size_t open = text.find('{', equals);
            value = trimmed(text.substr(open + 1, end - open - 1));
            if (end < text.size()) ++end;
        }
        values.emplace(key, value);
        text.remove_prefix(std::min(end + 1, text.size()));
    }
    return values;
}

std::int64_t saturating_product(std::int64_t a, std::int64_t b) {
    std::int64_t product = 0;
    return __builtin_mul_overflow(a, b, &product) ? std::numeric_limits<std::int64_t>::max() : product;
}

// What is left open by the header's own strides is tightly packed. Strides above the file's size are refused here, so
// that sums of them do not overflow.
void lay_out(Interleave interleave, std::int64_t file_bytes, HeaderReader& header, RawSamples& s) {
    const auto sample = static_cast<std::int64_t>(memory_bytes(s.type));
    const std::int64_t row = s.width * s.channels * sample;  // at most 2^43
    const std::int64_t all = saturating_product(row, s.height);
    if (all > file_bytes)
        return header.complain(fmt::format("{} x {} samples of {} channels need {} bytes where the file has {}",
                                           s.width, s.height, s.channels, all, file_bytes));
    const std::int64_t band_row = s.width * sample;
    switch (interleave) {
        case Interleave::by_pixel:
            s.pixel_bytes = s.channels * sample;
            s.channel_bytes = sample;
            s.row_bytes = header.count("totalrowbytes", row, file_bytes, row);
            break;
        case Interleave::by_line:
            s.pixel_bytes = sample;
            s.channel_bytes = header.count("bandrowbytes", band_row, file_bytes, band_row);
            s.row_bytes = saturating_product(s.channel_bytes, s.channels);
            s.row_bytes = header.count("totalrowbytes", row, file_bytes, s.row_bytes);
            break;
        case Interleave::sequential:
            s.pixel_bytes = sample;
            s.row_bytes = band_row;
            s.channel_bytes = band_row * s.height;
            s.channel_bytes += header.count("bandgapbytes", 0, file_bytes, 0);
            break;
    }
}

// Negative voids say that samples have a sign, where nothing else does (GTOPO30).
bool is_signed(const HeaderReader& header, const std::optional<std::string>& nodata) {
    if (const auto type = header.text("pixeltype")) return lower_case(*type).starts_with("signed");
    const auto value = parse_number(nodata.value_or(""));
    return value && *value < 0;
}

void read_esri_type(HeaderReader& header, bool gridfloat, const std::optional<std::string>& nodata, RawSamples& s) {
    const std::string type = lower_case(header.text("pixeltype").value_or(gridfloat ? "float" : ""));
    const std::int64_t bits = header.count("nbits", 1, 64, gridfloat ? 32 : 8);
    if (type == "float") {
        s.type = bits == 64 ? SampleType::f64 : SampleType::f32;
        if (bits != 32 && bits != 64) header.complain(fmt::format("nbits is {} for floats, not 32 or 64", bits));
    } else if (const auto integer = integer_type(bits, is_signed(header, nodata))) {
        s.type = *integer;
    } else {
        header.complain(fmt::format("nbits is {}; 8, 16, 32 and 64 can be read", bits));
    }
    const std::string order = lower_case(header.text("byteorder").value_or("i"));
    if (order == "m" || order.starts_with("msb") || order == "motorola" || order == "big_endian")
        s.big_endian = true;
    else if (order != "i" && !order.starts_with("lsb") && order != "intel" && order != "little_endian" &&
             order != "vms_float")
        header.complain(fmt::format("byteorder is '{}', neither I nor M", order.substr(0, 40)));
    if (order == "vms_float") header.complain("byteorder is VMS_FLOAT, a float format that is not read");
}

std::optional<Georeference> esri_place(HeaderReader& header, std::int64_t rows) {
    const std::optional<double> cell = header.number("cellsize");
    const auto step = [&](const char* key, const char* other_key) {
        if (header.text(key)) return header.number(key);
        return header.text(other_key) ? header.number(other_key) : cell;
    };
    const std::optional<double> step_x = step("xdim", "dx"), step_y = step("ydim", "dy");
    const auto ul_x = header.number("ulxmap");
    const auto ul_y = header.number("ulymap");
    const auto corner_x = header.number("xllcorner");
    const auto corner_y = header.number("yllcorner");
    const auto centre_x = header.number("xllcenter");
    const auto centre_y = header.number("yllcenter");
    for (const auto& distance : {step_x, step_y})
        if (distance && !(*distance > 0)) header.complain(fmt::format("the distance of samples is {}", *distance));
    Georeference place;
    place.column_x = step_x.value_or(1);
    place.row_y = -step_y.value_or(1);
    if (ul_x && ul_y) {
        place.first_x = *ul_x;
        place.first_y = *ul_y;
        return place;
    }
    if (!step_x || !step_y || !(corner_x || centre_x) || !(corner_y || centre_y)) return std::nullopt;
    const auto height = static_cast<double>(rows);
    place.first_x = centre_x ? *centre_x : *corner_x + 0.5 * *step_x;
    place.first_y = centre_y ? *centre_y + (height - 1) * *step_y : *corner_y + (height - 0.5) * *step_y;
    return place;
}

Result<RawGrid> read_esri(const ByteFile& file, const std::string& header_path, std::string_view text) {
    HeaderReader header(header_path, esri_values(text));
    const std::size_t dot = file.path().find_last_of("./");
    const std::string extension = dot == std::string::npos ? std::string() : lower_case(file.path().substr(dot));
    const bool gridfloat = extension == ".flt";
    RawGrid grid;
    RawSamples& s = grid.samples;
    s.width = header.count("ncols", 1, kMaxGridSide, std::nullopt);
    s.height = header.count("nrows", 1, kMaxGridSide, std::nullopt);
    s.channels = static_cast<int>(header.count("nbands", 1, kMaxChannels, 1));
    s.first = header.count("skipbytes", 0, std::int64_t{1} << 50, 0);
    grid.nodata = header.first_text({"nodata", "nodata_value", "nodatavalue"});
    read_esri_type(header, gridfloat, grid.nodata, s);
    const std::string otherwise = extension == ".bip" ? "bip" : extension == ".bsq" ? "bsq" : "bil";
    const std::string layout = lower_case(header.text("layout").value_or(otherwise));
    if (layout != "bil" && layout != "bip" && layout != "bsq")
        header.complain(fmt::format("layout is '{}', none of BIL, BIP and BSQ", layout.substr(0, 40)));
    if (auto ok = header.verdict(); !ok) return ok.error();
    lay_out(layout == "bip"   ? Interleave::by_pixel
            : layout == "bsq" ? Interleave::sequential
                              : Interleave::by_line,
            file.size(), header, s);
    grid.place = esri_place(header, s.height);
    if (auto ok = header.verdict(); !ok) return ok.error();
    return grid;
}

std::optional<SampleType> envi_type(std::int64_t code) {
    switch (code) {
        case 1:
            return SampleType::u8;
        case 2:
            return SampleType::i16;
        case 3:
            return SampleType::i32;
        case 4:
            return SampleType::f32;
        case 5:
            return SampleType::f64;
        case 12:
            return SampleType::u16;
        case 13:
            return SampleType::u32;
        case 14:
            return SampleType::i64;
        case 15:
            return SampleType::u64;
        default:
            return std::nullopt;
    }
}

std::vector<std::string> comma_parts(std::string_view text) {
    std::vector<std::string> parts;
    while (true) {
        const std::size_t comma = std::min(text.find(','), text.size());
        parts.emplace_back(trimmed(text.substr(0, comma)));
        if (comma == text.size()) return parts;
        text.remove_prefix(comma + 1);
    }
}

// EPSG codes of the datums that ENVI writes for geographic and UTM grids.
std::string envi_crs(const std::vector<std::string>& map_info) {
    const auto part = [&](std::size_t i) { return i < map_info.size() ? lower_case(map_info[i]) : std::string(); };
    const auto is = [](const std::string& datum, const char* name) { return datum.find(name) != std::string::npos; };
    if (part(0) == "geographic lat/lon") {
        const std::string datum = part(7);
        if (is(datum, "wgs-84")) return "EPSG:4326";
        if (is(datum, "north america 1983")) return "EPSG:4269";
        if (is(datum, "north america 1927")) return "EPSG:4267";
        return {};
    }
    const auto zone = whole_number(part(7), 1, 60);
    if (part(0) != "utm" || !zone) return {};
    const std::string datum = part(9);
    if (is(datum, "wgs-84")) return fmt::format("EPSG:{}", (part(8) == "south" ? 32700 : 32600) + *zone);
    if (part(8) == "south" || *zone > 22) return {};
    if (is(datum, "north america 1983")) return fmt::format("EPSG:{}", 26900 + *zone);
    if (is(datum, "north america 1927")) return fmt::format("EPSG:{}", 26700 + *zone);
    return {};
}

// "rotation=30" among the parts: counter-clockwise.
double envi_rotation_deg(const std::vector<std::string>& parts, HeaderReader& header) {
    double angle = 0;
    for (const std::string& part : parts) {
        if (!lower_case(part).starts_with("rotation")) continue;
        const std::size_t equals = part.find('=');
        const auto number = parse_number(equals == std::string::npos ? "" : part.substr(equals + 1));
        if (number && std::abs(*number) <= 360)
            angle = *number;
        else
            header.complain(fmt::format("map info's '{}' is no angle", part.substr(0, 40)));
    }
    return angle;
}

// map info = {projection, column, row, x, y, step x, step y, ...}: place of a point given in columns and rows that
// count from 1 at the outer edge of the first sample.
std::optional<Georeference> envi_place(HeaderReader& header) {
    const auto map_info = header.text("map info");
    if (!map_info) return std::nullopt;
    const std::vector<std::string> parts = comma_parts(*map_info);
    std::vector<double> numbers;
    for (std::size_t i = 1; i < parts.size() && i < 7; ++i) {
        const auto number = parse_number(parts[i]);
        if (!number) break;
        numbers.push_back(*number);
    }
    if (numbers.size() < 6) {
        header.complain("map info lacks one of its six numbers");
        return std::nullopt;
    }
    const double angle = envi_rotation_deg(parts, header) * std::numbers::pi / 180;
    if (angle != 0 && numbers[4] != numbers[5])
        header.complain("map info turns samples that are not square, and programs differ on what that means");
    Georeference place;
    place.column_x = numbers[4] * std::cos(angle);
    place.column_y = numbers[4] * std::sin(angle);
    place.row_x = numbers[5] * std::sin(angle);
    place.row_y = -numbers[5] * std::cos(angle);
    place.first_x = numbers[2] + (1.5 - numbers[0]) * place.column_x + (1.5 - numbers[1]) * place.row_x;
    place.first_y = numbers[3] + (1.5 - numbers[0]) * place.column_y + (1.5 - numbers[1]) * place.row_y;
    place.crs = header.text("coordinate system string").value_or(envi_crs(parts));
    place.crs_name = parts[0];
    place.geographic = lower_case(parts[0]).starts_with("geographic");
    return place;
}

Result<RawGrid> read_envi(const ByteFile& file, const std::string& header_path, std::string_view text) {
    HeaderReader header(header_path, envi_values(text));
    RawGrid grid;
    RawSamples& s = grid.samples;
    s.width = header.count("samples", 1, kMaxGridSide, std::nullopt);
    s.height = header.count("lines", 1, kMaxGridSide, std::nullopt);
    s.channels = static_cast<int>(header.count("bands", 1, kMaxChannels, 1));
    s.first = header.count("header offset", 0, std::int64_t{1} << 50, 0);
    s.big_endian = header.count("byte order", 0, 1, 0) == 1;
    const std::int64_t code = header.count("data type", 0, 99, std::nullopt);
    const auto type = envi_type(code);
    if (!type) header.complain(fmt::format("data type is {}; 1 to 5 and 12 to 15 can be read", code));
    if (header.count("file compression", 0, 99, 0) != 0) header.complain("file compression is on");
    const std::string layout = lower_case(header.text("interleave").value_or("bsq"));
    if (layout != "bil" && layout != "bip" && layout != "bsq")
        header.complain(fmt::format("interleave is '{}', none of bil, bip and bsq", layout.substr(0, 40)));
    if (auto ok = header.verdict(); !ok) return ok.error();
    s.type = *type;
    lay_out(layout == "bip"   ? Interleave::by_pixel
            : layout == "bsq" ? Interleave::sequential
                              : Interleave::by_line,
            file.size(), header, s);
    grid.nodata = header.text("data ignore value");
    grid.place = envi_place(header);
    if (auto ok = header.verdict(); !ok) return ok.error();
    return grid;
}

}  // namespace

Result<GridFile> open_raw_grid(ByteFile file) {
    const std::optional<std::string> header = header_beside(file.path());
    if (!header)
        return unusable_grid(file.path(),
                             "a raw grid needs its header, the file of the same name that ends in .hdr; there is "
                             "none beside it");
    const Result<std::string> text = read_text_file(*header, kMaxHeaderBytes);
    if (!text) return text.error();
    Result<RawGrid> grid =
        trimmed(*text).starts_with("ENVI") ? read_envi(file, *header, *text) : read_esri(file, *header, *text);
    if (!grid) return grid.error();
    if (grid->place) {
        if (auto checked = check_place(*grid->place, *header, "it"); !checked) return checked.error();
    }
    GridFile opened;
    opened.nodata = grid->nodata;
    opened.georeference = grid->place;
    Result<std::unique_ptr<PixelDecoder>> decoder = make_raw_decoder(std::move(file), grid->samples);
    if (!decoder) return decoder.error();
    opened.decoder = std::move(*decoder);
    return opened;
}

}  // namespace scree
