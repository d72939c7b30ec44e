// Viewer: the window: takes what the user does, moves the camera, has the stage choose and draw, and puts lines and the
// head-up display over it. Draws when something has changed and sleeps otherwise; nothing here reads the store.
// viewer.cpp is the loop, viewer_actions.cpp what keys and clicks do, viewer_hud.cpp what stands over the picture.
#pragma once

#include <chrono>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "runtime/app/picture_writer.h"
#include "runtime/app/profile_tool.h"
#include "runtime/app/stage.h"
#include "runtime/app/view_options.h"
#include "runtime/render/line_renderer.h"
#include "runtime/scene/frame_governor.h"
#include "runtime/window/camera_rig.h"
#include "runtime/window/flight_recorder.h"
#include "runtime/window/frame_history.h"
#include "runtime/window/full_screen.h"
#include "runtime/window/ground_probe.h"
#include "runtime/window/hud.h"
#include "runtime/window/sun_clock.h"
#include "runtime/window/toasts.h"
#include "runtime/window/window_input.h"

namespace scree {

struct ViewerOptions {
    ViewOptions view;  ///< the size changes with the window; `path` is what a replay flies until something is recorded
    double seconds = 0;                ///< 0: until it is closed
    double fps = 0, tau_most_px = 16;  ///< 0: tau is kept
};

class Viewer {
public:
    /// `stage` outlives it. Errors: those of LineRenderer; those of read_flight_path() for the path.
    static Result<std::unique_ptr<Viewer>> create(const ViewerOptions& options, Stage& stage);
    Viewer(const Viewer&) = delete;
    Viewer& operator=(const Viewer&) = delete;

    /// Until the window is closed, or the time is over. Errors: those of the stage.
    Result<void> run();
    /// What was drawn and done, for --json.
    nlohmann::ordered_json report() const;

private:
    using Clock = std::chrono::steady_clock;
    static constexpr double kSecondShare = 0.35;  ///< of the window's height and width

    Viewer(const ViewerOptions& options, Stage& stage, std::unique_ptr<LineRenderer> lines);

    // The loop, in its order.
    bool over() const;
    void tick();
    Result<void> fit_size();
    Result<void> take_input();
    void move();
    void ask();
    void take_answers();
    void take_written(bool all);
    Result<void> choose();
    Result<void> show();
    Result<void> draw_picture();
    Result<void> draw_second();
    void draw_lines();
    void draw_overlay();
    void wait();

    // What keys and clicks do.
    Result<void> act(Action action);
    Result<void> act_on_stage(Action action);
    void act_on_view(Action action);
    void act_on_files(Action action);
    void ask_click();
    void take_click();
    void set_mode(RigMode mode);
    void go_home();
    void close_topmost();
    void colour_by(Highlight highlight);
    void change_tau(double factor);
    Result<void> exaggerate(int steps);
    void move_sun(double by_hours);
    void take_screenshot();
    void record();
    void replay();
    void toggle_profile();
    void ask_for_profile();
    void save_profile();

    // What stands over the picture.
    HudModel hud_model() const;
    void describe_place(HudModel& model) const;
    void describe_signs(HudModel& model) const;

    void say(std::string text);
    void change_picture() { picture_due_ = true; }
    void change_overlay() { overlays_due_ = Hud::kFramesOfAChange; }
    FrameGovernor governor() const;
    std::optional<std::filesystem::path> free_file(const std::string& extension, int& first);
    double extent_m() const;

    ViewerOptions options_;
    std::string name_;  ///< of the store, in the names of files
    Stage& stage_;
    GLFWwindow* window_;
    WindowInput input_;
    Hud hud_;
    std::unique_ptr<LineRenderer> line_renderer_;
    FullScreen full_screen_;
    GroundProbe ground_;
    CameraRig rig_;
    FlightRecorder recorder_;
    std::optional<FlightReplay> replay_;
    FlightPath path_;  ///< what a replay flies
    ProfileTool profile_;
    PictureWriter writer_;
    Toasts toasts_;
    FrameGovernor governor_;
    FrameHistory history_;

    // Of the frame.
    Clock::time_point start_, last_;
    double now_s_ = 0, elapsed_s_ = 0;
    bool slept_ = true;
    RigInput wishes_;
    Camera camera_, chosen_for_;
    std::vector<Camera> views_;
    StageFrame frame_;
    RenderTarget* second_ = nullptr;  ///< what is shown of the second view
    std::optional<glm::dvec2> cursor_px_;
    std::optional<double> ground_m_;  ///< under the eye, as drawn
    GroundProbe::Hit cursor_hit_;
    std::vector<glm::dvec3> clicks_;                        ///< rays that are not asked for yet, oldest first
    std::uint64_t awaited_click_ = 0, awaited_middle_ = 0;  ///< questions; 0: none
    std::shared_ptr<const TileStore> asked_store_;
    std::vector<Action> actions_;  ///< of keys, that are still to be done
    bool screenshot_due_ = false;
    bool picture_due_ = true;
    int overlays_due_ = Hud::kFramesOfAChange;

    // What the user chose.
    double wanted_tau_px_;
    bool show_hud_ = true, show_help_ = false, show_second_ = false, show_boxes_ = false, quit_ = false;
    std::optional<FlightPose> frozen_;  ///< what is drawn is chosen for this pose
    double sun_hour_;
    int next_picture_ = 1, next_path_ = 1, next_profile_ = 1;

    // For the report.
    std::int64_t pictures_drawn_ = 0, overlays_drawn_ = 0;
    double seconds_ = 0, cpu_s_ = 0;
    std::vector<std::string> screenshots_, recordings_, profiles_, said_;
    std::size_t recorded_poses_ = 0, profile_points_ = 0;
    std::int64_t replays_ = 0, focused_ = 0;
};

}  // namespace scree
