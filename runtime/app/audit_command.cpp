#include <fmt/format.h>

#include <filesystem>

#include "common/cli/arguments.h"
#include "common/report.h"
#include "runtime/app/audit.h"
#include "runtime/app/audit_page.h"
#include "runtime/app/audit_result.h"
#include "runtime/app/block_commands.h"
#include "runtime/app/commands.h"
#include "runtime/app/coverage.h"
#include "runtime/app/pose_pictures.h"
#include "runtime/app/source_samples.h"
#include "runtime/app/view_options.h"
#include "runtime/report/machine.h"
#include "runtime/report/report_folder.h"

namespace scree {
namespace {

/// In motion, the clock that tiles grow by: 30 frames a second.
constexpr double kFrame_s = 1.0 / 30;

struct AuditOptions {
    int frames = 12;
    bool moving = false;
    std::vector<std::string> against;
    SamplingOptions sampling;
    std::string report;
    bool force = false;
    std::string command;  ///< as it was typed
};

struct Audit {
    const ViewOptions& options;
    const AuditOptions& audit;
    const SqliteStore& store;
    Scene& scene;
    CpuArena& arena;
    TileReader& reader;
    const TilePatterns& patterns;
    std::vector<SourceJudge> sources;
    AuditResult result;

    // What is drawn from one pose: settled, or as a flight would have it by now.
    Result<SceneFrame> frame_at(const Camera& camera) {
        if (!audit.moving) return scene.complete({&camera, 1}, [] { return interrupt_flag().load(); });
        return scene.advance({&camera, 1}, kFrame_s * static_cast<double>(result.frames.size()));
    }

