#include <epoxy/gl.h>
#include <gtest/gtest.h>

#include <bit>
#include <map>
#include <optional>
#include <random>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "common/height_tile.h"
#include "common/lattice.h"
#include "runtime/render/program.h"
#include "runtime/render/render_target.h"
#include "runtime/render/shader_constants.h"
#include "runtime/render/shader_sources.h"
#include "runtime/render/vertex_arena.h"
#include "runtime/view/camera.h"
#include "runtime/view/relative_frame.h"
#include "tests/runtime/render/gl_test.h"

namespace scree {
namespace {

struct Bits {
    std::uint32_t x = 0, y = 0, z = 0;
    friend bool operator==(const Bits&, const Bits&) = default;
};

Bits bits(glm::vec3 v) {
    return {std::bit_cast<std::uint32_t>(v.x), std::bit_cast<std::uint32_t>(v.y), std::bit_cast<std::uint32_t>(v.z)};
}

std::ostream& operator<<(std::ostream& out, const Bits& b) {
    return out << std::bit_cast<float>(b.x) << ' ' << std::bit_cast<float>(b.y) << ' ' << std::bit_cast<float>(b.z);
}

void set_frame(GLuint program, const RelativeFrame& frame) {
    glProgramUniform3i(program, shader::kAnchorUniform, frame.i0, frame.j0, frame.n0);
    glProgramUniform1f(program, shader::kSpacingUniform, frame.spacing_m);
    glProgramUniform1f(program, shader::kQuantumUniform, frame.quantum_m);
    glProgramUniform3fv(program, shader::kFractionUniform, 1, &frame.fraction_m.x);
}

/// Runs the vertex stage alone over `count` points from `first`; returns what it wrote, `floats` numbers a vertex.
std::vector<float> capture(GLuint program, GLuint vertex_array, GLint first, GLsizei count, std::size_t floats) {
    std::vector<float> out(static_cast<std::size_t>(count) * floats);
    GLuint name = 0;
    glCreateBuffers(1, &name);
    const BufferHandle buffer(name);
    const auto bytes = static_cast<GLsizeiptr>(out.size() * sizeof(float));
    glNamedBufferStorage(name, bytes, nullptr, 0);
    glUseProgram(program);
    glBindVertexArray(vertex_array);
    glBindBufferBase(GL_TRANSFORM_FEEDBACK_BUFFER, 0, name);
    glEnable(GL_RASTERIZER_DISCARD);
    glBeginTransformFeedback(GL_POINTS);
    glDrawArrays(GL_POINTS, first, count);
    glEndTransformFeedback();
    glDisable(GL_RASTERIZER_DISCARD);
    glGetNamedBufferSubData(name, 0, bytes, out.data());
    return out;
}

Lattice world(double spacing_m, std::int64_t cells) {
    auto lattice = make_lattice(412345.678, 5612345.25, spacing_m, cells, cells, 4);
    EXPECT_TRUE(lattice.ok());
    return *lattice;
}

constexpr double kOffset_m = 431.7;

/// Eyes over the middle of the world and far outside it.
std::vector<glm::dvec3> eyes(const Lattice& lattice) {
    const double middle_i = static_cast<double>(lattice.cells_x) * 0.5137;
    const glm::dvec3 middle(lattice.x_m(middle_i), lattice.y_m(middle_i + 0.31), kOffset_m);
    return {middle + glm::dvec3(0.3, -0.2, 1), middle + glm::dvec3(12.34, 56.78, 1e3),
            middle + glm::dvec3(6.1e6, -5.9e6, 5.3e6)};  // 10,000 km away
}

class PositionTest : public GlTest {
protected:
    // Even a draw that writes no pixel wants a complete framebuffer, and without a window there is none.
    void SetUp() override {
        GlTest::SetUp();
        if (IsSkipped()) return;
        auto target = RenderTarget::create({1, 1, 0});
        ASSERT_TRUE(target.ok()) << target.error().message;
        target_.emplace(std::move(*target));
        glBindFramebuffer(GL_DRAW_FRAMEBUFFER, target_->framebuffer());
    }

private:
    std::optional<RenderTarget> target_;
};

TEST_F(PositionTest, GlslEqualsRelativeFrameBitForBit) {
    auto program =
        build_program({"position",
                       {std::string(shader_source::shared_constants), std::string(shader_source::terrain_position),
                        "layout(location = 0) in ivec2 vertex;\n"
                        "layout(location = 1) in float height_n;\n"
                        "out vec3 position_m;\n"
                        "void main() { position_m = relative_position(vertex, height_n); }\n"},
                       {},
                       {"position_m"}});
    ASSERT_TRUE(program.ok()) << program.error().message;

    struct Vertex {
        std::int32_t i, j;
        float height_n;
    };
    constexpr int kCount = 20'000;
    std::mt19937 random(7);
    std::size_t compared = 0;
    for (const auto& [spacing_m, cells, quantum_m] :
         {std::tuple{10.0 / 3, std::int64_t{1} << 15, 1.0 / 64}, std::tuple{30.0, std::int64_t{40'000}, 0.1},
          std::tuple{0.2, std::int64_t{1} << 29, 1.0}}) {
        const Lattice lattice = world(spacing_m, cells);
        std::vector<Vertex> vertices;
        for (int k = 0; k < kCount; ++k) {
            const std::int32_t stride = 1 << (random() % static_cast<unsigned>(lattice.deepest_level + 1));
            const auto coordinate = [&] {
                return static_cast<std::int32_t>(random() % static_cast<std::uint32_t>(lattice.cells_x)) / stride *
                       stride;
            };
            const auto n =
                static_cast<float>(static_cast<std::int64_t>(random() % (2u * kMaxHeightUnits)) - kMaxHeightUnits);
            vertices.push_back({coordinate(), coordinate(), k % 2 == 0 ? n : 0.5f * n});
        }
        GLuint buffer_name = 0, array_name = 0;
        glCreateBuffers(1, &buffer_name);
        glCreateVertexArrays(1, &array_name);
        const BufferHandle buffer(buffer_name);
        const VertexArrayHandle array(array_name);
        glNamedBufferStorage(buffer_name, static_cast<GLsizeiptr>(vertices.size() * sizeof(Vertex)), vertices.data(),
                             0);
        glVertexArrayVertexBuffer(array_name, 0, buffer_name, 0, sizeof(Vertex));
        for (const GLuint attribute : {0u, 1u}) {
            glEnableVertexArrayAttrib(array_name, attribute);
            glVertexArrayAttribBinding(array_name, attribute, 0);
        }
        glVertexArrayAttribIFormat(array_name, 0, 2, GL_INT, 0);
        glVertexArrayAttribFormat(array_name, 1, 1, GL_FLOAT, GL_FALSE, offsetof(Vertex, height_n));

        for (const glm::dvec3& eye : eyes(lattice)) {
            const RelativeFrame frame = make_relative_frame(lattice, kOffset_m, quantum_m, eye);
            set_frame(program->name(), frame);
            const auto positions = capture(program->name(), array_name, 0, kCount, 3);
            for (std::size_t k = 0; k < vertices.size(); ++k) {
                const glm::vec3 glsl(positions[3 * k], positions[3 * k + 1], positions[3 * k + 2]);
                const Vertex& v = vertices[k];
                ASSERT_EQ(bits(glsl), bits(frame.position(v.i, v.j, v.height_n)))
                    << "vertex " << v.i << ", " << v.j << " at " << v.height_n << " quanta, spacing " << spacing_m;
                ++compared;
            }
        }
    }
    EXPECT_EQ(compared, 9u * kCount);
}

TEST_F(PositionTest, TilesOfDifferentLevelShareEveryVertex) {
    const Lattice lattice = world(10.0 / 3, 1 << 9);
    const int n = lattice.tile_cells_log2;
    const int samples = lattice.tile_samples();
    ProgramSources sources{"terrain positions", terrain_vertex_sources(n), {}, {"relative_m", "gl_Position"}};
    auto program = build_program(sources);
    ASSERT_TRUE(program.ok()) << program.error().message;

    const std::vector<TileId> tiles{{0, 0, 0}, {1, 0, 1}, {2, 2, 1}, {4, 7, 8}, {5, 15, 16}, {5, 16, 15}, {5, 16, 16}};
    ASSERT_GE(lattice.deepest_level, 5);
    auto arena = VertexArena::create(n, static_cast<int>(tiles.size()));
    ASSERT_TRUE(arena.ok()) << arena.error().message;
    const auto height_at = [](std::int64_t i, std::int64_t j) {
        return static_cast<float>((i * 7919 + j * 104'729) % 100'003);
    };
    for (std::size_t t = 0; t < tiles.size(); ++t) {
        std::vector<SlotVertex> slot = flat_slot(n, 0);
        const LatticePoint corner = lattice.corner(tiles[t]);
        const std::int64_t step = lattice.step(tiles[t].level);
        for (int j = 0; j < samples; ++j)
            for (int i = 0; i < samples; ++i)
                slot[static_cast<std::size_t>(j * samples + i)].height_n =
                    height_at(corner.i + i * step, corner.j + j * step);
        arena->upload(static_cast<int>(t), slot);
    }
    GLuint array_name = 0;
    glCreateVertexArrays(1, &array_name);
    const VertexArrayHandle array(array_name);
    glVertexArrayVertexBuffer(array_name, 0, arena->buffer(), 0, sizeof(SlotVertex));
    glEnableVertexArrayAttrib(array_name, shader::kHeightAttribute);
    glVertexArrayAttribBinding(array_name, shader::kHeightAttribute, 0);
    glVertexArrayAttribFormat(array_name, shader::kHeightAttribute, 3, GL_FLOAT, GL_FALSE, 0);
    glVertexAttrib4f(shader::kTextureAttribute, 0, 1, 0, 0);

    for (const glm::dvec3& eye : eyes(lattice)) {
        auto camera = look_at(eye, {lattice.x_m(256), lattice.y_m(256), kOffset_m}, 40, 800, 600);
        ASSERT_TRUE(camera.ok());
        const RelativeFrame frame = make_relative_frame(lattice, kOffset_m, 0.25, eye);
        const glm::mat4 clip = clip_from_relative(*camera);
        set_frame(program->name(), frame);
        glProgramUniformMatrix4fv(program->name(), shader::kClipFromRelativeUniform, 1, GL_FALSE, &clip[0].x);

        std::map<std::pair<std::int64_t, std::int64_t>, std::vector<std::uint32_t>> seen;
        int shared = 0;
        for (std::size_t t = 0; t < tiles.size(); ++t) {
            const LatticePoint corner = lattice.corner(tiles[t]);
            const std::int64_t step = lattice.step(tiles[t].level);
            const int first = static_cast<int>(t) * arena->slot_vertices();
            glVertexAttribI4i(shader::kTileAttribute, static_cast<GLint>(corner.i), static_cast<GLint>(corner.j),
                              static_cast<GLint>(step), first);
            const auto out = capture(program->name(), array_name, first, samples * samples, 7);
            for (int k = 0; k < samples * samples; ++k) {
                const std::int64_t i = corner.i + (k % samples) * step, j = corner.j + (k / samples) * step;
                const float* v = &out[7 * static_cast<std::size_t>(k)];
                ASSERT_EQ(
                    bits({v[0], v[1], v[2]}),
                    bits(frame.position(static_cast<std::int32_t>(i), static_cast<std::int32_t>(j), height_at(i, j))));
                std::vector<std::uint32_t> words;
                for (int c = 0; c < 7; ++c) words.push_back(std::bit_cast<std::uint32_t>(v[c]));
                const auto [known, is_new] = seen.try_emplace({i, j}, words);
                if (is_new) continue;
                ++shared;
                ASSERT_EQ(known->second, words) << "lattice vertex " << i << ", " << j << " in tile " << t;
            }
        }
        EXPECT_GT(shared, 80);
    }
}

}  // namespace
}  // namespace scree
