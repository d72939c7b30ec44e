// BlockDisplay: a context, a renderer and a target for a BlockScene, with or without a window: what Display is where
// tiles are paged. OpenGL thread only.
#pragma once

#include <memory>

#include "runtime/app/block_scene.h"
#include "runtime/app/display.h"
#include "runtime/render/surface_renderer.h"

namespace scree {

class BlockDisplay {
public:
    /// Size, window and samples of the options. `scene` outlives the display.
    /// `context`: to draw with, else it makes its own.
    static Result<std::unique_ptr<BlockDisplay>> create(const BlockScene& scene, const DisplayOptions& options,
                                                        std::unique_ptr<GlContext> context = nullptr);
    /// A context by the options, for create().
    static Result<std::unique_ptr<GlContext>> make_context(const DisplayOptions& options);

    GlContext& context() { return *context_; }
    RenderTarget& target() { return *target_; }
    FrameSettings& frame_settings() { return settings_; }
    /// Lets go of one scene for another, in the same context. Settings stay, but for those that go by its heights.
    /// After an error nothing can be drawn.
    Result<void> change_to(const BlockScene& scene);
    Result<void> resize(int width_px, int height_px);
    /// What the scene has last selected.
    FrameTimes draw(const Camera& camera);
    void show();  ///< in the window, where there is one

private:
    explicit BlockDisplay(const BlockScene& scene) : scene_(&scene) {}
    void warm_up();

    const BlockScene* scene_;
    std::unique_ptr<GlContext> context_;  // goes last
    std::unique_ptr<SurfaceRenderer> renderer_;
    std::unique_ptr<RenderTarget> target_;
    FrameSettings settings_;
    int samples_ = 0;
};

}  // namespace scree
