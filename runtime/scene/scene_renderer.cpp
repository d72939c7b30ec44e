#include "runtime/scene/scene_renderer.h"

#include <algorithm>

namespace scree {
namespace {

RendererOptions options_of(const Dataset& d, const MemoryPlan& plan, double anisotropy) {
    RendererOptions o;
    o.lattice = d.lattice;
    o.height_offset_m = d.height_offset_m;
    o.height_quantum_m = d.height_quantum_m;
    o.texture_size_log2 = d.texture_size_log2;
    o.height_slots = static_cast<int>(plan.height_slots);
    o.texture_slots = static_cast<int>(plan.texture_slots);
    o.max_draws = o.height_slots + o.texture_slots;  // a page, or a part for each deep texture
    o.anisotropy = anisotropy;
    return o;
}

}  // namespace

FrameSettings scenery(const Dataset& d) {
    FrameSettings s;
    const double extent = static_cast<double>(std::max(d.lattice.cells_x, d.lattice.cells_y)) * d.lattice.spacing_m;
    s.haze_distance_m = 2.2 * extent;
    s.haze_scale_height_m = std::max(0.08 * extent, d.max_height_m - d.min_height_m);
    s.ground_height_m = d.min_height_m;
    return s;
}

Result<std::unique_ptr<SceneRenderer>> SceneRenderer::create(const Scene& scene, const SceneRendererOptions& options) {
    std::unique_ptr<SceneRenderer> made(new SceneRenderer(options, scene));
    made->settings_ = scenery(scene.dataset());
    if (auto ok = made->make_renderer(scene.dataset(), scene.memory()); !ok) return ok.error();
    return made;
}

Result<void> SceneRenderer::make_renderer(const Dataset& dataset, const MemoryPlan& plan) {
    renderer_.reset();  // never the memory of two
    renderer_options_ = options_of(dataset, plan, options_.anisotropy);
    const MeshPool* meshes = scene_.meshes();
    renderer_options_.mesh_indices = meshes != nullptr ? meshes->capacity() : 0;
    meshes_passed_on_ = 0;
    edge_field_.reset();
    auto renderer = Renderer::create(renderer_options_);
    if (!renderer) return renderer.error();
    renderer_ = std::move(*renderer);
    // Drivers compile for a format, not for a size.
    auto target = RenderTarget::create({16, 16, options_.samples});
    if (!target) return target.error();
    renderer_->warm_up(settings_, *target);
    return {};
}

bool SceneRenderer::fits(const Dataset& d, const MemoryPlan& plan) const {
    const RendererOptions& o = renderer_options_;
    return o.height_slots == plan.height_slots && o.texture_slots == plan.texture_slots &&
           o.height_offset_m == d.height_offset_m && o.height_quantum_m == d.height_quantum_m;
}

Result<void> SceneRenderer::renew(const Dataset& d, const MemoryPlan& plan) {
    const FrameSettings fresh = scenery(d);
    meshes_passed_on_ = 0;
    settings_.haze_distance_m = fresh.haze_distance_m;
    settings_.haze_scale_height_m = fresh.haze_scale_height_m;
    settings_.ground_height_m = fresh.ground_height_m;
    return fits(d, plan) ? Result<void>{} : make_renderer(d, plan);
}

void SceneRenderer::put_height(std::int32_t slot, std::span<const SlotVertex> vertices) {
    renderer_->upload_height(slot, vertices);
}

void SceneRenderer::put_texture(std::int32_t slot, std::span<const std::uint8_t> chain) {
    renderer_->upload_texture(slot, chain);
}

void SceneRenderer::pass_meshes_on() {
    const MeshPool* meshes = scene_.meshes();
    if (meshes == nullptr) return;
    for (const MeshPool::Piece& piece : meshes->written_since(meshes_passed_on_))
        renderer_->upload_mesh(piece.first, piece.indices);
    meshes_passed_on_ = meshes->written();
}

// Without memory for it the ends are cut.
void SceneRenderer::pass_edge_field_on() {
    if (edge_field_ == scene_.edge_field()) return;
    edge_field_ = scene_.edge_field();
    [[maybe_unused]] const auto ok = renderer_->set_edge_field(edge_field_);
}

FrameTimes SceneRenderer::draw(const Camera& camera, std::span<const DrawItem> draws, double half_curvature,
                               RenderTarget& target) {
    pass_meshes_on();
    pass_edge_field_on();
    settings_.half_curvature = half_curvature;
    return renderer_->draw(camera, draws, settings_, target);
}

}  // namespace scree
