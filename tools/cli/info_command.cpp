#include "tools/cli/info_command.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "common/cli/arguments.h"
#include "common/report.h"
#include "common/store/sqlite_store.h"
#include "tools/cli/dataset_label.h"
#include "tools/source/crs.h"

namespace scree {
namespace {

// WGS 84.
struct Corner {
    double longitude_deg = 0, latitude_deg = 0;
};

// North-west, north-east, south-west, south-east; none where the CRS is unknown or does not reach one of them.
std::vector<Corner> corners_of(const Dataset& d) {
    const auto crs = crs_of(d);
    if (!crs) return {};
    const auto degrees = Crs::parse("EPSG:4326");
    if (!degrees) return {};
    const auto transform = CrsTransform::make(*crs, *degrees);
    if (!transform) return {};
    const Lattice& l = d.lattice;
    const double east = l.x_m(static_cast<double>(l.cells_x)), south = l.y_m(static_cast<double>(l.cells_y));
    std::array<double, 4> x{l.origin_x_m, east, l.origin_x_m, east}, y{l.origin_y_m, l.origin_y_m, south, south};
    transform->apply(x, y);
    std::vector<Corner> corners;
    for (std::size_t k = 0; k < x.size(); ++k) {
        if (!std::isfinite(x[k]) || !std::isfinite(y[k])) return {};
        corners.push_back({x[k], y[k]});
    }
    return corners;
}

void print_corners(const std::vector<Corner>& corners) {
    constexpr std::array<const char*, 4> kNames{"NW", "NE", "SW", "SE"};
    std::string line;
    for (std::size_t k = 0; k < corners.size(); ++k)
        line += fmt::format("{}{} {:.6f} {:.6f}", k == 0 ? "" : ", ", kNames[k], corners[k].longitude_deg,
                            corners[k].latitude_deg);
    if (!line.empty()) fmt::print("  corners    {} (longitude, latitude)\n", line);
}

}  // namespace

int run_info(int argc, char** argv) {
    CLI::App app{"Says what a store holds.", "scree info"};
    std::string path, json;
    bool with_digest = false;
    app.add_option("STORE", path, "A .scree file")->required();
    app.add_flag("--digest", with_digest, "Also the SHA-256 of the contents (reads everything)");
    add_json_option(app, json);
    if (const int code = parse_arguments(app, argc, argv); code >= 0) return code;
    auto store = SqliteStore::open(path);
    if (!store) return report_error("scree info", store.error());
    auto contents = (*store)->contents();
    if (!contents) return report_error("scree info", contents.error());
    std::string digest;
    if (with_digest) {
        auto computed = (*store)->digest();
        if (!computed) return report_error("scree info", computed.error());
        digest = *computed;
    }
    const Dataset& d = (*store)->dataset();
    const Lattice& l = d.lattice;
    const auto cells_x = static_cast<double>(l.cells_x), cells_y = static_cast<double>(l.cells_y);
    const std::vector<Corner> corners = corners_of(d);
    if (json != "-") {
        fmt::print("{}: Scree store, format {}\n", path, kFormatVersion);
        fmt::print("  CRS        {}\n", crs_label(d));
        fmt::print("  datum      {}\n", d.vertical_datum.empty() ? "not stated" : d.vertical_datum);
        fmt::print("  extent     x {} .. {}, y {} .. {} m\n", l.x_m(0), l.x_m(cells_x), l.y_m(cells_y), l.y_m(0));
        print_corners(corners);
        if (d.geo_grid)
            fmt::print("  longitudes {} x {} nodes, off by {} m at most\n", d.geo_grid->columns, d.geo_grid->rows,
                       d.geo_grid->error_m);
        fmt::print("  lattice    {} x {} cells of {} m, {} levels, {} x {} roots\n", l.cells_x, l.cells_y, l.spacing_m,
                   l.deepest_level + 1, l.root_rows, l.root_columns);
        fmt::print("  heights    {} .. {} m in steps of {} m (error {} m), {} tiles of {}^2\n", d.min_height_m,
                   d.max_height_m, d.height_quantum_m, d.height_quantum_error_m, contents->height_rows,
                   l.tile_samples());
        if (d.coarsest_leaf_level)
            fmt::print("  leaves     levels {} .. {}, of {} .. {} m: depth varies by place\n", *d.coarsest_leaf_level,
                       l.deepest_level, l.spacing_m * static_cast<double>(l.step(*d.coarsest_leaf_level)), l.spacing_m);
        if (d.warp_error_m > 0) fmt::print("  resampled  heights moved by {} m at most\n", d.warp_error_m);
        fmt::print("  textures   {} levels of {}^2, finest texel {} m, {} tiles, {}\n", d.texture_deepest_level + 1,
                   d.texture_size(), d.texel_m(d.texture_deepest_level), contents->texture_rows,
                   d.has_imagery ? "imagery" : "tint");
        if (d.coarsest_texture_level)
            fmt::print(
                "  depths     textures end at levels {} .. {}, of {} .. {} m: depth varies by place; {} tiles a "
                "level\n",
                *d.coarsest_texture_level, d.texture_deepest_level, d.texel_m(*d.coarsest_texture_level),
                d.texel_m(d.texture_deepest_level), fmt::join(contents->texture_rows_of_level, ", "));
        fmt::print("  bytes      {} in the file: {} heights, {} textures\n", contents->file_bytes,
                   contents->height_bytes, contents->texture_bytes);
        for (const SourceRecord& s : d.sources)
            fmt::print("  source     {} ({}, {} x {}, {} bytes{}{})\n", s.name, s.role, s.width, s.height, s.bytes,
                       s.fingerprint.empty() ? "" : ", fingerprint ", s.fingerprint);
        for (const auto& [name, value] : d.options) fmt::print("  option     --{} {}\n", name, value);
        if (!d.attribution.empty()) fmt::print("  credit     {}\n", d.attribution);
        if (!digest.empty()) fmt::print("  digest     {}\n", digest);
    }
    if (json.empty()) return 0;
    nlohmann::ordered_json sources = nlohmann::ordered_json::array();
    for (const SourceRecord& s : d.sources)
        sources.push_back({{"name", s.name},
                           {"role", s.role},
                           {"bytes", s.bytes},
                           {"width", s.width},
                           {"height", s.height},
                           {"fingerprint", s.fingerprint}});
    nlohmann::ordered_json corners_deg = nlohmann::ordered_json::array();
    for (const Corner& c : corners) corners_deg.push_back({c.longitude_deg, c.latitude_deg});
    nlohmann::ordered_json out = {
        {"format_version", kFormatVersion},
        {"crs", d.crs},
        {"crs_name", d.crs_name},
        {"vertical_datum", d.vertical_datum},
        {"origin_m", {l.origin_x_m, l.origin_y_m}},
        {"corners_deg", corners_deg},
        {"spacing_m", l.spacing_m},
        {"cells", {l.cells_x, l.cells_y}},
        {"present_cells", d.present_cells},
        {"levels", l.deepest_level + 1},
        {"coarsest_leaf_level", d.least_leaf_level()},
        {"texture_levels", d.texture_deepest_level + 1},
        {"coarsest_texture_level", d.least_texture_level()},
        {"texture_tiles_of_level", contents->texture_rows_of_level},
        {"roots", {l.root_rows, l.root_columns}},
        {"tile_size", l.tile_samples()},
        {"texture_size", d.texture_size()},
        {"texel_m", d.texel_m(d.texture_deepest_level)},
        {"has_imagery", d.has_imagery},
        {"options", d.options},
        {"height_quantum_m", d.height_quantum_m},
        {"height_quantum_error_m", d.height_quantum_error_m},
        {"warp_error_m", d.warp_error_m},
        {"height_range_m", {d.min_height_m, d.max_height_m}},
        {"height_tiles", contents->height_rows},
        {"texture_tiles", contents->texture_rows},
        {"bytes",
         {{"file", contents->file_bytes}, {"heights", contents->height_bytes}, {"textures", contents->texture_bytes}}},
        {"sources", sources},
        {"attribution", d.attribution},
        {"digest", digest}};
    if (d.geo_grid)
        out["geo_grid"] = {{"nodes", {d.geo_grid->columns, d.geo_grid->rows}},
                           {"box_m", d.geo_grid->box_m},
                           {"error_m", d.geo_grid->error_m}};
    if (auto ok = write_text(json, out.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n");
        !ok)
        return report_error("scree info", ok.error());
    return 0;
}

}  // namespace scree
