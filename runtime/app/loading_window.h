// LoadingWindow: what a window shows while there is nothing to draw yet: the sky and how far it has come. OpenGL thread
// only; gone before the window has a WindowInput or a Hud.
#pragma once

#include <chrono>
#include <memory>
#include <string>

#include "runtime/render/context.h"
#include "runtime/render/frame_passes.h"
#include "runtime/window/hud.h"

namespace scree {

class LoadingWindow {
public:
    /// `context` has a window. Errors (ErrorCode::display): the sky's shader does not compile.
    static Result<std::unique_ptr<LoadingWindow>> create(GlContext& context, std::string text);

    /// Shows the share, a few times a second at most, and answers the desktop. False: the user closed the window.
    bool show(double share);

private:
    LoadingWindow(GlContext& context, std::string text, SkyPass sky);
    void draw(double share);

    GlContext& context_;
    std::string text_;
    SkyPass sky_;
    Hud hud_;
    std::chrono::steady_clock::time_point last_;
};

}  // namespace scree
