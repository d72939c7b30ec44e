// GlContext: an OpenGL 4.5 core context, with a window (GLFW) or without (EGL, no X needed). Created current on the
// calling thread, which is from then on the OpenGL thread: everything in this room is called there and nowhere else. A
// context outlives all that was created under it.
#pragma once

#include <memory>
#include <string>

#include "common/result.h"

struct GLFWwindow;

namespace scree {

class GlContext {
public:
    virtual ~GlContext() = default;
    GlContext(const GlContext&) = delete;
    GlContext& operator=(const GlContext&) = delete;

    /// The driver's name for itself, e.g. "llvmpipe (LLVM 15.0.6, 256 bits)", and its OpenGL version.
    const std::string& renderer() const { return renderer_; }
    const std::string& version() const { return version_; }
    /// Drawn by the CPU: options that cost much there (anisotropy, multisampling) are best left off.
    bool is_software() const { return is_software_; }

    /// Null without a window.
    virtual GLFWwindow* window() const = 0;
    /// Shows what was blitted to the window; waits for the display's refresh if WindowOptions says so. Nothing without
    /// a window.
    virtual void swap_buffers() = 0;

protected:
    GlContext() = default;
    /// Reads the names and checks that the current context can draw what this room draws.
    Result<void> inspect();

private:
    std::string renderer_;
    std::string version_;
    bool is_software_ = false;
};

struct WindowOptions {
    std::string title = "Scree";
    int width_px = 1280;
    int height_px = 800;
    bool wait_for_refresh = true;  ///< off: as many frames as the machine gives, for measuring; the picture may tear
    bool visible = true;
};

/// A context that draws into RenderTargets only. Prefers a GPU; LIBGL_ALWAYS_SOFTWARE=1 in the environment prefers the
/// CPU, whose pictures are the same on every machine. Errors (ErrorCode::display): no EGL, no OpenGL 4.5, an extension
/// missing.
Result<std::unique_ptr<GlContext>> create_headless_context();

/// One window at a time. The window's own framebuffer has no depth: draw into a RenderTarget and blit. Errors
/// (ErrorCode::display): no display, no OpenGL 4.5, an extension missing.
Result<std::unique_ptr<GlContext>> create_window_context(const WindowOptions& options);

}  // namespace scree
