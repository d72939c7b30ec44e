// What drawing tiles costs beside one plain indexed draw of the same triangles and textures, and what each feature of
// the renderer adds, in one process: the ways take turns frame by frame, and medians are printed. No argument: 800 x
// 800 px.
//     scree_render_bench [FRAMES]
#include <epoxy/gl.h>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "common/mesh/tile_patterns.h"
#include "common/texture_tile.h"
#include "runtime/render/context.h"
#include "runtime/render/program.h"
#include "runtime/render/renderer.h"
#include "runtime/render/shader_constants.h"
#include "runtime/view/relative_frame.h"

namespace scree {
namespace {

constexpr int kSide_px = 800;
constexpr int kTilesASide = 11;  // 121 tiles of 2048 triangles: 248k
constexpr int kTileCellsLog2 = 5;
constexpr int kTextureLog2 = 8;
constexpr double kSpacing_m = 10;

struct World {
    Lattice lattice;
    std::vector<TileId> tiles;
    std::vector<std::vector<SlotVertex>> slots;
};

World make_world() {
    World world;
    constexpr std::int64_t kCells = 16 << kTileCellsLog2;
    world.lattice = *make_lattice(0, 0, kSpacing_m, kCells, kCells, kTileCellsLog2);
    const int level = world.lattice.deepest_level, samples = world.lattice.tile_samples();
    for (int y = 0; y < kTilesASide; ++y)
        for (int x = 0; x < kTilesASide; ++x) {
            const TileId id{level, x, y};
            const LatticePoint corner = world.lattice.corner(id);
            std::vector<std::int32_t> heights;
            for (int k = 0; k < samples * samples; ++k) {
                const double i = static_cast<double>(corner.i + k % samples),
                             j = static_cast<double>(corner.j + k / samples);
                heights.push_back(static_cast<std::int32_t>(400 * std::sin(i * 0.05) * std::cos(j * 0.07)));
            }
            world.tiles.push_back(id);
            world.slots.emplace_back(slot_vertex_count(kTileCellsLog2));
            fill_vertex_slot(heights, kTileCellsLog2, world.slots.back());
        }
    return world;
}

std::vector<std::uint8_t> random_chain(std::mt19937& random) {
    std::vector<std::uint8_t> chain(bc1_chain_bytes(kTextureLog2));
    for (std::uint8_t& byte : chain) byte = static_cast<std::uint8_t>(random());
    for (std::size_t block = 0; block < chain.size(); block += 8) chain[block + 1] |= 0x80, chain[block + 3] &= 0x7f;
    return chain;
}

/// The rivals: the same shader's work without tiles, patterns, morphs; positions ready in the buffer.
constexpr const char* kPlainVertex = R"(
layout(location = 0) in vec3 position_m;
layout(location = 1) in vec3 texture_place;
layout(location = 0) uniform mat4 clip_from_relative;
out vec2 texture_position;
flat out float texture_layer;
void main() {
    texture_position = texture_place.xy;
    texture_layer = texture_place.z;
    gl_Position = clip_from_relative * vec4(position_m, 1.0);
}
)";
constexpr const char* kPlainFragment = R"(
layout(binding = 0) uniform sampler2DArray imagery;
in vec2 texture_position;
flat in float texture_layer;
out vec4 fragment_colour;
void main() {
    vec4 texel = texture(imagery, vec3(texture_position, texture_layer));
    if (texel.a < 0.5) discard;
    fragment_colour = vec4(texel.rgb / texel.a, 1.0);
}
)";

struct PlainVertex {
    float x, y, z, u, v, layer;
};

