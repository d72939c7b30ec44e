#include <fmt/format.h>

#include <chrono>
#include <nlohmann/json.hpp>

#include "common/process_usage.h"
#include "common/report.h"
#include "runtime/app/commands.h"
#include "runtime/app/coverage.h"
#include "runtime/app/display.h"
#include "runtime/app/statistics.h"
#include "runtime/app/view_options.h"
#include "runtime/render/png.h"

namespace scree {
namespace {

using Clock = std::chrono::steady_clock;

double milliseconds_since(Clock::time_point start) {
    return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

struct FlyOptions {
    int frames = 300;
    bool wait = false;
    bool headless = false;
    int latency_ms = 0;
    std::string csv;
    std::string last_frame;
};

struct FlightLog {
    Series frame_ms, select_ms, triangles, tiles;
    std::int64_t stand_ins = 0, holes = 0, limited = 0;
    double max_bound_px = 0;
    std::string csv =
        "frame,frame_ms,select_ms,triangles,tiles_drawn,uploads,requests,stand_ins,holes,max_bound_px,rss_bytes\n";

    void add(int k, double ms, const SceneFrame& frame, std::int64_t frame_holes) {
        const Selection& s = *frame.selection;
        frame_ms.add(ms);
        select_ms.add(frame.select_ms);
        triangles.add(static_cast<double>(s.triangles));
        tiles.add(static_cast<double>(s.nodes));
        stand_ins += frame.stand_ins ? 1 : 0;
        limited += s.budget_limited ? 1 : 0;
        holes += frame_holes;
        max_bound_px = std::max(max_bound_px, s.max_bound_px);
        csv += fmt::format("{},{:.3f},{:.4f},{},{},{},{},{},{},{:.4f},{}\n", k, ms, frame.select_ms, s.triangles,
                           s.nodes, frame.uploads, s.requests.size(), frame.stand_ins ? 1 : 0, frame_holes,
                           s.max_bound_px, process_usage().peak_rss_bytes);
    }
};

Result<FlightLog> fly(Scene& scene, Display& display, const FlightPath& path, const ViewOptions& o,
                      const FlyOptions& f) {
    FlightLog log;
    for (std::size_t k = 0; k < path.size(); ++k) {
        if (interrupt_flag()) return Error{ErrorCode::interrupted, "stopped"};
        auto camera = camera_of(path[k], o);
        if (!camera) return camera.error();
        const auto start = Clock::now();
        SceneFrame frame;
        if (f.wait) {
            auto complete = scene.complete({&*camera, 1}, [] { return interrupt_flag().load(); });
            if (!complete) return complete.error();
            frame = *complete;
        } else {
            frame = scene.advance({&*camera, 1});
        }
        display.draw(*camera, frame.selection->to_render(0));
        if (display.context().window() != nullptr) {
            display.target().blit_to_window(o.width_px, o.height_px);
            display.context().swap_buffers();
        }
        const double ms = milliseconds_since(start);
        log.add(static_cast<int>(k), ms, frame,
                count_holes(scene.dataset(), scene.pager(), *camera, frame.selection->draws[0]));
    }
    return log;
}

nlohmann::ordered_json report_of(const FlightLog& log, const Scene& scene, const ViewOptions& o,
                                 const std::string& renderer) {
    const PagerCounters& c = scene.pager().counters();
    return {{"frames", log.frame_ms.values.size()},
            {"frame_ms", log.frame_ms.spread()},
            {"select_ms", log.select_ms.spread()},
            {"triangles", log.triangles.mean_max()},
            {"tiles_drawn", log.tiles.mean_max()},
            {"budget_bytes", o.budget_bytes},
            {"peak_resident_bytes", scene.memory().resident_bytes},
            {"peak_rss_bytes", process_usage().peak_rss_bytes},
            {"tiles_paged_in", c.tiles_paged_in},
            {"tiles_paged_out", c.tiles_paged_out},
            {"bytes_read", c.bytes_read},
            {"frames_with_stand_ins", log.stand_ins},
            {"budget_limited_frames", log.limited},
            {"holes", log.holes},
            {"max_bound_px", log.max_bound_px},
            {"damaged_tiles", c.damaged_tiles},
            {"tau_px", o.tau_px},
            {"size_px", {o.width_px, o.height_px}},
            {"renderer", renderer}};
}

Result<void> run(const ViewOptions& o, const FlyOptions& f) {
    auto store = SqliteStore::open(o.store);
    if (!store) return store.error();
    SceneOptions options = scene_options(o);
    options.latency_ms = f.latency_ms;
    auto scene = Scene::open(**store, options);
    if (!scene) return scene.error();
    auto path = flight_of(**store, o, f.frames);
    if (!path) return path.error();
    DisplayOptions display_options{o.width_px, o.height_px};
    display_options.window = !f.headless;
    auto display = Display::create(**scene, display_options);
    if (!display) return display.error();
    (*display)->frame_settings().wait_until_drawn = true;
    if (auto ok = (*scene)->start(**display); !ok) return ok;
    auto log = fly(**scene, **display, *path, o, f);
    if (!log) return log.error();
    if (!f.csv.empty())
        if (auto ok = write_text(f.csv, log->csv); !ok) return ok;
    if (!f.last_frame.empty())
        if (auto ok = write_png(f.last_frame, o.width_px, o.height_px, (*display)->target().read_pixels()); !ok)
            return ok;
    const auto report = report_of(*log, **scene, o, (*display)->context().renderer());
    if (o.json != "-")
        fmt::print(
            "{} frames on {}: median {:.1f} ms, p99 {:.1f} ms; selection median {:.3f} ms; {:.0f} triangles in {:.0f} "
            "tiles (mean)\n"
            "promised within {:.3g} px; {} frames with stand-ins, {} holes; {:.1f} of {:.1f} MB for tiles, {} tiles "
            "in, {} out\n",
            log->frame_ms.values.size(), (*display)->context().renderer(), log->frame_ms.quantile(0.5),
            log->frame_ms.quantile(0.99), log->select_ms.quantile(0.5), log->triangles.mean(), log->tiles.mean(),
            log->max_bound_px, log->stand_ins, log->holes, static_cast<double>((*scene)->memory().resident_bytes) / 1e6,
            static_cast<double>(o.budget_bytes) / 1e6, (*scene)->pager().counters().tiles_paged_in,
            (*scene)->pager().counters().tiles_paged_out);
    if (o.json.empty()) return {};
    return write_text(o.json, report.dump(2) + "\n");
}

}  // namespace

int run_fly(int argc, char** argv) {
    CLI::App app{"Flies a path and measures it.", "scree-view fly"};
    ViewOptions o;
    FlyOptions f;
    add_view_options(app, o);
    app.add_option("--path", o.path,
                   "CSV of eye_x,eye_y,eye_z,look_x,look_y,look_z; default: a low, a high and a steep part");
    app.add_option("--frames", f.frames, "Poses along the path")->capture_default_str()->check(CLI::Range(1, 10000000));
    app.add_flag("--wait", f.wait, "Complete every frame before the next: reproducible");
    app.add_flag("--headless", f.headless, "Without a window");
    app.add_option("--csv", f.csv, "Write one line a frame");
    app.add_option("--last-frame", f.last_frame, "Write the last frame as PNG");
    app.add_option("--latency", f.latency_ms, "Delay every read by so many ms, to try a slow disk")
        ->check(CLI::Range(0, 60000));
    if (const int code = parse_arguments(app, argc, argv); code >= 0) return code;
    if (auto ok = check_view_options(o); !ok) return report_error("scree-view fly", ok.error());
    install_interrupt_handler();
    if (auto ok = run(o, f); !ok) return report_error("scree-view fly", ok.error());
    return 0;
}

}  // namespace scree
