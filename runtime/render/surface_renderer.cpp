#include "runtime/render/surface_renderer.h"

#include <epoxy/gl.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <utility>

#include "common/tint/hypsometry.h"
#include "runtime/render/frame_passes.h"
#include "runtime/render/gl_handle.h"
#include "runtime/render/program.h"
#include "runtime/render/shader_constants.h"
#include "runtime/view/relative_frame.h"

namespace scree {
namespace {

using Clock = std::chrono::steady_clock;

double ms_since(Clock::time_point start) {
    return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

BufferHandle make_buffer() {
    GLuint name = 0;
    glCreateBuffers(1, &name);
    return BufferHandle(name);
}

VertexArrayHandle make_vertex_array(GLuint vertices, GLuint indices) {
    GLuint name = 0;
    glCreateVertexArrays(1, &name);
    const auto location = [name](int attribute) {
        const auto index = static_cast<GLuint>(attribute);
        glEnableVertexArrayAttrib(name, index);
        glVertexArrayAttribBinding(name, index, 0);
        return index;
    };
    glVertexArrayAttribIFormat(name, location(shader::kSurfaceLatticeAttribute), 2, GL_INT, offsetof(SurfaceVertex, i));
    glVertexArrayAttribFormat(name, location(shader::kSurfaceHeightAttribute), 1, GL_FLOAT, GL_FALSE,
                              offsetof(SurfaceVertex, height_n));
    glVertexArrayAttribFormat(name, location(shader::kSurfaceNormalAttribute), 2, GL_SHORT, GL_TRUE,
                              offsetof(SurfaceVertex, normal_east));
    glVertexArrayVertexBuffer(name, 0, vertices, 0, sizeof(SurfaceVertex));
    glVertexArrayElementBuffer(name, indices);
    return VertexArrayHandle(name);
}

float light_of(double srgb) {
    const double c = srgb / 255;
    return static_cast<float>(c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4));
}

std::array<glm::vec3, shader::kTintColours> tints_of(const SurfaceOptions& o) {
    const double low_m = o.height_offset_m + o.low_n * o.height_quantum_m,
                 high_m = o.height_offset_m + o.high_n * o.height_quantum_m;
    const Hypsometry colours(low_m, high_m);
    std::array<glm::vec3, shader::kTintColours> tints;
    for (std::size_t k = 0; k < tints.size(); ++k) {
        const TintColour c =
            colours.at(low_m + (high_m - low_m) * static_cast<double>(k) / (static_cast<double>(tints.size()) - 1));
        tints[k] = {light_of(c.r), light_of(c.g), light_of(c.b)};
    }
    return tints;
}

}  // namespace

struct SurfaceRenderer::State {
    SurfaceOptions options;
    BufferHandle vertices, indices;
    std::size_t index_bytes = 0;  ///< of the buffer
    VertexArrayHandle array;
    std::array<ProgramHandle, 2> ground;  ///< without haze and with it
    SkyPass sky;
    EdgePass edge;
    std::array<glm::vec3, shader::kTintColours> tints;

