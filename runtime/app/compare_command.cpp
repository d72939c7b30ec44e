#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "common/cli/arguments.h"
#include "common/report.h"
#include "runtime/app/commands.h"
#include "runtime/app/comparison_page.h"
#include "runtime/app/comparison_run.h"
#include "runtime/app/comparison_table.h"
#include "runtime/app/view_options.h"
#include "runtime/paging/memory_plan.h"
#include "runtime/report/html.h"
#include "runtime/report/report_folder.h"

namespace scree {
namespace {

Result<ReportFolder> report_folder(const std::string& name, bool force) {
    return ReportFolder::prepare(name, {"index.html", "comparison.csv", "comparison.json"}, force);
}

struct CompareOptions {
    int frames = 6, rounds = 2;
    double step_m = 15;
    std::vector<double> tau_px = CaseList{}.tau_px;
    std::string report, csv;
    bool force = false, quiet = false, recommended = false, quick = false;
    Wish wish;
};

// With what was measured under, so that what is seen is what was measured.
std::string view_command(const ComparisonCase& c, const ViewOptions& o) {
    std::string line = fmt::format("scree-view view {} {} --size {}x{}", shell_quoted(o.store), options_of(c),
                                   o.width_px, o.height_px);
    if (o.fov_deg != ViewOptions{}.fov_deg) line += fmt::format(" --fov {}", o.fov_deg);
    if (o.exaggeration != 1) line += fmt::format(" --exaggeration {}", o.exaggeration);
    if (o.curvature_text != ViewOptions{}.curvature_text) line += fmt::format(" --curvature {}", o.curvature_text);
    return line;
}

std::int64_t all_tiles_bytes(const Dataset& d) {
    return fixed_cost(d, SceneOptions{}.loader_threads) + d.height_tiles * height_slot_cost(d) +
           d.texture_tiles * texture_slot_cost(d);
}

std::vector<ComparisonCase> cases_of(const Dataset& d, const ViewOptions& o, const CompareOptions& c) {
    CaseList list;
    list.tau_px = c.tau_px;
    list.base.method = fmt::format("{}{}", command_line_of(o.lod).substr(6), o.no_morph ? ", no morph" : "");
    list.base.lod = o.lod;
    list.base.morph = !o.no_morph;
    list.base.tau_px = o.tau_px;
    list.base.texture_tau_px = o.texture_tau_px;
    list.base.budget_bytes = o.budget_bytes;
    if (c.recommended) list.just_px = c.wish.most_error_px;
    list.promises_only = c.recommended && c.report.empty() && c.csv.empty() && o.json.empty();
    return without_idle_budgets(comparison_cases(list), all_tiles_bytes(d));
}

Result<Comparison> measure(const ViewOptions& o, const CompareOptions& c) {
    auto store = open_store(o);
    if (!store) return store.error();
    ComparisonSetup setup;
    setup.store = std::move(*store);
    setup.scene = scene_options(o);
    // What the command's own options cannot have is no case to pass over.
    if (auto scene = Scene::open(setup.store, setup.scene); !scene) return scene.error();
    auto path = flight_of(*setup.store, o, c.frames);
    if (!path) return path.error();
    setup.path = std::move(*path);
    setup.fov_deg = o.fov_deg;
    setup.width_px = o.width_px;
    setup.height_px = o.height_px;
    setup.step_m = c.step_m;
    setup.rounds = c.rounds;
    setup.quiet = c.quiet;
    setup.cases = cases_of(setup.store->dataset(), o, c);
    if (!c.quiet)
        note("compare: {} cases, {} poses, {} round{}; the time left is that of cases like those measured so far\n",
             setup.cases.size(), setup.path.size(), setup.rounds, setup.rounds == 1 ? "" : "s");
    return run_comparison(setup);
}

Result<void> write(const Comparison& comparison, const ViewOptions& o, const CompareOptions& c,
                   const std::optional<Wish>& wish, const std::string& command) {
    const std::string json = comparison_json(comparison, wish).dump(2) + "\n";
    if (!c.report.empty()) {
        auto folder = report_folder(c.report, c.force);
        if (!folder) return folder.error();
        auto page = comparison_page(comparison, wish, command);
        if (!page) return page.error();
        if (auto ok = folder->write(
                {{"index.html", *page}, {"comparison.csv", comparison_csv(comparison)}, {"comparison.json", json}});
            !ok)
            return ok;
    }
    if (!c.csv.empty())
        if (auto ok = write_text(c.csv, comparison_csv(comparison)); !ok) return ok;
    if (!o.json.empty())
        if (auto ok = write_text(o.json, json); !ok) return ok;
    return {};
}

// Standard output has one thing: the report, the command line or the table.
void tell(const Comparison& comparison, const ViewOptions& o, const CompareOptions& c, const Recommendation& r,
          const std::string& command) {
    const std::string table = comparison_text(comparison);
    if (c.recommended) {
        if (!c.quiet) note("{}", table);
        note("{}\n", r.reason);
        if (r.cheaper_here)
            note("cheaper, and within {:g} px on this path but not by promise: {}\n", c.wish.most_error_px,
                 options_of(comparison.cases[*r.cheaper_here].what));
        if (o.json != "-" && c.csv != "-" && !command.empty()) fmt::print("{}\n", command);
        return;
    }
    if (o.json != "-" && c.csv != "-") fmt::print("{}", table);
}

Result<bool> compare(const ViewOptions& o, const CompareOptions& c) {
    if (!c.report.empty())
        if (auto folder = report_folder(c.report, c.force); !folder) return folder.error();
    auto comparison = measure(o, c);
    if (!comparison) return comparison.error();
    const std::optional<Wish> wish = c.recommended ? std::optional(c.wish) : std::nullopt;
    const Recommendation r = recommend(comparison->cases, c.wish);
    const std::string command = wish && r.best ? view_command(comparison->cases[*r.best].what, o) : std::string();
    if (auto ok = write(*comparison, o, c, wish, command); !ok) return ok.error();
    tell(*comparison, o, c, r, command);
    return comparison->kept();
}

Result<void> check(const CompareOptions& c, const ViewOptions& o) {
    for (const double tau_px : c.tau_px)
        if (!(std::isfinite(tau_px) && tau_px > 0))
            return Error{ErrorCode::usage, fmt::format("--taus {}: is no length above 0", tau_px)};
    if (!(std::isfinite(c.step_m) && c.step_m > 0))
        return Error{ErrorCode::usage, fmt::format("--step {}: is no length above 0", c.step_m)};
    if (!(std::isfinite(c.wish.fps) && c.wish.fps > 0))
        return Error{ErrorCode::usage, fmt::format("--fps {}: is no rate above 0", c.wish.fps)};
    if (!(std::isfinite(c.wish.most_error_px) && c.wish.most_error_px > 0))
        return Error{ErrorCode::usage, fmt::format("--max-error {}: is no length above 0", c.wish.most_error_px)};
    if (o.json == "-" && c.csv == "-") return Error{ErrorCode::usage, "--json - and --csv - both want standard output"};
    return {};
}

}  // namespace

int run_compare(int argc, char** argv) {
    CLI::App app{"Measures what accuracy costs: every method of level of detail, over its settings.",
                 "scree-view compare"};
    ViewOptions o;
    CompareOptions c;
    add_view_options(app, o);
    app.add_option("--path", o.path,
                   "CSV of eye_x,eye_y,eye_z,look_x,look_y,look_z; default: a low, a high and a steep part")
        ->type_name("FILE");
    app.add_option("--frames", c.frames, "Poses along the path: more say more of the store, and take longer")
        ->capture_default_str()
        ->check(CLI::Range(1, 10000));
    app.add_option("--step", c.step_m, "Metres that the eye moves on from each pose, twice: what caches are worth")
        ->capture_default_str();
    app.add_option("--rounds", c.rounds, "How often all is timed, in turns: more are steadier")
        ->capture_default_str()
        ->check(CLI::Range(1, 1000));
    app.add_option("--taus", c.tau_px, "Tolerances of the methods, pixels, separated by commas")
        ->delimiter(',')
        ->capture_default_str();
    app.add_option("--report", c.report, "Write index.html, comparison.csv and comparison.json into this new folder")
        ->type_name("DIR");
    app.add_flag("--force", c.force, "Replace an earlier report");
    app.add_option("--csv", c.csv, "Write a line a case, or - for standard output")->type_name("FILE|-");
    auto* recommended =
        app.add_flag("--recommend", c.recommended, "Print the command line that fits --fps and --max-error best");
    app.add_option("--fps", c.wish.fps, "Frames a second that 99 of 100 frames must make")
        ->capture_default_str()
        ->needs(recommended);
    app.add_option("--max-error", c.wish.most_error_px, "Pixels that may be promised at most")
        ->capture_default_str()
        ->needs(recommended);
    auto* quick = app.add_flag("--quick", c.quick, "3 poses, 1 round, tolerances 0.5, 1, 2 and 4: a first look");
    for (const char* option : {"--frames", "--rounds", "--taus"}) quick->excludes(app.get_option(option));
    app.add_flag("--quiet", c.quiet, "No progress");
    if (const int code = parse_arguments(app, argc, argv); code >= 0) return code;
    if (c.quick) {
        c.frames = 3;
        c.rounds = 1;
        c.tau_px = {0.5, 1, 2, 4};
    }
    auto ok = check_view_options(o);
    if (ok) ok = check(c, o);
    if (!ok) return report_error("scree-view compare", ok.error());
    install_interrupt_handler();
    const auto kept = compare(o, c);
    if (!kept) return report_error("scree-view compare", kept.error());
    return *kept ? 0 : static_cast<int>(ErrorCode::check_failed);
}

}  // namespace scree
