// SurfaceRenderer: draws triangles between fixed lattice vertices, untextured (tinted by height and slope), and the
// sky. Which triangles may change with every frame; those of a piece stay in the index buffer until they do. Nothing is
// paged. OpenGL thread only, like Renderer.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "common/lattice.h"
#include "common/result.h"
#include "runtime/lod/surface_piece.h"
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
    /// `rooms`: by place, the most indices that a piece may have; all of it is taken at once. Needs a current
    /// GlContext. Errors (ErrorCode::display): no memory for the vertices and indices, a shader does not compile.
    static Result<std::unique_ptr<SurfaceRenderer>> create(const SurfaceOptions& options,
                                                           std::span<const SurfaceVertex> vertices,
                                                           std::span<const std::uint32_t> rooms);
    ~SurfaceRenderer();
    SurfaceRenderer(const SurfaceRenderer&) = delete;
    SurfaceRenderer& operator=(const SurfaceRenderer&) = delete;

    /// As Renderer's.
    Result<void> set_edge_field(std::shared_ptr<const EdgeField> field);

    /// Clears `target`, draws the triangles of all pieces (no place twice; vertex numbers are not checked) and the sky.
    /// Sends what is not there in its version yet: FrameTimes::uploaded_bytes. The camera's size is the target's. Of
    /// the settings, there are no levels to colour by.
    FrameTimes draw(const Camera& camera, std::span<const SurfacePiece> pieces, const FrameSettings& settings,
                    RenderTarget& target);

private:
    struct State;
    explicit SurfaceRenderer(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace scree
