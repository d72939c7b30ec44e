#include "runtime/render/renderer.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "runtime/render/draw_batches.h"
#include "runtime/render/draw_stream.h"
#include "runtime/render/edge_parts.h"
#include "runtime/render/frame_passes.h"
#include "runtime/render/index_arena.h"
#include "runtime/render/program.h"
#include "runtime/render/shader_constants.h"
#include "runtime/render/texture_arena.h"
#include "runtime/render/vertex_arena.h"
#include "runtime/view/relative_frame.h"

namespace scree {
namespace {

constexpr GLuint kVertexBinding = 0;
constexpr GLuint kDrawBinding = 1;
constexpr GLuint kBlendBinding = 2;

/// Draws at the data's ends, per item that may be drawn.
constexpr int kEdgeDraws = 2;
/// Tiles there are drawn by parts of an eighth of their side: finer ones would be more draws for few pixels less.
constexpr int kEdgePartLevel = 3;

using Clock = std::chrono::steady_clock;

double ms_since(Clock::time_point start) {
    return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

/// Names vertex attributes of one vertex array.
class AttributeFormats {
public:
    explicit AttributeFormats(GLuint vertex_array) : vertex_array_(vertex_array) {}
    void floats(int location, GLuint binding, GLint count, std::size_t offset) const {
        glVertexArrayAttribFormat(vertex_array_, enabled(location, binding), count, GL_FLOAT, GL_FALSE,
                                  static_cast<GLuint>(offset));
    }
    void integers(int location, GLuint binding, GLint count, GLenum type, std::size_t offset) const {
        glVertexArrayAttribIFormat(vertex_array_, enabled(location, binding), count, type, static_cast<GLuint>(offset));
    }
    /// 0..255 as 0..1.
    void bytes(int location, GLuint binding, GLint count, std::size_t offset) const {
        glVertexArrayAttribFormat(vertex_array_, enabled(location, binding), count, GL_UNSIGNED_BYTE, GL_TRUE,
                                  static_cast<GLuint>(offset));
    }

private:
    GLuint enabled(int location, GLuint binding) const {
        const auto index = static_cast<GLuint>(location);
        glEnableVertexArrayAttrib(vertex_array_, index);
        glVertexArrayAttribBinding(vertex_array_, index, binding);
        return index;
    }
    GLuint vertex_array_;
};

VertexArrayHandle make_vertex_array(const VertexArena& vertices, const IndexArena& indices, bool blended) {
    GLuint name = 0;
    glCreateVertexArrays(1, &name);
    const AttributeFormats formats(name);
    formats.floats(shader::kHeightAttribute, kVertexBinding, 3, 0);
    formats.integers(shader::kTileAttribute, kDrawBinding, 4, GL_INT, offsetof(DrawAttributes, lattice_i));
    formats.floats(shader::kTextureAttribute, kDrawBinding, 4, offsetof(DrawAttributes, texture_layer));
    formats.integers(shader::kPatternAttribute, kDrawBinding, 2, GL_INT, offsetof(DrawAttributes, stride));
    formats.floats(shader::kMorphAttribute, kDrawBinding, 1, offsetof(DrawAttributes, morph));
    formats.floats(shader::kEdgeMorphAttribute, kDrawBinding, 4, offsetof(DrawAttributes, edge_morph));
    formats.bytes(shader::kHighlightAttribute, kDrawBinding, 4, offsetof(DrawAttributes, highlight));
    if (blended) {
        formats.floats(shader::kCoarseAttribute, kBlendBinding, 4, offsetof(BlendAttributes, coarse_scale));
        formats.integers(shader::kCodesAttribute, kBlendBinding, 2, GL_UNSIGNED_INT, offsetof(BlendAttributes, own));
        formats.integers(shader::kNeighboursAttribute, kBlendBinding, 4, GL_UNSIGNED_INT,
                         offsetof(BlendAttributes, neighbours));
        glVertexArrayBindingDivisor(name, kBlendBinding, 1);
    }
    glVertexArrayBindingDivisor(name, kDrawBinding, 1);
    glVertexArrayVertexBuffer(name, kVertexBinding, vertices.buffer(), 0, sizeof(SlotVertex));
    glVertexArrayElementBuffer(name, indices.buffer());
    return VertexArrayHandle(name);
}

std::size_t look_of(const FrameSettings& settings) {
    return (settings.haze_distance_m > 0 ? 1u : 0u) + (settings.highlight != Highlight::none ? 2u : 0u);
}

std::array<std::uint8_t, 4> highlight_of(const DrawItem& item, const FrameSettings& settings) {
    switch (settings.highlight) {
        case Highlight::none:
            break;
        case Highlight::level:
            return highlight_colour(Highlight::level, item.tile.level);
        case Highlight::geomip:
            return highlight_colour(Highlight::geomip, item.geomip);
        case Highlight::error:
            return highlight_colour(Highlight::error, static_cast<double>(item.bound_px) / settings.highlight_full_px);
    }
    return {};
}

}  // namespace

std::size_t renderer_bytes(const RendererOptions& options) {
    return vertex_arena_bytes(options.lattice.tile_cells_log2, options.height_slots) +
           texture_arena_bytes(options.texture_size_log2, options.texture_slots) +
           mesh_arena_bytes(options.lattice.tile_cells_log2, options.mesh_indices);
}

struct Renderer::State {
    RendererOptions options;
    VertexArena vertices;
    TextureArena textures;
    IndexArena indices;
    DrawBatches batches;
    DrawStream stream;
    VertexArrayHandle plain_array, blended_array;
    SkyPass sky;
    EdgePass edge;
    std::array<std::array<ProgramHandle, 4>, kImageryKinds> terrain;  ///< [imagery][haze + 2 * highlight]

