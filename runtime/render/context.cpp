#include "runtime/render/context.h"

#include <epoxy/gl.h>
#include <fmt/format.h>

namespace scree {
namespace {

std::string gl_string(GLenum name) {
    const GLubyte* text = glGetString(name);
    return text == nullptr ? "unknown" : reinterpret_cast<const char*>(text);
}

bool contains(const std::string& text, const char* part) { return text.find(part) != std::string::npos; }

class BorrowedContext final : public GlContext {
public:
    GLFWwindow* window() const override { return nullptr; }
    void swap_buffers() override {}
    Result<void> open() { return inspect(); }
};

}  // namespace

Result<void> GlContext::inspect() {
    renderer_ = gl_string(GL_RENDERER);
    version_ = gl_string(GL_VERSION);
    is_software_ = contains(renderer_, "llvmpipe") || contains(renderer_, "softpipe") || contains(renderer_, "SWR");
    const int found = epoxy_gl_version();
    if (!epoxy_is_desktop_gl() || found < 45)
        return Error{ErrorCode::display,
                     fmt::format("{} offers OpenGL {}.{}; Scree needs OpenGL 4.5", renderer_, found / 10, found % 10)};
    for (const char* extension : {"GL_EXT_texture_compression_s3tc", "GL_EXT_texture_sRGB"})
        if (!epoxy_has_gl_extension(extension))
            return Error{ErrorCode::display, fmt::format("{} lacks {}, without which it cannot draw compressed imagery",
                                                         renderer_, extension)};
    return {};
}

Result<std::unique_ptr<GlContext>> borrow_current_context() {
    auto context = std::make_unique<BorrowedContext>();
    if (const Result<void> opened = context->open(); !opened) return opened.error();
    return std::unique_ptr<GlContext>(std::move(context));
}

}  // namespace scree