/// All tiles as one mesh, one glDrawElements, one array texture.
class PlainDraw {
public:
    PlainDraw(const World& world, const RelativeFrame& frame, const std::vector<std::vector<std::uint8_t>>& chains) {
        std::vector<PlainVertex> vertices;
        std::vector<std::uint32_t> indices;
        const TilePatterns patterns(kTileCellsLog2);
        const PatternRange range = patterns.range(0, 0);
        const int samples = world.lattice.tile_samples();
        for (std::size_t t = 0; t < world.tiles.size(); ++t) {
            const auto base = static_cast<std::uint32_t>(vertices.size());
            const LatticePoint corner = world.lattice.corner(world.tiles[t]);
            for (int k = 0; k < samples * samples; ++k) {
                const glm::vec3 p = frame.position(static_cast<std::int32_t>(corner.i + k % samples),
                                                   static_cast<std::int32_t>(corner.j + k / samples),
                                                   world.slots[t][static_cast<std::size_t>(k)].height_n);
                const float m = static_cast<float>(samples - 1);
                vertices.push_back({p.x, p.y, p.z, static_cast<float>(k % samples) / m,
                                    static_cast<float>(k / samples) / m, static_cast<float>(t)});
            }
            for (std::uint32_t k = 0; k < range.count; ++k)
                indices.push_back(base + patterns.indices()[range.first + k]);
        }
        count_ = static_cast<GLsizei>(indices.size());
        GLuint names[2], array = 0, texture = 0;
        glCreateBuffers(2, names);
        glNamedBufferStorage(names[0], static_cast<GLsizeiptr>(vertices.size() * sizeof(PlainVertex)), vertices.data(),
                             0);
        glNamedBufferStorage(names[1], static_cast<GLsizeiptr>(indices.size() * 4), indices.data(), 0);
        vertices_ = BufferHandle(names[0]);
        indices_ = BufferHandle(names[1]);
        glCreateVertexArrays(1, &array);
        array_ = VertexArrayHandle(array);
        glVertexArrayVertexBuffer(array, 0, names[0], 0, sizeof(PlainVertex));
        glVertexArrayElementBuffer(array, names[1]);
        for (const GLuint location : {0u, 1u}) {
            glEnableVertexArrayAttrib(array, location);
            glVertexArrayAttribBinding(array, location, 0);
            glVertexArrayAttribFormat(array, location, 3, GL_FLOAT, GL_FALSE, 12 * location);
        }
        glCreateTextures(GL_TEXTURE_2D_ARRAY, 1, &texture);
        texture_ = TextureHandle(texture);
        constexpr GLenum kFormat = GL_COMPRESSED_SRGB_ALPHA_S3TC_DXT1_EXT;
        glTextureStorage3D(texture, mip_count(kTextureLog2), kFormat, 1 << kTextureLog2, 1 << kTextureLog2,
                           static_cast<GLsizei>(chains.size()));
        for (std::size_t layer = 0; layer < chains.size(); ++layer)
            for (int mip = 0; mip <= kTextureLog2; ++mip)
                glCompressedTextureSubImage3D(texture, mip, 0, 0, static_cast<GLint>(layer), 1 << (kTextureLog2 - mip),
                                              1 << (kTextureLog2 - mip), 1, kFormat,
                                              static_cast<GLsizei>(bc1_mip_bytes(kTextureLog2, mip)),
                                              chains[layer].data() + bc1_mip_offset(kTextureLog2, mip));
        glTextureParameteri(texture, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
        glTextureParameteri(texture, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
        glTextureParameteri(texture, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
        auto program = build_program({"plain", {kPlainVertex}, {kPlainFragment}, {}});
        if (!program) fmt::print(stderr, "{}\n", program.error().message), std::exit(1);
        program_ = std::move(*program);
    }

    void draw(const Camera& camera, RenderTarget& target) const {
        glBindFramebuffer(GL_DRAW_FRAMEBUFFER, target.framebuffer());
        glViewport(0, 0, target.width_px(), target.height_px());
        glClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
        glEnable(GL_FRAMEBUFFER_SRGB);
        glEnable(GL_DEPTH_TEST);
        glDepthFunc(GL_GEQUAL);
        glEnable(GL_CULL_FACE);
        constexpr float kMagenta[] = {1, 0, 1, 1}, kFar = 0;
        glClearNamedFramebufferfv(target.framebuffer(), GL_COLOR, 0, kMagenta);
        glClearNamedFramebufferfv(target.framebuffer(), GL_DEPTH, 0, &kFar);
        const glm::mat4 clip = clip_from_relative(camera);
        glProgramUniformMatrix4fv(program_.name(), 0, 1, GL_FALSE, &clip[0].x);
        glUseProgram(program_.name());
        glBindVertexArray(array_.name());
        glBindTextureUnit(0, texture_.name());
        glDrawElements(GL_TRIANGLES, count_, GL_UNSIGNED_INT, nullptr);
        glFinish();
    }

private:
    BufferHandle vertices_, indices_;
    VertexArrayHandle array_;
    TextureHandle texture_;
    ProgramHandle program_;
    GLsizei count_ = 0;
};

double median(std::vector<double> values) {
    std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
    return values[values.size() / 2];
}

struct Way {
    std::string name;
    std::function<void()> draw;
    std::vector<double> frame_ms;
    double first_ms = 0;  ///< a driver may compile here
};

void compare(const std::string& view, int frames, std::vector<Way>& ways) {
    for (int frame = -5; frame < frames; ++frame)
        for (Way& way : ways) {
            const auto start = std::chrono::steady_clock::now();
            way.draw();
            const std::chrono::duration<double, std::milli> taken = std::chrono::steady_clock::now() - start;
            if (frame >= 0) way.frame_ms.push_back(taken.count());
            if (frame == -5) way.first_ms = taken.count();
        }
    fmt::print("{}, {} frames:\n", view, frames);
    const double plain = median(ways.front().frame_ms);
    for (const Way& way : ways)
        fmt::print("  {:<42} {:6.2f} ms  {:5.3f} of plain  (first frame {:.0f})\n", way.name, median(way.frame_ms),
                   median(way.frame_ms) / plain, way.first_ms);
}

/// Scattered over the slots, as textures come and go: neighbours lie in any array.
std::int32_t texture_slot(std::size_t tile) {
    return static_cast<std::int32_t>(tile * 50 % (kTilesASide * kTilesASide));
}

/// The items of one way to draw the world.
DrawList items_of(const World& world) {
    DrawList items;
    for (std::size_t t = 0; t < world.tiles.size(); ++t) {
        DrawItem item;
        item.tile = world.tiles[t];
        item.height_slot = static_cast<std::int32_t>(t);
        item.texture.slot = texture_slot(t);
        items.push_back(item);
    }
    return items;
}

/// Neighbours where a texel may be larger than a pixel, as selection gives them.
DrawList with_neighbours(const World& world, DrawList items, const Camera& camera) {
    const double texel_m = kSpacing_m * (1 << kTileCellsLog2) / (1 << kTextureLog2);
    for (DrawItem& item : items) {
        const LatticePoint corner = world.lattice.corner(item.tile);
        const auto extent = static_cast<double>(world.lattice.tile_extent(item.tile.level));
        const double i = std::clamp(world.lattice.i_of(camera.eye.x), static_cast<double>(corner.i),
                                    static_cast<double>(corner.i) + extent);
        const double j = std::clamp(world.lattice.j_of(camera.eye.y), static_cast<double>(corner.j),
                                    static_cast<double>(corner.j) + extent);
        const glm::dvec3 nearest(world.lattice.x_m(i), world.lattice.y_m(j), std::min(camera.eye.z, 100.0));
        if (texel_m * camera.focal_px() < glm::distance(camera.eye, nearest)) continue;
        std::size_t side = 0;
        for (std::int64_t y = -1; y <= 1; ++y)
            for (std::int64_t x = -1; x <= 1; ++x) {
                if (x == 0 && y == 0) continue;
                const std::int64_t nx = item.tile.x + x, ny = item.tile.y + y;
                const bool there = nx >= 0 && ny >= 0 && nx < kTilesASide && ny < kTilesASide;
                item.neighbour_textures[side++] =
                    there ? texture_slot(static_cast<std::size_t>(ny * kTilesASide + nx)) : -1;
            }
    }
    return items;
}

DrawList morphing(DrawList items) {
    for (DrawItem& item : items) {
        item.morph = 0.4f;
        item.edge_morph = {0.2f, 0.3f, 0.4f, 0.5f};
    }
    return items;
}

DrawList fading(DrawList items) {
    for (DrawItem& item : items) {
        item.texture_share = 0.5f;
        item.coarse_texture = {0, 0.25f, 0.25f, 0.25f};
    }
    return items;
}

void run(int frames) {
    auto context = create_headless_context();
    if (!context) fmt::print(stderr, "{}\n", context.error().message), std::exit(1);
    fmt::print("{}, OpenGL {}\n", (*context)->renderer(), (*context)->version());
    const World world = make_world();
    std::mt19937 random(1);
    std::vector<std::vector<std::uint8_t>> chains;
    for (std::size_t t = 0; t < world.tiles.size(); ++t) chains.push_back(random_chain(random));

    RendererOptions options;
    options.lattice = world.lattice;
    options.height_quantum_m = 0.25;
    options.texture_size_log2 = kTextureLog2;
    options.height_slots = options.texture_slots = static_cast<int>(world.tiles.size());
    const auto make_renderer = [&](int layers) {
        options.max_array_layers = layers;
        auto renderer = Renderer::create(options);
        if (!renderer) fmt::print(stderr, "{}\n", renderer.error().message), std::exit(1);
        for (std::size_t t = 0; t < world.tiles.size(); ++t) {
            (*renderer)->upload_height(static_cast<int>(t), world.slots[t]);
            (*renderer)->upload_texture(texture_slot(t), chains[t]);
        }
        return std::move(*renderer);
    };
    const auto start = std::chrono::steady_clock::now();
    const auto renderer = make_renderer(kMaxArrayLayers);
    const std::chrono::duration<double, std::milli> taken = std::chrono::steady_clock::now() - start;
    fmt::print("renderer made and filled in {:.0f} ms\n", taken.count());
    const auto two_arrays = make_renderer((kTilesASide * kTilesASide + 1) / 2);
    const auto three_arrays = make_renderer((kTilesASide * kTilesASide + 2) / 3);
    auto target = RenderTarget::create({kSide_px, kSide_px, 0});

    const double side_m = kTilesASide * kSpacing_m * (1 << kTileCellsLog2);
    const double middle = side_m / 2;
    struct View {
        std::string name;
        glm::dvec3 eye, target;
    };
    const View views[] = {
        {"from above, all tiles, textures minified 3 x", {middle, -middle, 4900}, {middle, -middle, 0}},
        {"low, half the screen magnified", {middle, -side_m, 260}, {middle, -middle, -60}},
        {"from 150 m, textures magnified 4 x", {middle, -middle, 330}, {middle, -middle, 0}}};
    const DrawList plain = items_of(world);
    for (const View& view : views) {
        auto camera = look_at(view.eye, view.target, 40, kSide_px, kSide_px);
        const RelativeFrame frame =
            make_relative_frame(world.lattice, options.height_offset_m, options.height_quantum_m, camera->eye);
        const DrawList seams = with_neighbours(world, plain, *camera);
        const PlainDraw rival(world, frame, chains);
        const auto by = [&](Renderer& with, DrawList items, double half_curvature = 0) {
            return [&, items = std::move(items), half_curvature] {
                FrameSettings settings;
                settings.magenta_background = settings.wait_until_drawn = true;
                settings.half_curvature = half_curvature;
                with.draw(*camera, items, settings, *target);
            };
        };
        std::vector<Way> ways{{"one indexed draw, plain shader", [&] { rival.draw(*camera, *target); }, {}, 0},
                              {"tiles", by(*renderer, plain), {}, 0},
                              {"tiles, morphing, curved earth", by(*renderer, morphing(plain), 7.8e-8), {}, 0},
                              {"the same, blended over borders", by(*renderer, morphing(seams), 7.8e-8), {}, 0},
                              {"the same in two arrays", by(*two_arrays, morphing(seams), 7.8e-8), {}, 0},
                              {"the same in three arrays", by(*three_arrays, morphing(seams), 7.8e-8), {}, 0},
                              {"tiles fading in over borders", by(*renderer, fading(seams)), {}, 0}};
        compare(view.name, frames, ways);
    }
}

}  // namespace
}  // namespace scree

int main(int argc, char** argv) {
    scree::run(argc > 1 ? std::max(1, std::atoi(argv[1])) : 100);
    return 0;
}
