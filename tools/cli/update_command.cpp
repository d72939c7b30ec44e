#include "tools/cli/update_command.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>
#include <string>

#include "common/cli/arguments.h"
#include "common/report.h"
#include "tools/pyramid/updater.h"

namespace scree {

int run_update(int argc, char** argv) {
    CLI::App app{
        "Lays new, changed or removed sources over a store and rewrites only what they touch. Readers go on meanwhile.",
        "scree update"};
    UpdateOptions options;
    std::string memory = "256M", json;
    app.add_option("STORE", options.store, "A .scree file that scree build wrote")->required();
    app.add_option("DEM", options.dems, "Heights: files and folders that lie on top; one of an old name replaces it")
        ->expected(0, -1);
    app.add_option("--imagery", options.images, "Colour images: the same")->expected(1, -1)->type_name("PATH");
    app.add_option("--remove", options.remove, "Names of sources to take out, as scree info lists them")
        ->expected(1, -1);
    app.add_option("--sources", options.sources,
                   "Folders with the store's own sources, besides those of the store and of the new files")
        ->expected(1, -1)
        ->type_name("DIR");
    app.add_option("--attribution", options.attribution, "Text shown with the terrain, instead of the store's");
    app.add_option("--threads", options.threads, "0: one a core")->capture_default_str()->check(CLI::Range(0, 1024));
    app.add_option("--memory", memory, "Ceiling of resident memory, at least 192M")->capture_default_str();
    app.add_flag("--quiet", options.quiet, "No progress");
    add_json_option(app, json);
    if (const int code = parse_arguments(app, argc, argv); code >= 0) return code;
    const auto bytes = parse_bytes(memory);
    if (!bytes)
        return report_error("scree update",
                            {ErrorCode::usage, fmt::format("--memory {} is not a size such as 256M", memory)});
    options.memory_bytes = *bytes;
    if (options.dems.empty() && options.images.empty() && options.remove.empty() && !options.attribution)
        return report_error("scree update", {ErrorCode::usage, "nothing to do: name new sources, or --remove some"});

    install_interrupt_handler();
    auto report = update_store(options, interrupt_flag());
    if (!report) return report_error("scree update", report.error());
    for (const std::string& warning : report->warnings) note("warning: {}\n", warning);
    if (!options.quiet)
        note(
            "{}: {} of {} districts made again; {} height tiles and {} texture tiles written, {} removed; {:.1f} s, "
            "{:.1f} CPU s, peak {} MiB\n",
            options.store, report->districts_built, report->districts, report->height_tiles_written,
            report->texture_tiles_written, report->tiles_removed, report->seconds, report->cpu_seconds,
            report->peak_rss_bytes >> 20);
    if (json.empty()) return 0;
    const nlohmann::ordered_json out = {{"seconds", report->seconds},
                                        {"cpu_seconds", report->cpu_seconds},
                                        {"peak_rss_bytes", report->peak_rss_bytes},
                                        {"districts", report->districts},
                                        {"districts_built", report->districts_built},
                                        {"height_tiles_written", report->height_tiles_written},
                                        {"texture_tiles_written", report->texture_tiles_written},
                                        {"tiles_removed", report->tiles_removed},
                                        {"warnings", report->warnings}};
    if (auto ok = write_text(json, out.dump(2) + "\n"); !ok) return report_error("scree update", ok.error());
    return 0;
}

}  // namespace scree
