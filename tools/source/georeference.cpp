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

#include <geotiff/geotiff.h>
#include <geotiff/xtiffio.h>

#include "tools/source/gdal_metadata.h"
#include "tools/source/geotiff_crs.h"
#include "tools/source/number_text.h"
#include "tools/source/pam_file.h"
#include "tools/source/projection_file.h"
#include "tools/source/tiff_file.h"

namespace scree {
namespace {

// A rotation term below this share of the step moves the far edge of 2^20 samples by a thousandth of a sample.
constexpr double kNegligibleRotation = 1e-9;
// Six numbers of 17 digits fit 200 bytes; what is a thousand times that is not a world file.
constexpr std::uintmax_t kMaxWorldFileBytes = 65536;
// No CRS has places so far off, and 2^30 steps of this size still have finite sums.
constexpr double kFarthest = 1e15;
constexpr std::uint16_t kTiePointDoubles = 6;
constexpr std::uint16_t kMatrixDoubles = 16;
constexpr std::uint32_t kGdalMetadataTag = 42112;

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
    int control_points = 0;  ///< where they are all that places the image
};

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

struct Doubles {
    std::uint16_t count = 0;
    const double* values = nullptr;
    double operator[](int i) const { return values[i]; }
};

// None where there are fewer than `least`.
Doubles doubles_tag(TIFF* file, std::uint32_t tag, std::uint16_t least) {
    Doubles read;
    double* values = nullptr;
    if (TIFFGetField(file, tag, &read.count, &values) != 1 || values == nullptr || read.count < least) return {};
    read.values = values;
    return read;
}

Result<void> read_transform(TIFF* file, const std::string& path, GeotiffTags& tags) {
    const Doubles scale = doubles_tag(file, TIFFTAG_GEOPIXELSCALE, 2);
    const Doubles tie = doubles_tag(file, TIFFTAG_GEOTIEPOINTS, kTiePointDoubles);
    Doubles matrix = doubles_tag(file, TIFFTAG_GEOTRANSMATRIX, kMatrixDoubles);
    // Intergraph wrote the same matrix, one double longer or not, before GeoTIFF had a tag for it.
    if (matrix.count == 0) matrix = doubles_tag(file, TIFFTAG_INTERGRAPH_MATRIX, kMatrixDoubles);
    const double centre = tags.reference.raster_is_point ? 0.0 : 0.5;
    const int ties = tie.count / kTiePointDoubles;
    // Some writers put zeros for a scale that they do not have.
    const bool no_scale = scale.count == 0 || (scale[0] == 0 && scale[1] == 0 && (matrix.count > 0 || ties > 1));

    if (!no_scale && ties > 0) {
        // A negative y scale is a writer's slip: the specification's y axis already points up, and such files are
        // north-up.
        const Affine t{
            scale[0], 0, tie[3] - tie[0] * scale[0], 0, -std::abs(scale[1]), tie[4] + tie[1] * std::abs(scale[1])};
        apply(t, centre, tags.reference);
        tags.has_transform = true;
        return check_place(tags.reference, path, "its ModelPixelScale and ModelTiepoint");
    }
    if (matrix.count > 0) {
        apply({matrix[0], matrix[1], matrix[3], matrix[4], matrix[5], matrix[7]}, centre, tags.reference);
        tags.has_transform = true;
        return check_place(tags.reference, path, "its ModelTransformation");
    }
    if (ties > 1) tags.control_points = ties;
    return {};
}

void read_keys(TIFF* file, Georeference& reference, bool& has_crs) {
    const GtifHandle keys(GTIFNewEx(file, ignore_geotiff_message, nullptr));
    if (!keys) return;
    GeotiffCrs said = read_geotiff_crs(keys.get());
    has_crs = said.said;
    reference.crs = std::move(said.crs);
    reference.crs_name = std::move(said.name);
    reference.vertical_datum = std::move(said.vertical);
    reference.height_unit_m = said.height_unit_m;
    reference.geographic = said.geographic;
    reference.linear_unit_m = said.linear_unit_m;
    reference.raster_is_point = said.raster_is_point;
}

Result<GeotiffTags> read_geotiff_tags(const std::string& path) {
    GeotiffTags tags;
    if (!looks_like_tiff(path)) return tags;
    TiffFile file(path, "rm");
    if (!file.valid())
        return Error{ErrorCode::input,
                     fmt::format("{}: not a readable TIFF ({}), so it cannot be placed", path, file.messages())};
    read_keys(file.get(), tags.reference, tags.has_crs);
    if (tags.reference.height_unit_m == 0) {
        const std::string metadata = text_tag(file.get(), kGdalMetadataTag);
        tags.reference.height_unit_m = length_unit_m(parse_gdal_metadata(metadata).unit);
    }
    if (Result<void> placed = read_transform(file.get(), path, tags); !placed) return placed.error();
    return tags;
}

Error only_control_points(const std::string& path, int count) {
    return {ErrorCode::input,
            fmt::format("{}: placed by {} ground control points, which give no grid; rectify it first (gdalwarp)", path,
                        count)};
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

void take_place(const Georeference& from, Georeference& to) {
    to.first_x = from.first_x;
    to.first_y = from.first_y;
    to.column_x = from.column_x;
    to.column_y = from.column_y;
    to.row_x = from.row_x;
    to.row_y = from.row_y;
}

}  // namespace

bool Georeference::axis_aligned() const {
    return std::abs(row_x) <= kNegligibleRotation * std::abs(column_x) &&
           std::abs(column_y) <= kNegligibleRotation * std::abs(row_y);
}

Result<void> check_place(const Georeference& place, const std::string& path, const char* where) {
    for (const double value :
         {place.first_x, place.first_y, place.column_x, place.column_y, place.row_x, place.row_y}) {
        if (!(std::abs(value) <= kFarthest))
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
        if (tags->control_points > 0) return only_control_points(path, tags->control_points);
        if (!tags->has_transform) return std::optional<Georeference>{};
        return std::optional<Georeference>(std::move(tags->reference));
    } catch (const std::exception& problem) {
        return Error{ErrorCode::input, fmt::format("{}: its GeoTIFF tags cannot be read ({})", path, problem.what())};
    }
}

std::optional<std::string> world_file_beside(const std::string& image_path) {
    for (const std::string& name : world_file_names(image_path)) {
        std::error_code ignored;
        if (name != image_path && std::filesystem::is_regular_file(name, ignored)) return name;
    }
    return std::nullopt;
}

Result<std::optional<Georeference>> read_world_file(const std::string& image_path) {
    try {
        const auto name = world_file_beside(image_path);
        if (!name) return std::optional<Georeference>{};
        Result<Georeference> reference = parse_world_file(*name);
        if (!reference) return reference.error();
        return std::optional<Georeference>(std::move(*reference));
    } catch (const std::exception& problem) {
        return Error{ErrorCode::input,
                     fmt::format("{}: its world file cannot be read ({})", image_path, problem.what())};
    }
}

Result<std::optional<Georeference>> read_georeference(const std::string& image_path) {
    try {
        Result<GeotiffTags> tags = read_geotiff_tags(image_path);
        if (!tags) return tags.error();
        Georeference reference = std::move(tags->reference);
        const Result<PamFile> pam = read_pam(image_path);
        if (!pam) return pam.error();
        if (reference.crs.empty()) reference.crs = pam->crs;
        if (!tags->has_transform && pam->geotransform) {
            if (auto placed = place_by(*pam, image_path, reference); !placed) return placed.error();
        } else if (!tags->has_transform) {
            const Result<std::optional<Georeference>> world = read_world_file(image_path);
            if (!world) return world.error();
            if (!world->has_value()) {
                if (tags->control_points > 0) return only_control_points(image_path, tags->control_points);
                return std::optional<Georeference>{};
            }
            take_place(**world, reference);
        }
        if (auto taken = take_projection_file(image_path, reference); !taken) return taken.error();
        return std::optional<Georeference>(std::move(reference));
    } catch (const std::exception& problem) {
        return Error{ErrorCode::input,
                     fmt::format("{}: its georeference cannot be read ({})", image_path, problem.what())};
    }
}

}  // namespace scree
