#include "runtime/app/loading_window.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace scree {
namespace {

constexpr std::chrono::milliseconds kBetween{150};

}  // namespace

LoadingWindow::LoadingWindow(GlContext& context, std::string text, SkyPass sky)
    : context_(context), text_(std::move(text)), sky_(std::move(sky)), hud_(context.window()) {
    draw(0);
}

Result<std::unique_ptr<LoadingWindow>> LoadingWindow::create(GlContext& context, std::string text) {
    auto sky = SkyPass::create();
    if (!sky) return sky.error();
    return std::unique_ptr<LoadingWindow>(new LoadingWindow(context, std::move(text), std::move(*sky)));
}

bool LoadingWindow::show(double share) {
    if (std::chrono::steady_clock::now() - last_ >= kBetween) {
        glfwPollEvents();
        draw(share);
    }
    return glfwWindowShouldClose(context_.window()) == 0;
}

void LoadingWindow::draw(double share) {
    last_ = std::chrono::steady_clock::now();
    int width = 0, height = 0;
    glfwGetFramebufferSize(context_.window(), &width, &height);
    auto target = RenderTarget::create({std::clamp(width, 1, 16384), std::clamp(height, 1, 16384), 0});
    if (!target) return;
    Camera camera;
    camera.width_px = target->width_px();
    camera.height_px = target->height_px();
    camera.forward = glm::normalize(glm::dvec3(0, 1, -0.15));
    camera.up = glm::normalize(glm::dvec3(0, 0.15, 1));
    HudModel model;
    model.show_status = false;
    model.progress = HudModel::Progress{share, fmt::format("{}: {:.0f} %", text_, 100 * share)};
    // Dear ImGui knows how large a text is in the frame after.
    for (int k = 0; k < Hud::kFramesOfAChange; ++k) {
        begin_picture(*target);
        sky_.draw(camera, {});
        target->blit_to_window(target->width_px(), target->height_px());
        hud_.draw(model);
        context_.swap_buffers();
    }
}

}  // namespace scree
