// SurfaceRenderer: draws triangles between fixed lattice vertices, untextured (tinted by height and slope), and the
// sky. Which triangles may change with every frame; nothing is paged. OpenGL thread only, like Renderer.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "common/lattice.h"
#include "common/result.h"
#include "runtime/render/render_target.h"
#include "runtime/render/renderer.h"
#include "runtime/view/camera.h"

namespace scree {

struct SurfaceVertex {
    std::int32_t i = 0, j = 0;  ///< on the lattice
    float height_n = 0;         ///< quanta
    /// East and north parts of the unit normal, of 32767.
    std::int16_t normal_east = 0, normal_north = 0;
};
static_assert(sizeof(SurfaceVertex) == 16);

struct SurfaceOptions {
    Lattice lattice;  ///< checked
    double height_offset_m = 0;
    double height_quantum_m = 1;
    double low_n = 0, high_n = 1;  ///< quanta that the tints go from and to
};

class SurfaceRenderer {
public:
    /// Needs a current GlContext. Errors (ErrorCode::display): no memory for the vertices, a shader does not compile.
    static Result<std::unique_ptr<SurfaceRenderer>> create(const SurfaceOptions& options,
                                                           std::span<const SurfaceVertex> vertices);
    ~SurfaceRenderer();
    SurfaceRenderer(const SurfaceRenderer&) = delete;
    SurfaceRenderer& operator=(const SurfaceRenderer&) = delete;

    /// As Renderer's.
    Result<void> set_edge_field(std::shared_ptr<const EdgeField> field);

    /// Clears `target`, draws the triangles of all pieces (three vertex numbers each, counter-clockwise from above; not
    /// checked) and the sky. The last `at_end` pieces are all that reach into the EdgeField's band. The camera's size
    /// is the target's. Of the settings, there are no levels to colour by, and the world is flat. Errors
    /// (ErrorCode::display): no memory for the triangles.
    Result<FrameTimes> draw(const Camera& camera, std::span<const std::span<const std::uint32_t>> pieces,
                            std::size_t at_end, const FrameSettings& settings, RenderTarget& target);

private:
    struct State;
    explicit SurfaceRenderer(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace scree
