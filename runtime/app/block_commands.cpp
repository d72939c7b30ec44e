#include "runtime/app/block_commands.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "common/process_usage.h"
#include "common/progress.h"
#include "common/report.h"
#include "runtime/app/audit.h"
#include "runtime/app/block_display.h"
#include "runtime/app/block_page.h"
#include "runtime/app/block_scene.h"
#include "runtime/lod/block_truth.h"
#include "runtime/render/png.h"
#include "runtime/report/machine.h"
#include "runtime/report/report_folder.h"
#include "runtime/report/statistics.h"
#include "runtime/scene/frame_governor.h"

namespace scree {
namespace {

using Clock = std::chrono::steady_clock;
using Json = nlohmann::ordered_json;

double share(std::int64_t part, std::int64_t whole) {
    return whole > 0 ? static_cast<double>(part) / static_cast<double>(whole) : 0;
}

// What is said of every picture and flight: whether anything is promised, and what of the store is not shown.
void describe(Json& report, const BlockScene& scene) {
    report["guaranteed"] = scene.promise_px().has_value();
    report["exaggeration"] = scene.dataset().exaggeration;
    report["complete_triangles"] = scene.world().complete_triangles();
    report["dropped_columns"] = scene.world().dropped_columns();
    report["dropped_rows"] = scene.world().dropped_rows();
}

std::string promise_text(const std::optional<double>& promise_px) {
    return promise_px ? fmt::format("at most {:.3g} px from the finest surface", *promise_px)
                      : "how far from the finest surface is not promised";
}

std::string dropped_text(const BlockWorld& world) {
    if (world.dropped_columns() == 0 && world.dropped_rows() == 0) return {};
    return fmt::format("\nnot shown, as no whole block: {} columns in the east, {} rows in the south",
                       world.dropped_columns(), world.dropped_rows());
}

Json shot_report(const BlockScene& scene, const BlockFrame& frame, const FlightPose& pose) {
    Json report = {{"triangles", frame.triangles()},
                   {"blocks", frame.blocks.size()},
                   {"strips", frame.strips.size()},
                   {"block_triangles", frame.block_triangles},
                   {"dike_triangles", frame.dike_triangles}};
    if (const auto promise_px = scene.promise_px()) report["max_bound_px"] = *promise_px;
    report["tau_effective_px"] = scene.tau_px();
    report["curvature"] = scene.half_curvature() > 0;
    report["eye"] = {pose.eye.x, pose.eye.y, pose.eye.z};
    report["look"] = {pose.look.x, pose.look.y, pose.look.z};
    describe(report, scene);
    return report;
}

BlockFacts facts_of(const BlockScene& scene, const ViewOptions& o, const BlockReport& report) {
    BlockFacts facts;
    facts.store = std::filesystem::path(o.store).filename().string();
    facts.command = report.command;
    facts.machine = machine_name();
    facts.lod = command_line_of(o.lod);
    facts.promise_px = scene.promise_px();
    facts.tau_px = o.tau_px;
    facts.fov_deg = o.fov_deg;
    facts.exaggeration = scene.dataset().exaggeration;
    facts.width_px = o.width_px;
    facts.height_px = o.height_px;
    facts.budget_bytes = o.budget_bytes;
    facts.resident_bytes = scene.resident_bytes();
    facts.dropped_columns = scene.world().dropped_columns();
    facts.dropped_rows = scene.world().dropped_rows();
    facts.height_quantum_error_m = scene.dataset().height_quantum_error_m;
    return facts;
}

PosePicture picture_of(std::size_t k, const ViewOptions& o, BlockDisplay& display) {
    const PagePicture drawn{o.width_px, o.height_px, display.target().read_pixels()};
    return {k, reduced(drawn, kPictureWidth_px)};
}

struct FlightLog : BlockFlightFigures {
    std::int64_t drawn = 0, reused_blocks = 0, all_meshes_made = 0, strips_made = 0, upload_bytes = 0;
    Series settled_triangles, settled_px;
    std::vector<PosePicture> pictures;
    double max_bound_px = 0;
    std::string csv =
        "frame,frame_ms,select_ms,triangles,blocks,strips,reused,meshes_made,upload_bytes,tau_effective,rss_bytes\n";

