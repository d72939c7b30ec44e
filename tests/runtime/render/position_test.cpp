#include <epoxy/gl.h>
#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cmath>
#include <map>
#include <optional>
#include <random>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "common/height_tile.h"
#include "common/lattice.h"
#include "common/mesh/morphed_vertex.h"
#include "runtime/render/program.h"
#include "runtime/render/render_target.h"
#include "runtime/render/shader_constants.h"
#include "runtime/render/shader_sources.h"
#include "runtime/render/vertex_arena.h"
#include "runtime/view/camera.h"
#include "runtime/view/relative_frame.h"
#include "tests/common/test_support.h"
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
    glProgramUniform1f(program, shader::kHalfCurvatureUniform, frame.half_curvature);
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
constexpr double kEarth = 0.5 / 6'371'000;  // 1 / (2 R), 1/m

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
                        "layout(location = 1) in vec2 height_and_reach;\n"
                        "out vec3 position_m;\n"
                        "void main() {\n"
                        "    vec3 flat_m = flat_position(vertex, height_and_reach.x);\n"
                        "    position_m = curved_position(flat_m, curvature_drop(flat_m, height_and_reach.y));\n"
                        "}\n"},
                       {},
                       {"position_m"}});
    ASSERT_TRUE(program.ok()) << program.error().message;

    struct Vertex {
        std::int32_t i, j;
        float height_n, reach_m2;
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
            const float reach_m2 =
                k % 3 == 0 ? 0.0f : std::ldexp(static_cast<float>(random()), -static_cast<int>(k % 40));
            vertices.push_back({coordinate(), coordinate(), k % 2 == 0 ? n : 0.5f * n, reach_m2});
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
        glVertexArrayAttribFormat(array_name, 1, 2, GL_FLOAT, GL_FALSE, offsetof(Vertex, height_n));

        for (const glm::dvec3& eye : eyes(lattice)) {
            for (const double half_curvature : {0.0, kEarth}) {
                const RelativeFrame frame = make_relative_frame(lattice, kOffset_m, quantum_m, eye, half_curvature);
                set_frame(program->name(), frame);
                const auto positions = capture(program->name(), array_name, 0, kCount, 3);
                for (std::size_t k = 0; k < vertices.size(); ++k) {
                    const glm::vec3 glsl(positions[3 * k], positions[3 * k + 1], positions[3 * k + 2]);
                    const Vertex& v = vertices[k];
                    ASSERT_EQ(bits(glsl), bits(frame.position(v.i, v.j, v.height_n, v.reach_m2)))
                        << "vertex " << v.i << ", " << v.j << " at " << v.height_n << " quanta, spacing " << spacing_m;
                    ++compared;
                }
            }
        }
    }
    EXPECT_EQ(compared, 18u * kCount);
}

/// A world of `height_at` on every lattice point, drawn by the terrain's own vertex shader.
class TilePositionTest : public PositionTest {
protected:
    struct Attributes {
        GLint tile[4];
        GLint pattern[2];
        float morph;
        std::array<float, 4> edge_morph;
    };

