#include "runtime/app/block_stage.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <fmt/format.h>

#include "common/report.h"
#include "runtime/app/hud_text.h"
#include "runtime/app/loading_window.h"
#include "runtime/app/stage_lines.h"

namespace scree {
namespace {

constexpr Rgba kAnew{255, 190, 60, 255}, kReused{120, 200, 255, 255};

// The window is there at once, and says how far it has come.
Result<std::unique_ptr<BlockScene>> load(const SqliteStore& store, const ViewOptions& o, GlContext& context) {
    auto window = LoadingWindow::create(context, "reading heights");
    if (!window) return window.error();
    return BlockScene::open(store, scene_options(o),
                            [&](double share) { return (*window)->show(share) && !interrupt_flag(); });
}

}  // namespace

Result<std::unique_ptr<Stage>> BlockStage::create(const ViewOptions& o, std::shared_ptr<const SqliteStore> store) {
    std::unique_ptr<BlockStage> stage(new BlockStage(o, std::move(store)));
    DisplayOptions shown = display_options(o);
    shown.window = true;
    shown.wait_for_refresh = true;
    auto context = BlockDisplay::make_context(shown);
    if (!context) return context.error();
    auto scene = load(*stage->store_, o, **context);
    if (!scene) return scene.error();
    stage->scene_ = std::move(*scene);
    auto display = BlockDisplay::create(*stage->scene_, shown, std::move(*context));
    if (!display) return display.error();
    stage->display_ = std::move(*display);
    set_look(o, stage->display_->frame_settings());
    return std::unique_ptr<Stage>(std::move(stage));
}

// All of it is in memory: nothing changes by itself.
StageFrame BlockStage::choose(std::span<const Camera> views, double, double) {
    frame_ = scene_->select(views[0]);
    StageFrame chosen;
    chosen.half_curvature = scene_->half_curvature();
    chosen.changed = first_;
    first_ = false;
    return chosen;
}

Result<void> BlockStage::draw(const Camera& camera) {
    display_->draw(camera);
    return {};
}

std::vector<LineSegment> BlockStage::boxes() const {
    std::vector<LineSegment> lines;
    for (const std::int32_t block : frame_.blocks)
        add_box(scene_->world().box(block), scene_->world().was_reused(block) ? kReused : kAnew, lines);
    return lines;
}

void BlockStage::describe(HudModel& model) const {
    const auto promise_px = scene_->promise_px();
    model.picture.push_back({"drawn", fmt::format("{} triangles in {} blocks, {} strips", grouped(frame_.triangles()),
                                                  frame_.blocks.size(), frame_.strips.size())});
    model.picture.push_back({"error", promise_px
                                          ? fmt::format("within {:.2f} px, tau {:.2f}", *promise_px, scene_->tau_px())
                                          : fmt::format("not promised, tau {:.2f}", scene_->tau_px())});
    model.picture.push_back({"method", command_line_of(options_.lod).substr(6)});
    model.picture.push_back({"blocks", fmt::format("{} reused, {} meshes made", frame_.reused, frame_.meshes_made)});
    const std::int64_t held = scene_->resident_bytes();
    model.memory.push_back({"memory",
                            fmt::format("{} of {} MB, all of it", megabytes(held), megabytes(options_.budget_bytes)),
                            static_cast<double>(held) / static_cast<double>(options_.budget_bytes)});
}

StageFacts BlockStage::facts() const {
    return {std::string(to_string(options_.lod.method)), dataset().exaggeration, scene_->tau_px(), frame_.triangles(),
            0};
}

std::optional<std::string> BlockStage::refusal(Action action) const {
    switch (action) {
        case Action::colour_by_level:
        case Action::colour_by_geomip:
        case Action::colour_by_error:
            return "Blocks (--cracks dike) have no levels to colour by.";
        case Action::second_view:
            return "Blocks (--cracks dike) are chosen for one view alone.";
        case Action::next_method:
            return "Blocks (--cracks dike) are one method: start without them to change it.";
        default:
            return std::nullopt;
    }
}

Result<std::string> BlockStage::exaggerate(double factor) {
    const auto stay = [](const Error& error) { return fmt::format("Heights stay as they are: {}", error.message); };
    auto store = SqliteStore::open(store_->path(), {factor});
    if (!store) return stay(store.error());
    SceneOptions options = scene_options(options_);
    options.tau_px = scene_->tau_px();
    GLFWwindow* window = context().window();
    auto scene = BlockScene::open(**store, options, [window](double share) {
        glfwSetWindowTitle(window, fmt::format("Scree: reading heights, {:.0f} %", 100 * share).c_str());
        return !interrupt_flag();
    });
    glfwSetWindowTitle(window, window_title(options_).c_str());
    if (!scene) return stay(scene.error());
    if (auto ok = display_->change_to(**scene); !ok) return ok.error();
    store_ = std::move(*store);
    scene_ = std::move(*scene);
    first_ = true;
    return fmt::format("Heights x {:g}", factor);
}

}  // namespace scree