    void add(std::size_t k, double ms, const BlockFrame& frame, const FrameTimes& times, const BlockScene& scene) {
        frame_ms.add(ms);
        select_ms.add(frame.lod_ms);
        triangles.add(static_cast<double>(frame.triangles()));
        blocks.add(static_cast<double>(frame.blocks.size()));
        strips.add(static_cast<double>(frame.strips.size()));
        tau_px.add(scene.tau_px());
        promised_px.add(scene.promise_px().value_or(0));
        reused.add(frame.reused);
        meshes_made.add(frame.meshes_made);
        const std::int64_t rss = resident_bytes();
        rss_bytes.add(static_cast<double>(rss));
        drawn += static_cast<std::int64_t>(frame.blocks.size());
        reused_blocks += frame.reused;
        all_meshes_made += frame.meshes_made;
        strips_made += frame.strips_made;
        upload_bytes += static_cast<std::int64_t>(times.uploaded_bytes);
        max_bound_px = std::max(max_bound_px, scene.promise_px().value_or(0));
        csv += fmt::format("{},{:.3f},{:.4f},{},{},{},{},{},{},{:.4f},{}\n", k, ms, frame.lod_ms, frame.triangles(),
                           frame.blocks.size(), frame.strips.size(), frame.reused, frame.meshes_made,
                           times.uploaded_bytes, scene.tau_px(), rss);
    }
};

Result<FlightLog> fly(const ViewOptions& o, const FlightPath& path, const BlockFlight& f, BlockScene& scene,
                      BlockDisplay& display) {
    FlightLog log;
    std::vector<std::size_t> pictured;
    if (!f.report.folder.empty()) pictured = pictured_frames(path.size());
    FrameGovernor governor({f.fps > 0 ? 1000 / f.fps : 1e9, o.tau_px, f.tau_most_px});
    for (std::size_t k = 0; k < path.size(); ++k) {
        if (interrupt_flag()) return Error{ErrorCode::interrupted, "stopped"};
        auto camera = camera_of(path[k], o);
        if (!camera) return camera.error();
        const auto start = Clock::now();
        const BlockFrame& frame = scene.select(*camera);
        const FrameTimes times = display.draw(*camera);
        display.show();
        const double ms = std::chrono::duration<double, std::milli>(Clock::now() - start).count();
        log.add(k, ms, frame, times, scene);
        log.holes += scene.count_holes(*camera);
        if (std::binary_search(pictured.begin(), pictured.end(), k)) log.pictures.push_back(picture_of(k, o, display));
        if (f.fps > 0) scene.set_tau_px(governor.next(ms));
    }
    return log;
}

// The same poses with nothing reused, at the tolerance that was asked for, not drawn.
Result<void> settle(const ViewOptions& o, const FlightPath& path, BlockScene& scene, FlightLog& log) {
    scene.set_tau_px(o.tau_px);
    for (const FlightPose& pose : path) {
        auto camera = camera_of(pose, o);
        if (!camera) return camera.error();
        scene.forget();
        log.settled_triangles.add(static_cast<double>(scene.select(*camera).triangles()));
        log.settled_px.add(scene.promise_px() ? o.tau_px : 0);
    }
    return {};
}

Json settled_report(const FlightLog& log) {
    double least_share = 1;
    for (std::size_t k = 0; k < log.triangles.values.size(); ++k)
        if (log.settled_triangles.values[k] > 0)
            least_share = std::min(least_share, log.triangles.values[k] / log.settled_triangles.values[k]);
    const double settled_px = log.settled_px.mean();
    return {{"error_integral_px", settled_px},
            {"error_integral_ratio", settled_px > 0 ? log.promised_px.mean() / settled_px : 1},
            {"triangles", log.settled_triangles.mean_max()},
            {"least_triangle_share", least_share}};
}

Json flight_report(const FlightLog& log, const BlockScene& scene, const ViewOptions& o, const std::string& renderer) {
    Json report = {{"frames", log.frame_ms.values.size()},
                   {"frame_ms", log.frame_ms.spread()},
                   {"select_ms", log.select_ms.spread()},
                   {"triangles", log.triangles.mean_max()},
                   {"blocks", log.blocks.mean_max()},
                   {"strips", log.strips.mean_max()},
                   {"reused_share", share(log.reused_blocks, log.drawn)},
                   {"meshes_made", log.all_meshes_made},
                   {"strips_made", log.strips_made},
                   {"upload_bytes", log.upload_bytes},
                   {"budget_bytes", o.budget_bytes},
                   {"peak_resident_bytes", scene.resident_bytes()},
                   {"peak_rss_bytes", process_usage().peak_rss_bytes},
                   {"holes", log.holes}};
    if (scene.promise_px()) report["max_bound_px"] = log.max_bound_px;
    if (!log.settled_triangles.values.empty()) report["settled"] = settled_report(log);
    report["tau_effective_px"] = log.tau_px.mean_max();
    report["tau_px"] = o.tau_px;
    report["size_px"] = {o.width_px, o.height_px};
    report["renderer"] = renderer;
    describe(report, scene);
    return report;
}

void print_flight(const FlightLog& log, const BlockScene& scene, const ViewOptions& o, const std::string& renderer) {
    fmt::print(
        "{} frames on {}: median {:.1f} ms, p99 {:.1f} ms; selection median {:.3f} ms; {:.0f} triangles in {:.0f} "
        "blocks and {:.0f} strips (mean)\n"
        "{}; {:.1f} % of the blocks reused, {} holes; {:.1f} of {:.1f} MB for heights and meshes{}\n",
        log.frame_ms.values.size(), renderer, log.frame_ms.quantile(0.5), log.frame_ms.quantile(0.99),
        log.select_ms.quantile(0.5), log.triangles.mean(), log.blocks.mean(), log.strips.mean(),
        promise_text(scene.promise_px() ? std::optional(log.max_bound_px) : std::nullopt),
        100 * share(log.reused_blocks, log.drawn), log.holes, static_cast<double>(scene.resident_bytes()) / 1e6,
        static_cast<double>(o.budget_bytes) / 1e6, dropped_text(scene.world()));
}

struct BlockAudit {
    bool by_frame = false;  ///< fill `figures`
    BlockAuditFigures figures;
    BlockTruth truth;
    CrackReport cracks;
    std::int64_t holes = 0, blocks = 0, reused = 0;
    int frames = 0;
    double worst_share = 0;  ///< greatest error of a frame over what was promised

