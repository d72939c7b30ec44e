#include "runtime/window/hud.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_opengl3.h>
#include <imgui.h>

#include <algorithm>
#include <cmath>

#include "runtime/window/hud_panels.h"

namespace scree {
namespace {

constexpr float kFont_px = 13;  // what Dear ImGui's own font is drawn for
// The panels fit this at a scale of 1. A smaller window shows them smaller, rather than cut off.
constexpr float kLeastWidth = 640, kLeastHeight = 480;

void use_font(float font_px) {
    ImGuiIO& io = ImGui::GetIO();
    io.Fonts->Clear();
    ImFontConfig font;
    font.SizePixels = font_px;
    io.Fonts->AddFontDefault(&font);
    ImGui_ImplOpenGL3_CreateFontsTexture();
}

void use_style(float scale) {
    ImGuiStyle style;
    ImGui::StyleColorsDark(&style);
    style.WindowRounding = 6;
    style.WindowBorderSize = 0;
    style.Colors[ImGuiCol_PlotHistogram] = {0.35f, 0.62f, 0.85f, 1};
    style.ScaleAllSizes(scale);
    ImGui::GetStyle() = style;
}

}  // namespace

Hud::Hud(GLFWwindow* window) : window_(window) {
    IMGUI_CHECKVERSION();
    ImGui::CreateContext();
    ImGui::GetIO().IniFilename = nullptr;
    ImGui::GetIO().ConfigFlags |= ImGuiConfigFlags_NoMouseCursorChange;
    ImGui_ImplGlfw_InitForOpenGL(window, true);
    ImGui_ImplOpenGL3_Init("#version 450 core");
}

Hud::~Hud() {
    ImGui_ImplOpenGL3_Shutdown();
    ImGui_ImplGlfw_Shutdown();
    ImGui::DestroyContext();
}

// Text as large as the desktop wants it, made for the pixels of the framebuffer; sizes are in the window's coordinates.
void Hud::fit_scale() {
    float desktop = 1, unused = 1;
    glfwGetWindowContentScale(window_, &desktop, &unused);
    int width = 0, height = 0, window_width = 0, window_height = 0;
    glfwGetFramebufferSize(window_, &width, &height);
    glfwGetWindowSize(window_, &window_width, &window_height);
    const float density =
        window_width > 0 && width > 0 ? static_cast<float>(width) / static_cast<float>(window_width) : 1;
    const float room = std::min(static_cast<float>(width) / kLeastWidth, static_cast<float>(height) / kLeastHeight);
    const float scale = std::clamp(std::min(desktop, room), 0.75f, 4.0f);
    const float font_px = std::round(kFont_px * scale);
    if (font_px == font_px_) return;
    font_px_ = font_px;
    use_font(font_px);
    use_style(scale / density);
    ImGui::GetIO().FontGlobalScale = 1 / density;
}

HudAnswer Hud::draw(const HudModel& model) {
    ImGui_ImplOpenGL3_NewFrame();
    fit_scale();
    ImGui_ImplGlfw_NewFrame();
    ImGui::NewFrame();
    panels_.clear();
    HudAnswer answer;
    float bottom = ImGui::GetIO().DisplaySize.y;
    draw_second_frame(model);
    if (model.profile) {
        const DrawnPanel panel = draw_profile(*model.profile);
        panels_.push_back(panel.place);
        answer = panel.answer;
        bottom = static_cast<float>(panel.place.y);
    } else {
        draw_credit(model);
    }
    if (model.show_status && !model.show_help) {  // which would lie over it
        draw_status(model);
        draw_legend(model);
    }
    if (model.progress) draw_progress(model);
    draw_toasts(model, bottom);
    if (model.show_help) panels_.push_back(draw_help(model).place);
    ImGui::Render();
    ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
    return answer;
}

bool Hud::takes_mouse_at(const glm::dvec2& at) const {
    return std::any_of(panels_.begin(), panels_.end(),
                       [&](const glm::dvec4& p) { return at.x >= p.x && at.y >= p.y && at.x < p.z && at.y < p.w; });
}

}  // namespace scree
