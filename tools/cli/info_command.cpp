#include "tools/cli/info_command.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "common/report.h"
#include "common/store/sqlite_store.h"

namespace scree {

int run_info(int argc, char** argv) {
    CLI::App app{"Says what a store holds.", "scree info"};
    std::string path, json;
    bool with_digest = false;
    app.add_option("STORE", path, "A .scree file")->required();
    app.add_flag("--digest", with_digest, "Also the SHA-256 of the contents (reads everything)");
    app.add_option("--json", json, "Write the report as JSON to a file, or - for standard output");
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        return app.exit(error) == 0 ? 0 : static_cast<int>(ErrorCode::usage);
    }
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
    if (json != "-") {
        fmt::print("{}: Scree store, format {}\n", path, kFormatVersion);
        fmt::print("  CRS        {}{}\n", d.crs.empty() ? "none" : d.crs,
                   d.crs_name.empty() ? "" : " (" + d.crs_name + ")");
        fmt::print("  datum      {}\n", d.vertical_datum.empty() ? "not stated" : d.vertical_datum);
        fmt::print("  extent     x {} .. {}, y {} .. {} m\n", l.x_m(0), l.x_m(cells_x), l.y_m(cells_y), l.y_m(0));
        fmt::print("  lattice    {} x {} cells of {} m, {} levels, {} x {} roots\n", l.cells_x, l.cells_y, l.spacing_m,
                   l.deepest_level + 1, l.root_rows, l.root_columns);
        fmt::print("  heights    {} .. {} m in steps of {} m (error {} m), {} tiles of {}^2\n", d.min_height_m,
                   d.max_height_m, d.height_quantum_m, d.height_quantum_error_m, contents->height_rows,
                   l.tile_samples());
        fmt::print("  textures   {} levels of {}^2, finest texel {} m, {} tiles, {}\n", d.texture_deepest_level + 1,
                   d.texture_size(), d.texel_m(d.texture_deepest_level), contents->texture_rows,
                   d.has_imagery ? "imagery" : "tint");
        fmt::print("  bytes      {} in the file: {} heights, {} textures\n", contents->file_bytes,
                   contents->height_bytes, contents->texture_bytes);
        for (const SourceRecord& s : d.sources)
            fmt::print("  source     {} ({}, {} x {}, {} bytes)\n", s.name, s.role, s.width, s.height, s.bytes);
        if (!d.attribution.empty()) fmt::print("  credit     {}\n", d.attribution);
        if (!digest.empty()) fmt::print("  digest     {}\n", digest);
    }
    if (json.empty()) return 0;
    nlohmann::ordered_json sources = nlohmann::ordered_json::array();
    for (const SourceRecord& s : d.sources)
        sources.push_back(
            {{"name", s.name}, {"role", s.role}, {"bytes", s.bytes}, {"width", s.width}, {"height", s.height}});
    const nlohmann::ordered_json out = {
        {"format_version", kFormatVersion},
        {"crs", d.crs},
        {"vertical_datum", d.vertical_datum},
        {"origin_m", {l.origin_x_m, l.origin_y_m}},
        {"spacing_m", l.spacing_m},
        {"cells", {l.cells_x, l.cells_y}},
        {"present_cells", d.present_cells},
        {"levels", l.deepest_level + 1},
        {"texture_levels", d.texture_deepest_level + 1},
        {"roots", {l.root_rows, l.root_columns}},
        {"tile_size", l.tile_samples()},
        {"texture_size", d.texture_size()},
        {"texel_m", d.texel_m(d.texture_deepest_level)},
        {"has_imagery", d.has_imagery},
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
    if (auto ok = write_text(json, out.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n");
        !ok)
        return report_error("scree info", ok.error());
    return 0;
}

}  // namespace scree
