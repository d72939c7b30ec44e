// Hud: the text over the picture, by Dear ImGui. OpenGL thread only.
#pragma once

#include <string>

struct GLFWwindow;

namespace scree {

struct HudLines {
    std::string title;
    std::string body;
    std::string credit;
};

class Hud {
public:
    explicit Hud(GLFWwindow* window);
    ~Hud();
    Hud(const Hud&) = delete;
    Hud& operator=(const Hud&) = delete;
    /// Draws into the window's framebuffer, which must be bound.
    void draw(const HudLines& lines);
};

}  // namespace scree
