#include <fmt/format.h>

#include <chrono>
#include <nlohmann/json.hpp>
#include <optional>

#include "common/cli/arguments.h"
#include "common/process_usage.h"
#include "common/query/ground.h"
#include "common/report.h"
#include "runtime/app/block_commands.h"
#include "runtime/app/commands.h"
#include "runtime/app/coverage.h"
#include "runtime/app/display.h"
#include "runtime/app/see_through.h"
#include "runtime/app/view_options.h"
#include "runtime/render/png.h"
#include "runtime/report/statistics.h"
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
};

struct FlightLog {
    Series frame_ms, select_ms, triangles, tiles, tau, bound, mean_bound, tiles_reused;
    Series settled_triangles, settled_mean_bound;  // of the same poses, when nothing is missing
    std::int64_t stand_ins = 0, reused = 0, holes = 0, limited = 0, see_through = 0, looked_through = 0;
    double coarse_after_ms = 0, true_after_ms = 0;  // from the context on; 0: never
    std::int64_t fixed_rss_bytes = 0;
    std::string csv =
        "frame,frame_ms,select_ms,triangles,tiles_drawn,uploads,requests,stand_ins,holes,max_bound_px,mean_bound_px,"
        "tau_effective_px,rss_bytes\n";

    void add(int k, double ms, const SceneFrame& frame, std::int64_t frame_holes) {
        const Selection& s = *frame.selection;
        frame_ms.add(ms);
        select_ms.add(frame.select_ms);
        triangles.add(static_cast<double>(s.triangles));
        tiles.add(static_cast<double>(s.nodes));
        tau.add(s.tau_effective_px);
        bound.add(s.max_bound_px);
        mean_bound.add(s.mean_bound_px);
        stand_ins += frame.stand_ins ? 1 : 0;
        reused += frame.reused ? 1 : 0;
        limited += s.budget_limited ? 1 : 0;
        holes += frame_holes;
        csv += fmt::format("{},{:.3f},{:.4f},{},{},{},{},{},{},{:.4f},{:.4f},{:.4f},{}\n", k, ms, frame.select_ms,
                           s.triangles, s.nodes, frame.uploads, s.requests.size(), frame.stand_ins ? 1 : 0, frame_holes,
                           s.max_bound_px, s.mean_bound_px, s.tau_effective_px, resident_bytes());
    }
    // Least share of the settled triangles that was drawn while flying, after the coarse and the true first picture; 1
    // without a settled flight.
    double least_triangle_share() const {
        double least = 1;
        for (std::size_t k = 2; k < settled_triangles.values.size(); ++k)
            if (settled_triangles.values[k] > 0)
                least = std::min(least, triangles.values[k] / settled_triangles.values[k]);
        return least;
    }
};

class Flight {
public:
    Flight(Scene& scene, Display& display, const ViewOptions& o, const FlyOptions& f, Clock::time_point context_at)
        : scene_(scene), display_(display), options_(o), fly_(f), context_at_(context_at) {}

