#include "runtime/render/renderer.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "common/mesh/tile_patterns.h"
#include "runtime/render/draw_stream.h"
#include "runtime/render/program.h"
#include "runtime/render/shader_constants.h"
#include "runtime/render/texture_arena.h"
#include "runtime/render/vertex_arena.h"
#include "runtime/view/relative_frame.h"

namespace scree {
namespace {

constexpr GLuint kVertexBinding = 0;
constexpr GLuint kDrawBinding = 1;

/// Haze of the sky below the horizon where the scene asks for none.
constexpr double kBackdropHaze_m = 20'000;

using Clock = std::chrono::steady_clock;

double ms_since(Clock::time_point start) {
    return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

/// All patterns' indices in one buffer. They are local to a tile, so 16 bits serve up to m = 128.
struct IndexArena {
    BufferHandle buffer;
    TilePatterns patterns{1};  ///< where each pattern and part lies in the buffer
    GLenum type = GL_UNSIGNED_SHORT;
};

IndexArena make_index_arena(int tile_cells_log2) {
    IndexArena arena{{}, TilePatterns(tile_cells_log2)};
    const TilePatterns& patterns = arena.patterns;
    GLuint name = 0;
    glCreateBuffers(1, &name);
    arena.buffer = BufferHandle(name);
    const auto store = [&](const auto& indices) {
        glNamedBufferStorage(name, static_cast<GLsizeiptr>(indices.size() * sizeof(indices[0])), indices.data(), 0);
    };
    const int samples = (1 << tile_cells_log2) + 1;
    if (samples * samples <= 65535) {
        std::vector<std::uint16_t> small;
        small.reserve(patterns.indices().size());
        for (const std::uint32_t index : patterns.indices()) small.push_back(static_cast<std::uint16_t>(index));
        store(small);
    } else {
        arena.type = GL_UNSIGNED_INT;
        store(patterns.indices());
    }
    return arena;
}

VertexArrayHandle make_vertex_array(const VertexArena& vertices, const IndexArena& indices) {
    GLuint name = 0;
    glCreateVertexArrays(1, &name);
    const auto attribute = [name](int location, GLuint binding) {
        const auto index = static_cast<GLuint>(location);
        glEnableVertexArrayAttrib(name, index);
        glVertexArrayAttribBinding(name, index, binding);
        return index;
    };
    glVertexArrayAttribFormat(name, attribute(shader::kHeightAttribute, kVertexBinding), 3, GL_FLOAT, GL_FALSE, 0);
    glVertexArrayAttribIFormat(name, attribute(shader::kTileAttribute, kDrawBinding), 4, GL_INT,
                               offsetof(DrawAttributes, lattice_i));
    glVertexArrayAttribFormat(name, attribute(shader::kTextureAttribute, kDrawBinding), 4, GL_FLOAT, GL_FALSE,
                              offsetof(DrawAttributes, texture_layer));
    glVertexArrayBindingDivisor(name, kDrawBinding, 1);
    glVertexArrayVertexBuffer(name, kVertexBinding, vertices.buffer(), 0, sizeof(SlotVertex));
    glVertexArrayElementBuffer(name, indices.buffer.name());
    return VertexArrayHandle(name);
}

/// Columns that take {x, y, 1} on the screen to a view ray.
glm::mat3 ray_from_screen(const Camera& camera) {
    return {glm::vec3(camera.right() * camera.tan_half_x()), glm::vec3(camera.up * camera.tan_half_y()),
            glm::vec3(camera.forward)};
}

void set_atmosphere(GLuint program, const Camera& camera, const FrameSettings& settings) {
    const double distance_m = settings.haze_distance_m > 0 ? settings.haze_distance_m : kBackdropHaze_m;
    const double scale_height_m = std::max(settings.haze_scale_height_m, 1.0);
    const double altitude_m = std::max(camera.eye.z - settings.ground_height_m, 1.0);
    glProgramUniform3fv(program, shader::kSunUniform, 1, &settings.sun_direction.x);
    glProgramUniform4f(program, shader::kHazeUniform, static_cast<float>(1 / distance_m),
                       static_cast<float>(1 / scale_height_m), static_cast<float>(altitude_m),
                       static_cast<float>(std::exp(-altitude_m / scale_height_m)));
}

void set_position(GLuint program, const Camera& camera, const RelativeFrame& frame) {
    const glm::mat4 clip = clip_from_relative(camera);
    glProgramUniformMatrix4fv(program, shader::kClipFromRelativeUniform, 1, GL_FALSE, &clip[0].x);
    glProgramUniform3i(program, shader::kAnchorUniform, frame.i0, frame.j0, frame.n0);
    glProgramUniform1f(program, shader::kSpacingUniform, frame.spacing_m);
    glProgramUniform1f(program, shader::kQuantumUniform, frame.quantum_m);
    glProgramUniform3fv(program, shader::kFractionUniform, 1, &frame.fraction_m.x);
}

}  // namespace

std::size_t renderer_bytes(const RendererOptions& options) {
    return vertex_arena_bytes(options.lattice.tile_cells_log2, options.height_slots) +
           texture_arena_bytes(options.texture_size_log2, options.texture_slots);
}

struct Renderer::State {
    RendererOptions options;
    VertexArena vertices;
    TextureArena textures;
    IndexArena indices;
    DrawStream stream;
    VertexArrayHandle terrain_array;
    VertexArrayHandle sky_array;  ///< no attributes
    ProgramHandle sky;
    std::array<ProgramHandle, 4> terrain;  ///< [haze + 2 * colour by level]

