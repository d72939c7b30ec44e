#include "runtime/app/display.h"

#include <algorithm>
#include <cassert>

namespace scree {

FrameSettings scenery(const Dataset& d) {
    FrameSettings s;
    const double extent = static_cast<double>(std::max(d.lattice.cells_x, d.lattice.cells_y)) * d.lattice.spacing_m;
    s.haze_distance_m = 1.6 * extent;
    s.haze_scale_height_m = std::max(0.08 * extent, d.max_height_m - d.min_height_m);
    s.ground_height_m = d.min_height_m;
    return s;
}

Result<std::unique_ptr<Display>> Display::create(const Scene& scene, const DisplayOptions& o) {
    const Dataset& d = scene.dataset();
    std::unique_ptr<Display> display(new Display);
    auto context = o.window
                       ? create_window_context({"Scree", o.width_px, o.height_px, o.wait_for_refresh, o.visible_window})
                       : create_headless_context();
    if (!context) return context.error();
    display->context_ = std::move(*context);
    display->samples_ = o.samples;
    display->meshes_ = scene.meshes();
    if (auto ok = display->make_renderer(d, scene.memory()); !ok) return ok.error();
    if (auto ok = display->resize(o.width_px, o.height_px); !ok) return ok.error();
    if (o.keep_heights) display->arena_ = std::make_unique<CpuArena>(d, scene.memory().height_slots);
    display->settings_ = scenery(d);
    display->renderer_->warm_up(display->settings_, *display->target_);
    return display;
}

Result<void> Display::make_renderer(const Dataset& d, const MemoryPlan& plan) {
    RendererOptions options;
    options.lattice = d.lattice;
    options.height_offset_m = d.height_offset_m;
    options.height_quantum_m = d.height_quantum_m;
    options.texture_size_log2 = d.texture_size_log2;
    options.height_slots = static_cast<int>(plan.height_slots);
    options.texture_slots = static_cast<int>(plan.texture_slots);
    options.mesh_indices = meshes_ != nullptr ? meshes_->capacity() : 0;
    options.max_draws = options.height_slots + options.texture_slots;  // a page, or a part for each deep texture
    renderer_.reset();                                                 // never the memory of two
    auto renderer = Renderer::create(options);
    if (!renderer) return renderer.error();
    renderer_ = std::move(*renderer);
    renderer_options_ = options;
    meshes_passed_on_ = 0;
    arena_bytes_ = renderer_bytes(options);
    return {};
}

Result<void> Display::renew(const Dataset& d, const MemoryPlan& plan) {
    const FrameSettings fresh = scenery(d);
    meshes_passed_on_ = 0;
    settings_.haze_distance_m = fresh.haze_distance_m;
    settings_.haze_scale_height_m = fresh.haze_scale_height_m;
    settings_.ground_height_m = fresh.ground_height_m;
    const RendererOptions& o = renderer_options_;
    if (o.height_slots == plan.height_slots && o.texture_slots == plan.texture_slots &&
        o.height_offset_m == d.height_offset_m && o.height_quantum_m == d.height_quantum_m)
        return {};
    if (arena_) arena_ = std::make_unique<CpuArena>(d, plan.height_slots);
    if (auto ok = make_renderer(d, plan); !ok) return ok;
    renderer_->warm_up(settings_, *target_);
    return {};
}

void Display::put_height(std::int32_t slot, std::span<const SlotVertex> vertices) {
    renderer_->upload_height(slot, vertices);
    if (arena_) arena_->put_height(slot, vertices);
}

void Display::put_texture(std::int32_t slot, std::span<const std::uint8_t> chain) {
    renderer_->upload_texture(slot, chain);
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

void Display::pass_meshes_on() {
    if (meshes_ == nullptr) return;
    for (const MeshPool::Piece& piece : meshes_->written_since(meshes_passed_on_))
        renderer_->upload_mesh(piece.first, piece.indices);
    meshes_passed_on_ = meshes_->written();
}

FrameTimes Display::draw_into(RenderTarget& target, const Camera& camera, const DrawList& draws,
                              double half_curvature) {
    pass_meshes_on();
    settings_.half_curvature = half_curvature;
    return renderer_->draw(camera, draws, settings_, target);
}

FrameTimes Display::draw_inset(const Camera& camera, const DrawList& draws, double half_curvature) {
    return draw_into(*inset_, camera, draws, half_curvature);
}

FrameTimes Display::draw(const Camera& camera, const DrawList& draws, double half_curvature) {
    return draw_into(*target_, camera, draws, half_curvature);
}

void Display::warm_up(const Camera& camera, const DrawItem& tile, std::int64_t triangles) {
    DrawItem whole = tile;
    whole.geomip = 0;
    whole.edge_mask = 0;
    whole.mesh = {};
    const auto each = static_cast<std::int64_t>(pattern_triangles(renderer_options_.lattice.tile_cells_log2, 0, 0));
    const std::int64_t count = std::clamp<std::int64_t>(triangles / each, 1, renderer_options_.max_draws);
    draw(camera, DrawList(static_cast<std::size_t>(count), whole), 0);
}

}  // namespace scree
