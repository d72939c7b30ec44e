#include "runtime/render/window_context.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <fmt/format.h>

namespace scree {
namespace {

Error glfw_error(const char* what) {
    const char* reason = nullptr;
    glfwGetError(&reason);
    return {ErrorCode::display, fmt::format("{}: {}", what, reason == nullptr ? "no reason given" : reason)};
}

class WindowContext final : public GlContext {
public:
    ~WindowContext() override {
        if (window_ != nullptr) glfwDestroyWindow(window_);
        if (initialised_) glfwTerminate();
    }

    GLFWwindow* window() const override { return window_; }
    void swap_buffers() override { glfwSwapBuffers(window_); }

    Result<void> open(const WindowOptions& options) {
        initialised_ = glfwInit() == GLFW_TRUE;
        if (!initialised_) return glfw_error("no display to open a window on");
        glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 4);
        glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 5);
        glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
        glfwWindowHint(GLFW_OPENGL_FORWARD_COMPAT, GLFW_TRUE);
        glfwWindowHint(GLFW_DEPTH_BITS, 0);
        glfwWindowHint(GLFW_STENCIL_BITS, 0);
        glfwWindowHint(GLFW_VISIBLE, options.visible ? GLFW_TRUE : GLFW_FALSE);
        window_ = glfwCreateWindow(options.width_px, options.height_px, options.title.c_str(), nullptr, nullptr);
        if (window_ == nullptr) return glfw_error("no window with OpenGL 4.5");
        glfwMakeContextCurrent(window_);
        glfwSwapInterval(options.wait_for_refresh ? 1 : 0);
        return inspect();
    }

private:
    bool initialised_ = false;
    GLFWwindow* window_ = nullptr;
};

}  // namespace

Result<std::unique_ptr<GlContext>> create_window_context(const WindowOptions& options) {
    auto context = std::make_unique<WindowContext>();
    if (const Result<void> opened = context->open(options); !opened) return opened.error();
    return std::unique_ptr<GlContext>(std::move(context));
}

}  // namespace scree
