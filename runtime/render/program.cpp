#include "runtime/render/program.h"

#include <epoxy/gl.h>
#include <fmt/format.h>

#include "runtime/render/shader_sources.h"

namespace scree {
namespace {

constexpr const char* kVersion = "#version 450 core\n";
constexpr const char* kHighlightDefine = "#define SCREE_HIGHLIGHT\n";

Result<void> attach(GLuint program, GLenum stage, const std::vector<std::string>& strings, const std::string& name) {
    const ShaderHandle shader(glCreateShader(stage));
    std::vector<const char*> pointers{kVersion};
    for (const std::string& text : strings) pointers.push_back(text.c_str());
    glShaderSource(shader.name(), static_cast<GLsizei>(pointers.size()), pointers.data(), nullptr);
    glCompileShader(shader.name());
    GLint compiled = GL_FALSE;
    glGetShaderiv(shader.name(), GL_COMPILE_STATUS, &compiled);
    if (compiled != GL_TRUE) {
        std::string log(4096, '\0');
        GLsizei length = 0;
        glGetShaderInfoLog(shader.name(), static_cast<GLsizei>(log.size()), &length, log.data());
        log.resize(static_cast<std::size_t>(length));
        return Error{ErrorCode::display, fmt::format("the {} shader of '{}' does not compile on this driver: {}",
                                                     stage == GL_VERTEX_SHADER ? "vertex" : "fragment", name, log)};
    }
    glAttachShader(program, shader.name());  // keeps it alive until the program goes
    return {};
}

std::string with_bool(const char* name, bool value) {
    return fmt::format("const bool {} = {};\n", name, value ? "true" : "false");
}

}  // namespace

Result<ProgramHandle> build_program(const ProgramSources& sources) {
    ProgramHandle program(glCreateProgram());
    if (const auto done = attach(program.name(), GL_VERTEX_SHADER, sources.vertex, sources.name); !done)
        return done.error();
    if (!sources.fragment.empty())
        if (const auto done = attach(program.name(), GL_FRAGMENT_SHADER, sources.fragment, sources.name); !done)
            return done.error();
    if (!sources.captured_outputs.empty())
        glTransformFeedbackVaryings(program.name(), static_cast<GLsizei>(sources.captured_outputs.size()),
                                    sources.captured_outputs.data(), GL_INTERLEAVED_ATTRIBS);
    glLinkProgram(program.name());
    GLint linked = GL_FALSE;
    glGetProgramiv(program.name(), GL_LINK_STATUS, &linked);
    if (linked != GL_TRUE) {
        std::string log(4096, '\0');
        GLsizei length = 0;
        glGetProgramInfoLog(program.name(), static_cast<GLsizei>(log.size()), &length, log.data());
        log.resize(static_cast<std::size_t>(length));
        return Error{ErrorCode::display,
                     fmt::format("the program '{}' does not link on this driver: {}", sources.name, log)};
    }
    return program;
}

std::vector<std::string> terrain_vertex_sources(int tile_cells_log2, Imagery imagery, bool highlight) {
    using namespace shader_source;
    // A constant, so that the compiler turns the division by it into a multiplication.
    return {imagery == Imagery::plain ? "" : "#define SCREE_BLENDED\n",
            highlight ? kHighlightDefine : "",
            std::string(shared_constants),
            fmt::format("const int kTileSamples = {};\n", (1 << tile_cells_log2) + 1),
            std::string(terrain_position),
            std::string(terrain_morph),
            std::string(atmosphere),
            std::string(srgb),
            std::string(terrain_vert)};
}

std::vector<std::string> terrain_fragment_sources(const TerrainVariant& variant) {
    using namespace shader_source;
    const bool fading = variant.imagery == Imagery::blended || variant.imagery == Imagery::blended_of_all;
    const int arrays = variant.imagery == Imagery::blended_of_all ? variant.all_arrays : fading ? 2 : 1;
    return {variant.highlight ? kHighlightDefine : "",
            std::string(shared_constants),
            with_bool("kWithHaze", variant.with_haze),
            with_bool("kFading", fading),
            fmt::format("const int kArrays = {};\nconst float kTextureTexels = {}.0;\n", arrays,
                        1 << variant.texture_size_log2),
            std::string(variant.imagery == Imagery::plain   ? imagery_plain
                        : variant.imagery == Imagery::faded ? imagery_faded
                                                            : imagery_blended),
            std::string(atmosphere),
            std::string(terrain_frag)};
}

Result<ProgramHandle> build_terrain_program(const TerrainVariant& variant) {
    return build_program({"terrain",
                          terrain_vertex_sources(variant.tile_cells_log2, variant.imagery, variant.highlight),
                          terrain_fragment_sources(variant),
                          {}});
}

Result<ProgramHandle> build_edge_program(int tile_cells_log2) {
    using namespace shader_source;
    return build_program(
        {"edge",
         terrain_vertex_sources(tile_cells_log2, Imagery::plain),
         {std::string(shared_constants), std::string(atmosphere), std::string(dither), std::string(edge_frag)},
         {}});
}

Result<ProgramHandle> build_surface_edge_program() {
    using namespace shader_source;
    return build_program(
        {"surface edge",
         {std::string(shared_constants), std::string(terrain_position), std::string(atmosphere),
          std::string(surface_vert)},
         {std::string(shared_constants), std::string(atmosphere), std::string(dither), std::string(edge_frag)},
         {}});
}

Result<ProgramHandle> build_surface_program(bool with_haze) {
    using namespace shader_source;
    return build_program({"surface",
                          {std::string(shared_constants), std::string(terrain_position), std::string(atmosphere),
                           std::string(surface_vert)},
                          {std::string(shared_constants), with_bool("kWithHaze", with_haze), std::string(atmosphere),
                           std::string(surface_frag)},
                          {}});
}

Result<ProgramHandle> build_line_program() {
    using namespace shader_source;
    return build_program({"line",
                          {std::string(shared_constants), std::string(srgb), std::string(line_vert)},
                          {std::string(shared_constants), std::string(line_frag)},
                          {}});
}

Result<ProgramHandle> build_sky_program() {
    using namespace shader_source;
    return build_program(
        {"sky",
         {std::string(shared_constants), std::string(sky_vert)},
         {std::string(shared_constants), std::string(atmosphere), std::string(dither), std::string(sky_frag)},
         {}});
}

}  // namespace scree
