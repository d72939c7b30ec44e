#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "common/report.h"
#include "runtime/app/audit.h"
#include "runtime/app/commands.h"
#include "runtime/app/coverage.h"
#include "runtime/app/view_options.h"

namespace scree {
namespace {

// Positions and projections are doubles here and floats on screen: what they may differ by (Scree lod, 5.2) at 800 px.
constexpr double kRoundingPx = 1e-3;

struct AuditResult {
    ErrorHistogram errors;
    CrackReport cracks;
    double max_bound_px = 0;
    std::int64_t holes = 0, limited = 0;
    int frames = 0;
};

Result<AuditResult> audit(const ViewOptions& o, int frames) {
    auto store = SqliteStore::open(o.store);
    if (!store) return store.error();
    const Dataset& d = (*store)->dataset();
    SceneOptions options = scene_options(o);
    options.textures = false;  // pages are chosen as with them, but nothing is looked at
    auto scene = Scene::open(**store, options);
    if (!scene) return scene.error();
    auto path = flight_of(**store, o, frames);
    if (!path) return path.error();
    CpuArena arena(d, (*scene)->memory().height_slots);
    if (auto ok = (*scene)->start(arena); !ok) return ok.error();
    auto reader = (*store)->open_reader();
    if (!reader) return reader.error();
    const TilePatterns patterns(d.lattice.tile_cells_log2);
    AuditResult result;
    for (const FlightPose& pose : *path) {
        if (interrupt_flag()) return Error{ErrorCode::interrupted, "stopped"};
        auto camera = camera_of(pose, o);
        if (!camera) return camera.error();
        auto frame = (*scene)->complete({&*camera, 1}, [] { return interrupt_flag().load(); });
        if (!frame) return frame.error();
        const Selection& s = *frame->selection;
        const DrawList& draws = s.draws[0];
        if (auto ok = audit_frame(**store, **reader, *camera, draws, arena, result.errors); !ok) return ok.error();
        const CrackReport cracks = count_cracks(d, draws, drawn_mesh(d, patterns, draws, arena));
        result.cracks.edges += cracks.edges;
        result.cracks.open_edges += cracks.open_edges;
        result.cracks.t_junctions += cracks.t_junctions;
        result.holes += count_holes(d, (*scene)->pager(), *camera, draws);
        result.max_bound_px = std::max(result.max_bound_px, s.max_bound_px);
        result.limited += s.budget_limited ? 1 : 0;
        ++result.frames;
    }
    return result;
}

}  // namespace

int run_audit(int argc, char** argv) {
    CLI::App app{"Measures the drawn surface against the finest data, in pixels, and looks for cracks.",
                 "scree-view audit"};
    ViewOptions o;
    int frames = 12;
    add_view_options(app, o);
    app.add_option("--path", o.path,
                   "CSV of eye_x,eye_y,eye_z,look_x,look_y,look_z; default: a low, a high and a steep part");
    app.add_option("--frames", frames, "Poses along the path")->capture_default_str()->check(CLI::Range(1, 1000000));
    if (const int code = parse_arguments(app, argc, argv); code >= 0) return code;
    if (auto ok = check_view_options(o); !ok) return report_error("scree-view audit", ok.error());
    install_interrupt_handler();
    auto result = audit(o, frames);
    if (!result) return report_error("scree-view audit", result.error());
    const AuditResult& r = *result;
    // What was promised: tau, or the stated bound where the budget or the data's own depth did not allow tau.
    const double promised = std::max(o.tau_px, r.max_bound_px) + kRoundingPx;
    const bool kept =
        r.errors.max() <= promised && r.cracks.open_edges == 0 && r.cracks.t_junctions == 0 && r.holes == 0;
    if (o.json != "-")
        fmt::print(
            "{} frames, {} samples: error max {:.4f} px, p99 {:.4f}, mean {:.5f}; promised {:.4f} at tau {}\n"
            "{} open edges, {} T-junctions, {} holes{}: {}\n",
            r.frames, r.errors.count(), r.errors.max(), r.errors.quantile(0.99), r.errors.mean(), r.max_bound_px,
            o.tau_px, r.cracks.open_edges, r.cracks.t_junctions, r.holes,
            r.limited > 0 ? fmt::format(" ({} frames limited by the budget)", r.limited) : "",
            kept ? "the promise holds" : "THE PROMISE IS BROKEN");
    if (!o.json.empty()) {
        const nlohmann::ordered_json report = {{"frames", r.frames},
                                               {"tau_px", o.tau_px},
                                               {"max_error_px", r.errors.max()},
                                               {"p99_error_px", r.errors.quantile(0.99)},
                                               {"mean_error_px", r.errors.mean()},
                                               {"max_bound_px", r.max_bound_px},
                                               {"open_edges", r.cracks.open_edges},
                                               {"t_junctions", r.cracks.t_junctions},
                                               {"samples", r.errors.count()},
                                               {"holes", r.holes},
                                               {"budget_limited_frames", r.limited}};
        if (auto ok = write_text(o.json, report.dump(2) + "\n"); !ok)
            return report_error("scree-view audit", ok.error());
    }
    return kept ? 0 : static_cast<int>(ErrorCode::check_failed);
}

}  // namespace scree