    Result<void> look(const Camera& camera) {
        auto frame = frame_at(camera);
        if (!frame) return frame.error();
        const Selection& s = *frame->selection;
        const DrawList& draws = s.draws[0];
        const Dataset& d = store.dataset();
        const AuditedFrame audited{camera, draws, arena, frame->half_curvature, scene.meshes()};
        // What was promised: tau, or the stated bound where residency, the budget or the data's depth do not allow it.
        const double promised_px = std::max(options.tau_px, s.max_bound_px) + kRoundingPx;
        ErrorHistogram errors;
        if (auto ok = audit_frame(store, reader, audited, errors); !ok) return ok;
        result.kept = result.kept && errors.max() <= promised_px;
        result.worst_share = std::max(result.worst_share, errors.max() / promised_px);
        result.errors.merge(errors);
        AuditFrame noted;
        for (const SourceJudge& source : sources) {
            double excess_px = 0;
            ErrorHistogram source_errors;
            auto ok =
                audit_against(d, source, audited, d.warp_error_m + d.height_quantum_error_m, source_errors, excess_px);
            if (!ok) return ok;
            result.source_errors.merge(source_errors);
            noted.source_max_px = std::max(noted.source_max_px, source_errors.max());
            result.kept = result.kept && excess_px <= promised_px;
            result.source_excess_px = std::max(result.source_excess_px, excess_px);
        }
        const CrackReport cracks = count_cracks(d, draws, drawn_mesh(d, patterns, draws, arena, scene.meshes()));
        result.cracks.edges += cracks.edges;
        result.cracks.open_edges += cracks.open_edges;
        result.cracks.t_junctions += cracks.t_junctions;
        noted.holes = count_holes(d, scene.pager().residency(), camera, draws, frame->half_curvature);
        result.holes += noted.holes;
        result.max_bound_px = std::max(result.max_bound_px, s.max_bound_px);
        result.limited += s.budget_limited ? 1 : 0;
        result.stand_ins += frame->stand_ins ? 1 : 0;
        noted.triangles = s.triangles;
        noted.samples = errors.count();
        noted.promised_px = promised_px;
        noted.max_px = errors.max();
        noted.p99_px = errors.quantile(0.99);
        noted.mean_px = errors.mean();
        noted.open_edges = cracks.open_edges;
        noted.t_junctions = cracks.t_junctions;
        noted.limited = s.budget_limited;
        noted.incomplete = frame->stand_ins;
        result.frames.push_back(noted);
        return {};
    }
};

Result<AuditResult> audit(const ViewOptions& o, const AuditOptions& a, const SqliteStore& store,
                          const FlightPath& path) {
    const Dataset& d = store.dataset();
    std::optional<SourceSamples> sources;
    if (!a.against.empty()) {
        SamplingOptions sampling = a.sampling;
        sampling.crs = d.crs;
        sampling.vertical_crs = d.vertical_datum;
        auto samples = sample_sources(a.against, sampling);
        if (!samples) return samples.error();
        samples->exaggerate(d.exaggeration);
        sources = std::move(*samples);
    }
    SceneOptions options = scene_options(o);
    options.textures = false;  // pages are chosen as with them, but nothing is looked at
    auto scene = Scene::open(store, options);
    if (!scene) return scene.error();
    CpuArena arena(d, (*scene)->memory().height_slots);
    if (auto ok = (*scene)->start(arena); !ok) return ok.error();
    auto reader = store.open_reader();
    if (!reader) return reader.error();
    const TilePatterns patterns(d.lattice.tile_cells_log2);
    Audit audit{o, a, store, **scene, arena, **reader, patterns, {}, {}};
    if (sources)
        for (const SourceLayer& layer : sources->layers()) {
            auto judge = SourceJudge::make(d, **reader, layer);
            if (!judge) return judge.error();
            audit.result.samples_not_drawn += judge->not_drawn();
            audit.sources.push_back(std::move(*judge));
        }
    for (const FlightPose& pose : path) {
        if (interrupt_flag()) return Error{ErrorCode::interrupted, "stopped"};
        auto camera = camera_of(pose, o);
        if (!camera) return camera.error();
        if (auto ok = audit.look(*camera); !ok) return ok.error();
    }
    AuditResult& r = audit.result;
    // The papers' own choices promise nothing of errors; what is drawn is whole all the same, but for what corners
    // lose.
    if (!o.lod.is_guaranteed()) r.kept = true;
    const bool whole = r.holes == 0 || o.lod.culling == Culling::corners;
    r.kept = r.kept && whole && r.cracks.open_edges == 0 && r.cracks.t_junctions == 0 && r.samples_not_drawn == 0;
    return std::move(r);
}

AuditFacts facts_of(const Dataset& d, const ViewOptions& o, const AuditOptions& a) {
    AuditFacts facts;
    facts.store = std::filesystem::path(o.store).filename().string();
    facts.command = a.command;
    facts.machine = machine_name();
    facts.lod = command_line_of(o.lod);
    facts.guaranteed = o.lod.is_guaranteed();
    facts.moving = a.moving;
    facts.tau_px = o.tau_px;
    facts.fov_deg = o.fov_deg;
    facts.width_px = o.width_px;
    facts.height_px = o.height_px;
    facts.budget_bytes = o.budget_bytes;
    facts.exaggeration = d.exaggeration;
    facts.height_quantum_error_m = d.height_quantum_error_m;
    facts.warp_error_m = d.warp_error_m;
    for (const std::string& source : a.against) {
        const std::filesystem::path named = std::filesystem::path(source).lexically_normal();
        facts.sources.push_back((named.has_filename() ? named : named.parent_path()).filename().string());
    }
    return facts;
}

Result<ReportFolder> report_folder(const AuditOptions& a) {
    return ReportFolder::prepare(a.report, kAuditReport, a.force);
}

// Without pictures where they cannot be had: the figures stand by themselves.
Result<void> write_report(const AuditResult& result, const AuditFacts& facts, const ViewOptions& o,
                          const AuditOptions& a, const SqliteStore& store, const FlightPath& path) {
    std::string why_none;
    auto pictures = draw_poses(store, o, path);
    if (!pictures) {
        if (pictures.error().code != ErrorCode::display) return pictures.error();
        why_none = pictures.error().message;
        note("--report without pictures: {}\n", why_none);
    }
    auto page = audit_page(result, facts, pictures ? *pictures : std::vector<PosePicture>{}, why_none);
    if (!page) return page.error();
    auto folder = report_folder(a);
    if (!folder) return folder.error();
    return folder->write({{"index.html", *page}, {"audit.json", audit_json(result, facts).dump(2) + "\n"}});
}

Result<bool> run_blocks(const ViewOptions& o, const AuditOptions& a) {
    if (auto ok = refuse_with_blocks(!a.against.empty(), "--against"); !ok) return ok.error();
    if (!a.report.empty())
        if (auto folder = report_folder(a); !folder) return folder.error();
    auto store = open_store(o);
    if (!store) return store.error();
    auto path = flight_of(**store, o, a.frames);
    if (!path) return path.error();
    return audit_blocks(o, **store, *path, {a.report, a.force, a.command});
}

Result<bool> run_tiles(const ViewOptions& o, const AuditOptions& a) {
    if (!a.report.empty())
        if (auto folder = report_folder(a); !folder) return folder.error();
    auto store = open_store(o);
    if (!store) return store.error();
    auto path = flight_of(**store, o, a.frames);
    if (!path) return path.error();
    auto result = audit(o, a, **store, *path);
    if (!result) return result.error();
    const AuditFacts facts = facts_of((*store)->dataset(), o, a);
    if (!a.report.empty())
        if (auto ok = write_report(*result, facts, o, a, **store, *path); !ok) return ok.error();
    if (o.json != "-") fmt::print("{}", audit_text(*result, facts));
    if (!o.json.empty())
        if (auto ok = write_text(o.json, audit_json(*result, facts).dump(2) + "\n"); !ok) return ok.error();
    return result->kept;
}

}  // namespace

int run_audit(int argc, char** argv) {
    CLI::App app{"Measures the drawn surface against the finest data, in pixels, and looks for cracks.",
                 "scree-view audit"};
    ViewOptions o;
    AuditOptions a;
    add_view_options(app, o);
    app.add_option("--path", o.path,
                   "CSV of eye_x,eye_y,eye_z,look_x,look_y,look_z; default: a low, a high and a steep part")
        ->type_name("FILE");
    app.add_option("--frames", a.frames, "Poses along the path")->capture_default_str()->check(CLI::Range(1, 1000000));
    app.add_flag(
        "--moving", a.moving,
        "Do not wait for tiles: judge each frame as a flight draws it, stand-ins and growing tiles included, by "
        "the bound it states");
    auto* against = app.add_option("--against", a.against,
                                   "Also judge by the DEMs themselves, read by `scree samples`: every sample in view")
                        ->type_name("PATH");
    app.add_option("--assume-crs", a.sampling.assume_crs, "As for scree build")->needs(against);
    app.add_flag("--assume-same-datum", a.sampling.assume_same_datum, "As for scree build")->needs(against);
    app.add_option("--spacing", a.sampling.spacing_m, "As for scree build, of sources without georeference")
        ->needs(against);
    app.add_option("--height-scale", a.sampling.height_scale, "As for scree build")->needs(against);
    app.add_option("--height-offset", a.sampling.height_offset_m, "As for scree build")->needs(against);
    app.add_option("--nodata", a.sampling.nodata, "As for scree build")->needs(against);
    auto* report = app.add_option("--report", a.report,
                                  "Write a page of charts and pictures, and audit.json, into this new folder")
                       ->type_name("DIR");
    app.add_flag("--force", a.force, "Replace an earlier report")->needs(report);
    if (const int code = parse_arguments(app, argc, argv); code >= 0) return code;
    a.command = typed_command("audit", argc, argv);
    if (auto ok = check_view_options(o); !ok) return report_error("scree-view audit", ok.error());
    install_interrupt_handler();
    a.sampling.stop = &interrupt_flag();
    const auto kept = wants_blocks(o) ? run_blocks(o, a) : run_tiles(o, a);
    if (!kept) return report_error("scree-view audit", kept.error());
    return *kept ? 0 : static_cast<int>(ErrorCode::check_failed);
}

}  // namespace scree
