// The panels of a Hud, for Hud alone: each draws one thing of the model, within Dear ImGui's frame. Lengths are in the
// window's own coordinates; a panel that takes the mouse returns its place.
#pragma once

#include <optional>

#include <glm/glm.hpp>

#include "runtime/window/hud_model.h"

namespace scree {

void draw_status(const HudModel& model);
void draw_legend(const HudModel& model);
void draw_credit(const HudModel& model);
void draw_second_frame(const HudModel& model);
void draw_progress(const HudModel& model);
/// Above what lies at the bottom.
void draw_toasts(const HudModel& model, float above);

struct DrawnPanel {
    glm::dvec4 place{0};  ///< left, top, right, bottom
    HudAnswer answer;
};
DrawnPanel draw_help(const HudModel& model);
DrawnPanel draw_profile(const HudModel::ProfilePanel& profile);

}  // namespace scree
