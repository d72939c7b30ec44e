#include "runtime/app/viewer.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/process_usage.h"
#include "common/report.h"
#include "runtime/app/second_view.h"
#include "runtime/app/stage_lines.h"

namespace scree {
namespace {

/// Share of a frame that may be spent on waiting for tiles that are missing.
constexpr double kPatience = 0.08;
/// Between looks at what the store's readers have brought, and at whether the store was updated.
constexpr double kSoon_s = 0.01, kIdle_s = 0.1;
/// What a frame may have taken that comes after sleep: nobody held a key meanwhile.
constexpr double kAfterSleep_s = 1.0 / 60;
constexpr double kLine_px = 1.5, kHiddenShare = 0.25;
constexpr Rgba kFrustum{255, 255, 255, 220};

double seconds_of(std::chrono::steady_clock::duration d) { return std::chrono::duration<double>(d).count(); }

bool same(const Camera& a, const Camera& b) {
    return a.eye == b.eye && a.forward == b.forward && a.up == b.up && a.width_px == b.width_px &&
           a.height_px == b.height_px;
}

bool same(const GroundProbe::Hit& a, const GroundProbe::Hit& b) {
    return a.question == b.question && a.point == b.point;
}

}  // namespace

Result<std::unique_ptr<Viewer>> Viewer::create(const ViewerOptions& options, Stage& stage) {
    auto lines = LineRenderer::create();
    if (!lines) return lines.error();
    std::unique_ptr<Viewer> viewer(new Viewer(options, stage, std::move(*lines)));
    if (options.view.path) {
        auto path = read_flight_path(*options.view.path);
        if (!path) return path.error();
        viewer->path_ = std::move(*path);
    }
    return viewer;
}

Viewer::Viewer(const ViewerOptions& options, Stage& stage, std::unique_ptr<LineRenderer> lines)
    : options_(options),
      name_(std::filesystem::path(options.view.store).stem().string()),
      stage_(stage),
      window_(stage.context().window()),
      input_(window_),
      hud_(window_),
      line_renderer_(std::move(lines)),
      full_screen_(window_),
      ground_(stage.store(), glfwPostEmptyEvent),
      rig_(overview(stage.dataset(), options.view.fov_deg,
                    static_cast<double>(options.view.width_px) / options.view.height_px),
           extent_m()),
      writer_(glfwPostEmptyEvent),
      governor_(options_.fps > 0 ? GovernorLimits{1000 / options_.fps, options_.view.tau_px, options_.tau_most_px}
                                 : GovernorLimits{1e9, options_.view.tau_px, options_.tau_most_px}),
      start_(Clock::now()),
      last_(start_),
      asked_store_(stage.store()),
      wanted_tau_px_(options.view.tau_px),
      sun_hour_(sun_hour_of(glm::dvec3(stage.settings().sun_direction))) {
    glfwSetWindowTitle(window_, window_title(options.view).c_str());
    input_.leave_to([this](const glm::dvec2& at) { return hud_.takes_mouse_at(at); });
}

double Viewer::extent_m() const {
    const Lattice& l = stage_.dataset().lattice;
    return static_cast<double>(std::max(l.cells_x, l.cells_y)) * l.spacing_m;
}

FrameGovernor Viewer::governor() const {
    return FrameGovernor({options_.fps > 0 ? 1000 / options_.fps : 1e9, wanted_tau_px_, options_.tau_most_px});
}

Result<void> Viewer::run() {
    const double cpu_s = process_usage().cpu_seconds;
    Result<void> outcome;
    while (outcome && !over()) {
        tick();
        outcome = fit_size();
        if (outcome) outcome = take_input();
        if (!outcome) break;
        move();
        ask();
        take_answers();
        outcome = choose();
        if (outcome) outcome = show();
        wait();
    }
    if (recorder_.recording()) record();  // a flight that was not stopped is kept
    take_written(true);
    seconds_ = seconds_of(Clock::now() - start_);
    cpu_s_ = process_usage().cpu_seconds - cpu_s;
    return outcome;
}

bool Viewer::over() const {
    return quit_ || glfwWindowShouldClose(window_) != 0 || interrupt_flag() ||
           (options_.seconds > 0 && seconds_of(Clock::now() - start_) > options_.seconds);
}

void Viewer::tick() {
    const auto now = Clock::now();
    elapsed_s_ = std::min(seconds_of(now - last_), slept_ ? kAfterSleep_s : 0.1);
    last_ = now;
    now_s_ = seconds_of(now - start_);
    if (toasts_.expire(now_s_)) change_overlay();
}

Result<void> Viewer::fit_size() {
    int width = 0, height = 0;
    glfwGetFramebufferSize(window_, &width, &height);
    ViewOptions& view = options_.view;
    if (width <= 0 || height <= 0 || (width == view.width_px && height == view.height_px)) return {};
    view.width_px = std::min(width, 16384);
    view.height_px = std::min(height, 16384);
    second_ = nullptr;
    change_picture();
    return stage_.resize(view.width_px, view.height_px);
}

Result<void> Viewer::take_input() {
    const TakenInput taken = input_.take();
    wishes_ = taken.rig;
    cursor_px_ = taken.cursor_px;
    if (taken.anything) change_overlay();
    actions_.insert(actions_.end(), taken.actions.begin(), taken.actions.end());
    // A screenshot shows what the keys before it did, and nothing of those after it.
    while (!actions_.empty() && !screenshot_due_) {
        const Action action = actions_.front();
        actions_.erase(actions_.begin());
        if (auto ok = act(action); !ok) return ok;
    }
    for (const glm::dvec2& at_px : taken.clicks_px) clicks_.push_back(ray_through(camera_, at_px));
    ask_click();
    return {};
}

void Viewer::move() {
    wishes_.seconds = elapsed_s_;
    if (replay_) {
        const auto pose = replay_->pose(now_s_);
        rig_.set_pose(pose ? *pose : path_.back());  // the last frame came a little before the end
        if (!pose) {
            replay_.reset();
            say("The flight is over.");
        }
    }
    rig_.move(wishes_, replay_ ? std::nullopt : ground_m_);
    if (recorder_.recording()) recorder_.add(now_s_, rig_.pose());
}

// Whatever the probe is asked twice is one question to it.
void Viewer::ask() {
    const glm::dvec3 eye = rig_.pose().eye;
    const auto ground_m = ground_.height_m(eye.x, eye.y);
    if (ground_m != ground_m_) change_overlay();
    ground_m_ = ground_m;
    if (!cursor_px_ || pictures_drawn_ == 0) return;
    ground_.cast(GroundProbe::Ray::cursor, camera_.eye, ray_through(camera_, *cursor_px_), frame_.half_curvature);
}

void Viewer::take_answers() {
    const GroundProbe::Hit hit = ground_.last_hit(GroundProbe::Ray::cursor);
    if (!same(hit, cursor_hit_)) change_overlay();
    cursor_hit_ = hit;
    take_click();
    const GroundProbe::Hit middle = ground_.last_hit(GroundProbe::Ray::middle);
    if (awaited_middle_ != 0 && middle.question >= awaited_middle_) {
        awaited_middle_ = 0;
        rig_.set_mode(RigMode::orbit, middle.point);
        change_overlay();
    }
    if (profile_.take(ground_.last_profile())) {
        profile_points_ = profile_.profile()->points.size();
        change_picture();
    }
    take_written(false);
}

void Viewer::take_written(bool all) {
    for (const PictureWriter::Done& done : writer_.take_done(all)) {
        if (done.outcome) screenshots_.push_back(done.file.string());
        if (!done.outcome) note("{}\n", done.outcome.error().message);
        say(done.outcome ? fmt::format("{} is written.", done.file.string())
                         : fmt::format("No picture: {}", done.outcome.error().message));
    }
}

Result<void> Viewer::choose() {
    if (auto ok = stage_.follow(); !ok) return ok;
    for (std::string& trouble : stage_.take_troubles()) say(std::move(trouble));
    if (stage_.store() != asked_store_) {
        asked_store_ = stage_.store();
        ground_.use(asked_store_);
        ask_for_profile();
    }
    auto camera = camera_of(rig_.pose(), options_.view);
    if (!camera) return camera.error();
    if (!same(*camera, camera_)) change_picture();
    camera_ = *camera;
    if (frozen_) camera = camera_of(*frozen_, options_.view);
    if (!camera) return camera.error();
    chosen_for_ = *camera;
    views_.assign(1, chosen_for_);
    if (show_second_) {
        const int width = std::max(1, static_cast<int>(kSecondShare * options_.view.width_px)),
                  height = std::max(1, static_cast<int>(kSecondShare * options_.view.height_px));
        const double ground_m = std::max(ground_m_.value_or(-1e9), stage_.dataset().min_height_m);
        auto above = view_from_above(camera_, stage_.dataset(), ground_m, width, height);
        if (!above) return above.error();
        views_.push_back(*above);
    }
    stage_.set_tau_px(governor_.tau_px());
    frame_ = stage_.choose(views_, now_s_, kPatience * history_.mean_ms() / 1000);
    if (frame_.changed) change_picture();
    return {};
}

Result<void> Viewer::show() {
    if (!picture_due_ && overlays_due_ == 0) return {};
    if (picture_due_) {
        const auto start = Clock::now();
        picture_due_ = frame_.goes_on || replay_.has_value();
        if (auto ok = draw_picture(); !ok) return ok;
        if (std::exchange(screenshot_due_, false)) take_screenshot();
        const double frame_ms = 1000 * seconds_of(Clock::now() - start);
        history_.add(frame_ms);
        const double before_px = governor_.tau_px();
        if (options_.fps > 0 && governor_.next(frame_ms) != before_px) change_picture();
        change_overlay();
    }
    draw_overlay();
    return {};
}

Result<void> Viewer::draw_picture() {
    ++pictures_drawn_;
    if (auto ok = stage_.draw(camera_); !ok) return ok;
    draw_lines();
    return draw_second();
}

void Viewer::draw_lines() {
    std::vector<LineSegment> lines;
    if (show_boxes_) lines = stage_.boxes();
    if (frozen_) add_frustum(chosen_for_, 0.5 * extent_m(), kFrustum, lines);
    const auto course = profile_.lines(camera_.eye);
    lines.insert(lines.end(), course.begin(), course.end());
    if (lines.empty()) return;
    lines = lowered(lines, camera_.eye, frame_.half_curvature);
    line_renderer_->draw(camera_, lines, kLine_px, kHiddenShare, stage_.target());
}

Result<void> Viewer::draw_second() {
    second_ = nullptr;
    if (views_.size() < 2) return {};
    auto drawn = stage_.draw_second(views_[1]);
    if (!drawn) return drawn.error();
    second_ = *drawn;
    return {};
}

// The last picture with what stands over it.
void Viewer::draw_overlay() {
    const ViewOptions& view = options_.view;
    overlays_due_ = std::max(overlays_due_ - 1, 0);
    ++overlays_drawn_;
    stage_.target().blit_to_window(view.width_px, view.height_px);
    if (second_ != nullptr)
        second_->blit_to_window(view.width_px - second_->width_px(), 0, second_->width_px(), second_->height_px());
    const HudAnswer answer = hud_.draw(hud_model());
    if (profile_.point_at(answer.profile_point)) change_picture();
    if (answer.save_profile) save_profile();
    if (answer.close_profile) toggle_profile();
    stage_.context().swap_buffers();
}

void Viewer::wait() {
    const bool at_once =
        !actions_.empty() || picture_due_ || overlays_due_ > 0 || rig_.moved() || rig_.gliding() || frame_.goes_on;
    slept_ = !at_once;
    if (at_once) return glfwPollEvents();
    double seconds = frame_.expects ? kSoon_s : kIdle_s;
    if (const auto end_s = toasts_.next_end_s()) seconds = std::clamp(*end_s - now_s_, 0.001, seconds);
    glfwWaitEventsTimeout(seconds);
}

void Viewer::say(std::string text) {
    said_.push_back(text);
    toasts_.say(std::move(text), now_s_);
    change_overlay();
}

nlohmann::ordered_json Viewer::report() const {
    const StageFacts facts = stage_.facts();
    const FlightPose pose = rig_.pose();
    constexpr const char* kModes[] = {"fly", "orbit", "walk"};
    constexpr const char* kHighlights[] = {"none", "level", "geomip", "error"};
    nlohmann::ordered_json report = {
        {"seconds", seconds_}, {"cpu_seconds", cpu_s_}, {"pictures", pictures_drawn_}, {"overlays", overlays_drawn_}};
    report["frame_ms"] = {{"mean", history_.mean_ms()}, {"p99", history_.p99_ms()}, {"max", history_.max_ms()}};
    report["triangles"] = facts.triangles;
    report["method"] = facts.method;
    report["tau_px"] = wanted_tau_px_;
    report["tau_effective_px"] = facts.tau_effective_px;
    report["exaggeration"] = facts.exaggeration;
    report["updates"] = facts.updates;
    report["mode"] = kModes[static_cast<std::size_t>(rig_.mode())];
    report["eye"] = {pose.eye.x, pose.eye.y, pose.eye.z};
    report["look"] = {pose.look.x, pose.look.y, pose.look.z};
    report["focused"] = focused_;
    report["wireframe"] = stage_.settings().wireframe;
    report["highlight"] = kHighlights[static_cast<std::size_t>(stage_.settings().highlight)];
    report["boxes"] = show_boxes_;
    report["frozen"] = frozen_.has_value();
    report["second_view"] = show_second_;
    report["hud"] = show_hud_;
    report["help"] = show_help_;
    report["fullscreen"] = full_screen_.on();
    report["sun_hour"] = sun_hour_;
    report["size_px"] = {options_.view.width_px, options_.view.height_px};
    report["screenshots"] = screenshots_;
    report["recordings"] = recordings_;
    report["recorded_poses"] = recorded_poses_;
    report["replays"] = replays_;
    report["profile_points"] = profile_points_;  // of the last one
    report["profiles"] = profiles_;
    report["said"] = said_;
    report["renderer"] = stage_.context().renderer();
    return report;
}

}  // namespace scree
