#include "runtime/render/surface_renderer.h"

#include <epoxy/gl.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>
#include <vector>

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
    VertexArrayHandle array;
    std::array<ProgramHandle, 2> ground;  ///< without haze and with it
    SkyPass sky;
    EdgePass edge;
    std::array<glm::vec3, shader::kTintColours> tints;

    std::vector<std::size_t> first_of;        ///< index, by place, and the end
    std::vector<std::uint32_t> version_sent;  ///< by place; 0: nothing
    // A frame's draws: of pieces that stand together one.
    struct Draws {
        std::vector<GLsizei> counts;
        std::vector<const void*> offsets;
    };
    Draws all, at_end;

    /// Returns the bytes sent.
    std::uint64_t upload(std::span<const SurfacePiece> pieces);
    template <class Belongs>
    void gather(std::span<const SurfacePiece> pieces, const Belongs& belongs, Draws& draws) const;
    RelativeFrame frame_of(const Camera& camera, const FrameSettings& settings) const;
    void draw(const Draws& draws) const;
    void draw_ground(const Camera& camera, const FrameSettings& settings) const;
    void draw_edge(const Camera& camera, const FrameSettings& settings) const;
};

std::uint64_t SurfaceRenderer::State::upload(std::span<const SurfacePiece> pieces) {
    std::uint64_t sent = 0;
    for (const SurfacePiece& piece : pieces) {
        assert(piece.version != 0 && piece.indices.size() <= first_of[piece.place + 1] - first_of[piece.place]);
        if (version_sent[piece.place] == piece.version) continue;
        version_sent[piece.place] = piece.version;
        if (piece.indices.empty()) continue;
        glNamedBufferSubData(indices.name(), static_cast<GLintptr>(first_of[piece.place] * sizeof(std::uint32_t)),
                             static_cast<GLsizeiptr>(piece.indices.size_bytes()), piece.indices.data());
        sent += piece.indices.size_bytes();
    }
    return sent;
}

template <class Belongs>
void SurfaceRenderer::State::gather(std::span<const SurfacePiece> pieces, const Belongs& belongs, Draws& draws) const {
    draws.counts.clear();
    draws.offsets.clear();
    std::size_t end = std::numeric_limits<std::size_t>::max();
    for (const SurfacePiece& piece : pieces) {
        if (piece.indices.empty() || !belongs(piece)) continue;
        const std::size_t first = first_of[piece.place];
        if (first == end) {
            draws.counts.back() += static_cast<GLsizei>(piece.indices.size());
        } else {
            draws.counts.push_back(static_cast<GLsizei>(piece.indices.size()));
            draws.offsets.push_back(reinterpret_cast<const void*>(first * sizeof(std::uint32_t)));
        }
        end = first + piece.indices.size();
    }
}

RelativeFrame SurfaceRenderer::State::frame_of(const Camera& camera, const FrameSettings& settings) const {
    return make_relative_frame(options.lattice, options.height_offset_m, options.height_quantum_m, camera.eye,
                               settings.half_curvature);
}

void SurfaceRenderer::State::draw(const Draws& draws) const {
    glBindVertexArray(array.name());
    glMultiDrawElements(GL_TRIANGLES, draws.counts.data(), GL_UNSIGNED_INT, draws.offsets.data(),
                        static_cast<GLsizei>(draws.counts.size()));
}

void SurfaceRenderer::State::draw_ground(const Camera& camera, const FrameSettings& settings) const {
    if (all.counts.empty()) return;
    const GLuint program = ground[settings.haze_distance_m > 0 ? 1 : 0].name();
    set_position(program, camera, frame_of(camera, settings));
    set_atmosphere(program, camera, settings);
    const double span_n = std::max(options.high_n - options.low_n, 1.0);
    glProgramUniform3fv(program, shader::kTintColoursUniform, shader::kTintColours, &tints[0].x);
    glProgramUniform2f(program, shader::kTintUniform, static_cast<float>(1 / span_n),
                       static_cast<float>(-options.low_n / span_n));
    glUseProgram(program);
    glPolygonMode(GL_FRONT_AND_BACK, settings.wireframe ? GL_LINE : GL_FILL);
    draw(all);
    glPolygonMode(GL_FRONT_AND_BACK, GL_FILL);
}

// Once more, over the sky.
void SurfaceRenderer::State::draw_edge(const Camera& camera, const FrameSettings& settings) const {
    if (at_end.counts.empty() || edge.field_for(settings) == nullptr) return;
    edge.begin(camera, frame_of(camera, settings), options.lattice, settings);
    draw(at_end);
    EdgePass::end();
}

SurfaceRenderer::SurfaceRenderer(std::unique_ptr<State> state) : state_(std::move(state)) {}
SurfaceRenderer::~SurfaceRenderer() = default;

Result<std::unique_ptr<SurfaceRenderer>> SurfaceRenderer::create(const SurfaceOptions& options,
                                                                 std::span<const SurfaceVertex> vertices,
                                                                 std::span<const std::uint32_t> rooms) {
    assert(!vertices.empty() && !rooms.empty());
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
    state->version_sent.resize(rooms.size());
    state->first_of.assign(1, 0);
    for (const std::uint32_t room : rooms) state->first_of.push_back(state->first_of.back() + room);
    const std::size_t index_bytes = state->first_of.back() * sizeof(std::uint32_t);
    glNamedBufferStorage(state->indices.name(), static_cast<GLsizeiptr>(index_bytes), nullptr, GL_DYNAMIC_STORAGE_BIT);
    state->array = make_vertex_array(state->vertices.name(), state->indices.name());
    if (glGetError() != GL_NO_ERROR)
        return Error{ErrorCode::display, fmt::format("OpenGL has no memory for {} bytes of vertices and {} of indices",
                                                     vertices.size_bytes(), index_bytes)};
    return std::unique_ptr<SurfaceRenderer>(new SurfaceRenderer(std::move(state)));
}

Result<void> SurfaceRenderer::set_edge_field(std::shared_ptr<const EdgeField> field) {
    return state_->edge.set_field(std::move(field));
}

FrameTimes SurfaceRenderer::draw(const Camera& camera, std::span<const SurfacePiece> pieces,
                                 const FrameSettings& settings, RenderTarget& target) {
    assert(camera.width_px == target.width_px() && camera.height_px == target.height_px());
    const Clock::time_point start = Clock::now();
    FrameTimes times;
    times.uploaded_bytes = state_->upload(pieces);
    state_->gather(
        pieces, [](const SurfacePiece&) { return true; }, state_->all);
    state_->gather(
        pieces, [](const SurfacePiece& piece) { return piece.at_end; }, state_->at_end);
    begin_picture(target);
    state_->draw_ground(camera, settings);
    if (!settings.magenta_background) {
        state_->sky.draw(camera, settings);
        state_->draw_edge(camera, settings);
    }
    times.draws = static_cast<std::uint32_t>(state_->all.counts.size());
    for (const GLsizei count : state_->all.counts) times.triangles += static_cast<std::uint64_t>(count) / 3;
    times.submitted_ms = ms_since(start);
    if (settings.wait_until_drawn) {
        glFinish();
        times.finished_ms = ms_since(start);
    }
    return times;
}

}  // namespace scree
