// GeoTIFF: OGC 19-008r4, annex B and C (tags, keys); world files: the six numbers of ESRI's format.
#include "tools/source/georeference.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <sstream>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <tiffio.h>

#include <geotiff/geo_normalize.h>
#include <geotiff/geokeys.h>
#include <geotiff/geotiff.h>
#include <geotiff/geovalues.h>
#include <geotiff/xtiffio.h>

#include "tools/source/number_text.h"
#include "tools/source/tiff_file.h"

namespace scree {
namespace {

// A rotation term below this share of the step moves the far edge of 2^20 samples by a thousandth of a sample.
constexpr double kNegligibleRotation = 1e-9;
// Six numbers of 17 digits fit 200 bytes; what is a thousand times that is not a world file.
constexpr std::uintmax_t kMaxWorldFileBytes = 65536;
// The longest citation worth keeping.
constexpr std::size_t kMaxCitationBytes = 4096;
// Ground control points are four doubles more than a tie point is; a placed image has one tie point.
constexpr std::uint16_t kTiePointDoubles = 6;

struct GtifDeleter {
    void operator()(GTIF* keys) const { GTIFFree(keys); }
};
using GtifHandle = std::unique_ptr<GTIF, GtifDeleter>;

void ignore_geotiff_message(GTIF*, int, const char*, ...) {}

// What the tags say: a CRS, a place, or both.
struct GeotiffTags {
    Georeference reference;
    bool has_crs = false;
    bool has_transform = false;
};

std::optional<std::uint16_t> short_key(GTIF* keys, geokey_t key) {
    unsigned short value = 0;
    if (GTIFKeyGetSHORT(keys, key, &value, 0, 1) != 1) return std::nullopt;
    return value;
}

std::string text_key(GTIF* keys, geokey_t key) {
    int bytes = 0;
    tagtype_t type = TYPE_UNKNOWN;
    const int count = GTIFKeyInfo(keys, key, &bytes, &type);
    if (count <= 0 || type != TYPE_ASCII) return {};
    std::string text(std::min<std::size_t>(static_cast<std::size_t>(count), kMaxCitationBytes) + 1, '\0');
    if (GTIFKeyGetASCII(keys, key, text.data(), static_cast<int>(text.size())) <= 0) return {};
    text.resize(text.find('\0') == std::string::npos ? text.size() : text.find('\0'));
    while (!text.empty() && (text.back() == '|' || std::isspace(static_cast<unsigned char>(text.back()))))
        text.pop_back();
    return text;
}

std::string epsg(std::uint16_t code) { return fmt::format("EPSG:{}", code); }

bool is_code(std::optional<std::uint16_t> value) { return value && *value != KvUndefined && *value != KvUserDefined; }

double unit_length_m(std::uint16_t code) {
    double metres = 1;
    return GTIFGetUOMLengthInfo(code, nullptr, &metres) == 1 && std::isfinite(metres) && metres > 0 ? metres : 1.0;
}

double linear_unit_m(GTIF* keys, std::optional<std::uint16_t> projected_code) {
    const auto unit = short_key(keys, ProjLinearUnitsGeoKey);
    if (is_code(unit)) return unit_length_m(*unit);
    if (unit == KvUserDefined) {
        double metres = 1;
        if (GTIFKeyGetDOUBLE(keys, ProjLinearUnitSizeGeoKey, &metres, 0, 1) == 1 && std::isfinite(metres) && metres > 0)
            return metres;
        return 1;
    }
    // The key may be left out when the CRS is an EPSG code: then the registry says it.
    short registered = 0;
    if (is_code(projected_code) && GTIFGetPCSInfo(*projected_code, nullptr, nullptr, &registered, nullptr) == 1 &&
        registered > 0)
        return unit_length_m(static_cast<std::uint16_t>(registered));
    return 1;
}

void read_crs(GTIF* keys, GeotiffTags& tags) {
    Georeference& reference = tags.reference;
    const auto model = short_key(keys, GTModelTypeGeoKey);
    const auto projected = short_key(keys, ProjectedCSTypeGeoKey);
    const auto geographic = short_key(keys, GeographicTypeGeoKey);
    reference.geographic = model ? *model == ModelTypeGeographic : (!projected && geographic);
    tags.has_crs = model || projected || geographic;

    const auto code = reference.geographic ? geographic : projected;
    if (is_code(code)) reference.crs = epsg(*code);
    reference.crs_name = text_key(keys, reference.geographic ? GeogCitationGeoKey : PCSCitationGeoKey);
    if (reference.crs_name.empty()) reference.crs_name = text_key(keys, GTCitationGeoKey);
    if (!reference.geographic) reference.linear_unit_m = linear_unit_m(keys, projected);

    const auto vertical = short_key(keys, VerticalCSTypeGeoKey);
    const auto vertical_datum = short_key(keys, VerticalDatumGeoKey);
    if (is_code(vertical))
        reference.vertical_datum = epsg(*vertical);
    else if (is_code(vertical_datum))
        reference.vertical_datum = epsg(*vertical_datum);
}

// x = a*column + b*row + c, y = d*column + e*row + f in the file's own raster space.
struct Affine {
    double a = 0, b = 0, c = 0, d = 0, e = 0, f = 0;
};

void apply(const Affine& t, double centre, Georeference& reference) {
    reference.column_x = t.a;
    reference.row_x = t.b;
    reference.column_y = t.d;
    reference.row_y = t.e;
    reference.first_x = t.c + centre * (t.a + t.b);
    reference.first_y = t.f + centre * (t.d + t.e);
}

Result<void> read_transform(TIFF* file, const std::string& path, GeotiffTags& tags) {
    std::uint16_t scale_count = 0;
    std::uint16_t tie_count = 0;
    std::uint16_t matrix_count = 0;
    double* scale = nullptr;
    double* tie = nullptr;
    double* matrix = nullptr;
    const bool has_scale = TIFFGetField(file, TIFFTAG_GEOPIXELSCALE, &scale_count, &scale) == 1 && scale_count >= 2;
    const bool has_tie =
        TIFFGetField(file, TIFFTAG_GEOTIEPOINTS, &tie_count, &tie) == 1 && tie_count >= kTiePointDoubles;
    const bool has_matrix =
        TIFFGetField(file, TIFFTAG_GEOTRANSMATRIX, &matrix_count, &matrix) == 1 && matrix_count >= 16;
    const double centre = tags.reference.raster_is_point ? 0.0 : 0.5;

    if (has_scale && has_tie) {
        // A negative y scale is a writer's slip: the specification's y axis already points up, and such files are
        // north-up.
        const Affine t{
            scale[0], 0, tie[3] - tie[0] * scale[0], 0, -std::abs(scale[1]), tie[4] + tie[1] * std::abs(scale[1])};
        apply(t, centre, tags.reference);
        tags.has_transform = true;
        return check_place(tags.reference, path, "its ModelPixelScale and ModelTiepoint");
    }
    if (has_matrix) {
        apply({matrix[0], matrix[1], matrix[3], matrix[4], matrix[5], matrix[7]}, centre, tags.reference);
        tags.has_transform = true;
        return check_place(tags.reference, path, "its ModelTransformation");
    }
    return {};
}

Result<GeotiffTags> read_geotiff_tags(const std::string& path) {
    GeotiffTags tags;
    if (!looks_like_tiff(path)) return tags;
    TiffFile file(path, "rm");
    if (!file.valid())
        return Error{ErrorCode::input,
                     fmt::format("{}: not a readable TIFF ({}), so it cannot be placed", path, file.messages())};
    const GtifHandle keys(GTIFNewEx(file.get(), ignore_geotiff_message, nullptr));
    if (keys) {
        const auto raster_type = short_key(keys.get(), GTRasterTypeGeoKey);
        tags.reference.raster_is_point = raster_type == RasterPixelIsPoint;
        read_crs(keys.get(), tags);
    }
    if (Result<void> placed = read_transform(file.get(), path, tags); !placed) return placed.error();
    return tags;
}

std::string with_case(std::string text, int (*change)(int)) {
    for (char& c : text) c = static_cast<char>(change(static_cast<unsigned char>(c)));
    return text;
}

std::vector<std::string> world_file_names(const std::filesystem::path& image) {
    std::string extension = image.extension().string();
    if (!extension.empty()) extension.erase(0, 1);
    std::vector<std::string> suffixes;
    if (extension.size() >= 2) suffixes.push_back(fmt::format("{}{}w", extension.front(), extension.back()));
    if (!extension.empty()) suffixes.push_back(extension + "w");
    suffixes.emplace_back("wld");

    std::vector<std::string> names;
    for (const std::string& suffix : suffixes) {
        for (const std::string& spelled : {suffix, with_case(suffix, std::tolower), with_case(suffix, std::toupper)}) {
            std::filesystem::path name = image;
            names.push_back(name.replace_extension("." + spelled).string());
        }
    }
    return names;
}

Result<Georeference> parse_world_file(const std::string& path) {
    std::error_code status;
    const std::uintmax_t bytes = std::filesystem::file_size(path, status);
    if (status) return Error{ErrorCode::input, fmt::format("{}: cannot be read ({})", path, status.message())};
    if (bytes > kMaxWorldFileBytes)
        return Error{ErrorCode::input,
                     fmt::format("{}: {} bytes is too long for a world file, which holds six numbers", path, bytes)};
    std::ifstream stream(path, std::ios::binary);
    std::istringstream words(std::string(std::istreambuf_iterator<char>(stream), {}));
    std::array<double, 6> values{};
    std::size_t count = 0;
    std::string word;
    while (count < values.size() && words >> word) {
        const std::optional<double> value = parse_number(word);
        if (!value)
            return Error{ErrorCode::input,
                         fmt::format("{}: '{}' is not a number (number {} of 6), so the image cannot be placed", path,
                                     word.substr(0, 40), count + 1)};
        values[count++] = *value;
    }
    if (count < values.size())
        return Error{
            ErrorCode::input,
            fmt::format("{}: holds {} of the 6 numbers of a world file, so the image cannot be placed", path, count)};

    // The file's order is A D B E C F, and C F is already the centre of the upper-left sample.
    Georeference reference;
    apply({values[0], values[2], values[4], values[1], values[3], values[5]}, 0.0, reference);
    if (Result<void> checked = check_place(reference, path, "the world file"); !checked) return checked.error();
    return reference;
}

}  // namespace

bool Georeference::axis_aligned() const {
    return std::abs(row_x) <= kNegligibleRotation * std::abs(column_x) &&
           std::abs(column_y) <= kNegligibleRotation * std::abs(row_y);
}

Result<void> check_place(const Georeference& place, const std::string& path, const char* where) {
    for (const double value :
         {place.first_x, place.first_y, place.column_x, place.column_y, place.row_x, place.row_y}) {
        if (!std::isfinite(value))
            return Error{ErrorCode::input,
                         fmt::format("{}: {} holds {}, so the samples lie nowhere", path, where, value)};
    }
    const double area = place.column_x * place.row_y - place.column_y * place.row_x;
    if (area == 0 || !std::isfinite(area))
        return Error{ErrorCode::input,
                     fmt::format("{}: {} gives steps of ({}, {}) and ({}, {}), so all samples would lie on one line",
                                 path, where, place.column_x, place.column_y, place.row_x, place.row_y)};
    return {};
}

Result<std::optional<Georeference>> read_geotiff(const std::string& path) {
    try {
        Result<GeotiffTags> tags = read_geotiff_tags(path);
        if (!tags) return tags.error();
        if (!tags->has_transform) return std::optional<Georeference>{};
        return std::optional<Georeference>(std::move(tags->reference));
    } catch (const std::exception& problem) {
        return Error{ErrorCode::input, fmt::format("{}: its GeoTIFF tags cannot be read ({})", path, problem.what())};
    }
}

Result<std::optional<Georeference>> read_world_file(const std::string& image_path) {
    try {
        for (const std::string& name : world_file_names(image_path)) {
            std::error_code ignored;
            if (name == image_path || !std::filesystem::is_regular_file(name, ignored)) continue;
            Result<Georeference> reference = parse_world_file(name);
            if (!reference) return reference.error();
            return std::optional<Georeference>(std::move(*reference));
        }
        return std::optional<Georeference>{};
    } catch (const std::exception& problem) {
        return Error{ErrorCode::input,
                     fmt::format("{}: its world file cannot be read ({})", image_path, problem.what())};
    }
}

Result<std::optional<Georeference>> read_georeference(const std::string& image_path) {
    try {
        Result<GeotiffTags> tags = read_geotiff_tags(image_path);
        if (!tags) return tags.error();
        if (tags->has_transform) return std::optional<Georeference>(std::move(tags->reference));
        Result<std::optional<Georeference>> world = read_world_file(image_path);
        if (!world || !world->has_value() || !tags->has_crs) return world;
        const Georeference& placed = **world;
        Georeference merged = std::move(tags->reference);
        merged.first_x = placed.first_x;
        merged.first_y = placed.first_y;
        merged.column_x = placed.column_x;
        merged.column_y = placed.column_y;
        merged.row_x = placed.row_x;
        merged.row_y = placed.row_y;
        return std::optional<Georeference>(std::move(merged));
    } catch (const std::exception& problem) {
        return Error{ErrorCode::input,
                     fmt::format("{}: its georeference cannot be read ({})", image_path, problem.what())};
    }
}

}  // namespace scree
