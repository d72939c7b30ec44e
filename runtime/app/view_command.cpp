#include <GLFW/glfw3.h>
#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <filesystem>

#include "common/cli/arguments.h"
#include "common/report.h"
#include "runtime/app/block_commands.h"
#include "runtime/app/commands.h"
#include "runtime/app/display.h"
#include "runtime/app/fly_controls.h"
#include "runtime/app/hud.h"
#include "runtime/app/view_options.h"
#include "runtime/scene/frame_governor.h"
#include "runtime/window/ground_probe.h"

namespace scree {
namespace {

using Clock = std::chrono::steady_clock;

HudLines status_lines(const Scene& scene, const SceneFrame& frame, const FlightPose& pose, double fps, double speed) {
    const Selection& s = *frame.selection;
    HudLines lines;
    lines.title = fmt::format("{:.0f} fps   {} triangles in {} tiles", fps, s.triangles, s.nodes);
    lines.body = fmt::format(
        "within {:.2f} px{}{}{}\neye {:.0f}, {:.0f}, {:.0f} m   {:.0f} m/s\n\nW A S D Q E fly, drag to look, wheel: "
        "speed, Shift: faster\n"
        "[ ] accuracy   F wireframe   L levels   V second view   H hide   Home   Esc",
        s.max_bound_px, frame.stand_ins ? fmt::format(", loading {}", s.requests.size()) : "",
        s.budget_limited ? fmt::format(", the budget allows {:.1f} px", s.tau_effective_px) : "",
        scene.updates() > 0 ? fmt::format(", update {}", scene.updates()) : "", pose.eye.x, pose.eye.y, pose.eye.z,
        speed);
    if (scene.mesher() != nullptr) {
        const MeshCounters& c = scene.mesher()->counters();
        lines.title += fmt::format("   {}", to_string(scene.options().lod.method));
        lines.title += fmt::format(", {:.0f} % reused", 100 * c.reused_share());
    }
    lines.credit = scene.dataset().attribution;
    return lines;
}

/// Of the window's height and width.
constexpr double kInsetShare = 0.35;
/// Share of a frame that may be spent on waiting for tiles that are missing.
constexpr double kPatience = 0.08;
/// Longest that the first picture is waited for.
constexpr double kCatchUp_s = 0.08;

// Straight down on what the eye looks at, or stands over where that is beyond the data; north up.
Result<Camera> view_from_above(const Camera& main, const Dataset& d, double ground_m, int width_px, int height_px) {
    const Lattice& l = d.lattice;
    const glm::dvec2 north_west{l.x_m(0), l.y_m(0)};
    const glm::dvec2 south_east{l.x_m(static_cast<double>(l.cells_x)), l.y_m(static_cast<double>(l.cells_y))};
    const double extent_m = std::max(south_east.x - north_west.x, north_west.y - south_east.y);
    const double above_ground_m = std::max(main.eye.z - ground_m, 1.0);
    glm::dvec2 over(main.eye);
    if (main.forward.z < 0) {
        const double reach_m = std::min(above_ground_m / -main.forward.z, 2 * extent_m);
        over += reach_m * glm::dvec2(main.forward);
    }
    over = {std::clamp(over.x, north_west.x, south_east.x), std::clamp(over.y, south_east.y, north_west.y)};
    const double above_m = std::clamp(6 * above_ground_m, 0.05 * extent_m, 1.5 * extent_m);
    return look_at({over.x, over.y, ground_m + above_m}, {over.x, over.y, ground_m}, 40, width_px, height_px);
}

struct WindowSettings {
    double seconds = 0;
    double fps = 0;
    double tau_most_px = 16;
};

Result<void> view(ViewOptions o, const WindowSettings& w) {
    auto store = open_store(o);
    if (!store) return store.error();
    if (wants_blocks(o)) return view_blocks(o, std::move(*store), {w.seconds, w.fps, w.tau_most_px});
    SceneOptions options = scene_options(o);
    options.follow = true;
    auto scene = Scene::open(std::move(*store), options);
    if (!scene) return scene.error();
    DisplayOptions shown = display_options(o);
    shown.window = true;
    shown.wait_for_refresh = true;
    auto display = Display::create(**scene, shown);
    if (!display) return display.error();
    set_look(o, (*display)->frame_settings());
    if (auto ok = (*scene)->start(**display); !ok) return ok;
    GroundProbe ground((*scene)->shared_store(), {});
    GLFWwindow* window = (*display)->context().window();
    glfwSetWindowTitle(window, fmt::format("Scree - {}", std::filesystem::path(o.store).filename().string()).c_str());
    const Dataset& d = (*scene)->dataset();
    const double extent = static_cast<double>(std::max(d.lattice.cells_x, d.lattice.cells_y)) * d.lattice.spacing_m;
    FlyControls controls(window, overview(d, o.fov_deg, static_cast<double>(o.width_px) / o.height_px), extent);
    Hud hud(window);
    bool show_hud = true, redraw = true, second_view = false, first = true;
    FrameGovernor governor({w.fps > 0 ? 1000 / w.fps : 1e9, o.tau_px, w.tau_most_px});
    double wanted_tau_px = o.tau_px;
    std::pair<int, int> second_size;
    std::int64_t updates = 0;
    double mean_frame_s = 0;  // over frames that were drawn
    const auto start = Clock::now();
    auto last = start;
    while (glfwWindowShouldClose(window) == 0 && !interrupt_flag()) {
        const auto now = Clock::now();
        const double elapsed = std::chrono::duration<double>(now - last).count();
        last = now;
        const double now_s = std::chrono::duration<double>(now - start).count();
        if (w.seconds > 0 && now_s > w.seconds) break;
        if (controls.take_presses(GLFW_KEY_ESCAPE) > 0) break;

        int width = 0, height = 0;
        glfwGetFramebufferSize(window, &width, &height);
        if (width > 0 && height > 0 && (width != o.width_px || height != o.height_px)) {
            o.width_px = std::min(width, 16384);
            o.height_px = std::min(height, 16384);
            if (auto ok = (*display)->resize(o.width_px, o.height_px); !ok) return ok;
            second_size = {};
            redraw = true;
        }
        if (auto ok = (*scene)->follow(); !ok) return ok;
        const FlightPose before = controls.pose();
        const double ground_m = ground.height_m(before.eye.x, before.eye.y).value_or(-1e9);
        controls.move(std::min(elapsed, 0.1), ground_m);
        FrameSettings& settings = (*display)->frame_settings();
        const auto toggle = [&](int key, bool& value) {
            const int presses = controls.take_presses(key);
            value = value != (presses % 2 == 1);
            redraw = redraw || presses > 0;
        };
        toggle(GLFW_KEY_F, settings.wireframe);
        bool by_level = settings.highlight == Highlight::level;
        toggle(GLFW_KEY_L, by_level);
        settings.highlight = by_level ? Highlight::level : Highlight::none;
        toggle(GLFW_KEY_H, show_hud);
        toggle(GLFW_KEY_V, second_view);
        const int steps = controls.take_presses(GLFW_KEY_LEFT_BRACKET) - controls.take_presses(GLFW_KEY_RIGHT_BRACKET);
        if (steps != 0) {
            wanted_tau_px *= std::pow(1.25, steps);
            governor = FrameGovernor({w.fps > 0 ? 1000 / w.fps : 1e9, wanted_tau_px, w.tau_most_px});
        }
        (*scene)->options().tau_px = governor.tau_px();
        redraw = redraw || steps != 0;

        const FlightPose pose = controls.pose();
        auto camera = camera_of(pose, o);
        if (!camera) return camera.error();
        std::vector<Camera> views{*camera};
        if (second_view) {
            const int inset_width = std::max(1, static_cast<int>(kInsetShare * o.width_px)),
                      inset_height = std::max(1, static_cast<int>(kInsetShare * o.height_px));
            if (second_size != std::pair(inset_width, inset_height)) {
                if (auto ok = (*display)->resize_inset(inset_width, inset_height); !ok) return ok;
                second_size = {inset_width, inset_height};
            }
            const Dataset& dataset = (*scene)->dataset();
            auto above =
                view_from_above(*camera, dataset, std::max(ground_m, dataset.min_height_m), inset_width, inset_height);
            if (!above) return above.error();
            views.push_back(*above);
        }
        const SceneFrame frame = first ? (*scene)->catch_up(views, now_s, kCatchUp_s)
                                       : (*scene)->advance(views, now_s, kPatience * mean_frame_s);
        first = false;
        if ((*scene)->updates() != updates) {
            updates = (*scene)->updates();
            ground.use((*scene)->shared_store());
            redraw = true;
        }
        if (!redraw && !controls.moved() && !frame.stand_ins && frame.uploads == 0) {
            // Nothing changes: leave the core alone.
            glfwWaitEventsTimeout(frame.taking_over ? 0.01 : 0.1);
            continue;
        }
        redraw = frame.stand_ins || frame.selection->growing;
        (*display)->draw(*camera, frame.selection->to_render(0), frame.half_curvature);
        if (second_view) (*display)->draw_inset(views[1], frame.selection->to_render(1), frame.half_curvature);
        (*display)->target().blit_to_window(o.width_px, o.height_px);
        if (second_view)
            (*display)->inset().blit_to_window(o.width_px - second_size.first, 0, second_size.first,
                                               second_size.second);
        const double frame_s = std::chrono::duration<double>(Clock::now() - now).count();
        mean_frame_s = mean_frame_s > 0 ? 0.9 * mean_frame_s + 0.1 * frame_s : frame_s;
        if (w.fps > 0) {
            const double before_px = governor.tau_px(), next_px = governor.next(1000 * frame_s);
            redraw = redraw || next_px != before_px;
        }
        if (show_hud) hud.draw(status_lines(**scene, frame, pose, 1 / mean_frame_s, controls.speed_m_per_s()));
        (*display)->context().swap_buffers();
        glfwPollEvents();
    }
    return {};
}

}  // namespace

int run_view(int argc, char** argv) {
    CLI::App app{
        "Opens a window on a terrain. The commands shot, fly and audit work without one: scree-view COMMAND --help.",
        "scree-view"};
    ViewOptions o;
    o.size = "1280x800";
    WindowSettings w;
    add_view_options(app, o);
    app.add_option("--fps", w.fps, "Raise the tolerance as far as this many frames a second need, and no further")
        ->check(CLI::Range(0.1, 1000.0));
    app.add_option("--tau-max", w.tau_most_px, "With --fps: never coarser than this")->capture_default_str();
    app.add_option("--seconds", w.seconds, "Close after so long; 0: stay open")->capture_default_str();
    app.set_version_flag("--version", std::string("scree-view ") + SCREE_VERSION);
    if (const int code = parse_arguments(
            app, argc, argv, {"scree-view-audit", "scree-view-compare", "scree-view-fly", "scree-view-shot"});
        code >= 0)
        return code;
    if (auto ok = check_view_options(o); !ok) return report_error("scree-view", ok.error());
    install_interrupt_handler();
    if (auto ok = view(o, w); !ok) return report_error("scree-view", ok.error());
    return 0;
}

}  // namespace scree