    static float height_at(std::int64_t i, std::int64_t j) {
        return static_cast<float>((i * 7919 + j * 104'729) % 1'000'003 - 500'000);
    }

    void make(const Lattice& lattice, const std::vector<TileId>& tiles) {
        lattice_ = lattice;
        tiles_ = tiles;
        const int n = lattice.tile_cells_log2;
        auto program = build_program(
            {"terrain positions", terrain_vertex_sources(n, Imagery::plain), {}, {"relative_m", "gl_Position"}});
        ASSERT_TRUE(program.ok()) << program.error().message;
        program_ = std::move(*program);
        auto arena = VertexArena::create(n, static_cast<int>(tiles.size()));
        ASSERT_TRUE(arena.ok()) << arena.error().message;
        arena_ = std::move(*arena);
        for (std::size_t t = 0; t < tiles.size(); ++t) {
            slots_.emplace_back(slot_vertex_count(n));
            fill_vertex_slot(samples_of(tiles[t]), n, slots_.back());
            arena_.upload(static_cast<int>(t), slots_.back());
        }
        GLuint name = 0;
        glCreateVertexArrays(1, &name);
        array_ = VertexArrayHandle(name);
        glVertexArrayVertexBuffer(name, 0, arena_.buffer(), 0, sizeof(SlotVertex));
        glEnableVertexArrayAttrib(name, shader::kHeightAttribute);
        glVertexArrayAttribBinding(name, shader::kHeightAttribute, 0);
        glVertexArrayAttribFormat(name, shader::kHeightAttribute, 3, GL_FLOAT, GL_FALSE, 0);
        glVertexAttrib4f(shader::kTextureAttribute, 0, 1, 0, 0);
    }

    std::vector<std::int32_t> samples_of(TileId id) const {
        const LatticePoint corner = lattice_.corner(id);
        const std::int64_t step = lattice_.step(id.level);
        std::vector<std::int32_t> samples;
        for (int j = 0; j < lattice_.tile_samples(); ++j)
            for (int i = 0; i < lattice_.tile_samples(); ++i)
                samples.push_back(static_cast<std::int32_t>(height_at(corner.i + i * step, corner.j + j * step)));
        return samples;
    }

    void set_camera(const RelativeFrame& frame, glm::dvec3 eye) {
        auto camera = look_at(eye, {lattice_.x_m(256), lattice_.y_m(256), kOffset_m}, 40, 800, 600);
        ASSERT_TRUE(camera.ok());
        const glm::mat4 clip = clip_from_relative(*camera);
        set_frame(program_.name(), frame);
        glProgramUniformMatrix4fv(program_.name(), shader::kClipFromRelativeUniform, 1, GL_FALSE, &clip[0].x);
    }

    /// relative_m and gl_Position of every vertex of tiles_[t], 7 numbers each.
    std::vector<float> draw(std::size_t t, const MorphedPattern& pattern) {
        const LatticePoint corner = lattice_.corner(tiles_[t]);
        const int first = static_cast<int>(t) * arena_.slot_vertices();
        glVertexAttribI4i(shader::kTileAttribute, static_cast<GLint>(corner.i), static_cast<GLint>(corner.j),
                          static_cast<GLint>(lattice_.step(tiles_[t].level)), first);
        glVertexAttribI2i(shader::kPatternAttribute, 1 << pattern.geomip, static_cast<GLint>(pattern.edge_mask));
        glVertexAttrib1f(shader::kMorphAttribute, pattern.morph);
        glVertexAttrib4fv(shader::kEdgeMorphAttribute, pattern.edge_morph.data());
        return capture(program_.name(), array_.name(), first, arena_.slot_vertices(), 7);
    }

    /// The same position in C++.
    glm::vec3 expected(const RelativeFrame& frame, std::size_t t, int i, int j, const MorphedPattern& pattern) const {
        const LatticePoint corner = lattice_.corner(tiles_[t]);
        const std::int64_t step = lattice_.step(tiles_[t].level);
        const VertexMorph morph = vertex_morph(i, j, lattice_.tile_cells_log2, pattern);
        const SlotVertex& v = slots_[t][static_cast<std::size_t>(j * lattice_.tile_samples() + i)];
        return frame.position(static_cast<std::int32_t>(corner.i + i * step),
                              static_cast<std::int32_t>(corner.j + j * step),
                              morphed_height(v, morph), frame.morph_reach_m2(morph, step));
    }

    Lattice lattice_;
    std::vector<TileId> tiles_;
    std::vector<std::vector<SlotVertex>> slots_;
    ProgramHandle program_;
    VertexArena arena_;
    VertexArrayHandle array_;
};

TEST_F(TilePositionTest, TilesOfDifferentLevelShareEveryVertex) {
    make(world(10.0 / 3, 1 << 9), {{0, 0, 0}, {1, 0, 1}, {2, 2, 1}, {4, 7, 8}, {5, 15, 16}, {5, 16, 15}, {5, 16, 16}});
    ASSERT_GE(lattice_.deepest_level, 5);
    const int samples = lattice_.tile_samples();
    for (const glm::dvec3& eye : eyes(lattice_)) {
        const RelativeFrame frame = make_relative_frame(lattice_, kOffset_m, 0.25, eye, kEarth);
        set_camera(frame, eye);
        std::map<std::pair<std::int64_t, std::int64_t>, std::vector<std::uint32_t>> seen;
        int shared = 0;
        for (std::size_t t = 0; t < tiles_.size(); ++t) {
            const LatticePoint corner = lattice_.corner(tiles_[t]);
            const std::int64_t step = lattice_.step(tiles_[t].level);
            const auto out = draw(t, {});
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

TEST_F(TilePositionTest, MorphedVerticesEqualTheirTwinsBitForBit) {
    make(world(10.0 / 3, 1 << 9), {{1, 0, 1}, {4, 7, 8}, {5, 16, 16}});
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    const int n = lattice_.tile_cells_log2, samples = lattice_.tile_samples();
    const auto weight = [&] {
        const int kind = test::uniform(random, 0, 5);
        return kind == 0 ? 0.0f : kind == 1 ? 1.0f : std::uniform_real_distribution<float>(0, 1)(random);
    };
    int moved = 0, lowered = 0;
    for (int round = 0; round < 200; ++round) {
        const glm::dvec3 eye = eyes(lattice_)[static_cast<std::size_t>(test::uniform(random, 0, 2))];
        const RelativeFrame frame =
            make_relative_frame(lattice_, kOffset_m, 1.0 / 64, eye, round % 4 == 0 ? 0 : kEarth * (1 + round));
        set_camera(frame, eye);
        for (std::size_t t = 0; t < tiles_.size(); ++t) {
            const MorphedPattern pattern{test::uniform(random, 0, n - 1),
                                         static_cast<unsigned>(test::uniform(random, 0, 15)),
                                         weight(),
                                         {weight(), weight(), weight(), weight()}};
            const auto out = draw(t, pattern);
            for (int k = 0; k < samples * samples; ++k) {
                const int i = k % samples, j = k / samples;
                const float* v = &out[7 * static_cast<std::size_t>(k)];
                ASSERT_EQ(bits({v[0], v[1], v[2]}), bits(expected(frame, t, i, j, pattern)))
                    << "vertex " << i << ", " << j << ", geomip " << pattern.geomip << ", mask " << pattern.edge_mask;
                moved += bits(expected(frame, t, i, j, {})).z != bits(expected(frame, t, i, j, pattern)).z ? 1 : 0;
                lowered += frame.half_curvature > 0 && vertex_morph(i, j, n, pattern).weight > 0 ? 1 : 0;
            }
        }
    }
    EXPECT_GT(moved, 10'000);
    EXPECT_GT(lowered, 10'000);
}

// The edge between a finer tile, thinned there by two, and a coarser one, drawn at the same absolute stride.
TEST_F(TilePositionTest, AnEdgesVerticesMorphAlikeFromBothSides) {
    make(world(10.0 / 3, 1 << 9), {{5, 15, 16}, {4, 8, 8}});
    const int n = lattice_.tile_cells_log2, m = 1 << n, samples = m + 1;
    SCREE_TRACE_SEED();
    test::Random random(test::seed());
    int compared = 0, moved = 0;
    for (const glm::dvec3& eye : eyes(lattice_)) {
        const RelativeFrame frame = make_relative_frame(lattice_, kOffset_m, 1.0 / 64, eye, 3 * kEarth);
        set_camera(frame, eye);
        for (int geomip = 0; geomip + 1 < n; ++geomip) {
            const float weight = std::uniform_real_distribution<float>(0, 1)(random);
            MorphedPattern west{geomip, kEdgeEast, 0.3f, {}}, east{geomip, 0, 0.7f, {}};
            west.edge_morph[1] = weight;  // the finer tile's own stride, doubled on its east edge
            east.edge_morph[3] = weight;  // the same absolute stride at the coarser tile's geomip
            const auto west_out = draw(0, west), east_out = draw(1, east);
            for (int j = 0; j <= m; j += 2 << geomip) {  // the finer tile's north-east corner is the coarser's corner
                const float* a = &west_out[7 * static_cast<std::size_t>(j * samples + m)];
                const float* b = &east_out[7 * static_cast<std::size_t>(j / 2 * samples)];
                // A whole edge of the finer tile is no whole edge of the coarser: its ends stay, the middle may not.
                if (j == m) continue;
                for (int c = 0; c < 7; ++c)
                    ASSERT_EQ(std::bit_cast<std::uint32_t>(a[c]), std::bit_cast<std::uint32_t>(b[c]))
                        << "vertex " << j << " of the edge, geomip " << geomip;
                ++compared;
                moved += vertex_morph(m, j, n, west).weight > 0 ? 1 : 0;
            }
        }
    }
    EXPECT_GT(compared, 20);
    EXPECT_GT(moved, 10);
}

}  // namespace
}  // namespace scree
