// What every picture has, whatever its ground is made of: a cleared target, uniforms of the camera and the air, the
// sky. OpenGL thread only.
#pragma once

#include <cstdint>
#include <memory>
#include <utility>

#include "common/lattice.h"
#include "common/result.h"
#include "runtime/render/gl_handle.h"
#include "runtime/render/render_target.h"
#include "runtime/render/renderer.h"
#include "runtime/view/camera.h"
#include "runtime/view/edge_field.h"
#include "runtime/view/relative_frame.h"

namespace scree {

/// Binds the target, clears it to magenta and infinity, and sets the state that ground and sky are drawn with.
void begin_picture(RenderTarget& target);

/// Uniforms of atmosphere.glsl.
void set_atmosphere(std::uint32_t program, const Camera& camera, const FrameSettings& settings);
/// Uniforms of terrain_position.glsl.
void set_position(std::uint32_t program, const Camera& camera, const RelativeFrame& frame);

/// Fills what no ground was drawn on: after the ground.
class SkyPass {
public:
    /// Errors (ErrorCode::display): the shader does not compile.
    static Result<SkyPass> create();
    void draw(const Camera& camera, const FrameSettings& settings) const;

private:
    ProgramHandle program_;
    VertexArrayHandle array_;  ///< no attributes
};

/// Dissolves the ground's ends into what is behind them: what is drawn there, once more, after the sky.
class EdgePass {
public:
    EdgePass() = default;
    /// `program`: of build_edge_program() or build_surface_edge_program().
    explicit EdgePass(ProgramHandle program) : program_(std::move(program)) {}

    /// Where the ground ends, from now on; null: nowhere. Errors (ErrorCode::display): OpenGL has no memory for it.
    Result<void> set_field(std::shared_ptr<const EdgeField> field);
    /// What the pass goes by in a frame of these settings; null: it is not drawn.
    const EdgeField* field_for(const FrameSettings& settings) const;
    /// State and uniforms for drawing again; then end().
    void begin(const Camera& camera, const RelativeFrame& frame, const Lattice& lattice,
               const FrameSettings& settings) const;
    static void end();

private:
    ProgramHandle program_;
    std::shared_ptr<const EdgeField> field_;
    TextureHandle texture_;
};

}  // namespace scree
