#include "common/dataset.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "common/height_tile.h"
#include "common/texture_tile.h"

namespace scree {
namespace {

using Json = nlohmann::ordered_json;

Error store_error(std::string message) { return {ErrorCode::store, std::move(message)}; }

// Reads typed members of a JSON object and remembers the first that is missing or of the wrong type.
class Fields {
public:
    explicit Fields(const Json& object) : object_(object) {}

    void read(const char* key, double& out) {
        const Json* v = find(key);
        if (v == nullptr) return;
        if (!v->is_number() || !std::isfinite(v->get<double>())) return fail(key, "is not a finite number");
        out = v->get<double>();
    }
    void read(const char* key, std::int64_t& out) {
        const Json* v = find(key);
        if (v == nullptr) return;
        if (!v->is_number_integer() || (v->is_number_unsigned() && v->get<std::uint64_t>() > INT64_MAX))
            return fail(key, "is not an integer");
        out = v->get<std::int64_t>();
    }
    void read(const char* key, int& out) {
        std::int64_t value = out;
        read(key, value);
        if (value < -1000000 || value > 1000000) return fail(key, "is out of range");
        out = static_cast<int>(value);
    }
    void read(const char* key, bool& out) {
        const Json* v = find(key);
        if (v == nullptr) return;
        if (!v->is_boolean()) return fail(key, "is not true or false");
        out = v->get<bool>();
    }
    void read(const char* key, std::string& out) {
        const Json* v = find(key);
        if (v == nullptr) return;
        if (!v->is_string()) return fail(key, "is not text");
        out = v->get<std::string>();
    }
    const Json* array(const char* key) {
        const Json* v = find(key);
        if (v != nullptr && !v->is_array()) {
            fail(key, "is not a list");
            return nullptr;
        }
        return v;
    }
    const std::string& problem() const { return problem_; }

private:
    const Json* find(const char* key) {
        const auto it = object_.find(key);
        if (it == object_.end()) {
            fail(key, "is missing");
            return nullptr;
        }
        return &*it;
    }
    void fail(const char* key, const char* what) {
        if (problem_.empty()) problem_ = fmt::format("'{}' {}", key, what);
    }

