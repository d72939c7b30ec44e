#include "tools/cli/build_command.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "common/cli/arguments.h"
#include "common/report.h"
#include "common/store/height_codec.h"
#include "tools/cli/dataset_label.h"
#include "tools/cli/height_options.h"
#include "tools/pyramid/build_record.h"
#include "tools/pyramid/builder.h"
#include "tools/pyramid/codec_names.h"
#include "tools/source/number_text.h"

namespace scree {
namespace {

const std::map<std::string, Kernel> kKernels = {
    {"nearest", Kernel::nearest}, {"bilinear", Kernel::bilinear}, {"cubic", Kernel::cubic}};

const std::map<std::string, TextureQuality> kTextureQualities = {{"normal", TextureQuality::normal},
                                                                 {"high", TextureQuality::high}};

void print_plan(const BuildPlan& plan) {
    const Dataset& d = plan.dataset;
    const Lattice& l = d.lattice;
    note("lattice: {} x {} cells of {} m, {} levels, {} x {} root{}{}\n", l.cells_x, l.cells_y, l.spacing_m,
         l.deepest_level + 1, l.root_rows, l.root_columns, l.root_rows * l.root_columns == 1 ? "" : "s",
         d.crs.empty() ? "" : ", " + crs_label(d));
    const MosaicPlan& m = plan.mosaic;
    if (!m.crs_reason.empty()) note("CRS: {}\n", m.crs_reason);
    if (!m.heights_copied) note("heights are resampled: their samples are no square grid of {}\n", crs_label(d));
    for (const std::string& conversion : m.conversions) note("{}\n", conversion);
    for (const std::string& warning : m.warnings) note("warning: {}\n", warning);
    note("textures: {} levels, {} m a texel; memory: about {} MiB\n", d.texture_deepest_level + 1,
         d.texel_m(d.texture_deepest_level), plan.memory_bytes >> 20);
}

}  // namespace

int run_build(int argc, char** argv) {
    CLI::App app{"Cuts a DEM and an image into a pyramid of height and DXT1 texture tiles in one file.", "scree build"};
    BuildOptions options;
    std::string memory = "256M", json;
    bool dry_run = false;
    std::vector<double> stretch;
    std::string fill = "smooth";
    app.add_option("DEM", options.dems,
                   "Heights: files and folders; where several have a value the later one lies on top")
        ->required()
        ->expected(1, -1);
    app.add_option("--imagery", options.images, "Colour images: files and folders, in any CRS; later ones lie on top")
        ->expected(1, -1)
        ->type_name("PATH");
    app.add_option("-o,--output", options.out, "The store to write")->required()->type_name("FILE");
    add_height_options(app, options);
    app.add_option(
        "--crs", options.crs,
        "CRS of the store, metric: EPSG:n, WKT or a PROJ string; default: the DEM's own where it is metric, else "
        "chosen by its place");
    app.add_option("--assume-crs", options.assume_crs, "CRS of files that name none");
    app.add_flag("--assume-same-datum", options.assume_same_datum, "Take heights above different datums as they are");
    app.add_option("--resampling", options.kernel, "Where samples are not lattice points: nearest, bilinear or cubic")
        ->transform(CLI::CheckedTransformer(kKernels, CLI::ignore_case).description(""))
        ->type_name("nearest|bilinear|cubic")
        ->default_str("bilinear");
    app.add_option("--fill", fill, "Interior voids of the heights: smooth, none, or a height in metres")
        ->type_name("smooth|none|METRES")
        ->capture_default_str();
    app.add_option("--bands", options.colours.bands, "Bands shown as red, green, blue, or as grey: 3,2,1")
        ->delimiter(',');
    app.add_option("--stretch", stretch,
                   "MIN,MAX: values shown black and white; default for 16-bit and float images: percentiles 2 and 98")
        ->delimiter(',')
        ->expected(2);
    app.add_option("--imagery-nodata", options.colours.nodata,
                   "A pixel value that means nothing, besides the file's own");
    app.add_option("--tile-size", options.tile_size,
                   "Samples along a height tile, 2^n + 1: larger means fewer, coarser choices")
        ->capture_default_str();
    app.add_option("--texture-size", options.texture_size, "Texels along a texture tile, a power of two")
        ->capture_default_str();
    app.add_option("--texture-quality", options.texture_quality,
                   "DXT1: normal, or high for 0.2 to 0.9 dB more at a fifteenth of the speed")
        ->transform(CLI::CheckedTransformer(kTextureQualities, CLI::ignore_case).description(""))
        ->type_name("normal|high")
        ->default_str("normal");
    app.add_option("--height-quantum", options.height_quantum_m,
                   "Metres of the height unit; default: the source's own for integers, 1/64 m otherwise");
    app.add_option("--height-codec", options.height_codec, "How height tiles are packed; every one is without loss")
        ->transform(CLI::CheckedTransformer(codecs_by_name(height_codecs()), CLI::ignore_case).description(""))
        ->type_name(codec_names(height_codecs()))
        ->default_str("plane");
    app.add_option("--texture-codec", options.texture_codec,
                   "How texture tiles are packed; both without loss. raw: built faster, half as large again")
        ->transform(CLI::CheckedTransformer(codecs_by_name(texture_codecs()), CLI::ignore_case).description(""))
        ->type_name(codec_names(texture_codecs()))
        ->default_str("split");
    app.add_option("--threads", options.threads, "0: one a core")->capture_default_str()->check(CLI::Range(0, 1024));
    app.add_option("--memory", memory, "Ceiling of resident memory, at least 192M")->capture_default_str();
    app.add_option("--attribution", options.attribution, "Text shown with the terrain");
    app.add_flag("--force", options.force, "Replace an existing OUT");
    app.add_flag("--dry-run", dry_run, "Check the inputs and say what would be built");
    app.add_flag("--quiet", options.quiet, "No progress");
    add_json_option(app, json);
    if (const int code = parse_arguments(app, argc, argv); code >= 0) return code;
    auto rule = parse_fill(fill);
    if (!rule) return report_error("scree build", rule.error());
    options.fill = *rule;
    if (!stretch.empty()) options.colours.stretch = Stretch{stretch[0], stretch[1]};
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
    for (const std::string& warning : report->warnings) note("warning: {}\n", warning);
    if (!options.quiet)
        for (const std::string& line : report->notes) note("{}\n", line);
    if (!options.quiet)
        if (report->reused_tiles > 0) note("{} tiles were there from before\n", report->reused_tiles);
    if (!options.quiet)
        note("{}: {:.1f} MB, {} height tiles, {} texture tiles; {:.1f} s, {:.1f} CPU s, peak {} MiB\n", options.out,
             static_cast<double>(report->store_bytes) / 1e6, report->height_tiles, report->texture_tiles,
             report->seconds, report->cpu_seconds, report->peak_rss_bytes >> 20);
    if (!options.quiet && report->warp_error_m > 0)
        note("resampling moved heights by {:.3f} m at most, {:.3f} m root mean square\n", report->warp_error_m,
             report->warp_rms_m);
    if (json.empty()) return 0;
    const auto stage = [&](Stage s) { return report->stage_seconds[static_cast<std::size_t>(s)]; };
    const nlohmann::ordered_json out = {{"seconds", report->seconds},
                                        {"cpu_seconds", report->cpu_seconds},
                                        {"peak_rss_bytes", report->peak_rss_bytes},
                                        {"source_megapixels", report->source_megapixels},
                                        {"filled_samples", report->filled_samples},
                                        {"warnings", report->warnings},
                                        {"warp_error_m", report->warp_error_m},
                                        {"warp_rms_m", report->warp_rms_m},
                                        {"height_tiles", report->height_tiles},
                                        {"texture_tiles", report->texture_tiles},
                                        {"store_bytes", report->store_bytes},
                                        {"reused_tiles", report->reused_tiles},
                                        {"decode_seconds", stage(Stage::decode)},
                                        {"warp_seconds", stage(Stage::warp)},
                                        {"filter_seconds", stage(Stage::filter)},
                                        {"encode_seconds", stage(Stage::encode)},
                                        {"error_seconds", stage(Stage::error)},
                                        {"store_seconds", stage(Stage::store)}};
    if (auto ok = write_text(json, out.dump(2) + "\n"); !ok) return report_error("scree build", ok.error());
    return 0;
}

}  // namespace scree
