#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <fmt/format.h>

#include <array>
#include <cstdlib>
#include <cstring>
#include <string>
#include <string_view>

#include "runtime/render/context.h"

namespace scree {
namespace {

bool has_word(const char* list, std::string_view word) {
    if (list == nullptr) return false;
    const std::string padded = ' ' + std::string(list) + ' ';
    return padded.find(' ' + std::string(word) + ' ') != std::string::npos;
}

class HeadlessContext final : public GlContext {
public:
    ~HeadlessContext() override {
        if (context_ == EGL_NO_CONTEXT) return;
        // The display stays initialised: it belongs to the process, and other contexts may stand on it.
        eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
        eglDestroyContext(display_, context_);
    }

    GLFWwindow* window() const override { return nullptr; }
    void swap_buffers() override {}

    /// Creates the context on `display` and makes it current.
    Result<void> open(EGLDisplay display) {
        const auto fail = [](const char* step) {
            return Error{ErrorCode::display, fmt::format("{} failed (EGL error 0x{:04x})", step, eglGetError())};
        };
        if (display == EGL_NO_DISPLAY) return fail("eglGetPlatformDisplay");
        if (eglInitialize(display, nullptr, nullptr) != EGL_TRUE) return fail("eglInitialize");
        const char* extensions = eglQueryString(display, EGL_EXTENSIONS);
        if (!has_word(extensions, "EGL_KHR_surfaceless_context"))
            return Error{ErrorCode::display, "EGL_KHR_surfaceless_context is missing"};
        if (eglBindAPI(EGL_OPENGL_API) != EGL_TRUE) return fail("eglBindAPI(EGL_OPENGL_API)");

        constexpr std::array<EGLint, 5> wanted{EGL_SURFACE_TYPE, 0, EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_NONE};
        EGLConfig config = nullptr;
        EGLint config_count = 0;
        if (eglChooseConfig(display, wanted.data(), &config, 1, &config_count) != EGL_TRUE || config_count == 0) {
            if (!has_word(extensions, "EGL_KHR_no_config_context")) return fail("eglChooseConfig");
            config = EGL_NO_CONFIG_KHR;
        }
        constexpr std::array<EGLint, 7> version{
            EGL_CONTEXT_MAJOR_VERSION,           4,       EGL_CONTEXT_MINOR_VERSION, 5, EGL_CONTEXT_OPENGL_PROFILE_MASK,
            EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT, EGL_NONE};
        const EGLContext context = eglCreateContext(display, config, EGL_NO_CONTEXT, version.data());
        if (context == EGL_NO_CONTEXT) return fail("eglCreateContext for OpenGL 4.5 core");
        display_ = display;
        context_ = context;
        if (eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context) != EGL_TRUE) return fail("eglMakeCurrent");
        return inspect();
    }

private:
    EGLDisplay display_ = EGL_NO_DISPLAY;
    EGLContext context_ = EGL_NO_CONTEXT;
};

struct Devices {
    std::array<EGLDeviceEXT, 16> list{};
    EGLint count = 0;
    PFNEGLQUERYDEVICESTRINGEXTPROC query_string = nullptr;

    bool is_software(std::size_t k) const {
        return has_word(query_string(list[k], EGL_EXTENSIONS), "EGL_MESA_device_software");
    }
};

Devices list_devices(const char* client_extensions) {
    Devices devices;
    if (!has_word(client_extensions, "EGL_EXT_platform_device")) return devices;
    const auto query = reinterpret_cast<PFNEGLQUERYDEVICESEXTPROC>(eglGetProcAddress("eglQueryDevicesEXT"));
    devices.query_string =
        reinterpret_cast<PFNEGLQUERYDEVICESTRINGEXTPROC>(eglGetProcAddress("eglQueryDeviceStringEXT"));
    if (query == nullptr || devices.query_string == nullptr ||
        query(static_cast<EGLint>(devices.list.size()), devices.list.data(), &devices.count) != EGL_TRUE)
        devices.count = 0;
    return devices;
}

bool prefers_software() {
    const char* value = std::getenv("LIBGL_ALWAYS_SOFTWARE");
    return value != nullptr && (std::strcmp(value, "1") == 0 || std::strcmp(value, "true") == 0);
}

}  // namespace

Result<std::unique_ptr<GlContext>> create_headless_context() {
    const char* client_extensions = eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
    if (client_extensions == nullptr)
        return Error{ErrorCode::display,
                     "no EGL library that can work without a display (libegl1 is missing or too old)"};

    std::string reasons;
    const auto attempt = [&](const char* name, EGLDisplay display) {
        auto context = std::make_unique<HeadlessContext>();
        if (const Result<void> opened = context->open(display); !opened) {
            reasons += fmt::format("{}{}: {}", reasons.empty() ? "" : "; ", name, opened.error().message);
            context.reset();
        }
        return context;
    };
    const Devices devices = list_devices(client_extensions);
    const auto attempt_devices = [&](bool software) -> std::unique_ptr<HeadlessContext> {
        for (std::size_t k = 0; k < static_cast<std::size_t>(devices.count); ++k) {
            if (devices.is_software(k) != software) continue;
            if (auto context = attempt(software ? "software device" : "device",
                                       eglGetPlatformDisplay(EGL_PLATFORM_DEVICE_EXT, devices.list[k], nullptr)))
                return context;
        }
        return nullptr;
    };

    // A GPU first: where two drivers are installed, Mesa's surfaceless platform knows only its own and would draw on
    // the CPU.
    std::unique_ptr<HeadlessContext> context;
    if (!prefers_software()) context = attempt_devices(false);
    if (!context && has_word(client_extensions, "EGL_MESA_platform_surfaceless"))
        context =
            attempt("surfaceless", eglGetPlatformDisplay(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr));
    if (!context) context = attempt_devices(true);
    if (!context)
        return Error{ErrorCode::display, fmt::format("no OpenGL 4.5 without a display ({})",
                                                     reasons.empty() ? "EGL offers no platform for it" : reasons)};
    return std::unique_ptr<GlContext>(std::move(context));
}

}  // namespace scree
