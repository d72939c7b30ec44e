// The window of scree-view: a GlContext of GLFW's.
#pragma once

#include <memory>
#include <string>

#include "runtime/render/context.h"

namespace scree {

struct WindowOptions {
    std::string title = "Scree";
    int width_px = 1280;
    int height_px = 800;
    bool wait_for_refresh = true;  ///< off: as many frames as the machine gives, for measuring; the picture may tear
    bool visible = true;
};

/// One window at a time. The window's own framebuffer has no depth: draw into a RenderTarget and blit. Errors
/// (ErrorCode::display): no display, no OpenGL 4.5, an extension missing.
Result<std::unique_ptr<GlContext>> create_window_context(const WindowOptions& options);

}  // namespace scree
