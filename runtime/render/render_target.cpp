#include "runtime/render/render_target.h"

#include <epoxy/gl.h>
#include <fmt/format.h>

#include <algorithm>

namespace scree {
namespace {

constexpr int kMaxSize_px = 16384;

template <class T>
void flip_rows(std::vector<T>& picture, std::size_t row) {
    const std::size_t rows = picture.size() / row;
    for (std::size_t top = 0; top < rows / 2; ++top) {
        const auto at = [&](std::size_t y) { return picture.begin() + static_cast<std::ptrdiff_t>(y * row); };
        std::swap_ranges(at(top), at(top + 1), at(rows - 1 - top));
    }
}

}  // namespace

Result<RenderTarget::Framebuffer> RenderTarget::make_framebuffer(int width_px, int height_px, int samples) {
    GLuint framebuffer = 0, colour = 0, depth = 0;
    glCreateFramebuffers(1, &framebuffer);
    glCreateRenderbuffers(1, &colour);
    glCreateRenderbuffers(1, &depth);
    Framebuffer made{FramebufferHandle(framebuffer), RenderbufferHandle(colour), RenderbufferHandle(depth)};
    glNamedRenderbufferStorageMultisample(colour, samples, GL_SRGB8_ALPHA8, width_px, height_px);
    glNamedRenderbufferStorageMultisample(depth, samples, GL_DEPTH_COMPONENT32F, width_px, height_px);
    glNamedFramebufferRenderbuffer(framebuffer, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, colour);
    glNamedFramebufferRenderbuffer(framebuffer, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, depth);
    if (glGetError() != GL_NO_ERROR ||
        glCheckNamedFramebufferStatus(framebuffer, GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
        return Error{ErrorCode::display, fmt::format("OpenGL refuses a framebuffer of {}x{} px with {} samples",
                                                     width_px, height_px, samples)};
    return made;
}

Result<RenderTarget> RenderTarget::create(const RenderTargetOptions& options) {
    if (options.width_px < 1 || options.height_px < 1 || options.width_px > kMaxSize_px ||
        options.height_px > kMaxSize_px)
        return Error{ErrorCode::usage,
                     fmt::format("size {}x{} px is outside 1..{}", options.width_px, options.height_px, kMaxSize_px)};
    GLint max_samples = 0;
    glGetIntegerv(GL_MAX_SAMPLES, &max_samples);
    const int samples = std::clamp(options.samples, 0, static_cast<int>(max_samples));
    RenderTarget target;
    target.width_px_ = options.width_px;
    target.height_px_ = options.height_px;
    auto draw = make_framebuffer(options.width_px, options.height_px, samples);
    if (!draw) return draw.error();
    target.draw_ = std::move(*draw);
    if (samples > 0) {
        auto resolve = make_framebuffer(options.width_px, options.height_px, 0);
        if (!resolve) return resolve.error();
        target.resolve_ = std::move(*resolve);
    }
    return target;
}

std::uint32_t RenderTarget::resolved() const {
    if (resolve_.framebuffer.name() == 0) return draw_.framebuffer.name();
    glEnable(GL_FRAMEBUFFER_SRGB);  // samples are averaged as light, not as sRGB numbers
    glBlitNamedFramebuffer(draw_.framebuffer.name(), resolve_.framebuffer.name(), 0, 0, width_px_, height_px_, 0, 0,
                           width_px_, height_px_, GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT, GL_NEAREST);
    return resolve_.framebuffer.name();
}

std::vector<std::uint8_t> RenderTarget::read_pixels() const {
    const std::size_t row = 3 * static_cast<std::size_t>(width_px_);
    std::vector<std::uint8_t> picture(row * static_cast<std::size_t>(height_px_));
    glBindFramebuffer(GL_READ_FRAMEBUFFER, resolved());
    glPixelStorei(GL_PACK_ALIGNMENT, 1);
    glDisable(GL_FRAMEBUFFER_SRGB);  // the stored numbers as they are
    glReadPixels(0, 0, width_px_, height_px_, GL_RGB, GL_UNSIGNED_BYTE, picture.data());
    flip_rows(picture, row);
    return picture;
}

std::vector<float> RenderTarget::read_depth() const {
    const std::size_t row = static_cast<std::size_t>(width_px_);
    std::vector<float> depths(row * static_cast<std::size_t>(height_px_));
    glBindFramebuffer(GL_READ_FRAMEBUFFER, resolved());
    glReadPixels(0, 0, width_px_, height_px_, GL_DEPTH_COMPONENT, GL_FLOAT, depths.data());
    flip_rows(depths, row);
    return depths;
}

void RenderTarget::blit_to_window(int x_px, int y_px, int width_px, int height_px) const {
    const std::uint32_t source = resolved();
    const bool same = width_px == width_px_ && height_px == height_px_;
    glDisable(GL_FRAMEBUFFER_SRGB);  // the window takes the stored numbers, whether or not it calls itself sRGB
    glBlitNamedFramebuffer(source, 0, 0, 0, width_px_, height_px_, x_px, y_px, x_px + width_px, y_px + height_px,
                           GL_COLOR_BUFFER_BIT, same ? GL_NEAREST : GL_LINEAR);
}

void RenderTarget::blit_to_window(int window_width_px, int window_height_px) const {
    blit_to_window(0, 0, window_width_px, window_height_px);
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    glViewport(0, 0, window_width_px, window_height_px);
}

}  // namespace scree
