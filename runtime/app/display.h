// Display: a context, a renderer and a target for one scene, with or without a window; the sink that tiles arrive in.
#pragma once

#include <memory>
#include <span>

#include "runtime/app/cpu_arena.h"
#include "runtime/app/scene.h"
#include "runtime/render/context.h"
#include "runtime/render/renderer.h"

namespace scree {

struct DisplayOptions {
    int width_px = 800;
    int height_px = 800;
    bool window = false;
    bool visible_window = true;
    bool wait_for_refresh = false;
    bool keep_heights = false;  ///< also a CpuArena, for --mesh
    int samples = 0;
};

class Display final : public TileSink {
public:
    static Result<std::unique_ptr<Display>> create(const Scene& scene, const DisplayOptions& options);

    Result<void> renew(const Dataset& dataset, const MemoryPlan& plan) override;
    void put_height(std::int32_t slot, std::span<const SlotVertex> vertices) override;
    void put_texture(std::int32_t slot, std::span<const std::uint8_t> chain) override;

    GlContext& context() { return *context_; }
    Renderer& renderer() { return *renderer_; }
    RenderTarget& target() { return *target_; }
    /// Of tile memory, as taken by OpenGL.
    std::size_t arena_bytes() const { return arena_bytes_; }
    const CpuArena* arena() const { return arena_.get(); }
    FrameSettings& frame_settings() { return settings_; }
    Result<void> resize(int width_px, int height_px);
    /// A second picture of the same tiles, in a target of its own.
    RenderTarget& inset() { return *inset_; }
    Result<void> resize_inset(int width_px, int height_px);
    FrameTimes draw_inset(const Camera& camera, const DrawList& draws, double half_curvature);
    FrameTimes draw(const Camera& camera, const DrawList& draws, double half_curvature);
    /// Draws about so many triangles without a purpose, so that what OpenGL takes once is taken.
    void warm_up(const Camera& camera, const DrawItem& tile, std::int64_t triangles);

private:
    Display() = default;
    Result<void> make_renderer(const Dataset& dataset, const MemoryPlan& plan);
    FrameTimes draw_into(RenderTarget& target, const Camera& camera, const DrawList& draws, double half_curvature);
    void pass_meshes_on();
    std::unique_ptr<GlContext> context_;  // goes last
    std::unique_ptr<Renderer> renderer_;
    std::unique_ptr<RenderTarget> target_, inset_;
    std::unique_ptr<CpuArena> arena_;
    const MeshPool* meshes_ = nullptr;    ///< the scene's
    std::uint64_t meshes_passed_on_ = 0;  ///< MeshPool::written() of what the renderer has
    FrameSettings settings_;
    int samples_ = 0;
    std::size_t arena_bytes_ = 0;
    RendererOptions renderer_options_;
};

/// Haze, sun and ground plane that suit a dataset's size.
FrameSettings scenery(const Dataset& dataset);

}  // namespace scree