    Result<FlightLog> fly(const FlightPath& path) {
        if (auto ok = warm_up(); !ok) return ok.error();
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
        log_.add(k, ms, *frame,
                 count_holes(scene_.dataset(), scene_.pager().residency(), camera, s.draws[0], frame->half_curvature));
        if (fly_.see_through)
            if (auto ok = look_through(camera, *frame); !ok) return ok.error();
        return ms;
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
};

nlohmann::ordered_json loader_report(const LoaderCounters& c) {
    const double tiles = static_cast<double>(std::max<std::int64_t>(c.tiles, 1));
    return {{"tiles", c.tiles},
            {"cpu_us_per_tile", 1e6 * c.cpu_seconds / tiles},
            {"latency_ms_mean", 1e3 * c.latency_seconds / tiles}};
}

nlohmann::ordered_json report_of(const FlightLog& log, const Scene& scene, const ViewOptions& o, const FlyOptions& f,
                                 const std::string& renderer) {
    const PagerCounters c = scene.counters();
    const std::int64_t peak = process_usage().peak_rss_bytes;
    nlohmann::ordered_json report = {
        {"frames", log.frame_ms.values.size()},
        {"frame_ms", log.frame_ms.spread()},
        {"select_ms", log.select_ms.spread()},
        {"triangles", log.triangles.mean_max()},
        {"tiles_drawn", log.tiles.mean_max()},
        {"budget_bytes", o.budget_bytes},
        {"peak_resident_bytes", scene.peak_resident_bytes()},
        {"peak_rss_bytes", peak},
        {"fixed_rss_bytes", log.fixed_rss_bytes},
        {"tile_rss_bytes", peak - log.fixed_rss_bytes},
        {"tiles_paged_in", c.tiles_paged_in},
        {"tiles_paged_out", c.tiles_paged_out},
        {"tiles_prefetched", c.prefetched},
        {"requests_refused", c.refused},
        {"bytes_read", c.bytes_read},
        {"heights_loaded", loader_report(scene.loader_counters(TileKind::height))},
        {"textures_loaded", loader_report(scene.loader_counters(TileKind::texture))},
        {"frames_with_stand_ins", log.stand_ins},
        {"selections_reused", log.reused},
        {"lod", command_line_of(o.lod)},
        {"guaranteed", o.lod.is_guaranteed()},
        {"tiles_reused_share", log.tiles_reused.values.empty() ? 0 : log.tiles_reused.mean()},
        {"budget_limited_frames", log.limited},
        {"holes", log.holes},
        {"max_bound_px", log.bound.max()},
        {"error_integral_px", log.mean_bound.mean()},
        {"tau_effective_px", log.tau.mean_max()},
        {"cold_start_ms", {{"within_8_px", log.coarse_after_ms}, {"within_tau", log.true_after_ms}}},
        {"damaged_tiles", c.damaged_tiles},
        {"store_updates", scene.updates()},
        {"tau_px", o.tau_px},
        {"size_px", {o.width_px, o.height_px}},
        {"renderer", renderer}};
    if (f.settled) {
        const double settled = log.settled_mean_bound.mean();
        report["settled"] = {{"error_integral_px", settled},
                             {"error_integral_ratio", settled > 0 ? log.mean_bound.mean() / settled : 1},
                             {"triangles", log.settled_triangles.mean_max()},
                             {"least_triangle_share", log.least_triangle_share()}};
    }
    if (f.see_through) {
        report["see_through_pixels"] = log.see_through;
        report["frames_looked_through"] = log.looked_through;
    }
    return report;
}

void print(const FlightLog& log, const Scene& scene, const ViewOptions& o, const FlyOptions& f,
           const std::string& renderer) {
    const PagerCounters c = scene.counters();
    fmt::print(
        "{} frames on {}: median {:.1f} ms, p99 {:.1f} ms; selection median {:.3f} ms; {:.0f} triangles in {:.0f} "
        "tiles (mean)\n"
        "promised within {:.3g} px; {} frames with stand-ins, {} holes; {:.1f} of {:.1f} MB for tiles, {} tiles in, {} "
        "out{}{}\n",
        log.frame_ms.values.size(), renderer, log.frame_ms.quantile(0.5), log.frame_ms.quantile(0.99),
        log.select_ms.quantile(0.5), log.triangles.mean(), log.tiles.mean(), log.bound.max(), log.stand_ins, log.holes,
        static_cast<double>(scene.peak_resident_bytes()) / 1e6, static_cast<double>(o.budget_bytes) / 1e6,
        c.tiles_paged_in, c.tiles_paged_out, c.damaged_tiles > 0 ? fmt::format(", {} damaged", c.damaged_tiles) : "",
        scene.updates() > 0 ? fmt::format("; the store was updated {} times", scene.updates()) : "");
    if (log.limited > 0)
        fmt::print("the budget bound in {} frames: tau {:.2f} px at most\n", log.limited, log.tau.max());
    if (f.settled)
        fmt::print(
            "error over the flight {:.4f} px (mean promise), settled {:.4f}; at least {:.0f} % of the triangles\n",
            log.mean_bound.mean(), log.settled_mean_bound.mean(), 100 * log.least_triangle_share());
    if (f.see_through)
        fmt::print("{} see-through pixels in {} frames that promise something\n", log.see_through, log.looked_through);
}

Result<FlightPath> path_of(const TileStore& store, const ViewOptions& o, const FlyOptions& f) {
    if (f.roam) return roaming_flight(store, f.frames, *f.roam);
    if (!(f.step_m > 0)) return flight_of(store, o, f.frames);
    auto path = flight_of(store, o, 0);
    if (!path) return path;
    return paced(*path, f.step_m, f.frames);
}

Result<void> run_blocks(const ViewOptions& o, const FlyOptions& f, const TileStore& store) {
    for (const auto& [given, option] : {std::pair(f.settled, "--settled"), std::pair(f.see_through, "--see-through"),
                                        std::pair(f.latency_ms > 0, "--latency")})
        if (auto ok = refuse_with_blocks(given, option); !ok) return ok;
    auto path = path_of(store, o, f);
    if (!path) return path.error();
    return fly_blocks(o, store, *path, {f.headless, f.fps, f.tau_most_px, f.csv, f.last_frame});
}

Result<void> run(const ViewOptions& o, const FlyOptions& f) {
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
    auto log = Flight(**scene, **display, o, f, context_at).fly(*path);
    if (!log) return log.error();
    if (!f.csv.empty())
        if (auto ok = write_text(f.csv, log->csv); !ok) return ok;
    if (!f.last_frame.empty())
        if (auto ok = write_png(f.last_frame, o.width_px, o.height_px, (*display)->target().read_pixels()); !ok)
            return ok;
    const std::string renderer = (*display)->context().renderer();
    if (o.json != "-") print(*log, **scene, o, f, renderer);
    return o.json.empty() ? Result<void>{}
                          : write_text(o.json, report_of(*log, **scene, o, f, renderer).dump(2) + "\n");
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
    if (const int code = parse_arguments(app, argc, argv); code >= 0) return code;
    if (auto ok = check_view_options(o); !ok) return report_error("scree-view fly", ok.error());
    install_interrupt_handler();
    if (auto ok = run(o, f); !ok) return report_error("scree-view fly", ok.error());
    return 0;
}

}  // namespace scree
