// Renderer: draws a list of tiles and the sky as a camera sees them. Owns the arenas; slots are numbers that others
// deal out. OpenGL thread only: created, used and destroyed there, under one current context. A steady frame allocates
// nothing.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include <glm/glm.hpp>

#include "common/lattice.h"
#include "common/mesh/vertex_slot.h"
#include "common/result.h"
#include "runtime/lod/draw_list.h"
#include "runtime/render/highlight.h"
#include "runtime/render/render_target.h"
#include "runtime/render/texture_arena.h"
#include "runtime/view/camera.h"
#include "runtime/view/edge_field.h"

namespace scree {

struct RendererOptions {
    Lattice lattice;  ///< checked
    double height_offset_m = 0;
    double height_quantum_m = 1;
    int texture_size_log2 = 8;
    /// Slots are the memory: renderer_bytes() says how much. Fewer: coarser pictures under the same budget rule; all of
    /// it is taken at once.
    int height_slots = 1;
    int texture_slots = 1;
    /// Capacity of the frames' MeshPool, 0 without one: mesh_arena_bytes() says what it takes.
    std::size_t mesh_indices = 0;
    /// Items a frame at most. Each may be two draws, of 124 bytes each, and two more at the data's ends, of 20 bytes,
    /// three times.
    int max_draws = 4096;
    /// 1: off; up to 16: sharper imagery at grazing angles. Software OpenGL has one step of it, which doubles to
    /// triples a frame (docs/numbers.md).
    double anisotropy = 1;
    /// Textures in one array at most, 1 to kMaxArrayLayers: fewer make more arrays, for tests.
    int max_array_layers = kMaxArrayLayers;
};

/// Bytes the arenas will take of a memory budget.
std::size_t renderer_bytes(const RendererOptions& options);

struct FrameSettings {
    /// Towards the sun, unit length. Lights the sky only: imagery brings its own light.
    glm::vec3 sun_direction{-0.574f, -0.574f, 0.584f};
    /// Level distance at which haze takes 63 % of what is behind it, for an eye on the ground plane. Smaller: more
    /// depth to the picture, less to see. 0: none (the sky below the horizon keeps some).
    double haze_distance_m = 0;
    /// Height over the ground plane at which haze is 1/e as thick. Larger: views from above pale as well.
    double haze_scale_height_m = 2500;
    /// Height (z) of the plane that stands in for the world beyond the data.
    double ground_height_m = 0;
    /// The ground's ends dissolve into what is behind, where the renderer was given an EdgeField; false: they are cut.
    /// Costs the drawing of sky on them. Not with wireframe or magenta_background.
    bool soft_edge = true;
    /// 1 / (2 R) of the earth's curvature, 1/m; 0: flat.
    double half_curvature = 0;
    /// For finding faults.
    bool wireframe = false;
    Highlight highlight = Highlight::none;
    double highlight_full_px = 1;     ///< Highlight::error: DrawItem::bound_px of the ramp's far end
    bool magenta_background = false;  ///< pure (255, 0, 255) in place of the sky: what shows it was not drawn on
    /// Wait for the end of drawing and fill FrameTimes::finished_ms. Stops CPU and GPU from overlapping.
    bool wait_until_drawn = false;
};

struct FrameTimes {
    std::uint32_t draws = 0;
    std::uint32_t blended_draws = 0;  ///< those that look at several textures: fading in, or filtered over a border
    std::uint32_t multi_draws = 0;
    std::uint32_t edge_draws = 0;     ///< parts of tiles drawn again where the data ends
    std::uint32_t imagery_kinds = 0;  ///< bits: the Imagery of the draws, a program each
    std::uint64_t triangles = 0;
    std::uint64_t uploaded_bytes = 0;  ///< SurfaceRenderer: indices sent in this frame
    double submitted_ms = 0;  ///< wall time of draw() without waiting
    double finished_ms = 0;   ///< wall time with waiting; 0 without wait_until_drawn
};

class Renderer {
public:
    /// Needs a current GlContext. Errors (ErrorCode::display): no memory for the arenas, a shader does not compile.
    static Result<std::unique_ptr<Renderer>> create(const RendererOptions& options);
    ~Renderer();
    Renderer(const Renderer&) = delete;
    Renderer& operator=(const Renderer&) = delete;

    /// See VertexArena::upload and TextureArena::upload; slots and sizes that do not fit assert.
    void upload_height(int slot, std::span<const SlotVertex> vertices);
    void upload_texture(int slot, std::span<const std::uint8_t> chain);
    /// Indices of the MeshPool from `first` on, within mesh_indices: whatever MeshPool::written_since() tells, before
    /// the meshes are drawn. What was drawn before keeps the old ones.
    void upload_mesh(std::uint32_t first, std::span<const std::uint32_t> indices);

    /// Where the ground ends, from now on; null (at first): nowhere that would be known. Its raster is of the
    /// renderer's lattice. Errors (ErrorCode::display): OpenGL has no memory for it; then as with null.
    Result<void> set_edge_field(std::shared_ptr<const EdgeField> field);

    /// Takes state that it does not set (masks, stencil, polygon offset) for OpenGL's initial one.
    /// Clears `target`, draws `items` (slots uploaded before; at most max_draws) and the sky. The camera's size is the
    /// target's.
    FrameTimes draw(const Camera& camera, std::span<const DrawItem> items, const FrameSettings& settings,
                    RenderTarget& target);

    /// Draws into `target` once with every program that frames of these settings may need; returns how many. Drivers
    /// that compile at the first draw (software OpenGL: up to half a second, unless it kept the result of an earlier
    /// run) then do so now and not in mid-flight. What it draws means nothing.
    std::uint32_t warm_up(const FrameSettings& settings, RenderTarget& target);

    /// Puts the state of the context that draw() and RenderTarget's readings and blits change back to OpenGL's initial
    /// one, for programs that draw things of their own; the viewport and what texture units hold excepted.
    static void reset_state();

private:
    struct State;
    explicit Renderer(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace scree
