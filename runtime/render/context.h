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

    /// Null without a window of our own.
    virtual GLFWwindow* window() const = 0;
    /// Shows what was blitted to the window; waits for the display's refresh if WindowOptions says so. Nothing without
    /// a window of our own.
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

/// A context that draws into RenderTargets only. Prefers a GPU; LIBGL_ALWAYS_SOFTWARE=1 in the environment prefers the
/// CPU, whose pictures are the same on every machine. Errors (ErrorCode::display): no EGL, no OpenGL 4.5, an extension
/// missing.
Result<std::unique_ptr<GlContext>> create_headless_context();

/// The context that is current on this thread, which somebody else made and keeps: it must outlive all that is created
/// under it. Without any, libepoxy ends the process. Errors (ErrorCode::display): no OpenGL 4.5, an extension missing.
Result<std::unique_ptr<GlContext>> borrow_current_context();

}  // namespace scree