    void look(BlockScene& scene, const Camera& camera) {
        const BlockFrame& frame = scene.select(camera);
        const double limit_px = scene.promise_px().value_or(scene.tau_px()) + kRoundingPx;
        judge_frame(scene.world(), camera, frame, limit_px, truth, scene.half_curvature());
        const CrackReport found = scene.count_cracks();
        cracks.edges += found.edges;
        cracks.open_edges += found.open_edges;
        cracks.t_junctions += found.t_junctions;
        const std::int64_t missing = scene.count_holes(camera);
        holes += missing;
        if (by_frame) note_frame(scene, camera, frame, found, missing);
        blocks += static_cast<std::int64_t>(frame.blocks.size());
        reused += frame.reused;
        worst_share = max_px() / limit_px;  // one limit for all frames
        ++frames;
    }
    void note_frame(const BlockScene& scene, const Camera& camera, const BlockFrame& frame, const CrackReport& found,
                    std::int64_t missing) {
        BlockTruth own;
        judge_frame(scene.world(), camera, frame, 0, own);
        figures.triangles.add(static_cast<double>(frame.triangles()));
        figures.samples.add(static_cast<double>(own.blocks.count() + own.dikes.count()));
        figures.blocks_max_px.add(own.blocks.max_px());
        figures.strips_max_px.add(own.dikes.max_px());
        figures.mean_px.add(own.blocks.mean_px());
        figures.open_edges.add(static_cast<double>(found.open_edges));
        figures.t_junctions.add(static_cast<double>(found.t_junctions));
        figures.holes.add(static_cast<double>(missing));
    }
    double max_px() const { return std::max(truth.blocks.max_px(), truth.dikes.max_px()); }
    bool kept() const { return worst_share <= 1 && cracks.open_edges == 0 && cracks.t_junctions == 0 && holes == 0; }
};

Json audit_report(const BlockAudit& a, const BlockScene& scene) {
    Json report = {{"frames", a.frames},
                   {"tau_px", scene.tau_px()},
                   {"max_error_px", a.max_px()},
                   {"p99_error_px", a.truth.blocks.quantile_px(0.99)},
                   {"mean_error_px", a.truth.blocks.mean_px()}};
    const auto promise_px = scene.promise_px();
    if (promise_px) {
        report["max_bound_px"] = *promise_px;
        report["worst_share_of_promise"] = a.worst_share;
    }
    report["open_edges"] = a.cracks.open_edges;
    report["t_junctions"] = a.cracks.t_junctions;
    report["samples"] = a.truth.blocks.count();
    report["holes"] = a.holes;
    report["blocks"] = a.blocks;
    report["strips"] = a.truth.strips;
    report["reused_share"] = share(a.reused, a.blocks);
    report["dikes"] = {{"max_error_px", a.truth.dikes.max_px()},
                       {"p99_error_px", a.truth.dikes.quantile_px(0.99)},
                       {"mean_error_px", a.truth.dikes.mean_px()},
                       {"samples", a.truth.dikes.count()},
                       {"strips_above", a.truth.strips_above}};
    describe(report, scene);
    if (promise_px) report["kept"] = a.kept();
    return report;
}

void print_audit(const BlockAudit& a, const BlockScene& scene) {
    const auto promise_px = scene.promise_px();
    fmt::print(
        "{} frames, {} samples: error max {:.4f} px, p99 {:.4f}, mean {:.5f}; {} at tau {}\n"
        "of these {} strips, {} samples: error max {:.4f} px, {} strips above {}\n",
        a.frames, a.truth.blocks.count() + a.truth.dikes.count(), a.max_px(), a.truth.blocks.quantile_px(0.99),
        a.truth.blocks.mean_px(), promise_px ? fmt::format("promised {:.4f}", *promise_px) : "nothing promised",
        scene.tau_px(), a.truth.strips, a.truth.dikes.count(), a.truth.dikes.max_px(), a.truth.strips_above,
        promise_px ? "the promise" : "tau");
    fmt::print("{} open edges, {} T-junctions, {} holes{}{}\n", a.cracks.open_edges, a.cracks.t_junctions, a.holes,
               !promise_px ? ""
               : a.kept()  ? ": the promise holds"
                           : ": THE PROMISE IS BROKEN",
               dropped_text(scene.world()));
}

Result<std::vector<PosePicture>> draw_poses(BlockScene& scene, const ViewOptions& o, const FlightPath& path) {
    auto display = BlockDisplay::create(scene, display_options(o));
    if (!display) return display.error();
    set_look(o, (*display)->frame_settings());
    std::vector<PosePicture> pictures;
    for (const std::size_t k : pictured_frames(path.size())) {
        auto camera = camera_of(path[k], o);
        if (!camera) return camera.error();
        scene.select(*camera);
        (*display)->draw(*camera);
        pictures.push_back(picture_of(k, o, **display));
    }
    return pictures;
}

Result<void> write_flight(const BlockReport& report, const FlightLog& log, const BlockFacts& facts, const Json& json) {
    auto page = block_flight_page(log, facts, log.pictures);
    if (!page) return page.error();
    auto folder = ReportFolder::prepare(report.folder, kFlightReport, report.force);
    if (!folder) return folder.error();
    return folder->write({{"index.html", *page}, {"flight.csv", log.csv}, {"flight.json", json.dump(2) + "\n"}});
}

// Without pictures where they cannot be had: the figures stand by themselves.
Result<void> write_audit(const BlockReport& report, BlockAuditFigures figures, BlockScene& scene, const ViewOptions& o,
                         const FlightPath& path, const Json& json) {
    auto pictures = draw_poses(scene, o, path);
    std::string why_none;
    if (!pictures) {
        if (pictures.error().code != ErrorCode::display) return pictures.error();
        why_none = pictures.error().message;
        note("--report without pictures: {}\n", why_none);
    }
    auto page = block_audit_page(figures, facts_of(scene, o, report), pictures ? *pictures : std::vector<PosePicture>{},
                                 why_none);
    if (!page) return page.error();
    auto folder = ReportFolder::prepare(report.folder, kAuditReport, report.force);
    if (!folder) return folder.error();
    return folder->write({{"index.html", *page}, {"audit.json", json.dump(2) + "\n"}});
}

Result<std::unique_ptr<BlockScene>> open_scene(const TileStore& store, const ViewOptions& o) {
    Progress progress("reading blocks", "%", false);
    progress.set_total(100);
    return BlockScene::open(store, scene_options(o), [&](double share) {
        progress.update(100 * share);
        return !interrupt_flag();
    });
}

}  // namespace

Result<void> refuse_with_blocks(bool given, const std::string& option) {
    if (!given) return {};
    return Error{ErrorCode::usage,
                 fmt::format("{} with --cracks dike: it goes with tiles that are paged only", option)};
}

Result<void> shoot_blocks(const ViewOptions& o, const TileStore& store, const BlockShot& shot) {
    auto scene = open_scene(store, o);
    if (!scene) return scene.error();
    auto display = BlockDisplay::create(**scene, display_options(o));
    if (!display) return display.error();
    set_look(o, (*display)->frame_settings());
    (*display)->frame_settings().wireframe = shot.debug.wireframe;
    (*display)->frame_settings().magenta_background = shot.debug.magenta_background;
    const Dataset& d = (*scene)->dataset();
    const FlightPose pose = shot.pose.value_or(overview(d, o.fov_deg, static_cast<double>(o.width_px) / o.height_px));
    auto camera = camera_of(pose, o);
    if (!camera) return camera.error();
    const BlockFrame& frame = (*scene)->select(*camera);
    (*display)->draw(*camera);
    if (auto ok = write_png(shot.out, o.width_px, o.height_px, (*display)->target().read_pixels()); !ok) return ok;
    if (!shot.mesh_file.empty())
        if (auto ok = write_ply(shot.mesh_file, d, (*scene)->drawn_mesh(), camera->eye, (*scene)->half_curvature());
            !ok)
            return ok;
    if (o.json != "-")
        fmt::print("{}: {} triangles in {} blocks and {} strips, {}{}\n", shot.out, frame.triangles(),
                   frame.blocks.size(), frame.strips.size(), promise_text((*scene)->promise_px()),
                   dropped_text((*scene)->world()));
    if (o.json.empty()) return {};
    return write_text(o.json, shot_report(**scene, frame, pose).dump(2) + "\n");
}

Result<void> fly_blocks(const ViewOptions& o, const TileStore& store, const FlightPath& path, const BlockFlight& f) {
    auto scene = open_scene(store, o);
    if (!scene) return scene.error();
    DisplayOptions shown = display_options(o);
    shown.window = !f.headless;
    auto display = BlockDisplay::create(**scene, shown);
    if (!display) return display.error();
    set_look(o, (*display)->frame_settings());
    (*display)->frame_settings().wait_until_drawn = true;
    auto log = fly(o, path, f, **scene, **display);
    if (!log) return log.error();
    if (f.settled)
        if (auto ok = settle(o, path, **scene, *log); !ok) return ok;
    if (!f.csv.empty())
        if (auto ok = write_text(f.csv, log->csv); !ok) return ok;
    if (!f.last_frame.empty())
        if (auto ok = write_png(f.last_frame, o.width_px, o.height_px, (*display)->target().read_pixels()); !ok)
            return ok;
    const std::string renderer = (*display)->context().renderer();
    const Json report = flight_report(*log, **scene, o, renderer);
    if (!f.report.folder.empty()) {
        BlockFacts facts = facts_of(**scene, o, f.report);
        facts.renderer = renderer;
        facts.fps = f.fps;
        if (auto ok = write_flight(f.report, *log, facts, report); !ok) return ok;
    }
    if (o.json != "-") print_flight(*log, **scene, o, renderer);
    return o.json.empty() ? Result<void>{} : write_text(o.json, report.dump(2) + "\n");
}

Result<bool> audit_blocks(const ViewOptions& o, const TileStore& store, const FlightPath& path,
                          const BlockReport& report) {
    auto scene = open_scene(store, o);
    if (!scene) return scene.error();
    BlockAudit audit;
    audit.by_frame = !report.folder.empty();
    for (const FlightPose& pose : path) {
        if (interrupt_flag()) return Error{ErrorCode::interrupted, "stopped"};
        auto camera = camera_of(pose, o);
        if (!camera) return camera.error();
        audit.look(**scene, *camera);
    }
    const Json found = audit_report(audit, **scene);
    if (!report.folder.empty()) {
        audit.figures.kept = audit.kept();
        if (auto ok = write_audit(report, audit.figures, **scene, o, path, found); !ok) return ok.error();
    }
    if (o.json != "-") print_audit(audit, **scene);
    if (!o.json.empty())
        if (auto ok = write_text(o.json, found.dump(2) + "\n"); !ok) return ok.error();
    return !(*scene)->promise_px() || audit.kept();
}

}  // namespace scree
