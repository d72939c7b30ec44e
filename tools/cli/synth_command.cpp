#include "tools/cli/synth_command.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "common/cli/arguments.h"
#include "common/progress.h"
#include "common/report.h"
#include "tools/source/synth.h"

namespace scree {
namespace {

std::string json_of(const SynthOptions& options, const SynthReport& report) {
    nlohmann::ordered_json json;
    json["dem"] = {{"path", report.dem_path},     {"samples", report.dem_samples}, {"spacing_m", options.spacing_m},
                   {"lowest_m", report.lowest_m}, {"highest_m", report.highest_m}, {"seconds", report.dem_seconds}};
    if (!report.ortho_path.empty())
        json["ortho"] = {
            {"path", report.ortho_path}, {"pixels", report.ortho_pixels}, {"seconds", report.ortho_seconds}};
    json["seed"] = options.seed;
    json["bytes"] = report.bytes;
    return json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

}  // namespace

int run_synth(int argc, char** argv) {
    SynthOptions options;
    bool quiet = false;
    std::string json_target;
    CLI::App app("Makes a mountain landscape to try things on: DIR/dem.tif (float32 heights) and DIR/ortho.tif (RGB).",
                 argv[0]);
    app.add_option("-o,--output", options.directory, "Directory for dem.tif and ortho.tif; made when missing")
        ->required()
        ->type_name("DIR");
    app.add_option("--size", options.size, "Height samples a side, 3 to 1048576; time and bytes grow with its square")
        ->capture_default_str();
    app.add_option("--spacing", options.spacing_m,
                   "Metres between samples; less is a closer look at less of the same land")
        ->capture_default_str();
    app.add_option("--seed", options.seed, "Another number, another landscape")->capture_default_str();
    app.add_option("--imagery-scale", options.imagery_scale, "Image pixels per cell side, 0 to 64; 0 makes no image")
        ->capture_default_str();
    app.add_option("--threads", options.threads, "Threads; 0 is all cores. The bytes made do not depend on it")
        ->capture_default_str();
    app.add_flag("--force", options.force, "Replace dem.tif and ortho.tif when they exist");
    app.add_flag("--quiet", quiet, "No progress on standard error");
    add_json_option(app, json_target);
    if (const int code = parse_arguments(app, argc, argv); code >= 0) return code;

    install_interrupt_handler();
    options.stop = &interrupt_flag();
    Progress progress("synth", "MPix", quiet);
    const Result<SynthReport> report = synthesize(options, [&progress](const SynthProgress& p) {
        progress.set_total(static_cast<double>(p.pixels_total) / 1e6);
        progress.update(static_cast<double>(p.pixels_done) / 1e6);
    });
    if (!report) return report_error("scree synth", report.error());
    progress.finish();
    if (!quiet) {
        note("{}: {} x {} samples, {:.0f} to {:.0f} m, {:.1f} s\n", report->dem_path, report->dem_samples,
             report->dem_samples, report->lowest_m, report->highest_m, report->dem_seconds);
        if (!report->ortho_path.empty())
            note("{}: {} x {} pixels, {:.1f} s\n", report->ortho_path, report->ortho_pixels, report->ortho_pixels,
                 report->ortho_seconds);
    }
    if (!json_target.empty())
        if (auto ok = write_text(json_target, json_of(options, *report)); !ok)
            return report_error("scree synth", ok.error());
    return 0;
}

}  // namespace scree
