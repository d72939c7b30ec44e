// What every picture has, whatever its ground is made of: a cleared target, uniforms of the camera and the air, the
// sky. OpenGL thread only.
#pragma once

#include <cstdint>

#include "common/lattice.h"
#include "common/result.h"
#include "runtime/render/gl_handle.h"
#include "runtime/render/render_target.h"
#include "runtime/render/renderer.h"
#include "runtime/view/camera.h"
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

/// Dissolves the data's ends into what is behind them: the tiles there, once more, after the sky.
class EdgePass {
public:
    /// Errors (ErrorCode::display): the shader does not compile.
    static Result<EdgePass> create(int tile_cells_log2);
    /// State and uniforms for drawing tiles again; then end().
    void begin(const Camera& camera, const RelativeFrame& frame, const Lattice& lattice,
               const FrameSettings& settings) const;
    static void end();

private:
    ProgramHandle program_;
};

}  // namespace scree