    const Json& object_;
    std::string problem_;
};

std::optional<std::array<double, 4>> box_of(const Json& json) {
    std::array<double, 4> box{};
    if (!json.is_array() || json.size() != box.size()) return std::nullopt;
    for (std::size_t k = 0; k < box.size(); ++k) {
        if (!json[k].is_number() || !std::isfinite(json[k].get<double>())) return std::nullopt;
        box[k] = json[k].get<double>();
    }
    return box;
}

Result<GeoGrid> geo_grid_of(const Json& json) {
    if (!json.is_object()) return store_error("dataset: 'geo_grid' is not a JSON object");
    GeoGrid grid;
    std::string normals;
    Fields fields(json);
    fields.read("columns", grid.columns);
    fields.read("rows", grid.rows);
    fields.read("error_m", grid.error_m);
    fields.read("normals", normals);
    if (!fields.problem().empty()) return store_error("dataset: geo_grid " + fields.problem());
    const auto box = json.contains("box_m") ? box_of(json.at("box_m")) : std::nullopt;
    if (!box) return store_error("dataset: geo_grid 'box_m' is not four finite numbers");
    grid.box_m = *box;
    auto decoded = normals_from_text(normals, grid.columns, grid.rows);
    if (!decoded) return store_error("dataset: " + decoded.error().message);
    grid.normals = std::move(*decoded);
    return grid;
}

Json to_json(const GeoGrid& grid) {
    return {{"columns", grid.columns},
            {"rows", grid.rows},
            {"box_m", grid.box_m},
            {"error_m", grid.error_m},
            {"normals", normals_to_text(grid)}};
}

bool is_fingerprint(const std::string& text) {
    return text.size() == 16 && text.find_first_not_of("0123456789abcdef") == std::string::npos;
}

bool read_sidecars(const Json& json, std::map<std::string, std::string>& sidecars) {
    if (!json.is_object()) return false;
    for (const auto& [name, print] : json.items()) {
        if (!print.is_string() || !is_fingerprint(print.get<std::string>())) return false;
        sidecars[name] = print.get<std::string>();
    }
    return true;
}

}  // namespace

double Dataset::texel_m(int level) const {
    return std::ldexp(lattice.spacing_m, lattice.deepest_level - level + lattice.tile_cells_log2 - texture_size_log2);
}

int Dataset::deepest_level() const { return std::max(lattice.deepest_level, texture_deepest_level); }

Result<void> Dataset::exaggerate(double factor) {
    if (!(factor >= 0.01 && factor <= 100))
        return Error{ErrorCode::usage, fmt::format("an exaggeration of {} is outside 0.01..100", factor)};
    for (double* metres : {&height_offset_m, &height_quantum_m, &height_quantum_error_m, &warp_error_m, &min_height_m,
                           &max_height_m, &exaggeration})
        *metres *= factor;
    if (auto ok = check(); !ok)
        return Error{ErrorCode::usage, fmt::format("exaggeration {}: {}", factor, ok.error().message)};
    return {};
}

Result<void> Dataset::check() const {
    if (auto ok = lattice.check(); !ok) return store_error("dataset: " + ok.error().message);
    const auto finite = [](double v) { return std::isfinite(v); };
    if (!finite(height_offset_m) || !finite(height_quantum_m) || height_quantum_m <= 0 || height_quantum_m > 1e6 ||
        height_quantum_m < 1e-9 || std::abs(height_offset_m) > 1e9)
        return store_error(fmt::format("dataset: heights of offset {} m and quantum {} m are not usable",
                                       height_offset_m, height_quantum_m));
    if (!finite(min_height_m) || !finite(max_height_m) || min_height_m > max_height_m)
        return store_error(fmt::format("dataset: height range {}..{} m is not a range", min_height_m, max_height_m));
    if (texture_size_log2 < kMinTextureSizeLog2 || texture_size_log2 > kMaxTextureSizeLog2)
        return store_error(fmt::format("dataset: texture size 2^{} is outside 16..2048", texture_size_log2));
    if (texture_deepest_level < 0 || texture_deepest_level > kMaxLevel)
        return store_error(fmt::format("dataset: texture level {} is outside 0..30", texture_deepest_level));
    if (!(height_quantum_error_m >= 0) || !(warp_error_m >= 0) || !finite(height_quantum_error_m) ||
        !finite(warp_error_m))
        return store_error(fmt::format("dataset: errors of {} m (quantum) and {} m (warp) are not lengths",
                                       height_quantum_error_m, warp_error_m));
    if (!tile_key(lattice, {texture_deepest_level, lattice.tiles_x(texture_deepest_level) - 1,
                            lattice.tiles_y(texture_deepest_level) - 1}))
        return store_error(fmt::format("dataset: texture level {} with {} roots passes the format's keys",
                                       texture_deepest_level, lattice.root_rows * lattice.root_columns));
    if (coarsest_leaf_level && (*coarsest_leaf_level < 0 || *coarsest_leaf_level >= lattice.deepest_level))
        return store_error(fmt::format("dataset: coarsest leaf level {} is not above the deepest level {}",
                                       *coarsest_leaf_level, lattice.deepest_level));
    if (geo_grid)
        if (auto ok = geo_grid->check(); !ok) return store_error("dataset: " + ok.error().message);
    if (coarsest_texture_level && (*coarsest_texture_level < 0 || *coarsest_texture_level >= texture_deepest_level))
        return store_error(fmt::format("dataset: coarsest texture level {} is not above the deepest level {}",
                                       *coarsest_texture_level, texture_deepest_level));
    if (height_tiles < 1 || texture_tiles < 1 || present_cells < 1)
        return store_error("dataset: a store holds at least one tile of each kind and one present cell");
    return {};
}

std::string dataset_to_json(const Dataset& d) {
    Json sources = Json::array();
    for (const SourceRecord& s : d.sources) {
        sources.push_back(
            {{"name", s.name}, {"role", s.role}, {"bytes", s.bytes}, {"width", s.width}, {"height", s.height}});
        if (!s.fingerprint.empty()) sources.back()["fingerprint"] = s.fingerprint;
        if (s.box_m) sources.back()["box_m"] = *s.box_m;
        if (!s.layer.empty()) sources.back()["layer"] = s.layer;
        if (!s.sidecars.empty()) sources.back()["sidecars"] = s.sidecars;
    }
    Json json = {{"format_version", kFormatVersion},
                 {"origin_x_m", d.lattice.origin_x_m},
                 {"origin_y_m", d.lattice.origin_y_m},
                 {"spacing_m", d.lattice.spacing_m},
                 {"cells_x", d.lattice.cells_x},
                 {"cells_y", d.lattice.cells_y},
                 {"deepest_level", d.lattice.deepest_level},
                 {"tile_cells_log2", d.lattice.tile_cells_log2},
                 {"root_rows", d.lattice.root_rows},
                 {"root_columns", d.lattice.root_columns},
                 {"crs", d.crs},
                 {"crs_name", d.crs_name},
                 {"vertical_datum", d.vertical_datum},
                 {"height_offset_m", d.height_offset_m},
                 {"height_quantum_m", d.height_quantum_m},
                 {"height_quantum_error_m", d.height_quantum_error_m},
                 {"warp_error_m", d.warp_error_m},
                 {"min_height_m", d.min_height_m},
                 {"max_height_m", d.max_height_m},
                 {"texture_size_log2", d.texture_size_log2},
                 {"texture_deepest_level", d.texture_deepest_level},
                 {"has_imagery", d.has_imagery},
                 {"height_tiles", d.height_tiles},
                 {"texture_tiles", d.texture_tiles},
                 {"present_cells", d.present_cells},
                 {"sources", sources},
                 {"attribution", d.attribution}};
    if (d.coarsest_leaf_level) json["coarsest_leaf_level"] = *d.coarsest_leaf_level;
    if (d.geo_grid) json["geo_grid"] = to_json(*d.geo_grid);
    if (d.coarsest_texture_level) json["coarsest_texture_level"] = *d.coarsest_texture_level;
    if (!d.options.empty()) json["options"] = d.options;
    return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

Result<Dataset> dataset_from_json(const std::string& text) {
    const Json json = Json::parse(text, nullptr, false);
    if (json.is_discarded() || !json.is_object()) return store_error("dataset: the description is not a JSON object");
    Dataset d;
    int version = 0;
    Fields fields(json);
    fields.read("format_version", version);
    if (fields.problem().empty() && version != kFormatVersion)
        return store_error(
            fmt::format("dataset: format version {}; this program reads version {}", version, kFormatVersion));
    fields.read("origin_x_m", d.lattice.origin_x_m);
    fields.read("origin_y_m", d.lattice.origin_y_m);
    fields.read("spacing_m", d.lattice.spacing_m);
    fields.read("cells_x", d.lattice.cells_x);
    fields.read("cells_y", d.lattice.cells_y);
    fields.read("deepest_level", d.lattice.deepest_level);
    fields.read("tile_cells_log2", d.lattice.tile_cells_log2);
    fields.read("root_rows", d.lattice.root_rows);
    fields.read("root_columns", d.lattice.root_columns);
    fields.read("crs", d.crs);
    fields.read("crs_name", d.crs_name);
    fields.read("vertical_datum", d.vertical_datum);
    fields.read("height_offset_m", d.height_offset_m);
    fields.read("height_quantum_m", d.height_quantum_m);
    fields.read("height_quantum_error_m", d.height_quantum_error_m);
    fields.read("warp_error_m", d.warp_error_m);
    fields.read("min_height_m", d.min_height_m);
    fields.read("max_height_m", d.max_height_m);
    if (json.contains("coarsest_leaf_level")) fields.read("coarsest_leaf_level", d.coarsest_leaf_level.emplace());
    fields.read("texture_size_log2", d.texture_size_log2);
    fields.read("texture_deepest_level", d.texture_deepest_level);
    if (json.contains("coarsest_texture_level"))
        fields.read("coarsest_texture_level", d.coarsest_texture_level.emplace());
    fields.read("has_imagery", d.has_imagery);
    fields.read("height_tiles", d.height_tiles);
    fields.read("texture_tiles", d.texture_tiles);
    fields.read("present_cells", d.present_cells);
    fields.read("attribution", d.attribution);
    if (const Json* sources = fields.array("sources"); sources != nullptr) {
        for (const Json& item : *sources) {
            if (!item.is_object()) return store_error("dataset: a source is not a JSON object");
            SourceRecord record;
            Fields source(item);
            source.read("name", record.name);
            source.read("role", record.role);
            source.read("bytes", record.bytes);
            source.read("width", record.width);
            source.read("height", record.height);
            if (item.contains("fingerprint")) source.read("fingerprint", record.fingerprint);
            if (item.contains("layer")) source.read("layer", record.layer);
            if (item.contains("box_m")) {
                record.box_m = box_of(item.at("box_m"));
                if (!record.box_m) return store_error("dataset: source 'box_m' is not four finite numbers");
            }
            if (!source.problem().empty()) return store_error("dataset: source " + source.problem());
            if (item.contains("fingerprint") && !is_fingerprint(record.fingerprint))
                return store_error("dataset: source 'fingerprint' is not 16 hexadecimal digits");
            if (item.contains("sidecars") && !read_sidecars(item.at("sidecars"), record.sidecars))
                return store_error("dataset: source 'sidecars' are not names with 16 hexadecimal digits each");
            d.sources.push_back(std::move(record));
        }
    }
    if (const auto options = json.find("options"); options != json.end()) {
        if (!options->is_object()) return store_error("dataset: 'options' is not an object");
        for (const auto& [name, value] : options->items()) {
            if (!value.is_string()) return store_error("dataset: an option is not text");
            d.options[name] = value.get<std::string>();
        }
    }
    if (const auto grid = json.find("geo_grid"); grid != json.end()) {
        auto read = geo_grid_of(*grid);
        if (!read) return read.error();
        d.geo_grid = std::move(*read);
    }
    if (!fields.problem().empty()) return store_error("dataset: " + fields.problem());
    if (auto ok = d.check(); !ok) return ok.error();
    return d;
}

}  // namespace scree