    struct Batch {
        std::size_t first = 0;
        std::size_t count = 0;
    };
    std::vector<Batch> batches;  ///< one a texture array

    /// Orders the draws by texture array, otherwise as given, and writes them to the region.
    std::uint64_t write_draws(std::span<const DrawItem> items, const DrawStream::Region& region);
    void draw_terrain(const Camera& camera, const FrameSettings& settings, const DrawStream::Region& region,
                      FrameTimes& times);
    void draw_sky(const Camera& camera, const FrameSettings& settings);
};

std::uint64_t Renderer::State::write_draws(std::span<const DrawItem> items, const DrawStream::Region& region) {
    const auto layers = textures.layers_per_array();
    const auto batch_of = [&](const DrawItem& item) -> Batch& {
        return batches[static_cast<std::size_t>(item.texture_slot / layers)];
    };
    for (Batch& batch : batches) batch = {};
    for (const DrawItem& item : items) {
        assert(item.height_slot >= 0 && item.height_slot < vertices.slots());
        assert(item.texture_slot >= 0 && item.texture_slot < textures.slots());
        ++batch_of(item).count;
    }
    std::size_t next = 0;
    for (Batch& batch : batches) {
        batch.first = next;
        next += batch.count;
        batch.count = 0;
    }
    std::uint64_t triangles = 0;
    for (const DrawItem& item : items) {
        assert(options.lattice.contains(item.tile) && item.tile.level <= options.lattice.deepest_level);
        assert(item.edge_mask < kEdgeMaskCount);
        const PatternRange pattern = indices.patterns.range(item.geomip, item.edge_mask, item.part);
        const LatticePoint corner = options.lattice.corner(item.tile);
        const std::int32_t first_vertex = item.height_slot * vertices.slot_vertices();
        Batch& batch = batch_of(item);
        const std::size_t draw = batch.first + batch.count++;
        region.commands[draw] = {pattern.count, 1, pattern.first, first_vertex, static_cast<std::uint32_t>(draw)};
        region.attributes[draw] = {static_cast<std::int32_t>(corner.i),
                                   static_cast<std::int32_t>(corner.j),
                                   static_cast<std::int32_t>(options.lattice.step(item.tile.level)),
                                   first_vertex,
                                   static_cast<float>(item.texture_slot % layers),
                                   item.texture_scale,
                                   item.texture_offset_u,
                                   item.texture_offset_v};
        triangles += pattern.count / 3;
    }
    return triangles;
}

void Renderer::State::draw_terrain(const Camera& camera, const FrameSettings& settings,
                                   const DrawStream::Region& region, FrameTimes& times) {
    const std::size_t variant = (settings.haze_distance_m > 0 ? 1u : 0u) + (settings.colour_by_level ? 2u : 0u);
    const GLuint program = terrain[variant].name();
    set_position(program, camera,
                 make_relative_frame(options.lattice, options.height_offset_m, options.height_quantum_m, camera.eye));
    set_atmosphere(program, camera, settings);
    glUseProgram(program);
    glVertexArrayVertexBuffer(terrain_array.name(), kDrawBinding, stream.buffer(),
                              static_cast<GLintptr>(region.attributes_offset), sizeof(DrawAttributes));
    glBindVertexArray(terrain_array.name());
    glBindBuffer(GL_DRAW_INDIRECT_BUFFER, stream.buffer());
    glPolygonMode(GL_FRONT_AND_BACK, settings.wireframe ? GL_LINE : GL_FILL);
    for (std::size_t array = 0; array < batches.size(); ++array) {
        const Batch& batch = batches[array];
        if (batch.count == 0) continue;
        glBindTextureUnit(static_cast<GLuint>(shader::kImageryTextureUnit), textures.arrays()[array].name());
        glMultiDrawElementsIndirect(
            GL_TRIANGLES, indices.type,
            reinterpret_cast<const void*>(region.commands_offset + batch.first * sizeof(DrawCommand)),
            static_cast<GLsizei>(batch.count), sizeof(DrawCommand));
        ++times.multi_draws;
    }
    glPolygonMode(GL_FRONT_AND_BACK, GL_FILL);
}

void Renderer::State::draw_sky(const Camera& camera, const FrameSettings& settings) {
    const glm::mat3 rays = ray_from_screen(camera);
    glProgramUniformMatrix3fv(sky.name(), shader::kRayFromScreenUniform, 1, GL_FALSE, &rays[0].x);
    set_atmosphere(sky.name(), camera, settings);
    glUseProgram(sky.name());
    glBindVertexArray(sky_array.name());
    glDrawArrays(GL_TRIANGLES, 0, 3);
}

Renderer::Renderer(std::unique_ptr<State> state) : state_(std::move(state)) {}
Renderer::~Renderer() = default;

Result<std::unique_ptr<Renderer>> Renderer::create(const RendererOptions& options) {
    auto state = std::make_unique<State>();
    state->options = options;
    const int tile_cells_log2 = options.lattice.tile_cells_log2;

    auto vertices = VertexArena::create(tile_cells_log2, options.height_slots);
    if (!vertices) return vertices.error();
    state->vertices = std::move(*vertices);
    auto textures = TextureArena::create({options.texture_size_log2, options.texture_slots, options.anisotropy});
    if (!textures) return textures.error();
    state->textures = std::move(*textures);
    auto stream = DrawStream::create(options.max_draws);
    if (!stream) return stream.error();
    state->stream = std::move(*stream);

    auto sky = build_sky_program();
    if (!sky) return sky.error();
    state->sky = std::move(*sky);
    for (std::size_t variant = 0; variant < state->terrain.size(); ++variant) {
        auto terrain = build_terrain_program(tile_cells_log2, {(variant & 1) != 0, (variant & 2) != 0});
        if (!terrain) return terrain.error();
        state->terrain[variant] = std::move(*terrain);
    }

    state->indices = make_index_arena(tile_cells_log2);
    state->terrain_array = make_vertex_array(state->vertices, state->indices);
    GLuint empty = 0;
    glCreateVertexArrays(1, &empty);
    state->sky_array = VertexArrayHandle(empty);
    state->batches.resize(state->textures.arrays().size());
    if (glGetError() != GL_NO_ERROR)
        return Error{ErrorCode::display, "OpenGL has no memory for the index lists of this tile size"};
    return std::unique_ptr<Renderer>(new Renderer(std::move(state)));
}

void Renderer::upload_height(int slot, std::span<const SlotVertex> vertices) {
    state_->vertices.upload(slot, vertices);
}

void Renderer::upload_texture(int slot, std::span<const std::uint8_t> chain) { state_->textures.upload(slot, chain); }

FrameTimes Renderer::draw(const Camera& camera, std::span<const DrawItem> items, const FrameSettings& settings,
                          RenderTarget& target) {
    assert(camera.width_px == target.width_px() && camera.height_px == target.height_px());
    assert(items.size() <= static_cast<std::size_t>(state_->stream.max_draws()));
    const Clock::time_point start = Clock::now();
    FrameTimes times;
    items = items.first(std::min(items.size(), static_cast<std::size_t>(state_->stream.max_draws())));

    const DrawStream::Region region = state_->stream.begin_frame();
    times.draws = static_cast<std::uint32_t>(items.size());
    times.triangles = state_->write_draws(items, region);

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

    state_->draw_terrain(camera, settings, region, times);
    state_->stream.end_frame();
    if (!settings.magenta_background) state_->draw_sky(camera, settings);

    times.submitted_ms = ms_since(start);
    if (settings.wait_until_drawn) {
        glFinish();
        times.finished_ms = ms_since(start);
    }
    return times;
}

}  // namespace scree
