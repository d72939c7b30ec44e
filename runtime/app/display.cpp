#include "runtime/app/display.h"

#include <algorithm>

#include "runtime/render/window_context.h"

namespace scree {

Result<std::unique_ptr<Display>> Display::create(const Scene& scene, const DisplayOptions& o) {
    const Dataset& d = scene.dataset();
    std::unique_ptr<Display> display(new Display);
    auto context = o.window
                       ? create_window_context({"Scree", o.width_px, o.height_px, o.wait_for_refresh, o.visible_window})
                       : create_headless_context();
    if (!context) return context.error();
    display->context_ = std::move(*context);
    display->samples_ = o.samples;
    display->anisotropy_ = o.anisotropy;
    auto terrain = SceneRenderer::create(scene, {o.samples, o.anisotropy});
    if (!terrain) return terrain.error();
    display->terrain_ = std::move(*terrain);
    if (auto ok = display->resize(o.width_px, o.height_px); !ok) return ok.error();
    if (o.keep_heights) display->arena_ = std::make_unique<CpuArena>(d, scene.memory().height_slots);
    return display;
}

Result<void> Display::change_to(const Scene& scene) {
    const FrameSettings settings = terrain_->settings();
    terrain_.reset();  // never the memory of two
    auto terrain = SceneRenderer::create(scene, {samples_, anisotropy_});
    if (!terrain) return terrain.error();
    terrain_ = std::move(*terrain);
    terrain_->settings() = settings;
    return {};
}

Result<void> Display::renew(const Dataset& d, const MemoryPlan& plan) {
    if (arena_ && !terrain_->fits(d, plan)) arena_ = std::make_unique<CpuArena>(d, plan.height_slots);
    return terrain_->renew(d, plan);
}

void Display::put_height(std::int32_t slot, std::span<const SlotVertex> vertices) {
    terrain_->put_height(slot, vertices);
    if (arena_) arena_->put_height(slot, vertices);
}

void Display::put_texture(std::int32_t slot, std::span<const std::uint8_t> chain) {
    terrain_->put_texture(slot, chain);
}

Result<void> Display::resize(int width_px, int height_px) {
    auto target = RenderTarget::create({width_px, height_px, samples_});
    if (!target) return target.error();
    target_ = std::make_unique<RenderTarget>(std::move(*target));
    return {};
}

Result<void> Display::resize_inset(int width_px, int height_px) {
    auto target = RenderTarget::create({width_px, height_px, samples_});
    if (!target) return target.error();
    inset_ = std::make_unique<RenderTarget>(std::move(*target));
    return {};
}

FrameTimes Display::draw_inset(const Camera& camera, const DrawList& draws, double half_curvature) {
    return terrain_->draw(camera, draws, half_curvature, *inset_);
}

FrameTimes Display::draw(const Camera& camera, const DrawList& draws, double half_curvature) {
    return terrain_->draw(camera, draws, half_curvature, *target_);
}

void Display::warm_up(const Camera& camera, const DrawItem& tile, std::int64_t triangles) {
    const RendererOptions& o = terrain_->renderer_options();
    DrawItem whole = tile;
    whole.geomip = 0;
    whole.edge_mask = 0;
    whole.mesh = {};
    const auto each = static_cast<std::int64_t>(pattern_triangles(o.lattice.tile_cells_log2, 0, 0));
    const std::int64_t count = std::clamp<std::int64_t>(triangles / each, 1, o.max_draws);
    draw(camera, DrawList(static_cast<std::size_t>(count), whole), 0);
}

}  // namespace scree
