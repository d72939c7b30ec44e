#include <fmt/format.h>

#include "common/cli/arguments.h"
#include "common/report.h"
#include "runtime/app/block_commands.h"
#include "runtime/app/block_stage.h"
#include "runtime/app/commands.h"
#include "runtime/app/paged_stage.h"
#include "runtime/app/view_options.h"
#include "runtime/app/viewer.h"

namespace scree {
namespace {

Result<void> view(const ViewerOptions& o) {
    auto store = open_store(o.view);
    if (!store) return store.error();
    auto stage = wants_blocks(o.view) ? BlockStage::create(o.view, std::move(*store))
                                      : PagedStage::create(o.view, std::move(*store));
    if (!stage && stage.error().code == ErrorCode::interrupted && !interrupt_flag()) return {};  // closed meanwhile
    if (!stage) return stage.error();
    auto viewer = Viewer::create(o, **stage);
    if (!viewer) return viewer.error();
    if (auto ok = (*viewer)->run(); !ok) return ok;
    return o.view.json.empty() ? Result<void>{} : write_text(o.view.json, (*viewer)->report().dump(2) + "\n");
}

}  // namespace

int run_view(int argc, char** argv) {
    CLI::App app{
        "Opens a window on a terrain: F1 shows its keys. The commands shot, fly and audit work without one: scree-view "
        "COMMAND --help.",
        "scree-view"};
    ViewerOptions o;
    o.view.size = "1280x800";
    add_view_options(app, o.view);
    app.add_option("--path", o.view.path, "CSV of a flight that F10 flies, as F9 and scree-view fly --path have it")
        ->type_name("FILE");
    app.add_option("--fps", o.fps, "Raise the tolerance as far as this many frames a second need, and no further")
        ->check(CLI::Range(0.1, 1000.0));
    app.add_option("--tau-max", o.tau_most_px, "With --fps: never coarser than this")->capture_default_str();
    app.add_option("--seconds", o.seconds, "Close after so long; 0: stay open")->capture_default_str();
    app.set_version_flag("--version", std::string("scree-view ") + SCREE_VERSION);
    if (const int code = parse_arguments(
            app, argc, argv, {"scree-view-audit", "scree-view-compare", "scree-view-fly", "scree-view-shot"});
        code >= 0)
        return code;
    if (auto ok = check_view_options(o.view); !ok) return report_error("scree-view", ok.error());
    install_interrupt_handler();
    if (auto ok = view(o); !ok) return report_error("scree-view", ok.error());
    return 0;
}

}  // namespace scree
