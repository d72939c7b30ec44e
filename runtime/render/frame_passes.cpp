#include "runtime/render/frame_passes.h"

#include <epoxy/gl.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "runtime/render/program.h"
#include "runtime/render/shader_constants.h"

namespace scree {
namespace {

/// Haze of the sky below the horizon where the scene asks for none.
constexpr double kBackdropHaze_m = 20'000;

/// Columns that take {x, y, 1} on the screen to a view ray.
glm::mat3 ray_from_screen(const Camera& camera) {
    return {glm::vec3(camera.right() * camera.tan_half_x()), glm::vec3(camera.up * camera.tan_half_y()),
            glm::vec3(camera.forward)};
}

}  // namespace

void begin_picture(RenderTarget& target) {
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, target.framebuffer());
    glViewport(0, 0, target.width_px(), target.height_px());
    glClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
    glEnable(GL_FRAMEBUFFER_SRGB);
    glEnable(GL_DEPTH_TEST);
    glDepthMask(GL_TRUE);
    glDepthFunc(GL_GEQUAL);  // reversed: nearer is larger, and the sky at 0 passes where nothing was drawn
    glEnable(GL_CULL_FACE);
    glDisable(GL_BLEND);
    glDisable(GL_SCISSOR_TEST);
    constexpr std::array<float, 4> kMagenta{1, 0, 1, 1};
    constexpr float kInfinitelyFar = 0;
    glClearNamedFramebufferfv(target.framebuffer(), GL_COLOR, 0, kMagenta.data());
    glClearNamedFramebufferfv(target.framebuffer(), GL_DEPTH, 0, &kInfinitelyFar);
}

void set_atmosphere(std::uint32_t program, const Camera& camera, const FrameSettings& settings) {
    const double distance_m = settings.haze_distance_m > 0 ? settings.haze_distance_m : kBackdropHaze_m;
    const double scale_height_m = std::max(settings.haze_scale_height_m, 1.0);
    const double altitude_m = std::max(camera.eye.z - settings.ground_height_m, 1.0);
    glProgramUniform3fv(program, shader::kSunUniform, 1, &settings.sun_direction.x);
    glProgramUniform4f(program, shader::kHazeUniform, static_cast<float>(1 / distance_m),
                       static_cast<float>(1 / scale_height_m), static_cast<float>(altitude_m),
                       static_cast<float>(std::exp(-altitude_m / scale_height_m)));
}

void set_position(std::uint32_t program, const Camera& camera, const RelativeFrame& frame) {
    const glm::mat4 clip = clip_from_relative(camera);
    glProgramUniformMatrix4fv(program, shader::kClipFromRelativeUniform, 1, GL_FALSE, &clip[0].x);
    glProgramUniform3i(program, shader::kAnchorUniform, frame.i0, frame.j0, frame.n0);
    glProgramUniform1f(program, shader::kSpacingUniform, frame.spacing_m);
    glProgramUniform1f(program, shader::kQuantumUniform, frame.quantum_m);
    glProgramUniform3fv(program, shader::kFractionUniform, 1, &frame.fraction_m.x);
    glProgramUniform1f(program, shader::kHalfCurvatureUniform, frame.half_curvature);
}

Result<SkyPass> SkyPass::create() {
    SkyPass sky;
    auto program = build_sky_program();
    if (!program) return program.error();
    sky.program_ = std::move(*program);
    GLuint empty = 0;
    glCreateVertexArrays(1, &empty);
    sky.array_ = VertexArrayHandle(empty);
    return sky;
}

void SkyPass::draw(const Camera& camera, const FrameSettings& settings) const {
    const glm::mat3 rays = ray_from_screen(camera);
    glProgramUniformMatrix3fv(program_.name(), shader::kRayFromScreenUniform, 1, GL_FALSE, &rays[0].x);
    set_atmosphere(program_.name(), camera, settings);
    glUseProgram(program_.name());
    glBindVertexArray(array_.name());
    glDrawArrays(GL_TRIANGLES, 0, 3);
}

Result<void> EdgePass::set_field(std::shared_ptr<const EdgeField> field) {
    field_ = std::move(field);
    texture_ = {};
    if (!field_) return {};
    GLuint name = 0;
    glCreateTextures(GL_TEXTURE_2D, 1, &name);
    texture_ = TextureHandle(name);
    const auto columns = static_cast<GLsizei>(field_->shape().columns),
               rows = static_cast<GLsizei>(field_->shape().rows);
    glTextureStorage2D(name, 1, GL_R8, columns, rows);
    for (const GLenum wrap : {GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T}) glTextureParameteri(name, wrap, GL_CLAMP_TO_EDGE);
    for (const GLenum filter : {GL_TEXTURE_MIN_FILTER, GL_TEXTURE_MAG_FILTER})
        glTextureParameteri(name, filter, GL_LINEAR);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
    glTextureSubImage2D(name, 0, 0, 0, columns, rows, GL_RED, GL_UNSIGNED_BYTE, field_->values().data());
    glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
    if (glGetError() == GL_NO_ERROR) return {};
    field_.reset();
    texture_ = {};
    return Error{ErrorCode::display,
                 fmt::format("OpenGL has no texture of {} x {} for the ground's ends", columns, rows)};
}

const EdgeField* EdgePass::field_for(const FrameSettings& settings) const {
    return settings.soft_edge && !settings.wireframe && !settings.magenta_background ? field_.get() : nullptr;
}

void EdgePass::begin(const Camera& camera, const RelativeFrame& frame, const Lattice& lattice,
                     const FrameSettings& settings) const {
    const GLuint program = program_.name();
    set_position(program, camera, frame);
    set_atmosphere(program, camera, settings);
    const EdgeField::Shape& shape = field_->shape();
    const double cell_m = shape.cell_side * lattice.spacing_m;
    const double per_m_x = 1 / (cell_m * static_cast<double>(shape.columns)),
                 per_m_y = 1 / (cell_m * static_cast<double>(shape.rows));
    glProgramUniform4f(program, shader::kEdgeFieldUniform, static_cast<float>(per_m_x), static_cast<float>(-per_m_y),
                       static_cast<float>((camera.eye.x - lattice.x_m(0)) * per_m_x),
                       static_cast<float>((lattice.y_m(0) - camera.eye.y) * per_m_y));
    glUseProgram(program);
    glBindTextureUnit(shader::kEdgeFieldUnit, texture_.name());
    glEnable(GL_BLEND);
    glBlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
    glDepthMask(GL_FALSE);
    glDepthFunc(GL_EQUAL);  // what was cut out of the ground is not drawn over either
}

void EdgePass::end() {
    glDisable(GL_BLEND);
    glDepthMask(GL_TRUE);
    glDepthFunc(GL_GEQUAL);
}

}  // namespace scree
