// What stands over the picture.
#include <fmt/format.h>

#include "common/crs_label.h"
#include "runtime/app/hud_text.h"
#include "runtime/app/viewer.h"

namespace scree {

HudModel Viewer::hud_model() const {
    HudModel model;
    model.show_status = show_hud_;
    model.show_help = show_help_;
    const double mean_ms = history_.mean_ms();
    model.title = fmt::format("{:.0f} fps   {:.1f} ms   F1: keys", mean_ms > 0 ? 1000 / mean_ms : 0, mean_ms);
    model.frame_ms.assign(history_.times_ms().begin(), history_.times_ms().end());
    stage_.describe(model);
    describe_place(model);
    describe_signs(model);
    model.toasts = toasts_.texts();
    if (second_ != nullptr) model.second_share = kSecondShare;
    model.credit = stage_.dataset().attribution;
    if (profile_.on()) model.profile = profile_.panel(stage_.dataset().exaggeration);
    for (const KeyBinding& key : key_bindings())
        if (const auto why = stage_.refusal(key.action)) model.refused.push_back({key.action, *why});
    return model;
}

void Viewer::describe_place(HudModel& model) const {
    constexpr const char* kModes[] = {"flying", "circling", "walking"};
    const Dataset& d = stage_.dataset();
    const glm::dvec3 eye = rig_.pose().eye;
    const auto away_m = rig_.orbit_distance_m();
    model.place.push_back(
        {"mode", fmt::format("{}, {}", kModes[static_cast<std::size_t>(rig_.mode())],
                             away_m ? length_text(*away_m) + " away" : speed_text(rig_.speed_m_per_s()))});
    model.place.push_back({"eye", place_text(eye, d)});
    if (const auto at = lon_lat_text(eye, d)) model.place.push_back({"", *at});
    model.place.push_back(
        {"above", ground_m_ ? fmt::format("{} of the ground", length_text((eye.z - *ground_m_) / d.exaggeration))
                            : std::string("no ground under the eye")});
    const bool pointing = cursor_px_ && cursor_hit_.point;
    model.place.push_back({"looking", direction_text(rig_.pose().look - eye)});
    model.place.push_back({"cursor", pointing ? place_text(*cursor_hit_.point, d) : std::string("-")});
    if (d.geo_grid)
        model.place.push_back({"", pointing ? lon_lat_text(*cursor_hit_.point, d).value_or("-") : std::string("-")});
    if (!d.crs.empty()) model.place.push_back({"system", crs_label(d)});
}

void Viewer::describe_signs(HudModel& model) const {
    if (recorder_.recording()) model.signs.push_back(fmt::format("recording, {:.0f} s", recorder_.seconds()));
    if (replay_) model.signs.push_back("replaying");
    if (frozen_) model.signs.push_back("frozen: Z goes on");
    if (stage_.settings().wireframe) model.signs.push_back("wireframe");
    if (stage_.dataset().exaggeration != 1)
        model.signs.push_back(fmt::format("heights x {:g}", stage_.dataset().exaggeration));
}

}  // namespace scree
