#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <optional>

#include "common/cli/arguments.h"
#include "common/process_usage.h"
#include "common/query/ground.h"
#include "common/report.h"
#include "runtime/app/block_commands.h"
#include "runtime/app/commands.h"
#include "runtime/app/coverage.h"
#include "runtime/app/display.h"
#include "runtime/app/flight_log.h"
#include "runtime/app/flight_page.h"
#include "runtime/app/see_through.h"
#include "runtime/app/view_options.h"
#include "runtime/render/png.h"
#include "runtime/report/machine.h"
#include "runtime/report/report_folder.h"
#include "runtime/scene/frame_governor.h"

namespace scree {
namespace {

using Clock = std::chrono::steady_clock;

double milliseconds_since(Clock::time_point start) {
    return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

/// Drawn before the flight, so that what OpenGL takes once for many triangles is not charged to the tiles.
constexpr std::int64_t kWarmUpTriangles = 1'000'000;
/// Longest that the coarse first picture and the true second one are waited for.
constexpr double kCoarse_s = 0.05, kCatchUp_s = 0.15;
/// Share of a frame that may be spent on waiting for tiles that are missing.
constexpr double kPatience = 0.08;
/// The coarse picture of a cold start.
constexpr double kColdStartPx = 8;

struct FlyOptions {
    int frames = 300;
    double step_m = 0;
    std::optional<std::uint64_t> roam;
    bool wait = false;
    bool headless = false;
    bool settled = false;
    bool see_through = false;
    int latency_ms = 0;
    double fps = 0;
    double tau_most_px = 16;
    std::string csv;
    std::string last_frame;
    std::string report;
    bool force = false;
    std::string command;  ///< as it was typed
};

class Flight {
public:
    Flight(Scene& scene, Display& display, const ViewOptions& o, const FlyOptions& f, Clock::time_point context_at)
        : scene_(scene), display_(display), options_(o), fly_(f), context_at_(context_at) {}

    Result<FlightLog> fly(const FlightPath& path) {
        if (auto ok = warm_up(); !ok) return ok.error();
        if (!fly_.report.empty()) pictured_ = pictured_frames(path.size());
        uploaded_bytes_ = scene_.counters().upload_bytes;
        FrameGovernor governor({fly_.fps > 0 ? 1000 / fly_.fps : 1e9, options_.tau_px, fly_.tau_most_px});
        start_ = Clock::now();
        for (std::size_t k = 0; k < path.size(); ++k) {
            if (interrupt_flag()) return Error{ErrorCode::interrupted, "stopped"};
            auto camera = camera_of(path[k], options_);
            if (!camera) return camera.error();
            if (auto ok = scene_.follow(); !ok) return ok.error();
            auto ms = frame(static_cast<int>(k), *camera);
            if (!ms) return ms.error();
            if (fly_.fps > 0) scene_.options().tau_px = governor.next(*ms);
        }
        scene_.options().tau_px = options_.tau_px;
        if (fly_.settled)
            if (auto ok = settle(path); !ok) return ok.error();
        return std::move(log_);
    }
    /// With --report: along the flight.
    const std::vector<PosePicture>& pictures() const { return pictures_; }

private:
    Result<void> warm_up() {
        // Over the whole terrain: triangles out of the picture cost next to nothing.
        const double aspect = static_cast<double>(options_.width_px) / options_.height_px;
        auto camera = camera_of(overview(scene_.dataset(), options_.fov_deg, aspect), options_);
        if (!camera) return camera.error();
        const auto& roots = scene_.pager().residency().heights.roots;
        DrawItem root;
        const auto first = std::find_if(roots.begin(), roots.end(), [](std::int32_t slot) { return slot >= 0; });
        root.tile = {0, (first - roots.begin()) % scene_.dataset().lattice.root_columns,
                     (first - roots.begin()) / scene_.dataset().lattice.root_columns};
        root.height_slot = *first;
        root.texture.slot = scene_.pager().residency().textures.roots[static_cast<std::size_t>(first - roots.begin())];
        display_.warm_up(*camera, root, 1);  // what any first drawing costs is part of a cold start, the many are not
        const auto before = Clock::now();
        display_.warm_up(*camera, root, kWarmUpTriangles);
        context_at_ += Clock::now() - before;
        log_.fixed_rss_bytes = resident_bytes() - static_cast<std::int64_t>(display_.arena_bytes());
        return {};
    }

    Result<SceneFrame> think(int k, const Camera& camera) {
        const double now_s = std::chrono::duration<double>(Clock::now() - start_).count();
        if (fly_.wait) return scene_.complete({&camera, 1}, [] { return interrupt_flag().load(); });
        const Camera* views = &camera;
        if (k > 1) return scene_.advance({views, 1}, now_s, kPatience * last_ms_ / 1000);
        // A coarse picture at once, then a true one.
        const double wanted_px = scene_.options().tau_px;
        if (k == 0) scene_.options().tau_px = std::max(wanted_px, kColdStartPx);
        const SceneFrame frame = scene_.catch_up({views, 1}, now_s, k == 0 ? kCoarse_s : kCatchUp_s);
        scene_.options().tau_px = wanted_px;
        return frame;
    }

    Result<double> frame(int k, const Camera& camera) {
        const auto start = Clock::now();
        auto frame = think(k, camera);
        if (!frame) return frame.error();
        const Selection& s = *frame->selection;
        display_.draw(camera, s.to_render(0), frame->half_curvature);
        if (display_.context().window() != nullptr) {
            display_.target().blit_to_window(options_.width_px, options_.height_px);
            display_.context().swap_buffers();
        }
        const double ms = milliseconds_since(start);
        last_ms_ = ms;
        const double since_context = milliseconds_since(context_at_);
        if (log_.coarse_after_ms == 0 && s.max_bound_px <= kColdStartPx) log_.coarse_after_ms = since_context;
        if (log_.true_after_ms == 0 && s.max_bound_px <= options_.tau_px * (1 + 1e-9))
            log_.true_after_ms = since_context;
        if (scene_.mesher() != nullptr) log_.tiles_reused.add(scene_.mesher()->counters().reused_share());
        note_frame(ms, *frame, camera);
        if (std::binary_search(pictured_.begin(), pictured_.end(), static_cast<std::size_t>(k))) take_picture(k);
        if (fly_.see_through)
            if (auto ok = look_through(camera, *frame); !ok) return ok.error();
        return ms;
    }

    void note_frame(double ms, const SceneFrame& frame, const Camera& camera) {
        const Selection& s = *frame.selection;
        const PagerCounters counters = scene_.counters();
        FlightFrame f;
        f.frame_ms = ms;
        f.select_ms = frame.select_ms;
        f.triangles = s.triangles;
        f.tiles_drawn = s.nodes;
        f.uploads = frame.uploads;
        f.upload_bytes = counters.upload_bytes - uploaded_bytes_;
        uploaded_bytes_ = counters.upload_bytes;
        f.requests = static_cast<std::int64_t>(s.requests.size());
        f.queue = scene_.pager().queue();
        f.stand_ins = s.stand_ins;
        f.holes = count_holes(scene_.dataset(), scene_.pager().residency(), camera, s.draws[0], frame.half_curvature);
        f.max_bound_px = s.max_bound_px;
        f.mean_bound_px = s.mean_bound_px;
        f.tau_effective_px = s.tau_effective_px;
        f.resident_heights_bytes = scene_.tile_bytes(TileKind::height);
        f.resident_textures_bytes = scene_.tile_bytes(TileKind::texture);
        f.rss_bytes = resident_bytes();
        f.bytes_read = counters.bytes_read;
        f.incomplete = frame.stand_ins;
        f.growing = s.growing;
        f.reused = frame.reused;
        f.limited = s.budget_limited;
        log_.frames.push_back(f);
    }

    void take_picture(int k) {
        const PagePicture drawn{options_.width_px, options_.height_px, display_.target().read_pixels()};
        pictures_.push_back({static_cast<std::size_t>(k), reduced(drawn, kPictureWidth_px)});
    }

    Result<void> look_through(const Camera& camera, const SceneFrame& frame) {
        // A promise wider than the picture says nothing of what stands where: the eye may be under a stand-in.
        if (frame.selection->max_bound_px > options_.height_px) return {};
        // The ground under the picture: not before an update is taken up, and not after.
        if (scene_.store().is_rewritten()) return {};
        if (ground_store_ != scene_.shared_store()) {
            auto ground = Ground::open(scene_.store());
            if (!ground) return ground.error();
            ground_ = std::move(*ground);
            ground_store_ = scene_.shared_store();
        }
        FrameSettings& settings = display_.frame_settings();
        settings.magenta_background = true;
        display_.draw(camera, frame.selection->to_render(0), frame.half_curvature);
        settings.magenta_background = false;
        auto count = count_see_through(*ground_, camera, frame.half_curvature, frame.selection->max_bound_px + 1,
                                       display_.target().read_pixels());
        if (scene_.store().is_rewritten()) return {};
        if (!count) return count.error();
        ++log_.looked_through;
        log_.see_through += *count;
        return {};
    }

    // The same poses once more with all that they want, not drawn: what the flight is measured by.
    Result<void> settle(const FlightPath& path) {
        for (const FlightPose& pose : path) {
            auto camera = camera_of(pose, options_);
            if (!camera) return camera.error();
            auto frame = scene_.complete({&*camera, 1}, [] { return interrupt_flag().load(); });
            if (!frame) return frame.error();
            log_.settled_triangles.add(static_cast<double>(frame->selection->triangles));
            log_.settled_mean_bound.add(frame->selection->mean_bound_px);
        }
        return {};
    }

    Scene& scene_;
    Display& display_;
    std::shared_ptr<const SqliteStore> ground_store_;  // outlives its ground
    std::unique_ptr<Ground> ground_;
    const ViewOptions& options_;
    const FlyOptions& fly_;
    Clock::time_point context_at_, start_;
    double last_ms_ = 0;
    FlightLog log_;
    std::int64_t uploaded_bytes_ = 0;
    std::vector<std::size_t> pictured_;
    std::vector<PosePicture> pictures_;
};

FlightFacts facts_of(const Scene& scene, const ViewOptions& o, const FlyOptions& f, const std::string& renderer) {
    FlightFacts facts;
    facts.store = std::filesystem::path(o.store).filename().string();
    facts.command = f.command;
    facts.renderer = renderer;
    facts.machine = machine_name();
    facts.lod = command_line_of(o.lod);
    facts.guaranteed = o.lod.is_guaranteed();
    facts.settled = f.settled;
    facts.see_through = f.see_through;
    facts.fps = f.fps;
    facts.tau_px = o.tau_px;
    facts.texture_tau_px = o.texture_tau_px;
    facts.fov_deg = o.fov_deg;
    facts.width_px = o.width_px;
    facts.height_px = o.height_px;
    facts.budget_bytes = o.budget_bytes;
    facts.peak_resident_bytes = scene.peak_resident_bytes();
    facts.peak_rss_bytes = process_usage().peak_rss_bytes;
    facts.store_updates = scene.updates();
    facts.exaggeration = scene.dataset().exaggeration;
    facts.height_quantum_error_m = scene.dataset().height_quantum_error_m;
    facts.paging = scene.counters();
    for (const TileKind kind : {TileKind::height, TileKind::texture})
        facts.loads[static_cast<std::size_t>(kind)] = scene.loader_counters(kind);
    return facts;
}

Result<ReportFolder> report_folder(const FlyOptions& f) {
    return ReportFolder::prepare(f.report, kFlightReport, f.force);
}

Result<void> write_report(const FlightLog& log, const FlightFacts& facts, const std::vector<PosePicture>& pictures,
                          const FlyOptions& f) {
    auto folder = report_folder(f);
    if (!folder) return folder.error();
    auto page = flight_page(log, facts, pictures);
    if (!page) return page.error();
    return folder->write({{"index.html", *page},
                          {"flight.csv", flight_csv(log)},
                          {"flight.json", flight_json(log, facts).dump(2) + "\n"}});
}

Result<FlightPath> path_of(const TileStore& store, const ViewOptions& o, const FlyOptions& f) {
    if (f.roam) return roaming_flight(store, f.frames, *f.roam);
    if (!(f.step_m > 0)) return flight_of(store, o, f.frames);
    auto path = flight_of(store, o, 0);
    if (!path) return path;
    return paced(*path, f.step_m, f.frames);
}

Result<void> run_blocks(const ViewOptions& o, const FlyOptions& f, const TileStore& store) {
    for (const auto& [given, option] :
         {std::pair(f.see_through, "--see-through"), std::pair(f.latency_ms > 0, "--latency")})
        if (auto ok = refuse_with_blocks(given, option); !ok) return ok;
    auto path = path_of(store, o, f);
    if (!path) return path.error();
    return fly_blocks(
        o, store, *path,
        {f.headless, f.fps, f.tau_most_px, f.settled, f.csv, f.last_frame, {f.report, f.force, f.command}});
}

Result<void> run(const ViewOptions& o, const FlyOptions& f) {
    if (!f.report.empty())
        if (auto folder = report_folder(f); !folder) return folder.error();
    auto store = open_store(o);
    if (!store) return store.error();
    if (wants_blocks(o)) return run_blocks(o, f, **store);
    SceneOptions options = scene_options(o);
    options.latency_ms = f.latency_ms;
    options.follow = true;
    auto scene = Scene::open(**store, options);
    if (!scene) return scene.error();
    auto path = path_of(**store, o, f);
    if (!path) return path.error();
    DisplayOptions shown = display_options(o);
    shown.window = !f.headless;
    auto display = Display::create(**scene, shown);
    if (!display) return display.error();
    set_look(o, (*display)->frame_settings());
    const auto context_at = Clock::now();
    (*display)->frame_settings().wait_until_drawn = true;
    if (auto ok = (*scene)->start(**display); !ok) return ok;
    Flight flight(**scene, **display, o, f, context_at);
    auto log = flight.fly(*path);
    if (!log) return log.error();
    if (!f.csv.empty())
        if (auto ok = write_text(f.csv, flight_csv(*log)); !ok) return ok;
    if (!f.last_frame.empty())
        if (auto ok = write_png(f.last_frame, o.width_px, o.height_px, (*display)->target().read_pixels()); !ok)
            return ok;
    const FlightFacts facts = facts_of(**scene, o, f, (*display)->context().renderer());
    if (!f.report.empty())
        if (auto ok = write_report(*log, facts, flight.pictures(), f); !ok) return ok;
    if (o.json != "-") fmt::print("{}", flight_text(*log, facts));
    return o.json.empty() ? Result<void>{} : write_text(o.json, flight_json(*log, facts).dump(2) + "\n");
}

}  // namespace

int run_fly(int argc, char** argv) {
    CLI::App app{"Flies a path and measures it.", "scree-view fly"};
    ViewOptions o;
    FlyOptions f;
    add_view_options(app, o);
    auto* path =
        app.add_option("--path", o.path,
                       "CSV of eye_x,eye_y,eye_z,look_x,look_y,look_z; default: a low, a high and a steep part")
            ->type_name("FILE");
    app.add_option("--roam", f.roam, "Instead: a restless flight with leaps, the same for the same number")
        ->excludes(path);
    app.add_option("--frames", f.frames, "Poses along the path")->capture_default_str()->check(CLI::Range(1, 10000000));
    app.add_option("--step", f.step_m, "Metres between poses, there and back as often as needed; 0: the path once")
        ->check(CLI::NonNegativeNumber);
    app.add_flag("--wait", f.wait, "Complete every frame before the next: reproducible");
    app.add_flag("--headless", f.headless, "Without a window");
    app.add_option("--fps", f.fps, "Raise the tolerance as far as this many frames a second need, and no further")
        ->check(CLI::Range(0.1, 1000.0));
    app.add_option("--tau-max", f.tau_most_px, "With --fps: never coarser than this")->capture_default_str();
    app.add_flag("--settled", f.settled,
                 "Afterwards compare with the same poses complete: error over the flight, triangles");
    app.add_flag("--see-through", f.see_through,
                 "Draw each frame again over magenta and count pixels that show it where there is ground");
    app.add_option("--latency", f.latency_ms, "Delay every read by so many ms, to try a slow disk")
        ->check(CLI::Range(0, 60000));
    app.add_option("--csv", f.csv, "Write one line a frame")->type_name("FILE");
    app.add_option("--last-frame", f.last_frame, "Write the last frame as PNG")->type_name("FILE");
    auto* report =
        app.add_option("--report", f.report,
                       "Write a page of charts and pictures, flight.csv and flight.json into this new folder")
            ->type_name("DIR");
    app.add_flag("--force", f.force, "Replace an earlier report")->needs(report);
    if (const int code = parse_arguments(app, argc, argv); code >= 0) return code;
    f.command = typed_command("fly", argc, argv);
    if (auto ok = check_view_options(o); !ok) return report_error("scree-view fly", ok.error());
    install_interrupt_handler();
    if (auto ok = run(o, f); !ok) return report_error("scree-view fly", ok.error());
    return 0;
}

}  // namespace scree
