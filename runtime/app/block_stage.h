// BlockStage: a window's stage in the layout of Ueng & Chuang: a BlockScene and its BlockDisplay.
#pragma once

#include <memory>

#include "runtime/app/block_display.h"
#include "runtime/app/block_scene.h"
#include "runtime/app/stage.h"
#include "runtime/app/view_options.h"

namespace scree {

class BlockStage final : public Stage {
public:
    /// Reads the raster and opens the window. Errors: those of BlockScene and BlockDisplay.
    static Result<std::unique_ptr<Stage>> create(const ViewOptions& options, std::shared_ptr<const SqliteStore> store);

    const Dataset& dataset() const override { return scene_->dataset(); }
    std::shared_ptr<const TileStore> store() const override { return store_; }
    GlContext& context() override { return display_->context(); }
    RenderTarget& target() override { return display_->target(); }
    FrameSettings& settings() override { return display_->frame_settings(); }
    Result<void> resize(int width_px, int height_px) override { return display_->resize(width_px, height_px); }

    void set_tau_px(double tau_px) override { scene_->set_tau_px(tau_px); }
    StageFrame choose(std::span<const Camera> views, double now_s, double patience_s) override;
    Result<void> draw(const Camera& camera) override;
    Result<RenderTarget*> draw_second(const Camera&) override { return nullptr; }

    std::vector<LineSegment> boxes() const override;
    void describe(HudModel& model) const override;
    StageFacts facts() const override;

    std::optional<std::string> refusal(Action action) const override;
    Result<std::string> next_method() override { return refusal(Action::next_method).value_or(""); }
    Result<std::string> exaggerate(double factor) override;

private:
    BlockStage(const ViewOptions& options, std::shared_ptr<const SqliteStore> store)
        : options_(options), store_(std::move(store)) {}

    ViewOptions options_;
    std::shared_ptr<const SqliteStore> store_;
    std::unique_ptr<BlockScene> scene_;
    std::unique_ptr<BlockDisplay> display_;
    BlockFrame frame_;
    bool first_ = true;
};

}  // namespace scree
