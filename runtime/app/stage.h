// Stage: what a window shows and how it is chosen: tiles through a Scene (PagedStage) or the paper's blocks
// (BlockStage). Owns the context, so it outlives all else of OpenGL in the window. Frame-loop thread only.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/dataset.h"
#include "common/store/tile_store.h"
#include "runtime/render/context.h"
#include "runtime/render/line_renderer.h"
#include "runtime/render/render_target.h"
#include "runtime/render/renderer.h"
#include "runtime/view/camera.h"
#include "runtime/window/hud_model.h"
#include "runtime/window/key_table.h"

namespace scree {

/// What has to be done with the frame that was chosen.
struct StageFrame {
    bool changed = false;       ///< it looks different from the last one, though the camera may stand still
    bool goes_on = false;       ///< so will the next one
    bool expects = false;       ///< something is on its way: look again soon
    double half_curvature = 0;  ///< 1 / (2 R), 1/m, round the first view's eye; 0: flat
};

/// What a closing window says of it.
struct StageFacts {
    std::string method;
    double exaggeration = 1;
    double tau_effective_px = 0;
    std::int64_t triangles = 0, updates = 0;
};

class Stage {
public:
    virtual ~Stage() = default;
    Stage() = default;
    Stage(const Stage&) = delete;
    Stage& operator=(const Stage&) = delete;

    /// Of the state of the store that is drawn, heights as they are drawn.
    virtual const Dataset& dataset() const = 0;
    /// What holds the ground that is drawn; another one once an update was taken up.
    virtual std::shared_ptr<const TileStore> store() const = 0;
    virtual GlContext& context() = 0;
    virtual RenderTarget& target() = 0;
    virtual FrameSettings& settings() = 0;
    virtual Result<void> resize(int width_px, int height_px) = 0;

    /// Takes up what updates make of the store. Errors: those of Scene::follow().
    virtual Result<void> follow() { return {}; }
    virtual void set_tau_px(double tau_px) = 0;
    /// Chooses what is drawn of the views, the first one's for the whole window. May wait for `patience_s` for what is
    /// missing.
    virtual StageFrame choose(std::span<const Camera> views, double now_s, double patience_s) = 0;
    /// Draws what was chosen, as `camera` sees it.
    virtual Result<void> draw(const Camera& camera) = 0;
    /// The second view, into a target of its own that is as large as the camera's picture; null where refused.
    virtual Result<RenderTarget*> draw_second(const Camera& camera) = 0;

    /// The boxes of what is drawn, on a flat world.
    virtual std::vector<LineSegment> boxes() const = 0;
    /// Adds what there is to say of the frame: rows, bars, progress, legend.
    virtual void describe(HudModel& model) const = 0;
    virtual StageFacts facts() const = 0;

    /// Why an action does nothing here; none: it does.
    virtual std::optional<std::string> refusal(Action action) const = 0;
    /// These return what to tell the user, whether it was done or not; an error ends the window.
    virtual Result<std::string> next_method() = 0;
    virtual Result<std::string> exaggerate(double factor) = 0;

    /// What went wrong and is borne, since the last taking.
    virtual std::vector<std::string> take_troubles() { return {}; }
};

}  // namespace scree
