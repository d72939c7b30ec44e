// The shaders of runtime/render/shaders as text, embedded when the library is built (embed_shaders.cmake). One name a
// file; the order in which files are joined into a program stands in program.cpp.
#pragma once

#include <string_view>

namespace scree::shader_source {

extern const std::string_view shared_constants;
extern const std::string_view terrain_position;
extern const std::string_view terrain_morph;
extern const std::string_view imagery_plain;
extern const std::string_view imagery_faded;
extern const std::string_view imagery_blended;
extern const std::string_view atmosphere;
extern const std::string_view dither;
extern const std::string_view srgb;
extern const std::string_view terrain_vert;
extern const std::string_view terrain_frag;
extern const std::string_view edge_frag;
extern const std::string_view surface_vert;
extern const std::string_view surface_frag;
extern const std::string_view sky_vert;
extern const std::string_view sky_frag;
extern const std::string_view line_vert;
extern const std::string_view line_frag;

}  // namespace scree::shader_source
