// A terrain in a GLFW program of one's own:
//     glfw_viewer STORE [FRAMES PICTURE.png]
// The camera circles. With FRAMES it ends after so many, having written the last one as PNG.
#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <scree/runtime/render/context.h>
#include <scree/runtime/render/png.h>
#include <scree/runtime/scene/scene.h>
#include <scree/runtime/scene/scene_renderer.h>
#include <scree/runtime/view/flight_path.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>

namespace {

using namespace scree;

int fail(const Error& error) {
    std::fprintf(stderr, "glfw_viewer: %s\n", error.message.c_str());
    return static_cast<int>(error.code);
}

// Once round the middle of the terrain in a minute.
Result<Camera> camera_at(double now_s, const Dataset& dataset, int width_px, int height_px) {
    const double fov_deg = 40, turn = 2 * std::acos(-1.0) * now_s / 60;
    const FlightPose whole = overview(dataset, fov_deg, static_cast<double>(width_px) / height_px);
    const glm::dvec3 arm = whole.eye - whole.look;
    const glm::dvec3 turned{std::cos(turn) * arm.x - std::sin(turn) * arm.y,
                            std::sin(turn) * arm.x + std::cos(turn) * arm.y, arm.z};
    return look_at(whole.look + 0.6 * turned, whole.look, fov_deg, width_px, height_px);
}

int show(GLFWwindow* window, const char* path, int frames, const char* picture) {
    auto context = borrow_current_context();  // is it one that terrain can be drawn with?
    if (!context) return fail(context.error());
    auto store = SqliteStore::open(path);
    if (!store) return fail(store.error());
    SceneOptions options;
    options.budget_bytes = std::int64_t{128} << 20;  // all the tile memory that will ever be taken
    options.tau_px = 1;                              // what is drawn is within a pixel of the finest data
    auto scene = Scene::open(**store, options);
    if (!scene) return fail(scene.error());
    auto renderer = SceneRenderer::create(**scene);
    if (!renderer) return fail(renderer.error());
    if (auto ok = (*scene)->start(**renderer); !ok) return fail(ok.error());

    std::unique_ptr<RenderTarget> target;
    for (int frame_number = 1; glfwWindowShouldClose(window) == 0; ++frame_number) {
        int width_px = 0, height_px = 0;
        glfwGetFramebufferSize(window, &width_px, &height_px);
        width_px = std::max(width_px, 1);  // minimised
        height_px = std::max(height_px, 1);
        if (!target || target->width_px() != width_px || target->height_px() != height_px) {
            auto resized = RenderTarget::create({width_px, height_px});
            if (!resized) return fail(resized.error());
            target = std::make_unique<RenderTarget>(std::move(*resized));
        }
        const double now_s = glfwGetTime();
        auto camera = camera_at(now_s, (*scene)->dataset(), width_px, height_px);
        if (!camera) return fail(camera.error());
        // Chooses tiles, hands those that came to the renderer, asks for what is missing; never waits.
        SceneFrame frame = (*scene)->advance({&*camera, 1}, now_s);
        const bool last = frame_number == frames;
        if (last) {  // for the picture: wait until all is there
            auto complete = (*scene)->complete({&*camera, 1});
            if (!complete) return fail(complete.error());
            frame = *complete;
        }
        (*renderer)->draw(*camera, frame, 0, *target);
        if (last) {
            const auto written = write_png(picture, width_px, height_px, target->read_pixels());
            if (!written) return fail(written.error());
            std::printf("%lld triangles, within %.2f px\n", static_cast<long long>(frame.selection->triangles),
                        frame.selection->max_bound_px);
        }
        target->blit_to_window(width_px, height_px);
        Renderer::reset_state();  // what you draw yourself goes here
        glfwSwapBuffers(window);
        glfwPollEvents();
        if (last) break;
    }
    return 0;
}

}  // namespace

int main(int argc, char** argv) {
    if (argc != 2 && argc != 4) return std::fprintf(stderr, "usage: glfw_viewer STORE [FRAMES PICTURE.png]\n"), 2;
    if (glfwInit() == GLFW_FALSE) return std::fprintf(stderr, "glfw_viewer: no display\n"), 6;
    glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 4);
    glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 5);
    glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
    GLFWwindow* window = glfwCreateWindow(800, 600, "Scree in a program of one's own", nullptr, nullptr);
    int code = 6;
    if (window != nullptr) {
        glfwMakeContextCurrent(window);
        code = show(window, argv[1], argc == 4 ? std::atoi(argv[2]) : 0, argc == 4 ? argv[3] : nullptr);
    }
    glfwTerminate();
    return code;
}
