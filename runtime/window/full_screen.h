// FullScreen: a GLFW window over the whole screen, and back to where it was. The window's thread.
#pragma once

struct GLFWwindow;

namespace scree {

class FullScreen {
public:
    explicit FullScreen(GLFWwindow* window) : window_(window) {}
    bool on() const;
    /// False: there is no screen to fill.
    bool toggle();

private:
    GLFWwindow* window_;
    int x_ = 0, y_ = 0, width_ = 0, height_ = 0;  ///< of the window, before
};

}  // namespace scree
