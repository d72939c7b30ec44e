#include <GLFW/glfw3.h>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>

#include "common/report.h"
#include "runtime/app/block_commands.h"
#include "runtime/app/block_display.h"
#include "runtime/app/block_scene.h"
#include "runtime/app/fly_controls.h"
#include "runtime/app/hud.h"
#include "runtime/scene/frame_governor.h"
#include "runtime/window/ground_probe.h"

namespace scree {
namespace {

using Clock = std::chrono::steady_clock;

/// Dear ImGui shows a text that grew in the frame after the one that it measures it in.
constexpr int kFramesOfAChange = 2;

class Window {
public:
    Window(ViewOptions& o, const BlockWindow& w, BlockScene& scene, BlockDisplay& display,
           std::shared_ptr<const SqliteStore> store)
        : options_(o),
          asked_(w),
          scene_(scene),
          display_(display),
          window_(display.context().window()),
          ground_(std::move(store), {}),
          controls_(window_, overview(scene.dataset(), o.fov_deg, static_cast<double>(o.width_px) / o.height_px),
                    extent_m(scene.dataset())),
          hud_(window_),
          governor_(governor(o.tau_px)),
          wanted_tau_px_(o.tau_px) {}

    Result<void> run() {
        const auto start = Clock::now();
        auto last = start;
        while (glfwWindowShouldClose(window_) == 0 && !interrupt_flag() &&
               controls_.take_presses(GLFW_KEY_ESCAPE) == 0) {
            const auto now = Clock::now();
            if (asked_.seconds > 0 && std::chrono::duration<double>(now - start).count() > asked_.seconds) break;
            if (auto ok = fit_size(); !ok) return ok;
            move(std::chrono::duration<double>(now - last).count());
            last = now;
            take_keys();
            if (to_draw_ == 0 && !controls_.moved()) {
                // Nothing changes: leave the core alone.
                glfwWaitEventsTimeout(0.1);
                continue;
            }
            if (auto ok = draw(); !ok) return ok;
            glfwPollEvents();
        }
        return {};
    }

private:
    static double extent_m(const Dataset& d) {
        return static_cast<double>(std::max(d.lattice.cells_x, d.lattice.cells_y)) * d.lattice.spacing_m;
    }
    FrameGovernor governor(double tau_px) const {
        return FrameGovernor({asked_.fps > 0 ? 1000 / asked_.fps : 1e9, tau_px, asked_.tau_most_px});
    }

    Result<void> fit_size() {
        int width = 0, height = 0;
        glfwGetFramebufferSize(window_, &width, &height);
        if (width <= 0 || height <= 0 || (width == options_.width_px && height == options_.height_px)) return {};
        options_.width_px = std::min(width, 16384);
        options_.height_px = std::min(height, 16384);
        to_draw_ = kFramesOfAChange;
        return display_.resize(options_.width_px, options_.height_px);
    }

    void move(double seconds) {
        const glm::dvec3 eye = controls_.pose().eye;
        controls_.move(std::min(seconds, 0.1), ground_.height_m(eye.x, eye.y).value_or(-1e9));
    }

    void take_keys() {
        const auto toggle = [&](int key, bool& value) {
            const int presses = controls_.take_presses(key);
            value = value != (presses % 2 == 1);
            if (presses > 0) to_draw_ = kFramesOfAChange;
        };
        toggle(GLFW_KEY_F, display_.frame_settings().wireframe);
        toggle(GLFW_KEY_H, show_hud_);
        const int steps =
            controls_.take_presses(GLFW_KEY_LEFT_BRACKET) - controls_.take_presses(GLFW_KEY_RIGHT_BRACKET);
        if (steps == 0) return;
        wanted_tau_px_ *= std::pow(1.25, steps);
        governor_ = governor(wanted_tau_px_);
        to_draw_ = kFramesOfAChange;
    }

    Result<void> draw() {
        const auto start = Clock::now();
        scene_.set_tau_px(governor_.tau_px());
        auto camera = camera_of(controls_.pose(), options_);
        if (!camera) return camera.error();
        const BlockFrame& frame = scene_.select(*camera);
        if (auto times = display_.draw(*camera); !times) return times.error();
        display_.target().blit_to_window(options_.width_px, options_.height_px);
        const double frame_s = std::chrono::duration<double>(Clock::now() - start).count();
        mean_frame_s_ = mean_frame_s_ > 0 ? 0.9 * mean_frame_s_ + 0.1 * frame_s : frame_s;
        to_draw_ = std::max(to_draw_ - 1, 0);
        if (asked_.fps > 0 && governor_.next(1000 * frame_s) != scene_.tau_px()) to_draw_ = std::max(to_draw_, 1);
        if (show_hud_) hud_.draw(status_lines(frame));
        display_.context().swap_buffers();
        return {};
    }

    HudLines status_lines(const BlockFrame& frame) const {
        const glm::dvec3 eye = controls_.pose().eye;
        const auto promise_px = scene_.promise_px();
        HudLines lines;
        lines.title = fmt::format("{:.0f} fps   {} triangles in {} blocks and {} strips", 1 / mean_frame_s_,
                                  frame.triangles(), frame.blocks.size(), frame.strips.size());
        lines.body = fmt::format(
            "{}\n{}, {} blocks reused, {} meshes made\neye {:.0f}, {:.0f}, {:.0f} m   {:.0f} m/s\n\n"
            "W A S D Q E fly, drag to look, wheel: speed, Shift: faster\n"
            "[ ] accuracy   F wireframe   H hide   Home   Esc",
            command_line_of(options_.lod),
            promise_px ? fmt::format("within {:.2f} px", *promise_px)
                       : fmt::format("tau {:.2f} px, not promised", scene_.tau_px()),
            frame.reused, frame.meshes_made, eye.x, eye.y, eye.z, controls_.speed_m_per_s());
        lines.credit = scene_.dataset().attribution;
        return lines;
    }

    ViewOptions& options_;
    const BlockWindow& asked_;
    BlockScene& scene_;
    BlockDisplay& display_;
    GLFWwindow* window_;
    GroundProbe ground_;
    FlyControls controls_;
    Hud hud_;
    FrameGovernor governor_;
    double wanted_tau_px_;
    double mean_frame_s_ = 0;
    bool show_hud_ = true;
    int to_draw_ = kFramesOfAChange;  ///< frames, though nothing moves
};

}  // namespace

Result<void> view_blocks(ViewOptions o, std::shared_ptr<const SqliteStore> store, const BlockWindow& w) {
    auto scene = BlockScene::open(*store, scene_options(o));
    if (!scene) return scene.error();
    DisplayOptions shown = display_options(o);
    shown.window = true;
    shown.wait_for_refresh = true;
    auto display = BlockDisplay::create(**scene, shown);
    if (!display) return display.error();
    set_look(o, (*display)->frame_settings());
    glfwSetWindowTitle((*display)->context().window(),
                       fmt::format("Scree - {}", std::filesystem::path(o.store).filename().string()).c_str());
    return Window(o, w, **scene, **display, std::move(store)).run();
}

}  // namespace scree
