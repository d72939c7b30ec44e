// Display: a context of our own, with or without a window, and targets for one scene; the sink that tiles arrive in.
#pragma once

#include <memory>
#include <span>

#include "runtime/app/cpu_arena.h"
#include "runtime/render/context.h"
#include "runtime/scene/scene_renderer.h"

namespace scree {

struct DisplayOptions {
    int width_px = 800;
    int height_px = 800;
    bool window = false;
    bool visible_window = true;
    bool wait_for_refresh = false;
    bool keep_heights = false;  ///< also a CpuArena, for --mesh
    int samples = 0;            ///< RenderTargetOptions
    double anisotropy = 1;      ///< RendererOptions
};

class Display final : public TileSink {
public:
    static Result<std::unique_ptr<Display>> create(const Scene& scene, const DisplayOptions& options);

    /// Lets go of all tiles and makes room for those of another scene, in the same context. Settings stay. After an
    /// error nothing can be drawn.
    Result<void> change_to(const Scene& scene);
    Result<void> renew(const Dataset& dataset, const MemoryPlan& plan) override;
    void put_height(std::int32_t slot, std::span<const SlotVertex> vertices) override;
    void put_texture(std::int32_t slot, std::span<const std::uint8_t> chain) override;

    GlContext& context() { return *context_; }
    Renderer& renderer() { return terrain_->renderer(); }
    RenderTarget& target() { return *target_; }
    /// Of tile memory, as taken by OpenGL.
    std::size_t arena_bytes() const { return terrain_->arena_bytes(); }
    const CpuArena* arena() const { return arena_.get(); }
    FrameSettings& frame_settings() { return terrain_->settings(); }
    Result<void> resize(int width_px, int height_px);
    /// A second picture of the same tiles, in a target of its own.
    bool has_inset() const { return inset_ != nullptr; }
    RenderTarget& inset() { return *inset_; }
    Result<void> resize_inset(int width_px, int height_px);
    FrameTimes draw_inset(const Camera& camera, const DrawList& draws, double half_curvature);
    FrameTimes draw(const Camera& camera, const DrawList& draws, double half_curvature);
    /// Draws about so many triangles without a purpose, so that what OpenGL takes once is taken.
    void warm_up(const Camera& camera, const DrawItem& tile, std::int64_t triangles);

private:
    Display() = default;
    std::unique_ptr<GlContext> context_;  // goes last
    std::unique_ptr<SceneRenderer> terrain_;
    std::unique_ptr<RenderTarget> target_, inset_;
    std::unique_ptr<CpuArena> arena_;
    int samples_ = 0;
    double anisotropy_ = 1;
};

}  // namespace scree
