#include "runtime/window/full_screen.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

namespace scree {

bool FullScreen::on() const { return glfwGetWindowMonitor(window_) != nullptr; }

bool FullScreen::toggle() {
    if (on()) {
        glfwSetWindowMonitor(window_, nullptr, x_, y_, width_, height_, GLFW_DONT_CARE);
        return true;
    }
    GLFWmonitor* screen = glfwGetPrimaryMonitor();
    const GLFWvidmode* mode = screen == nullptr ? nullptr : glfwGetVideoMode(screen);
    if (mode == nullptr) return false;
    glfwGetWindowPos(window_, &x_, &y_);
    glfwGetWindowSize(window_, &width_, &height_);
    glfwSetWindowMonitor(window_, screen, 0, 0, mode->width, mode->height, mode->refreshRate);
    return true;
}

}  // namespace scree