    /// Returns how many.
    Result<std::size_t> upload(std::span<const std::span<const std::uint32_t>> pieces);
    void draw_ground(const Camera& camera, const FrameSettings& settings, std::size_t count) const;
    void draw_edge(const Camera& camera, const FrameSettings& settings, std::size_t first, std::size_t count) const;
};

// Whole, every frame: the driver keeps what frames under way still read.
Result<std::size_t> SurfaceRenderer::State::upload(std::span<const std::span<const std::uint32_t>> pieces) {
    std::size_t count = 0;
    for (const auto& piece : pieces) count += piece.size();
    if (count == 0) return count;
    const std::size_t bytes = count * sizeof(std::uint32_t);
    if (bytes > index_bytes) {
        index_bytes = bytes + bytes / 4;
        glNamedBufferData(indices.name(), static_cast<GLsizeiptr>(index_bytes), nullptr, GL_STREAM_DRAW);
    }
    auto* at = static_cast<std::byte*>(glMapNamedBufferRange(indices.name(), 0, static_cast<GLsizeiptr>(bytes),
                                                             GL_MAP_WRITE_BIT | GL_MAP_INVALIDATE_BUFFER_BIT));
    if (at == nullptr) {
        index_bytes = 0;
        return Error{ErrorCode::display, fmt::format("OpenGL cannot map {} bytes for a frame's triangles", bytes)};
    }
    for (const auto& piece : pieces) {
        if (piece.empty()) continue;
        std::memcpy(at, piece.data(), piece.size_bytes());
        at += piece.size_bytes();
    }
    if (glUnmapNamedBuffer(indices.name()) != GL_TRUE)
        return Error{ErrorCode::display, "OpenGL lost the triangles of a frame"};
    return count;
}

void SurfaceRenderer::State::draw_ground(const Camera& camera, const FrameSettings& settings, std::size_t count) const {
    if (count == 0) return;
    const GLuint program = ground[settings.haze_distance_m > 0 ? 1 : 0].name();
    set_position(
        program, camera,
        make_relative_frame(options.lattice, options.height_offset_m, options.height_quantum_m, camera.eye, 0));
    set_atmosphere(program, camera, settings);
    const double span_n = std::max(options.high_n - options.low_n, 1.0);
    glProgramUniform3fv(program, shader::kTintColoursUniform, shader::kTintColours, &tints[0].x);
    glProgramUniform2f(program, shader::kTintUniform, static_cast<float>(1 / span_n),
                       static_cast<float>(-options.low_n / span_n));
    glUseProgram(program);
    glBindVertexArray(array.name());
    glPolygonMode(GL_FRONT_AND_BACK, settings.wireframe ? GL_LINE : GL_FILL);
    glDrawElements(GL_TRIANGLES, static_cast<GLsizei>(count), GL_UNSIGNED_INT, nullptr);
    glPolygonMode(GL_FRONT_AND_BACK, GL_FILL);
}

// Indices `first` to `count`, once more.
void SurfaceRenderer::State::draw_edge(const Camera& camera, const FrameSettings& settings, std::size_t first,
                                       std::size_t count) const {
    if (first == count || edge.field_for(settings) == nullptr) return;
    edge.begin(camera,
               make_relative_frame(options.lattice, options.height_offset_m, options.height_quantum_m, camera.eye, 0),
               options.lattice, settings);
    glBindVertexArray(array.name());
    glDrawElements(GL_TRIANGLES, static_cast<GLsizei>(count - first), GL_UNSIGNED_INT,
                   reinterpret_cast<const void*>(first * sizeof(std::uint32_t)));
    EdgePass::end();
}

SurfaceRenderer::SurfaceRenderer(std::unique_ptr<State> state) : state_(std::move(state)) {}
SurfaceRenderer::~SurfaceRenderer() = default;

Result<std::unique_ptr<SurfaceRenderer>> SurfaceRenderer::create(const SurfaceOptions& options,
                                                                 std::span<const SurfaceVertex> vertices) {
    assert(!vertices.empty());
    auto state = std::make_unique<State>();
    state->options = options;
    state->tints = tints_of(options);
    for (const bool with_haze : {false, true}) {
        auto program = build_surface_program(with_haze);
        if (!program) return program.error();
        state->ground[with_haze ? 1 : 0] = std::move(*program);
    }
    auto sky = SkyPass::create();
    if (!sky) return sky.error();
    state->sky = std::move(*sky);
    auto edge = build_surface_edge_program();
    if (!edge) return edge.error();
    state->edge = EdgePass(std::move(*edge));
    state->vertices = make_buffer();
    state->indices = make_buffer();
    glNamedBufferStorage(state->vertices.name(), static_cast<GLsizeiptr>(vertices.size_bytes()), vertices.data(), 0);
    state->array = make_vertex_array(state->vertices.name(), state->indices.name());
    if (glGetError() != GL_NO_ERROR)
        return Error{ErrorCode::display,
                     fmt::format("OpenGL has no memory for {} bytes of vertices", vertices.size_bytes())};
    return std::unique_ptr<SurfaceRenderer>(new SurfaceRenderer(std::move(state)));
}

Result<void> SurfaceRenderer::set_edge_field(std::shared_ptr<const EdgeField> field) {
    return state_->edge.set_field(std::move(field));
}

Result<FrameTimes> SurfaceRenderer::draw(const Camera& camera, std::span<const std::span<const std::uint32_t>> pieces,
                                         std::size_t at_end, const FrameSettings& settings, RenderTarget& target) {
    assert(at_end <= pieces.size());
    assert(camera.width_px == target.width_px() && camera.height_px == target.height_px());
    const Clock::time_point start = Clock::now();
    auto count = state_->upload(pieces);
    if (!count) return count.error();
    begin_picture(target);
    state_->draw_ground(camera, settings, *count);
    if (!settings.magenta_background) {
        state_->sky.draw(camera, settings);
        std::size_t first = *count;
        for (const auto& piece : pieces.last(at_end)) first -= piece.size();
        state_->draw_edge(camera, settings, first, *count);
    }
    FrameTimes times;
    times.draws = *count > 0 ? 1 : 0;
    times.triangles = *count / 3;
    times.submitted_ms = ms_since(start);
    if (settings.wait_until_drawn) {
        glFinish();
        times.finished_ms = ms_since(start);
    }
    return times;
}

}  // namespace scree
