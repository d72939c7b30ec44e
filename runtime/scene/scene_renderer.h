// SceneRenderer: draws what a Scene selects, under whatever OpenGL 4.5 context is current: the sink that tiles arrive
// in, and the renderer that draws them into a RenderTarget. OpenGL thread only, one context for all calls; goes before
// the context does.
//
//     auto context = borrow_current_context();                      // checks what the window's maker made
//     auto scene = Scene::open(store, {});
//     auto renderer = SceneRenderer::create(**scene);
//     auto target = RenderTarget::create({width_px, height_px});
//     (*scene)->start(**renderer);
//     each frame:
//         const SceneFrame frame = (*scene)->advance({&camera, 1}, now_s);
//         (*renderer)->draw(camera, frame, 0, *target);
//         target->blit_to_window(width_px, height_px);
#pragma once

#include <cstddef>
#include <memory>
#include <span>

#include "runtime/render/renderer.h"
#include "runtime/scene/scene.h"

namespace scree {

struct SceneRendererOptions {
    int samples = 0;        ///< of the targets that will be drawn into (RenderTargetOptions)
    double anisotropy = 1;  ///< RendererOptions
};

class SceneRenderer final : public TileSink {
public:
    /// `scene` outlives it. Takes all of the scene's tile memory, and has the driver compile what frames will need.
    /// Errors (ErrorCode::display): those of Renderer and RenderTarget.
    static Result<std::unique_ptr<SceneRenderer>> create(const Scene& scene, const SceneRendererOptions& options = {});

    Result<void> renew(const Dataset& dataset, const MemoryPlan& plan) override;
    /// renew() would leave slots and what they hold as they are.
    bool fits(const Dataset& dataset, const MemoryPlan& plan) const;
    void put_height(std::int32_t slot, std::span<const SlotVertex> vertices) override;
    void put_texture(std::int32_t slot, std::span<const std::uint8_t> chain) override;

    /// Draws view number `view` of the frame, with the camera that it was selected for, whose size is the target's.
    FrameTimes draw(const Camera& camera, const SceneFrame& frame, std::size_t view, RenderTarget& target) {
        return draw(camera, frame.selection->to_render(view), frame.half_curvature, target);
    }
    FrameTimes draw(const Camera& camera, std::span<const DrawItem> draws, double half_curvature, RenderTarget& target);

    Renderer& renderer() { return *renderer_; }
    /// Sun, haze and what finds faults; half_curvature is each frame's own.
    FrameSettings& settings() { return settings_; }
    /// Of tile memory, as taken by OpenGL.
    std::size_t arena_bytes() const { return renderer_bytes(renderer_options_); }
    const RendererOptions& renderer_options() const { return renderer_options_; }

private:
    SceneRenderer(const SceneRendererOptions& options, const Scene& scene) : options_(options), scene_(scene) {}
    Result<void> make_renderer(const Dataset& dataset, const MemoryPlan& plan);

    void pass_meshes_on();
    void pass_edge_field_on();

    SceneRendererOptions options_;
    const Scene& scene_;
    std::uint64_t meshes_passed_on_ = 0;           ///< MeshPool::written() of what the renderer has
    std::shared_ptr<const EdgeField> edge_field_;  ///< what the renderer has
    RendererOptions renderer_options_;
    std::unique_ptr<Renderer> renderer_;
    FrameSettings settings_;
};

/// Haze, sun and ground plane that suit a dataset's size.
FrameSettings scenery(const Dataset& dataset);

}  // namespace scree
