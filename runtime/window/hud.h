// Hud: draws a HudModel over the picture in a window, by Dear ImGui. OpenGL thread only; made after the window's
// WindowInput, gone before it.
#pragma once

#include <vector>

#include <glm/glm.hpp>

#include "runtime/window/hud_model.h"

struct GLFWwindow;

namespace scree {

class Hud {
public:
    /// Dear ImGui shows a text that grew in the frame after the one that it measures it in: what changed is drawn so
    /// many times.
    static constexpr int kFramesOfAChange = 2;

    explicit Hud(GLFWwindow* window);
    ~Hud();
    Hud(const Hud&) = delete;
    Hud& operator=(const Hud&) = delete;

    /// Draws into the window's framebuffer, which must be bound.
    HudAnswer draw(const HudModel& model);
    /// Whether a panel that was drawn last and takes the mouse lies at a place of the window's own coordinates.
    bool takes_mouse_at(const glm::dvec2& at) const;

private:
    void fit_scale();

    GLFWwindow* window_;
    float font_px_ = 0;               ///< of the framebuffer, that the font was made for
    std::vector<glm::dvec4> panels_;  ///< left, top, right, bottom
};

}  // namespace scree
