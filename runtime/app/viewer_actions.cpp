// What keys and clicks do.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "common/report.h"
#include "runtime/app/hud_text.h"
#include "runtime/app/stage_lines.h"
#include "runtime/app/viewer.h"

namespace scree {
namespace {

constexpr std::array kExaggerations{1.0, 1.5, 2.0, 3.0, 5.0, 10.0};

// The next one up or down; a factor from the command line need not be among them.
double next_exaggeration(double now, int steps) {
    if (steps > 0) {
        const auto next = std::upper_bound(kExaggerations.begin(), kExaggerations.end(), now * (1 + 1e-9));
        return next == kExaggerations.end() ? now : *next;
    }
    const auto next = std::lower_bound(kExaggerations.begin(), kExaggerations.end(), now * (1 - 1e-9));
    return next == kExaggerations.begin() ? now : *(next - 1);
}

}  // namespace

Result<void> Viewer::act(Action action) {
    if (const auto why = stage_.refusal(action)) {
        say(*why);
        return {};
    }
    change_picture();
    switch (action) {
        case Action::next_method:
        case Action::higher:
        case Action::lower:
            return act_on_stage(action);
        case Action::screenshot:
        case Action::record:
        case Action::replay:
            act_on_files(action);
            return {};
        default:
            act_on_view(action);
            return {};
    }
}

Result<void> Viewer::act_on_stage(Action action) {
    if (action == Action::higher) return exaggerate(1);
    if (action == Action::lower) return exaggerate(-1);
    auto outcome = stage_.next_method();
    if (!outcome) return outcome.error();
    say(*outcome);
    return {};
}

void Viewer::act_on_view(Action action) {
    const auto toggle = [](bool& value) { value = !value; };
    switch (action) {
        case Action::help:
            return toggle(show_help_);
        case Action::quit:
            return close_topmost();
        case Action::home:
            return go_home();
        case Action::orbit:
            return set_mode(RigMode::orbit);
        case Action::walk:
            return set_mode(RigMode::walk);
        case Action::hud:
            return toggle(show_hud_);
        case Action::second_view:
            return toggle(show_second_);
        case Action::fullscreen:
            if (!full_screen_.toggle()) say("No screen to fill was found.");
            return;
        case Action::wireframe:
            return toggle(stage_.settings().wireframe);
        case Action::colour_by_level:
            return colour_by(Highlight::level);
        case Action::colour_by_geomip:
            return colour_by(Highlight::geomip);
        case Action::colour_by_error:
            return colour_by(Highlight::error);
        case Action::boxes:
            return toggle(show_boxes_);
        case Action::freeze:
            frozen_ = frozen_ ? std::nullopt : std::optional(rig_.pose());
            return;
        case Action::finer:
            return change_tau(1 / 1.25);
        case Action::coarser:
            return change_tau(1.25);
        case Action::sun_on:
            return move_sun(1);
        case Action::sun_back:
            return move_sun(-1);
        case Action::profile:
            return toggle_profile();
        default:
            return;
    }
}

void Viewer::act_on_files(Action action) {
    if (action == Action::screenshot) screenshot_due_ = true;
    if (action == Action::record) record();
    if (action == Action::replay) replay();
}

void Viewer::close_topmost() {
    if (show_help_)
        show_help_ = false;
    else if (profile_.on())
        toggle_profile();
    else
        quit_ = true;
}

// One after the other: the probe keeps one question of a kind, and a profile needs both of its ends.
void Viewer::ask_click() {
    if (awaited_click_ != 0 || clicks_.empty()) return;
    awaited_click_ = ground_.cast(GroundProbe::Ray::click, camera_.eye, clicks_.front(), frame_.half_curvature);
    clicks_.erase(clicks_.begin());
}

void Viewer::take_click() {
    if (awaited_click_ == 0) return;
    const GroundProbe::Hit hit = ground_.last_hit(GroundProbe::Ray::click);
    if (hit.question < awaited_click_) return;
    awaited_click_ = 0;
    if (!hit.point) return say("No ground there: click on the terrain.");
    if (!profile_.on()) {
        ++focused_;
        return rig_.focus(*hit.point);
    }
    profile_.add_end(*hit.point);
    ask_for_profile();
    change_picture();
}

// What the middle of the view shows is the probe's to say: an orbit begins a moment later.
void Viewer::set_mode(RigMode mode) {
    awaited_middle_ = 0;
    if (rig_.mode() == mode) return rig_.set_mode(RigMode::fly);
    if (mode == RigMode::walk && !ground_m_) say("Walking begins where there is ground under the eye.");
    if (mode != RigMode::orbit) return rig_.set_mode(mode);
    awaited_middle_ = ground_.cast(GroundProbe::Ray::middle, camera_.eye, camera_.forward, frame_.half_curvature);
}

// Where the flight began, over heights as they are drawn now.
void Viewer::go_home() {
    replay_.reset();
    rig_.go_home();
    rig_.set_pose(overview(stage_.dataset(), options_.view.fov_deg,
                           static_cast<double>(options_.view.width_px) / options_.view.height_px));
}

void Viewer::colour_by(Highlight highlight) {
    Highlight& now = stage_.settings().highlight;
    now = now == highlight ? Highlight::none : highlight;
}

void Viewer::change_tau(double factor) {
    wanted_tau_px_ *= factor;
    governor_ = governor();
}

// The eye stays as far above the ground as it is.
Result<void> Viewer::exaggerate(int steps) {
    const double before = stage_.dataset().exaggeration, factor = next_exaggeration(before, steps);
    if (factor == before) {
        say(fmt::format("Heights x {:g} is the {} there is.", before, steps > 0 ? "most" : "least"));
        return {};
    }
    auto outcome = stage_.exaggerate(factor);
    if (!outcome) return outcome.error();
    say(*outcome);
    const double rose_by = stage_.dataset().exaggeration / before;
    FlightPose pose = rig_.pose();
    const double ground_m =
        ground_m_.value_or(0.5 * (stage_.dataset().min_height_m + stage_.dataset().max_height_m) / rose_by);
    const double lift_m = ground_m * (rose_by - 1);
    pose.eye.z += lift_m;
    pose.look.z += lift_m;
    ground_m_.reset();  // that of the old heights
    rig_.set_pose(pose);
    frozen_.reset();
    if (profile_.on()) profile_.start();  // its ends lie on the old heights
    return {};
}

void Viewer::move_sun(double by_hours) {
    sun_hour_ = later(sun_hour_, by_hours);
    stage_.settings().sun_direction = glm::vec3(sun_at(sun_hour_));
    say(fmt::format("The sun as of {}.", hour_text(sun_hour_)));
}

std::optional<std::filesystem::path> Viewer::free_file(const std::string& extension, int& first) {
    auto file = next_free_file(".", name_, extension, first);
    if (file) return file->lexically_normal();
    say(file.error().message);
    return std::nullopt;
}

void Viewer::take_screenshot() {
    const RenderTarget& target = stage_.target();
    if (const auto file = free_file("png", next_picture_))
        writer_.write(*file, target.width_px(), target.height_px(), target.read_pixels());
}

void Viewer::record() {
    if (!recorder_.recording()) {
        recorder_.start(now_s_, rig_.pose());
        return say("Recording the flight: F9 stops.");
    }
    path_ = recorder_.stop();
    const auto file = free_file("csv", next_path_);
    if (!file) return;
    if (auto ok = write_flight_path(file->string(), path_); !ok)
        return say(fmt::format("The flight is not written: {}", ok.error().message));
    recorded_poses_ = path_.size();
    recordings_.push_back(file->string());
    say(fmt::format("{} is written: F10 flies it again, and so does scree-view fly --path.", file->string()));
}

void Viewer::replay() {
    if (replay_) {
        replay_.reset();
        return say("The flight is stopped.");
    }
    if (recorder_.recording()) return say("Recording: F9 stops it, then F10 flies it.");
    if (path_.empty()) return say("Nothing to fly: F9 records a flight, or start with --path FILE.");
    ++replays_;
    replay_.emplace(path_, now_s_);
    say(fmt::format("Flying {:.0f} s: F10 stops.", replay_->seconds()));
}

void Viewer::toggle_profile() {
    if (profile_.on())
        profile_.stop();
    else
        profile_.start();
    change_picture();
}

void Viewer::ask_for_profile() {
    if (const auto ends = profile_.ends()) ground_.profile((*ends)[0], (*ends)[1], ProfileTool::kPoints);
}

void Viewer::save_profile() {
    if (profile_.profile() == nullptr) return;
    const auto file = free_file("profile.csv", next_profile_);
    if (!file) return;
    if (auto ok = write_text(file->string(), csv_of(*profile_.profile(), stage_.dataset())); !ok)
        return say(ok.error().message);
    profiles_.push_back(file->string());
    say(fmt::format("{} is written.", file->string()));
}

}  // namespace scree
