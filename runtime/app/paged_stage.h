// PagedStage: a window's stage that pages tiles: a Scene and its Display.
#pragma once

#include <memory>

#include "runtime/app/display.h"
#include "runtime/app/stage.h"
#include "runtime/app/view_options.h"
#include "runtime/scene/scene.h"

namespace scree {

class PagedStage final : public Stage {
public:
    /// Opens the window. Errors: those of Scene and Display.
    static Result<std::unique_ptr<Stage>> create(const ViewOptions& options, std::shared_ptr<const SqliteStore> store);

    const Dataset& dataset() const override { return scene_->dataset(); }
    std::shared_ptr<const TileStore> store() const override { return scene_->shared_store(); }
    GlContext& context() override { return display_->context(); }
    RenderTarget& target() override { return display_->target(); }
    FrameSettings& settings() override { return display_->frame_settings(); }
    Result<void> resize(int width_px, int height_px) override { return display_->resize(width_px, height_px); }

    Result<void> follow() override { return scene_->follow(); }
    void set_tau_px(double tau_px) override { scene_->options().tau_px = tau_px; }
    StageFrame choose(std::span<const Camera> views, double now_s, double patience_s) override;
    Result<void> draw(const Camera& camera) override;
    Result<RenderTarget*> draw_second(const Camera& camera) override;

    std::vector<LineSegment> boxes() const override;
    void describe(HudModel& model) const override;
    StageFacts facts() const override;

    std::optional<std::string> refusal(Action) const override { return std::nullopt; }
    Result<std::string> next_method() override;
    Result<std::string> exaggerate(double factor) override;
    std::vector<std::string> take_troubles() override { return std::exchange(troubles_, {}); }

private:
    explicit PagedStage(const ViewOptions& options) : options_(options) {}
    Result<std::unique_ptr<Scene>> open_scene(std::shared_ptr<const SqliteStore> store, const LodSettings& lod);
    LodSettings settings_of(LodMethod method) const;
    Result<void> change_to(std::unique_ptr<Scene> scene);
    void begin_loading();
    void describe_error(HudModel& model) const;
    void describe_tiles(HudModel& model) const;
    void describe_progress(HudModel& model) const;
    void describe_legend(HudModel& model) const;

    ViewOptions options_;
    std::vector<std::string> troubles_;
    std::unique_ptr<Scene> scene_;
    std::unique_ptr<Display> display_;  // goes before the scene, whose meshes it draws
    SceneFrame frame_;
    bool first_ = true;             ///< nothing was chosen yet
    bool loading_ = true;           ///< the first picture is not complete yet
    std::int64_t before_ = 0;       ///< tiles that had come when it began
    std::int64_t updates_ = 0;      ///< of the scene, that were drawn
    std::int64_t exaggerated_ = 0;  ///< of them, those that were none of the store's
};

}  // namespace scree