    int bound_arrays = 1;  ///< by Imagery::blended_of_all

    Result<void> build_programs();
    /// Sorts the draws into batches and writes them to the region; returns their triangles.
    std::uint64_t write_draws(std::span<const DrawItem> items, const FrameSettings& settings,
                              const DrawStream::Region& region);
    DrawAttributes attributes_of(const DrawItem& item, const FrameSettings& settings) const;
    BlendAttributes blend_of(const DrawItem& item, const DrawBatch& batch) const;
    /// kNoTexture for what is in no array that the batch has bound.
    TextureCode texture_code(std::int32_t slot, const DrawBatch& batch, bool coarse = false) const;
    void draw_terrain(const Camera& camera, const FrameSettings& settings, const DrawStream::Region& region,
                      FrameTimes& times);
    /// Commands for the parts of tiles that lie where the data ends, behind all draws; returns how many.
    std::size_t write_edge(std::span<const DrawItem> items, const FrameSettings& settings,
                           const DrawStream::Region& region) const;
    void draw_edge(const Camera& camera, const FrameSettings& settings, const DrawStream::Region& region,
                   std::size_t count) const;
    void bind_textures(const DrawBatch& batch) const;
    void draw_batch(const DrawBatch& batch, const FrameSettings& settings, const DrawStream::Region& region) const;
};

Result<void> Renderer::State::build_programs() {
    for (std::size_t imagery = 0; imagery < kImageryKinds; ++imagery) {
        for (std::size_t look = 0; look < terrain[imagery].size(); ++look) {
            auto built =
                build_terrain_program({options.lattice.tile_cells_log2, options.texture_size_log2,
                                       static_cast<Imagery>(imagery), bound_arrays, (look & 1) != 0, (look & 2) != 0});
            if (!built) return built.error();
            terrain[imagery][look] = std::move(*built);
        }
    }
    return {};
}

DrawAttributes Renderer::State::attributes_of(const DrawItem& item, const FrameSettings& settings) const {
    assert(options.lattice.contains(item.tile) && item.tile.level <= options.lattice.deepest_level);
    assert(item.height_slot >= 0 && item.height_slot < vertices.slots());
    assert(item.edge_mask < kEdgeMaskCount);
    const LatticePoint corner = options.lattice.corner(item.tile);
    return {static_cast<std::int32_t>(corner.i),
            static_cast<std::int32_t>(corner.j),
            static_cast<std::int32_t>(options.lattice.step(item.tile.level)),
            item.height_slot * vertices.slot_vertices(),
            static_cast<float>(textures.layer_of(item.texture.slot)),
            item.texture.scale,
            item.texture.offset_u,
            item.texture.offset_v,
            1 << item.geomip,
            item.edge_mask,
            item.morph,
            item.edge_morph,
            highlight_of(item, settings)};
}

TextureCode Renderer::State::texture_code(std::int32_t slot, const DrawBatch& batch, bool coarse) const {
    static_assert(kMaxArrayLayers <= shader::kTextureLayerMask + 1);
    assert(slot < textures.slots());
    if (slot < 0) return shader::kNoTexture;
    const int array = textures.array_of(slot);
    int unit = array;
    if (batch.imagery != Imagery::blended_of_all) {
        if (array != batch.arrays[0] && array != batch.arrays[1]) return shader::kNoTexture;
        // Of two arrays each costs a tap on software OpenGL: a coarse texture takes the second one if it can.
        unit = array != batch.arrays[0] || (coarse && array == batch.arrays[1]) ? 1 : 0;
    }
    return static_cast<TextureCode>(unit << shader::kTextureLayerBits | textures.layer_of(slot));
}

BlendAttributes Renderer::State::blend_of(const DrawItem& item, const DrawBatch& batch) const {
    BlendAttributes blend;
    const TexturePlacement& coarse = item.texture_share < 1 ? item.coarse_texture : item.texture;
    blend.coarse_scale = coarse.scale;
    blend.coarse_offset_u = coarse.offset_u;
    blend.coarse_offset_v = coarse.offset_v;
    blend.texture_share = std::min(item.texture_share, 1.0f);
    blend.own = texture_code(item.texture.slot, batch);
    blend.coarse = texture_code(coarse.slot, batch, true);
    for (std::size_t side = 0; side < blend.neighbours.size(); ++side)
        blend.neighbours[side] = texture_code(item.neighbour_textures[side], batch);
    return blend;
}

std::uint64_t Renderer::State::write_draws(std::span<const DrawItem> items, const FrameSettings& settings,
                                           const DrawStream::Region& region) {
    batches.sort(items);
    std::uint64_t triangles = 0;
    for (std::size_t draw = 0; draw < batches.draws().size(); ++draw) {
        const SortedDraw& sorted = batches.draws()[draw];
        const DrawItem& item = items[sorted.item];
        const DrawBatch& batch = batches.batches()[sorted.batch];
        const IndexRange range = indices.range(item, sorted.shape);
        region.attributes[draw] = attributes_of(item, settings);
        region.commands[draw] = {range.count, 1, range.first, item.height_slot * vertices.slot_vertices(),
                                 static_cast<std::uint32_t>(draw)};
        if (batch.imagery != Imagery::plain) region.blends[draw] = blend_of(item, batch);
        triangles += range.count / 3;
    }
    return triangles;
}

std::size_t Renderer::State::write_edge(std::span<const DrawItem> items, const FrameSettings& settings,
                                        const DrawStream::Region& region) const {
    const EdgeField* field = edge.field_for(settings);
    if (field == nullptr) return 0;
    EdgeParts parts(*field);
    const std::size_t first = batches.draws().size(), room = region.commands.size();
    std::size_t count = 0;
    for (std::size_t draw = 0; draw < first; ++draw) {
        const SortedDraw& sorted = batches.draws()[draw];
        if (sorted.shape == DrawShape::ring) continue;  // with the item's other draw
        const DrawItem& item = items[sorted.item];
        const int finest =
            item.mesh.count > 0 ? 0 : std::min(kEdgePartLevel, options.lattice.tile_cells_log2 - 1 - item.geomip);
        for (const TilePart part : parts.of(item, finest)) {
            if (first + count == room) return count;
            DrawItem some = item;
            some.part = part;
            const IndexRange range = indices.range(some, DrawShape::whole);
            region.commands[first + count++] = {range.count, 1, range.first,
                                                item.height_slot * vertices.slot_vertices(),
                                                static_cast<std::uint32_t>(draw)};
        }
    }
    return count;
}

void Renderer::State::draw_edge(const Camera& camera, const FrameSettings& settings, const DrawStream::Region& region,
                                std::size_t count) const {
    const RelativeFrame frame = make_relative_frame(options.lattice, options.height_offset_m, options.height_quantum_m,
                                                    camera.eye, settings.half_curvature);
    edge.begin(camera, frame, options.lattice, settings);
    glBindVertexArray(plain_array.name());
    glMultiDrawElementsIndirect(
        GL_TRIANGLES, indices.type(),
        reinterpret_cast<const void*>(region.commands_offset + batches.draws().size() * sizeof(DrawCommand)),
        static_cast<GLsizei>(count), sizeof(DrawCommand));
    EdgePass::end();
}

void Renderer::State::bind_textures(const DrawBatch& batch) const {
    const auto bind = [this](int unit, int array) {
        glBindTextureUnit(static_cast<GLuint>(shader::kImageryTextureUnit + unit),
                          textures.arrays()[static_cast<std::size_t>(array)].name());
    };
    if (batch.imagery == Imagery::blended_of_all) {
        for (int array = 0; array < bound_arrays; ++array) bind(array, array);
        return;
    }
    bind(0, batch.arrays[0]);
    bind(1, batch.arrays[1]);
}

void Renderer::State::draw_batch(const DrawBatch& batch, const FrameSettings& settings,
                                 const DrawStream::Region& region) const {
    const bool plain = batch.imagery == Imagery::plain;
    glUseProgram(terrain[static_cast<std::size_t>(batch.imagery)][look_of(settings)].name());
    glBindVertexArray(plain ? plain_array.name() : blended_array.name());
    bind_textures(batch);
    glMultiDrawElementsIndirect(
        GL_TRIANGLES, indices.type(),
        reinterpret_cast<const void*>(region.commands_offset + batch.first * sizeof(DrawCommand)),
        static_cast<GLsizei>(batch.count), sizeof(DrawCommand));
}

void Renderer::State::draw_terrain(const Camera& camera, const FrameSettings& settings,
                                   const DrawStream::Region& region, FrameTimes& times) {
    const RelativeFrame frame = make_relative_frame(options.lattice, options.height_offset_m, options.height_quantum_m,
                                                    camera.eye, settings.half_curvature);
    const std::size_t look = look_of(settings);
    for (const auto& kind : terrain) {
        set_position(kind[look].name(), camera, frame);
        set_atmosphere(kind[look].name(), camera, settings);
    }
    for (const GLuint array : {plain_array.name(), blended_array.name()})
        glVertexArrayVertexBuffer(array, kDrawBinding, stream.buffer(), static_cast<GLintptr>(region.attributes_offset),
                                  sizeof(DrawAttributes));
    glVertexArrayVertexBuffer(blended_array.name(), kBlendBinding, stream.buffer(),
                              static_cast<GLintptr>(region.blends_offset), sizeof(BlendAttributes));
    glBindBuffer(GL_DRAW_INDIRECT_BUFFER, stream.buffer());
    glPolygonMode(GL_FRONT_AND_BACK, settings.wireframe ? GL_LINE : GL_FILL);
    for (const DrawBatch& batch : batches.batches()) {
        draw_batch(batch, settings, region);
        times.imagery_kinds |= 1u << static_cast<unsigned>(batch.imagery);
    }
    glPolygonMode(GL_FRONT_AND_BACK, GL_FILL);
    times.multi_draws = static_cast<std::uint32_t>(batches.batches().size());
    times.blended_draws = static_cast<std::uint32_t>(batches.blended_draws());
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
    auto textures = TextureArena::create(
        {options.texture_size_log2, options.texture_slots, options.anisotropy, options.max_array_layers});
    if (!textures) return textures.error();
    state->textures = std::move(*textures);
    auto stream = DrawStream::create(2 * options.max_draws, kEdgeDraws * options.max_draws);
    if (!stream) return stream.error();
    state->stream = std::move(*stream);

    GLint units = 0;
    glGetIntegerv(GL_MAX_TEXTURE_IMAGE_UNITS, &units);
    const auto arrays = static_cast<int>(state->textures.arrays().size());
    state->bound_arrays = std::min({arrays, static_cast<int>(units), shader::kMaxBlendedArrays});
    state->batches = DrawBatches({arrays, state->textures.layers_per_array(), state->bound_arrays, tile_cells_log2,
                                  options.texture_size_log2, options.max_draws});
    if (const auto built = state->build_programs(); !built) return built.error();
    auto indices = IndexArena::create(tile_cells_log2, options.mesh_indices);
    if (!indices) return indices.error();
    state->indices = std::move(*indices);
    state->plain_array = make_vertex_array(state->vertices, state->indices, false);
    state->blended_array = make_vertex_array(state->vertices, state->indices, true);
    auto edge = build_edge_program(tile_cells_log2);
    if (!edge) return edge.error();
    state->edge = EdgePass(std::move(*edge));
    auto sky = SkyPass::create();
    if (!sky) return sky.error();
    state->sky = std::move(*sky);
    if (glGetError() != GL_NO_ERROR) return Error{ErrorCode::display, "OpenGL has no memory for its vertex arrays"};
    return std::unique_ptr<Renderer>(new Renderer(std::move(state)));
}

void Renderer::upload_height(int slot, std::span<const SlotVertex> vertices) {
    state_->vertices.upload(slot, vertices);
}

void Renderer::upload_texture(int slot, std::span<const std::uint8_t> chain) { state_->textures.upload(slot, chain); }

void Renderer::upload_mesh(std::uint32_t first, std::span<const std::uint32_t> indices) {
    state_->indices.upload_mesh(first, indices);
}

Result<void> Renderer::set_edge_field(std::shared_ptr<const EdgeField> field) {
    return state_->edge.set_field(std::move(field));
}

FrameTimes Renderer::draw(const Camera& camera, std::span<const DrawItem> items, const FrameSettings& settings,
                          RenderTarget& target) {
    assert(camera.width_px == target.width_px() && camera.height_px == target.height_px());
    assert(items.size() <= static_cast<std::size_t>(state_->options.max_draws));
    const Clock::time_point start = Clock::now();
    FrameTimes times;
    items = items.first(std::min(items.size(), static_cast<std::size_t>(state_->options.max_draws)));

    const DrawStream::Region region = state_->stream.begin_frame();
    times.triangles = state_->write_draws(items, settings, region);
    times.draws = static_cast<std::uint32_t>(state_->batches.draws().size());
    const std::size_t edge_draws = state_->write_edge(items, settings, region);
    times.edge_draws = static_cast<std::uint32_t>(edge_draws);

    begin_picture(target);
    state_->draw_terrain(camera, settings, region, times);
    if (!settings.magenta_background) {
        state_->sky.draw(camera, settings);
        if (edge_draws > 0) state_->draw_edge(camera, settings, region, edge_draws);
    }
    state_->stream.end_frame();

    times.submitted_ms = ms_since(start);
    if (settings.wait_until_drawn) {
        glFinish();
        times.finished_ms = ms_since(start);
    }
    return times;
}

std::uint32_t Renderer::warm_up(const FrameSettings& settings, RenderTarget& target) {
    Camera camera;
    camera.width_px = target.width_px();
    camera.height_px = target.height_px();
    std::uint32_t kinds = 0;
    const auto draw_one = [&](float share, int neighbour_arrays) {
        DrawItem item;
        item.geomip = state_->options.lattice.tile_cells_log2 - 1;  // too coarse for a ring: one draw
        item.texture_share = share;
        for (int array = 0; array < neighbour_arrays; ++array)
            item.neighbour_textures[static_cast<std::size_t>(array)] = array * state_->textures.layers_per_array();
        kinds |= draw(camera, {&item, 1}, settings, target).imagery_kinds;
    };
    draw_one(1, 0);     // plain
    draw_one(1, 1);     // bordered
    draw_one(0.5f, 0);  // faded
    draw_one(0.5f, 1);  // blended
    if (state_->bound_arrays > 2) draw_one(1, 3);
    glFinish();
    return static_cast<std::uint32_t>(std::popcount(kinds));
}

void Renderer::reset_state() {
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    glClipControl(GL_LOWER_LEFT, GL_NEGATIVE_ONE_TO_ONE);
    glDisable(GL_FRAMEBUFFER_SRGB);
    glDisable(GL_DEPTH_TEST);
    glDepthFunc(GL_LESS);
    glDisable(GL_CULL_FACE);
    glUseProgram(0);
    glBindVertexArray(0);
    glBindBuffer(GL_DRAW_INDIRECT_BUFFER, 0);
    glPixelStorei(GL_PACK_ALIGNMENT, 4);
}

}  // namespace scree
