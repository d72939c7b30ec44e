#include "tools/cli/build_command.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "common/report.h"
#include "tools/cli/height_options.h"
#include "tools/pyramid/builder.h"

namespace scree {
namespace {

void print_plan(const BuildPlan& plan) {
    const Dataset& d = plan.dataset;
    const Lattice& l = d.lattice;
    note("lattice: {} x {} cells of {} m, {} levels, {} x {} root{}{}\n", l.cells_x, l.cells_y, l.spacing_m,
         l.deepest_level + 1, l.root_rows, l.root_columns, l.root_rows * l.root_columns == 1 ? "" : "s",
         d.crs.empty() ? "" : ", " + d.crs);
    note("textures: {} levels, {} m a texel; memory: about {} MiB\n", d.texture_deepest_level + 1,
         d.texel_m(d.texture_deepest_level), plan.memory_bytes >> 20);
}

}  // namespace

int run_build(int argc, char** argv) {
    CLI::App app{"Cuts a DEM and an image into a pyramid of height and DXT1 texture tiles in one file.", "scree build"};
    BuildOptions options;
    std::string memory = "256M", json, imagery;
    std::vector<std::string> dems, images;
    bool dry_run = false;
    app.add_option("DEM", dems, "Heights: GeoTIFF or any image; channel 1")->required()->expected(1, -1);
    app.add_option("--imagery", images, "Colour image in the same CRS; its extent and resolution may differ")
        ->expected(1, -1);
    app.add_option("-o,--output", options.out, "The store to write")->required();
    add_height_options(app, options);
    app.add_option("--tile-size", options.tile_size,
                   "Samples along a height tile, 2^n + 1: larger means fewer, coarser choices")
        ->capture_default_str();
    app.add_option("--texture-size", options.texture_size, "Texels along a texture tile, a power of two")
        ->capture_default_str();
    app.add_option("--height-quantum", options.height_quantum_m,
                   "Metres of the height unit; default: the source's own for integers, 1/64 m otherwise");
    app.add_option("--threads", options.threads, "0: one a core")->capture_default_str()->check(CLI::Range(0, 1024));
    app.add_option("--memory", memory, "Ceiling of resident memory, at least 192M")->capture_default_str();
    app.add_option("--attribution", options.attribution, "Text shown with the terrain");
    app.add_flag("--force", options.force, "Replace an existing OUT");
    app.add_flag("--dry-run", dry_run, "Check the inputs and say what would be built");
    app.add_flag("--quiet", options.quiet, "No progress");
    app.add_option("--json", json, "Write the report as JSON to a file, or - for standard output");
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        return app.exit(error) == 0 ? 0 : static_cast<int>(ErrorCode::usage);
    }
    if (dems.size() != 1 || images.size() > 1)
        return report_error("scree build",
                            {ErrorCode::usage, "one DEM and at most one image for now; mosaics come later"});
    options.dem = dems.front();
    if (!images.empty()) options.imagery = images.front();
    const auto bytes = parse_bytes(memory);
    if (!bytes)
        return report_error("scree build",
                            {ErrorCode::usage, fmt::format("--memory {} is not a size such as 256M", memory)});
    options.memory_bytes = *bytes;

    install_interrupt_handler();
    auto plan = plan_build(options);
    if (!plan) return report_error("scree build", plan.error());
    if (!options.quiet) print_plan(*plan);
    if (dry_run) options.force = true;
    if (auto ok = announce_build(*plan, options); !ok) return report_error("scree build", ok.error());
    if (dry_run) return 0;
    auto report = build_store(std::move(*plan), options, interrupt_flag());
    if (!report) return report_error("scree build", report.error());
    if (!options.quiet)
        note("{}: {:.1f} MB, {} height tiles, {} texture tiles; {:.1f} s, {:.1f} CPU s, peak {} MiB\n", options.out,
             static_cast<double>(report->store_bytes) / 1e6, report->height_tiles, report->texture_tiles,
             report->seconds, report->cpu_seconds, report->peak_rss_bytes >> 20);
    if (json.empty()) return 0;
    const nlohmann::ordered_json out = {{"seconds", report->seconds},
                                        {"cpu_seconds", report->cpu_seconds},
                                        {"peak_rss_bytes", report->peak_rss_bytes},
                                        {"source_megapixels", report->source_megapixels},
                                        {"height_tiles", report->height_tiles},
                                        {"texture_tiles", report->texture_tiles},
                                        {"store_bytes", report->store_bytes}};
    if (auto ok = write_text(json, out.dump(2) + "\n"); !ok) return report_error("scree build", ok.error());
    return 0;
}

}  // namespace scree
