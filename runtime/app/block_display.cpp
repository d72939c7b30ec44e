#include "runtime/app/block_display.h"

#include "runtime/render/window_context.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

namespace scree {
namespace {

/// Of the finest surface, by the samples on both sides.
class Normals {
public:
    explicit Normals(const BlockScene& scene) : scene_(scene), row_(scene.world().bisection().row()) {}

    glm::dvec3 at(LatticePoint p) const {
        const BlockWorld& world = scene_.world();
        const std::int64_t last_i = world.columns() * row_ - 1, last_j = world.rows() * row_ - 1;
        const LatticePoint west{std::max<std::int64_t>(p.i - 1, 0), p.j}, east{std::min(p.i + 1, last_i), p.j},
            north{p.i, std::max<std::int64_t>(p.j - 1, 0)}, south{p.i, std::min(p.j + 1, last_j)};
        const double spacing_m = world.spacing_m();
        return glm::normalize(glm::dvec3{(z(west) - z(east)) / (static_cast<double>(east.i - west.i) * spacing_m),
                                         (z(south) - z(north)) / (static_cast<double>(south.j - north.j) * spacing_m),
                                         1});
    }

private:
    double z(LatticePoint p) const {
        const std::int64_t block = p.j / row_ * scene_.world().columns() + p.i / row_;
        return scene_.world().heights(
            static_cast<int>(block))[static_cast<std::size_t>(p.j % row_ * row_ + p.i % row_)];
    }

    const BlockScene& scene_;
    std::int64_t row_;
};

std::vector<SurfaceVertex> surface_vertices(const BlockScene& scene) {
    const Normals normals(scene);
    std::vector<SurfaceVertex> vertices(scene.world().vertex_count());
    for (std::uint32_t v = 0; v < scene.world().vertex_count(); ++v) {
        const LatticePoint p = scene.lattice_point(v);
        const glm::dvec3 normal = 32767.0 * normals.at(p);
        vertices[v] = {static_cast<std::int32_t>(p.i), static_cast<std::int32_t>(p.j), scene.height_n(v),
                       static_cast<std::int16_t>(std::lround(normal.x)),
                       static_cast<std::int16_t>(std::lround(normal.y))};
    }
    return vertices;
}

Result<std::unique_ptr<SurfaceRenderer>> make_renderer(const BlockScene& scene) {
    static_assert(BlockScene::kBytesPerSample == BlockWorld::kBytesPerSample + sizeof(SurfaceVertex) + 24 + 3);
    const Dataset& d = scene.dataset();
    SurfaceOptions options{d.lattice, d.height_offset_m, d.height_quantum_m, 0, 1};
    const std::vector<SurfaceVertex> vertices = surface_vertices(scene);
    const auto [low, high] =
        std::minmax_element(vertices.begin(), vertices.end(),
                            [](const SurfaceVertex& a, const SurfaceVertex& b) { return a.height_n < b.height_n; });
    options.low_n = static_cast<double>(low->height_n);
    options.high_n = static_cast<double>(high->height_n);
    auto renderer = SurfaceRenderer::create(options, vertices, scene.rooms());
    if (!renderer) return renderer;
    if (auto ok = (*renderer)->set_edge_field(scene.edge_field()); !ok) return ok.error();
    return renderer;
}

}  // namespace

Result<std::unique_ptr<GlContext>> BlockDisplay::make_context(const DisplayOptions& o) {
    return o.window ? create_window_context({"Scree", o.width_px, o.height_px, o.wait_for_refresh, o.visible_window})
                    : create_headless_context();
}

Result<std::unique_ptr<BlockDisplay>> BlockDisplay::create(const BlockScene& scene, const DisplayOptions& o,
                                                           std::unique_ptr<GlContext> context) {
    std::unique_ptr<BlockDisplay> display(new BlockDisplay(scene));
    if (!context) {
        auto made = make_context(o);
        if (!made) return made.error();
        context = std::move(*made);
    }
    display->context_ = std::move(context);
    display->samples_ = o.samples;
    auto renderer = make_renderer(scene);
    if (!renderer) return renderer.error();
    display->renderer_ = std::move(*renderer);
    if (auto ok = display->resize(o.width_px, o.height_px); !ok) return ok.error();
    display->settings_ = scenery(scene.dataset());
    display->warm_up();
    return display;
}

// Drivers that compile at the first draw do so now.
void BlockDisplay::warm_up() {
    Camera camera;
    camera.width_px = target_->width_px();
    camera.height_px = target_->height_px();
    const std::array<std::uint32_t, 3> triangle{0, 1, 2};
    // A version that its block never comes to: the block is sent when it is drawn.
    const std::array<SurfacePiece, 1> pieces{{{0, std::numeric_limits<std::uint32_t>::max(), triangle}}};
    FrameSettings settings = settings_;
    settings.wait_until_drawn = true;
    renderer_->draw(camera, pieces, settings, *target_);
}

Result<void> BlockDisplay::change_to(const BlockScene& scene) {
    scene_ = &scene;
    renderer_.reset();  // never the memory of two
    auto renderer = make_renderer(scene);
    if (!renderer) return renderer.error();
    renderer_ = std::move(*renderer);
    const FrameSettings fresh = scenery(scene.dataset());
    settings_.haze_distance_m = fresh.haze_distance_m;
    settings_.haze_scale_height_m = fresh.haze_scale_height_m;
    settings_.ground_height_m = fresh.ground_height_m;
    return {};
}

Result<void> BlockDisplay::resize(int width_px, int height_px) {
    auto target = RenderTarget::create({width_px, height_px, samples_});
    if (!target) return target.error();
    target_ = std::make_unique<RenderTarget>(std::move(*target));
    return {};
}

FrameTimes BlockDisplay::draw(const Camera& camera) {
    settings_.half_curvature = scene_->half_curvature();
    return renderer_->draw(camera, scene_->pieces(), settings_, *target_);
}

void BlockDisplay::show() {
    if (context_->window() == nullptr) return;
    target_->blit_to_window(target_->width_px(), target_->height_px());
    context_->swap_buffers();
}

}  // namespace scree
