// The GLSL programs of this room, built from the embedded shaders. OpenGL thread only. Errors (ErrorCode::display)
// carry the compiler's log; a shader that does not compile on a driver is a defect here or there, never the user's.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/result.h"
#include "runtime/render/draw_batches.h"
#include "runtime/render/gl_handle.h"

namespace scree {

struct TerrainVariant {
    int tile_cells_log2 = 5;
    int texture_size_log2 = 8;
    Imagery imagery = Imagery::plain;
    int all_arrays = 1;  ///< that Imagery::blended_of_all has bound
    bool with_haze = false;
    bool highlight = false;
};

Result<ProgramHandle> build_terrain_program(const TerrainVariant& variant);
/// Draws over tiles at the data's edge.
Result<ProgramHandle> build_edge_program(int tile_cells_log2);
/// Of SurfaceRenderer.
Result<ProgramHandle> build_surface_edge_program();
Result<ProgramHandle> build_surface_program(bool with_haze);
Result<ProgramHandle> build_sky_program();
/// Of LineRenderer.
Result<ProgramHandle> build_line_program();

/// The strings that make the terrain's vertex shader, in order.
std::vector<std::string> terrain_vertex_sources(int tile_cells_log2, Imagery imagery, bool highlight = false);

struct ProgramSources {
    std::string name;                           ///< for messages
    std::vector<std::string> vertex;            ///< strings joined in order; the version line is added
    std::vector<std::string> fragment;          ///< may be empty: no fragment shader
    std::vector<const char*> captured_outputs;  ///< interleaved transform feedback; usually empty
};

Result<ProgramHandle> build_program(const ProgramSources& sources);

}  // namespace scree
