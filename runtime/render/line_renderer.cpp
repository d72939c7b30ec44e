#include "runtime/render/line_renderer.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "runtime/render/gl_handle.h"
#include "runtime/render/program.h"
#include "runtime/render/shader_constants.h"

namespace scree {
namespace {

/// Lines on the ground are drawn so much nearer, or they would flicker with it.
constexpr double kPull = 1.0 / 2048;

/// As line.vert reads it.
struct PictureLine {
    std::array<float, 4> ends_px{};
    std::array<float, 2> depths{};
    std::array<std::uint8_t, 4> rgba{};
};
static_assert(sizeof(PictureLine) == 28);

/// Keeps the part of a segment {share of its first end, of its last} where a function that is linear along it and is
/// `at_from` and `at_to` at its ends is not negative.
void clip(double at_from, double at_to, double& first, double& last) {
    if (at_from < 0 && at_to < 0) {
        last = -1;
    } else if (at_from < 0) {
        first = std::max(first, at_from / (at_from - at_to));
    } else if (at_to < 0) {
        last = std::min(last, at_from / (at_from - at_to));
    }
}

class Projection {
public:
    Projection(const Camera& camera, double reach_px)
        : camera_(camera),
          right_(camera.right() / camera.tan_half_x()),
          up_(camera.up / camera.tan_half_y()),
          margin_{1 + 2 * reach_px / camera.width_px, 1 + 2 * reach_px / camera.height_px} {}

    /// What of it lies before the near plane and within the picture, or just beside it.
    std::optional<PictureLine> picture_of(const LineSegment& line) const {
        const glm::dvec3 a = seen(line.from), b = seen(line.to);
        double first = 0, last = 1;
        clip(a.z - camera_.near_m, b.z - camera_.near_m, first, last);
        for (int axis = 0; axis < 2; ++axis)
            for (const double side : {-1.0, 1.0})
                clip(margin_[axis] * a.z + side * a[axis], margin_[axis] * b.z + side * b[axis], first, last);
        // Not finite: false.
        if (!(first <= last)) return std::nullopt;
        PictureLine out;
        out.rgba = line.rgba;
        put(glm::mix(a, b, first), out, 0);
        put(glm::mix(a, b, last), out, 1);
        for (const float x : out.ends_px)
            if (!std::isfinite(x)) return std::nullopt;
        return out;
    }

private:
    /// Across, up and forward; the picture's sides lie where across or up are as much as forward.
    glm::dvec3 seen(glm::dvec3 p) const {
        const glm::dvec3 relative = p - camera_.eye;
        return {glm::dot(relative, right_), glm::dot(relative, up_), glm::dot(relative, camera_.forward)};
    }
    void put(glm::dvec3 p, PictureLine& out, std::size_t end) const {
        const double forward_m = std::max(p.z, camera_.near_m);  // clipped there: rounding
        out.ends_px[2 * end] = static_cast<float>((p.x / forward_m + 1) / 2 * camera_.width_px);
        out.ends_px[2 * end + 1] = static_cast<float>((p.y / forward_m + 1) / 2 * camera_.height_px);
        out.depths[end] = static_cast<float>(std::min(camera_.near_m / forward_m * (1 + kPull), 1.0));
    }

    const Camera& camera_;
    glm::dvec3 right_, up_;
    glm::dvec2 margin_;
};

VertexArrayHandle make_vertex_array(GLuint buffer) {
    GLuint name = 0;
    glCreateVertexArrays(1, &name);
    const auto place = [name](int location, GLint count, GLenum type, std::size_t offset) {
        const auto index = static_cast<GLuint>(location);
        glEnableVertexArrayAttrib(name, index);
        glVertexArrayAttribBinding(name, index, 0);
        glVertexArrayAttribFormat(name, index, count, type, type == GL_UNSIGNED_BYTE ? GL_TRUE : GL_FALSE,
                                  static_cast<GLuint>(offset));
    };
    place(shader::kLineEndsAttribute, 4, GL_FLOAT, offsetof(PictureLine, ends_px));
    place(shader::kLineDepthsAttribute, 2, GL_FLOAT, offsetof(PictureLine, depths));
    place(shader::kLineColourAttribute, 4, GL_UNSIGNED_BYTE, offsetof(PictureLine, rgba));
    glVertexArrayBindingDivisor(name, 0, 1);
    glVertexArrayVertexBuffer(name, 0, buffer, 0, sizeof(PictureLine));
    return VertexArrayHandle(name);
}

void begin_overlay(RenderTarget& target) {
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, target.framebuffer());
    glViewport(0, 0, target.width_px(), target.height_px());
    glClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
    glEnable(GL_FRAMEBUFFER_SRGB);  // mixes light, not sRGB numbers
    glEnable(GL_DEPTH_TEST);
    glDepthMask(GL_FALSE);
    glDisable(GL_CULL_FACE);
    glEnable(GL_BLEND);
    glBlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
}

/// As Renderer wants to find it.
void end_overlay() {
    glDisable(GL_BLEND);
    glDepthMask(GL_TRUE);
    glDepthFunc(GL_GEQUAL);
    glEnable(GL_CULL_FACE);
}

}  // namespace

struct LineRenderer::State {
    ProgramHandle program;
    BufferHandle buffer;
    VertexArrayHandle array;
    std::vector<PictureLine> shown;

    void draw(const RenderTarget& target, double width_px, double opacity, GLenum depth_test) const {
        glProgramUniform4f(program.name(), shader::kLineUniform, static_cast<float>(target.width_px()),
                           static_cast<float>(target.height_px()), static_cast<float>(width_px / 2),
                           static_cast<float>(opacity));
        glDepthFunc(depth_test);
        glDrawArraysInstanced(GL_TRIANGLE_STRIP, 0, 4, static_cast<GLsizei>(shown.size()));
    }
};

LineRenderer::LineRenderer(std::unique_ptr<State> state) : state_(std::move(state)) {}
LineRenderer::~LineRenderer() = default;

Result<std::unique_ptr<LineRenderer>> LineRenderer::create() {
    auto state = std::make_unique<State>();
    auto program = build_line_program();
    if (!program) return program.error();
    state->program = std::move(*program);
    GLuint name = 0;
    glCreateBuffers(1, &name);
    state->buffer = BufferHandle(name);
    state->array = make_vertex_array(name);
    return std::unique_ptr<LineRenderer>(new LineRenderer(std::move(state)));
}

void LineRenderer::draw(const Camera& camera, std::span<const LineSegment> lines, double width_px, double hidden_share,
                        RenderTarget& target) {
    assert(camera.width_px == target.width_px() && camera.height_px == target.height_px());
    state_->shown.clear();
    const Projection projection(camera, width_px / 2 + 2);
    for (const LineSegment& line : lines)
        if (const auto shown = projection.picture_of(line)) state_->shown.push_back(*shown);
    if (state_->shown.empty()) return;
    // A new store for every draw: the driver keeps what frames under way still read.
    glNamedBufferData(state_->buffer.name(), static_cast<GLsizeiptr>(state_->shown.size() * sizeof(PictureLine)),
                      state_->shown.data(), GL_STREAM_DRAW);
    begin_overlay(target);
    glUseProgram(state_->program.name());
    glBindVertexArray(state_->array.name());
    state_->draw(target, width_px, 1, GL_GEQUAL);
    if (hidden_share > 0) state_->draw(target, width_px, hidden_share, GL_LESS);
    end_overlay();
}

}  // namespace scree
