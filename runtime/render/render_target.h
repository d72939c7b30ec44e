// RenderTarget: the framebuffer that frames are drawn into, with a window or without: sRGB8 colour, 32-bit float depth
// (reversed: 1 at the near plane, 0 at infinity). OpenGL thread only; goes before the context.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/result.h"
#include "runtime/render/gl_handle.h"

namespace scree {

struct RenderTargetOptions {
    int width_px = 800;
    int height_px = 800;
    /// 0: one sample a pixel. 4 or 8: smooth silhouettes for more memory and fill; costly on software OpenGL. More than
    /// the driver has: as many as it has.
    int samples = 0;
};

class RenderTarget {
public:
    /// Errors: ErrorCode::usage for a size outside 1..16384 px; ErrorCode::display when the driver refuses.
    static Result<RenderTarget> create(const RenderTargetOptions& options);

    int width_px() const { return width_px_; }
    int height_px() const { return height_px_; }

    /// The picture as sRGB RGB8, top row first, 3 * width * height bytes. Waits for the drawing to end.
    std::vector<std::uint8_t> read_pixels() const;
    /// The depth of every pixel, top row first. Distance along the view direction = near_m / depth. Waits likewise.
    std::vector<float> read_depth() const;
    /// Copies the picture to the window of the current context, stretched when the sizes differ. Leaves the window as
    /// the framebuffer to draw into, writing sRGB numbers as they are: an overlay may follow.
    void blit_to_window(int window_width_px, int window_height_px) const;
    /// The same into a rectangle of the window, from its lower left corner.
    void blit_to_window(int x_px, int y_px, int width_px, int height_px) const;

    /// The framebuffer to draw into.
    std::uint32_t framebuffer() const { return draw_.framebuffer.name(); }

private:
    struct Framebuffer {
        FramebufferHandle framebuffer;
        RenderbufferHandle colour, depth;
    };

    RenderTarget() = default;
    static Result<Framebuffer> make_framebuffer(int width_px, int height_px, int samples);
    /// The framebuffer with one sample a pixel, brought up to date.
    std::uint32_t resolved() const;

    int width_px_ = 0;
    int height_px_ = 0;
    Framebuffer draw_;
    Framebuffer resolve_;  ///< only with samples
};

}  // namespace scree
